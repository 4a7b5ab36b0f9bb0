"""Undrained soils of a site: pore water that is too soft for them."""

import numpy as np
import pytest
import study_main  # noqa: F401
from common.results import ROOT
from common.site.file import read_site
from common.site.undrained_doubts import skempton
from mpi4py import MPI

import mpm_core as mpm


def law_of(modulus=2e7):
    soil = mpm.MohrCoulomb(young=50e6, poisson=0.3, cohesion=1e6, friction_angle=20.0)
    return mpm.Undrained(soil, water_modulus=modulus, porosity=0.4)


@pytest.mark.parametrize(("modulus", "expected"), [(2e7, 50 / (50 + 50 / 1.2)), (2.2e9, 5500 / (5500 + 50 / 1.2))])
def test_the_water_takes_its_share_of_a_load_from_all_sides(modulus, expected):
    """B = (K_w / n) / (K_w / n + K), K = E / 3 (1 - 2 nu): 0.545 with a soft water; the law itself has it."""
    law = law_of(modulus)
    assert skempton(law) == pytest.approx(expected)
    test = mpm.ElementTest(law, stress=np.zeros(4))
    test.step([-1e-5, -1e-5, -1e-5, 0.0])
    pressure = test.state[law.state_names.index("excess_pore_pressure")]
    assert pressure / -test.stress[:3].mean() == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("place", ["soils.bank", "laws.undrained"])
@pytest.mark.parametrize(("modulus", "said"), [("", True), ("water_modulus = 2e9", False)])
def test_water_that_leaves_the_skeleton_much_of_a_load_is_said(tmp_path, place, modulus, said, recwarn):
    """The water modulus that is taken where it is left out, 20 MPa, is for soft soil."""
    law = "undrained = true\nmaterial = 'mohr-coulomb'\nyoung = 50e6\npoisson = 0.3\ncohesion = 5e3\nfriction_angle = 27\n"
    path = tmp_path / "site.toml"
    path.write_text(f'extends = "{ROOT}/meshes/dike.toml"\n[{place}]\n{law}porosity = 0.4\n{modulus}\n')
    read_site(path, MPI.COMM_WORLD, 3.0)
    texts = [str(one.message) for one in recwarn if "Skempton" in str(one.message)]
    assert len(texts) == said
    if said:
        assert f"{place}: undrained is true, but the water takes only 55% of a load" in texts[0]
        assert "water_modulus is 2e+07 Pa" in texts[0] and "4.17e+07 Pa" in texts[0]


def test_hardening_soil_counts_with_its_modulus_of_unloading():
    soil = mpm.HardeningSoil(
        secant_modulus=20e6, oedometer_modulus=20e6, unloading_modulus=60e6, cohesion=1e3, friction_angle=30.0
    )
    law = mpm.Undrained(soil, water_modulus=2e7, porosity=0.5)
    assert skempton(law) == pytest.approx(40 / (40 + 60 / (3 * (1 - 2 * 0.2))))


def test_a_skeleton_without_a_modulus_is_not_doubted():
    assert skempton(mpm.Undrained(mpm.CamClay(poisson=0.3, compression=0.1, swelling=0.02, critical_slope=1.0, void_ratio=1.0,
                                              preconsolidation=50e3, attraction=1e3), water_modulus=2e7, porosity=0.5)) is None  # fmt: skip
