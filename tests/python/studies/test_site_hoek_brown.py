"""Sites of rock by Hoek and Brown: the examples of a rock slope and of its slide, doubts about units, laws without effect."""

import pytest
import study_main  # noqa: F401
from common.results import ROOT
from common.site.file import read_site
from common.site.keys import read_site_table
from common.site.laws import unit_doubt, without_effect
from common.site.rock_doubts import rock_doubt
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


def rock(**changes):
    return mpm.HoekBrown(**{key: value for key, value in ROCK.items() if key != "material"} | changes)


@pytest.mark.parametrize("strength", [25.0, 200e3, 25e9])
def test_strength_in_mpa_or_kpa_is_doubted(strength):
    """Rock has 0.25 MPa (extremely weak, ISRM 1981) to some 400 MPa: 200 MPa in kPa is below, 25e9 Pa above."""
    law = rock(intact_strength=strength)
    said = f"soils.bank: intact_strength is {strength:g} Pa, expected that of rock samples"
    assert said in rock_doubt(law, "soils.bank") and said in rock_doubt(mpm.Undrained(law, porosity=0.1), "soils.bank")


def test_a_rock_mass_softer_than_its_samples_are_strong_is_doubted():
    """Of samples with 200 times their strength the softest rock mass has 0.02, 4 times the strength: 4 * 25 MPa."""
    assert "bank: young is 3e+06 Pa, less than the intact_strength of 2.5e+07 Pa" in rock_doubt(rock(young=3e6), "bank")
    assert "young is 3000 Pa" in unit_doubt(ROCK | {"young": 3e3}, "bank") and rock_doubt(rock(young=3e3), "bank") == ""
    usual = [rock(), rock(young=100e6), rock(intact_strength=0.25e6), rock(intact_strength=400e6)]
    assert [rock_doubt(law, "bank") for law in (*usual, mpm.LinearElastic(young=1e6, poisson=0.3))] == [""] * 5


@pytest.mark.parametrize("symbol, key", [("GSI", "geological_strength_index"), ("m_i", "intact_constant"), ("sigma_ci", "intact_strength"),
                                         ("D", "disturbance_factor")])  # fmt: skip
def test_symbols_of_the_criterion_lead_to_the_keys(tmp_path, symbol, key):
    path = tmp_path / "rock.toml"
    path.write_text(f'extends = "{ROOT}/meshes/rock_slope.toml"\n[soils.bank]\n{symbol} = 1.0\n')
    with pytest.raises(mpm.InputError, match=f"soils.bank: unknown key '{symbol}'; did you mean {key}\\?"):
        read_site(path, MPI.COMM_SELF, 8.0)
    path.write_text(f'extends = "{ROOT}/meshes/rock_slope.toml"\n[boundaries.face]\n{symbol} = 1.0\n')
    with pytest.raises(mpm.InputError, match=f"boundaries.face: unknown key '{symbol}', expected some of head"):
        read_site(path, MPI.COMM_SELF, 8.0)


def test_parameters_of_soil_have_no_effect_on_rock():
    assert without_effect(ROCK | {"cohesion": 10e3, "friction_angle": 30.0, "tension_cutoff": 0.0}) == [
        "cohesion",
        "friction_angle",
    ]
    assert without_effect({"material": "mohr-coulomb", "dilation_ratio": 0.2}) == ["dilation_ratio"]


def test_relaxation_of_a_stage_leads_to_its_deconfinement(tmp_path):
    path = tmp_path / "tunnel.toml"
    path.write_text(
        f'extends = "{ROOT}/meshes/tunnel.toml"\n[[stages]]\nname = "core"\nexcavate = "core"\nrelaxation = 0.5\n'
    )
    with pytest.raises(mpm.InputError, match=r"stages\[0\]: unknown key 'relaxation'; did you mean deconfinement\?"):
        read_site_table(path)
