"""Sites of rock by Hoek and Brown: the examples of a rock slope and of its slide, doubts about units, laws without effect."""

import study_main  # noqa: F401
from common.results import ROOT
from common.site.file import read_site
from common.site.laws import unit_doubt, without_effect
from mpi4py import MPI

import mpm_core as mpm

ROCK = {
    "material": "hoek-brown", "young": 3e9, "poisson": 0.25, "intact_strength": 25e6, "geological_strength_index": 30.0, "intact_constant": 8.0,
}  # fmt: skip


def test_examples_have_their_rock():
    slope = read_site(ROOT / "meshes" / "rock_slope.toml", MPI.COMM_SELF, 8.0)
    bank, ground = (slope.laws[slope.tags_of([name])[0]] for name in ("bank", "ground"))
    assert isinstance(bank, mpm.HoekBrown) and isinstance(ground, mpm.HoekBrown)
    assert (bank.disturbance_factor, ground.disturbance_factor) == (0.7, 0.0)
    assert bank.m_b < ground.m_b and bank.s < ground.s
    weathered = read_site(ROOT / "meshes" / "weathered_slope.toml", MPI.COMM_SELF, 8.0)
    assert bank in weathered.laws.values() and len(weathered.stages) == 2


def test_strength_in_mpa_is_doubted():
    assert "intact_strength is 25 Pa" in unit_doubt(ROCK | {"intact_strength": 25.0}, "soils.bank")
    assert unit_doubt(ROCK, "soils.bank") == ""


def test_parameters_of_soil_have_no_effect_on_rock():
    assert without_effect(ROCK | {"cohesion": 10e3, "friction_angle": 30.0, "tension_cutoff": 0.0}) == [
        "cohesion",
        "friction_angle",
    ]
    assert without_effect({"material": "mohr-coulomb", "dilation_ratio": 0.2}) == ["dilation_ratio"]
