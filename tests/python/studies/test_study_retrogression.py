"""The study retrogression: its weight and energy, and what it says of meshes that are too short and of other laws."""

import importlib
from argparse import Namespace

import numpy as np
import pytest
import study_main
from common.interrupt import Interrupt
from mpi4py import MPI

BANK = (
    "--cell-size 1 --crest 8 --height 4 --angle 45 --mesh crossed --unit-weight 24e3 --cohesion 24e3 --reference-length 1 "
    "--disturbed 2 --time 2 --frames 2"
).split()


def test_the_weight_that_falls_is_the_work_of_stresses_and_the_energy_of_motion(tmp_path):
    """Without damping and PIC; the bank is 8 m by 4 m and a triangle of 4 m by 4 m."""
    study = importlib.import_module("retrogression")
    p = study.parser()
    a = p.parse_args([*BANK, "--runout-length", "8", "--pic", "0", "--damping", "0", "--output", str(tmp_path)])
    study.check_slope_options(p, a)
    with Interrupt(MPI.COMM_WORLD) as interrupt:
        found = study.slide(a, 1.0, tmp_path, interrupt)
    particles = found.case.model.particles
    work, motion = (found.history[f"{name}_J_per_m"][-1] for name in ("work_of_stresses", "kinetic_energy"))
    assert found.stopped is None and found.ratio < 1e-8
    assert particles.mass.sum() == pytest.approx(24e3 / 9.81 * (8 * 4 + 4 * 4 / 2), rel=1e-12)
    fallen = -9.81 * float(particles.mass @ particles.displacement[:, 1])
    assert fallen == pytest.approx(work + motion, rel=5e-3)
    assert motion > 0.01 * fallen > 0


def test_soil_that_leaves_the_mesh_names_the_option(tmp_path):
    soft = "--disturbed 4 --residual-cohesion 100 --softening-strain 0.05 --damping 0 --pic 0 --no-pictures --meshes one".split()
    result = study_main.ended("retrogression", tmp_path, *BANK, *soft, "--runout-length", "1")
    assert result.returncode == 1 and "left the background mesh" in result.stderr
    assert "what leaves it beyond the toe needs more --runout-length than 1 m" in result.stderr


@pytest.mark.parametrize(("failed", "warned"), [(3.9, False), (4.1, True), (8.0, True), (0.0, False)])
def test_a_crest_that_fails_nearly_to_the_side_of_the_mesh_is_doubted(failed, warned):
    study = importlib.import_module("retrogression")
    slide = study.Slide(
        Namespace(args=Namespace(crest=8.0, height=4.0)), 1.0, {"retrogression_m": np.array([0, failed])}, 0.0
    )
    said = study.reaches_side(slide)
    assert ("--crest is 8 m" in said) == warned and bool(said) == warned
