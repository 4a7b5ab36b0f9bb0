"""Strength reduction of each law, and the strength of Davis."""

import numpy as np
import pytest

import fenics_bridge as bridge
import mpm_core as mpm

ELASTIC = {"young": 10e6, "poisson": 0.3}


def sand(**options):
    values = {"cohesion": 10.0, "friction_angle": 30.0, "dilation_angle": 20.0, **options}
    return mpm.MohrCoulomb(**ELASTIC, **values)


def tangent(degrees):
    return np.tan(np.radians(degrees))


def test_mohr_coulomb():
    weak = bridge.reduced_strength(sand(), 2.0)
    assert weak.cohesion == 5.0
    assert tangent(weak.friction_angle) == pytest.approx(tangent(30.0) / 2)
    assert weak.dilation_angle == weak.friction_angle  # 16.1 degrees: no longer 20
    assert bridge.reduced_strength(sand(), 1.2).dilation_angle == 20.0


def test_tresca_has_its_strength_divided():
    weak = bridge.reduced_strength(mpm.tresca(**ELASTIC, shear_strength=30e3), 1.5)
    assert weak.cohesion == pytest.approx(20e3) and weak.friction_angle == 0


def test_softening_soil_has_both_strengths_divided():
    law = mpm.SofteningMohrCoulomb(
        sand(), residual_cohesion=4.0, residual_friction_angle=20.0, softening_strain=0.1, reference_length=0.5
    )
    weak = bridge.reduced_strength(law, 2.0)
    assert weak.peak == bridge.reduced_strength(sand(), 2.0)
    assert weak.residual_cohesion == 2.0
    assert tangent(weak.residual_friction_angle) == pytest.approx(tangent(20.0) / 2)
    assert (weak.softening_strain, weak.reference_length) == (0.1, 0.5)


def shear_strength(law, pressure):
    """Deviatoric stress q [Pa] at which a triaxial compression under constant mean pressure fails."""
    strain, stress = np.zeros((1, 6)), np.zeros((1, 6))
    stress[0, :3] = -pressure
    state = np.zeros((1, law.n_state))
    if "log_preconsolidation" in law.state_names:
        state[0, law.state_names.index("log_preconsolidation")] = mpm.log_preconsolidation(law, stress)[0]
    for _ in range(4000):
        strain[0] = 1e-4 * np.array([0.5, 0.5, -1, 0, 0, 0])
        law.update(strain, stress, state)
        mean = stress[0, :3].mean()
        strain[0] = np.array([1, 1, 1, 0, 0, 0]) * (-pressure - mean) / (3 * law.p_wave_modulus)
        law.update(strain, stress, state)
    return stress[0, 0] - stress[0, 2]


def test_drucker_prager_fails_at_the_divided_stress():
    law = mpm.matched_drucker_prager(**ELASTIC, cohesion=10e3, friction_angle=25.0)
    strong, weak = (shear_strength(one, 100e3) for one in (law, bridge.reduced_strength(law, 1.6)))
    assert weak == pytest.approx(strong / 1.6, rel=1e-3)


def test_cam_clay_has_the_friction_angle_of_its_critical_state_reduced():
    law = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.2, poisson=0.3, preconsolidation=100e3, void_ratio=1.0
    )
    weak = bridge.reduced_strength(law, 1.5)
    sines = [3 * one.critical_slope / (6 + one.critical_slope) for one in (law, weak)]
    assert np.tan(np.arcsin(sines[1])) == pytest.approx(np.tan(np.arcsin(sines[0])) / 1.5)
    assert weak.preconsolidation == law.preconsolidation and weak.compression == law.compression


def test_laws_made_of_others():
    assert bridge.reduced_strength(mpm.Hencky(sand()), 2.0).law == bridge.reduced_strength(sand(), 2.0)
    soaked = bridge.reduced_strength(mpm.Undrained(sand(), porosity=0.4), 2.0)
    assert soaked.skeleton == bridge.reduced_strength(sand(), 2.0) and soaked.porosity == 0.4


def test_some_soils_stay_as_they_are():
    rock = mpm.LinearElastic(**ELASTIC)
    laws = {1: sand(), 2: sand(cohesion=20.0), 3: rock}
    weak = bridge.reduced_strength(laws, 2.0, unreduced=[2])
    assert weak[1].cohesion == 5.0 and weak[2] == laws[2] and weak[3] == rock
    with pytest.raises(bridge.InputError, match="unreduced.*no law is left"):
        bridge.reduced_strength(laws, 2.0, unreduced=[1, 2])
    with pytest.raises(bridge.InputError, match=r"unreduced.*7.*\[1, 2, 3\]"):
        bridge.reduced_strength(laws, 2.0, unreduced=[7])


@pytest.mark.parametrize("factor", [0.0, -1.0, np.nan, np.inf])
def test_bad_factors_are_refused(factor):
    with pytest.raises(bridge.InputError, match="factor"):
        bridge.reduced_strength(sand(), factor)


def test_laws_of_unknown_strength_are_refused_with_advice():
    with pytest.raises(bridge.InputError, match="LinearElastic.*reduce"):
        bridge.reduced_strength(mpm.LinearElastic(**ELASTIC), 1.0)


def test_strength_of_davis():
    """Without dilation c* = c cos(phi), tan(phi*) = sin(phi); with associated flow nothing changes."""
    davis = bridge.davis_strength(sand(dilation_angle=0.0))
    assert davis.cohesion == pytest.approx(10 * np.cos(np.radians(30)))
    assert tangent(davis.friction_angle) == pytest.approx(0.5)
    assert davis.dilation_angle == davis.friction_angle
    associated = sand(dilation_angle=30.0)
    assert bridge.davis_strength(associated).cohesion == pytest.approx(associated.cohesion)
    assert bridge.davis_strength(associated).friction_angle == pytest.approx(30.0)
    once = bridge.davis_reduced_strength({1: sand()}, 1.3)[1]
    assert once == bridge.davis_strength(bridge.reduced_strength(sand(), 1.3))
