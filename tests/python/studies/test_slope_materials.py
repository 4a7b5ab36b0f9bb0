"""The study slope with every law and scheme: from equilibrium by FEM, or under a weight that rises from zero."""

import importlib
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from common.schemes import SCHEMES, run_scheme
from common.slope.case import build_slope, initialise
from common.soils import MATERIALS, law_of
from mpi4py import MPI

import mpm_core as mpm

slope = importlib.import_module("slope")

SMALL = "--cell-size 0.25 --crest 1 --particles-per-cell 3 --nmd".split()
WITHOUT_COHESION = {
    "cam-clay",
    "nor-sand",
    "sanisand",
    "hoek-brown",
    "undrained NorSand",
    "elastic",
    "undrained Cam-Clay",
}
OTHERS = {
    "finite strain": ["--finite-strain"],
    "undrained": ["--undrained", "--water-modulus", "1e6"],
    "undrained Cam-Clay": ["--undrained", "--material", "cam-clay"],
    "undrained NorSand": ["--undrained", "--material", "nor-sand"],
    "Python": ["--python-law"],
    "UMAT": ["--umat"],
}
PYTHON_LAW = """
import mpm_core as mpm
class Soil:
    law = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=3e3, friction_angle=25.0)
    n_state, p_wave_modulus = law.n_state, law.p_wave_modulus
    def update(self, *arguments):
        self.law.update(*arguments)
"""


@pytest.fixture(scope="module")
def own_laws(tmp_path_factory):
    """What follows the options of laws of one's own."""
    folder = tmp_path_factory.mktemp("laws")
    (folder / "mine.py").write_text(PYTHON_LAW)
    source, library = Path(__file__).parents[1] / "umat_von_mises.f90", folder / "umat.so"
    subprocess.run(["gfortran", "-shared", "-fPIC", "-O1", "-o", library, source], check=True)
    return {"Python": [f"{folder / 'mine.py'}:Soil"],
            "UMAT": [str(library), "--properties", "200e3", "0.33", "6e3", "--variables", "1"]}  # fmt: skip


def test_a_umat_is_told_which_properties_are_its_strength(own_laws):
    def law(*words):
        return law_of(slope.parse([*OTHERS["UMAT"], *own_laws["UMAT"], "--strength-properties", *words]))

    assert law("3:strength").strength_parameters == {3: "strength"} and law().strength_parameters == {}
    assert law("1:friction", "2:dilation").strength_parameters == {1: "friction angle", 2: "dilation angle"}
    with pytest.raises(
        mpm.InputError, match="--strength-properties names '3', expected NUMBER:KIND with one of strength, "
    ):
        law("3")


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("name", [*MATERIALS, *OTHERS])
def test_slope_of_any_law_in_any_scheme(name, scheme, own_laws):
    material = [*OTHERS[name], *own_laws.get(name, [])] if name in OTHERS else ["--material", name]
    quasi_static = scheme == "quasi-static"
    material += [] if name in WITHOUT_COHESION else ["--cohesion", "3e3"]
    weight = ["--unit-weight", "5e3"] if quasi_static else ["--unit-weight", "20e3", "--initial-unit-weight", "4e3"]
    a = slope.parse([*SMALL, *material, *weight, "--scheme", scheme, "--time", "0.05"])
    case = build_slope(a, MPI.COMM_WORLD)
    start = initialise(case, a.initial, a.initial_unit_weight)["initial_out_of_balance_ratio"]
    if quasi_static:
        assert start > 0.9  # no stresses balance the weight; supports carry a little of it
    else:
        assert start < 1e-6  # the particles are in the equilibrium of the finite elements
    if quasi_static:
        case.model.set_gravity((0.0, -9.81), ramp=a.time)
    *_, report = run_scheme(a, case.model, a.time, lambda: False)
    p = case.model.particles
    assert report.time == pytest.approx(a.time) and np.isfinite(p.stress).all()
    assert p.displacement[:, 1].min() < -1e-4  # it settles or slides under the greater weight
    if quasi_static:
        assert report.residual < 1e-7


def test_pore_pressures_are_in_the_files_and_pictures(tmp_path):
    assert slope.main([*SMALL, *OTHERS["undrained"], "--initial-unit-weight", "4e3", "--time", "0.05", "--frames", "2",
                       "--output", str(tmp_path)]) == 0  # fmt: skip
    with h5py.File(tmp_path / "particles" / "000002.h5") as file:
        pressure = file["excess_pore_pressure"][:]
    assert np.isfinite(pressure).all() and pressure.max() > 100.0
    assert (tmp_path / "figure_7_excess_pore_pressure.png").stat().st_size > 0
