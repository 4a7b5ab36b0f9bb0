"""Sites of Hardening Soil: the example of the strutted pit, parameters that grow with depth, doubts about units."""

from pathlib import Path

import numpy as np
import pytest
import study_main  # noqa: F401
from common.site.file import read_site
from common.site.laws import idle_doubt, law_at, unit_doubt
from common.stages.runs import carry_out
from mpi4py import MPI

import mpm_core as mpm

MESHES = Path(__file__).parents[3] / "meshes"
SAND = {"material": "hardening-soil", "secant_modulus": 30e6, "oedometer_modulus": 30e6, "unloading_modulus": 90e6,
        "cohesion": 0.0, "friction_angle": 35.0}  # fmt: skip


def test_the_floor_of_a_pit_rises_by_less_than_in_soil_with_one_modulus(tmp_path):
    heave = {}
    for name in ("hardening_excavation", "braced_excavation"):
        (tmp_path / "site.toml").write_text(f'extends = "{MESHES / name}.toml"\ncell_size = 2.0\n')
        run = carry_out(read_site(tmp_path / "site.toml", MPI.COMM_WORLD), 2, tmp_path, MPI.COMM_WORLD)
        heave[name] = run.rows[-1]["heave_m"], run.rows[-1]["wall_axial_force_N_per_m"]
        if name == "hardening_excavation":  # ground at rest with its K0 does not move
            assert run.rows[0]["largest_displacement_m"] < 1e-9
    assert heave["hardening_excavation"][0] < 0.85 * heave["braced_excavation"][0]
    assert heave["hardening_excavation"][1] < heave["braced_excavation"][1]


def test_parameters_of_the_file_are_those_of_the_law():
    growing = {"value": 100e3, "per_metre": 8e3, "top": 10.0}
    law = law_at(
        SAND | {"vertical_preconsolidation": growing, "unloading_poisson": 0.25, "stiffness_exponent": 0.7},
        5.0,
        "soils.sand",
    )
    assert law == mpm.HardeningSoil(
        secant_modulus=30e6, oedometer_modulus=30e6, unloading_modulus=90e6, cohesion=0.0, friction_angle=35.0, exponent=0.7,
        poisson=0.25, vertical_preconsolidation=140e3,
    )  # fmt: skip


def test_moduli_that_do_not_fit_together_are_named_with_their_soil():
    with pytest.raises(mpm.InputError, match=r"soils.sand: oedometer_modulus = 8e\+07, but it must be below"):
        law_at(SAND | {"oedometer_modulus": 80e6}, None, "soils.sand")


def test_moduli_in_kpa_are_doubted():
    assert "soils.sand: secant_modulus is 30000 Pa, which hardly any soil has" in unit_doubt(
        SAND | {"secant_modulus": 30e3}, "soils.sand"
    )


def test_small_strain_stiffness_is_read_and_its_threshold_alone_is_doubted():
    small = {"small_strain_modulus": 120e6, "threshold_strain": 1e-4}
    law = law_at(SAND | small, None, "soils.sand")
    assert (law.small_strain_modulus, law.threshold_strain) == (120e6, 1e-4)
    assert not idle_doubt(SAND | small, "soils.sand")
    assert "threshold_strain has no effect" in idle_doubt(SAND | {"threshold_strain": 1e-4}, "soils.sand")
    assert "small_strain_modulus is 120 Pa" in unit_doubt(SAND | {"small_strain_modulus": 120.0}, "soils.sand")


def test_small_strain_stiffness_makes_the_floor_rise_less_and_the_far_ground_stay(tmp_path):
    """Far from the pit strains are small: there the stiffness is nearly that of very small strains."""
    found = {}
    for name, keys in (("usual", ""), ("small", "small_strain_modulus = 112.5e6\n")):
        soils = ("ground", '"cut 1"', '"cut 2"', '"cut 3"')
        text = f'extends = "{MESHES / "hardening_excavation"}.toml"\ncell_size = 2.0\n'
        (tmp_path / "site.toml").write_text(text + "".join(f"[soils.{soil}]\n{keys}" for soil in soils))
        run = carry_out(read_site(tmp_path / "site.toml", MPI.COMM_WORLD), 2, tmp_path, MPI.COMM_WORLD)
        far = run.site.fem.evaluate_at(np.array([[25.0, 19.9]]))["displacement"][0, 1]
        found[name] = run.rows[-1]["heave_m"], far
    assert 0.6 < found["small"][0] / found["usual"][0] < 0.85
    assert abs(found["small"][1]) < 0.4 * abs(found["usual"][1])  # G0 is three times that of unloading
