"""The studies handover and compare_fem, small, and what balance and cost compare."""

import importlib
import json

import numpy as np
import pytest
from study_main import ended

import fenics_bridge as bridge
import mpm_core as mpm

COARSE = "--cell-size", "0.2", "--crest", "1.2"


def summary_of(name, folder, *options):
    result = ended(name, folder, *options)
    assert result.returncode == 0, result.stderr
    return json.loads((folder / "summary.json").read_text())


def test_every_hand_over_is_in_equilibrium(tmp_path):
    summary = summary_of("handover", tmp_path, "--time", "0.6", *COARSE)
    assert 20e3 < summary["collapse_unit_weight_of_the_finite_elements"] < 27e3  # linear triangles are too stiff
    first, *rest = summary["handovers"]
    assert first["fraction_of_collapse"] == 0 and first["out_of_balance_ratio_before"] is None
    assert all(row["out_of_balance_ratio_before"] < 1e-8 and row["newly_yielded_fraction"] == 0 for row in rest)
    assert all(row["crest_displacement_m"] > 0.05 for row in rest)
    assert (tmp_path / "runout_over_fraction.png").exists() and (tmp_path / "crest_over_time.png").exists()


def test_particles_converge_to_the_finite_elements(tmp_path):
    """Linear triangles against quadratic ones, small strains: second order where little yields."""
    summary = summary_of("compare_fem", tmp_path, "--cell-size", "0.1", "--meshes", "2")
    rows = {(row["unit_weight"], row["cell_size_m"]): row for row in summary["comparisons"]}
    for unit_weight in (5e3, 10e3, 15e3, 20e3):
        coarse, fine = rows[unit_weight, 0.2], rows[unit_weight, 0.1]
        assert fine["displacement_difference_l2"] < 0.75 * coarse["displacement_difference_l2"]
        assert fine["out_of_balance_ratio"] < 1e-4
    assert rows[5e3, 0.1]["displacement_difference_l2"] < 0.3 * rows[5e3, 0.2]["displacement_difference_l2"]
    assert summary["crest_displacement_difference_on_finest_mesh"]["10000"] < 0.03
    assert (tmp_path / "convergence.png").exists() and (tmp_path / "side_by_side_10kN.png").exists()


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("handover", ["--cohesion", "0"], ["--cohesion", "soil at the surface of a slope has no strength"]),
        (
            "handover",
            ["--unit-weight", "20e3", *COARSE],
            ["--unit-weight is 20000 N/m3", "expected more than that at which"],
        ),
        ("handover", ["--material", "elastic", *COARSE], ["--material is elastic", "expected soil that can fail"]),
        (
            "compare_fem",
            ["--cohesion", "1", "--cell-size", "0.2", "--meshes", "1"],
            ["carries none of the unit weights"],
        ),
    ],
)
def test_slopes_that_do_not_stand_or_do_not_slide_are_refused(tmp_path, name, options, words):
    result = ended(name, tmp_path, *options)
    assert result.returncode == 2
    assert all(word in result.stderr for word in words), result.stderr


@pytest.mark.usefixtures("without_pictures")
def test_hand_over_of_particles_that_move(tmp_path):
    summary = summary_of("handover", tmp_path, "--time", "0.1", "--move", *COARSE)
    rows = [row for row in summary["handovers"] if row["fraction_of_collapse"] > 0]
    assert all(row["out_of_balance_ratio_after"] < 1e-3 and row["newly_yielded_fraction"] < 0.01 for row in rows)


@pytest.mark.usefixtures("without_pictures")
def test_soft_soil_too_within_the_effect_of_its_deformed_shape(tmp_path):
    summary = summary_of("compare_fem", tmp_path, "--cell-size", "0.1", "--meshes", "1", "--young", "200e3")
    assert summary["crest_displacement_difference_on_finest_mesh"]["10000"] < 0.03


@pytest.mark.usefixtures("without_pictures")
def test_particles_come_to_rest_however_fast_their_weight_rises(tmp_path):
    """In elastic soil the equilibrium does not depend on the way to it; the difference is that of linear cells to quadratic ones."""
    fast = "--cell-size", "0.2", "--meshes", "1", "--ramp", "0.01"
    for row in summary_of("compare_fem", tmp_path / "fast", *fast)["comparisons"][:2]:
        assert row["out_of_balance_ratio"] < 1e-4 and row["crest_displacement_difference"] < 0.02
    swinging = ended("compare_fem", tmp_path / "swinging", *fast, "--damping", "1e-4", "--cohesion", "1e6")
    assert swinging.returncode == 0 and "are not at rest after" in swinging.stderr


def test_the_balance_of_ranks_compares_distances_of_particles():
    study = importlib.import_module("balance")
    runs = [study.Slide(frames=[{"id": np.array(ids), "position": np.array(places)}]) for ids, places in
            (([0, 1], [[0.0, 0.0], [1.0, 1.0]]), ([1, 0], [[1.0, 1.0], [3.0, 4.0]]))]  # fmt: skip
    assert study.difference(*runs) == 5.0


def test_the_cost_of_newtons_method_has_no_ratio_where_it_is_not_known():
    study = importlib.import_module("cost")
    rows = [{"cells": 8, "soil": soil, "method": method, "reached": reached, "cpu_seconds": seconds} for soil, method, reached, seconds in
            (("drained", "explicit", True, 6.0), ("drained", "Newton", True, 2.0),
             ("undrained", "explicit", False, 6.0), ("undrained", "Newton", True, 0.0))]  # fmt: skip
    assert study.speed_up(rows) == {"drained": 3.0, "undrained": None}
    rows[1]["reached"] = False
    assert study.speed_up(rows)["drained"] is None


@pytest.mark.usefixtures("without_pictures")
def test_a_run_of_cost_that_fails_keeps_the_others(tmp_path, monkeypatch):
    """The slope collapses under the unit weight of limit analysis, so that no drained equilibrium under twice that gives the undrained runs
    their stresses; one iteration of Newton's method finds none of plastic soil either. The explicit scheme is a row as before.
    """
    study = importlib.import_module("cost")
    heavy = 2 * bridge.log_spiral(1.0, 45.0, 1e3, 25.0, 1.1).unit_weight
    monkeypatch.setattr(study, "SOLVERS", {"Newton": lambda: mpm.Newton(max_iterations=1)})
    monkeypatch.setattr(study, "MULTIPLES", (20,))
    options = f"--meshes 1 --mesh fitted --cell-size 0.5 --particles-per-cell 1 --limit 1 --initial-unit-weight {heavy} --unit-weight {1.1 * heavy}"
    result = ended("cost", tmp_path, *options.split())
    assert result.returncode == 1, result.stderr
    assert "undrained, cells of 0.5 m: no stresses to begin with: --initial-unit-weight is" in result.stdout
    assert "drained, Newton, cells of 0.5 m failed: no equilibrium" in result.stdout
    summary = json.loads((tmp_path / "summary.json").read_text())
    explicit, newton = summary["equilibrium"]
    assert explicit["method"] == "explicit" and explicit["failure"] is None
    assert newton["method"] == "Newton" and not newton["reached"] and newton["failure"] in summary["failures"][1]
    assert summary["explicit_over_newton_drained_seconds_ratio"] is None
    assert (tmp_path / "equilibrium.csv").read_text().count("\n") == 3
