"""Hardening Soil: laboratory tests by closed forms, strength, dilatancy, preconsolidation, parameters that do not fit."""

import numpy as np
import pytest
from core_cases import box
from hardening_soil_cases import (
    REFERENCE,
    SAND,
    attraction,
    clay,
    differences,
    hyperbola,
    isotropic,
    preloaded,
    sand,
    stiffness_factor,
    strength,
)
from law_cases import triaxial

import fenics_bridge as bridge
import mpm_core as mpm


@pytest.mark.parametrize("pressure", [50e3, 200e3])
@pytest.mark.parametrize("soil", [sand, clay])
def test_drained_triaxial_compression_is_a_hyperbola_with_the_secant_modulus(soil, pressure):
    law = soil(dilation_angle=0.0)
    strain, stress = triaxial(preloaded(law, pressure), -0.02, 200)
    q, failure = -stress[:, 0] - pressure, strength(law, pressure)
    before = q < 0.9 * failure
    assert before.sum() > 30
    expected = hyperbola(law, q[before], pressure)
    assert -strain[before, 0] == pytest.approx(expected, rel=5e-3)
    half = np.interp(failure / 2, q, -strain[:, 0])
    assert failure / 2 / half == pytest.approx(law.secant_modulus * stiffness_factor(law, pressure), rel=5e-3)
    assert -stress[-1, 1:3] == pytest.approx(pressure, rel=1e-6)


def test_unloading_and_reloading_are_elastic_with_their_own_modulus():
    law = sand()
    test = preloaded(law, 100e3)
    triaxial(test, -0.005, 50)
    top, hardening = test.stress[0], test.state.copy()
    unloaded, stress = triaxial(test, 0.0008, 20)
    slope = (stress[-1, 0] - stress[0, 0]) / (unloaded[-1, 0] - unloaded[0, 0])
    assert slope == pytest.approx(law.unloading_modulus, rel=3e-4)  # the edge of the hexagon is round
    assert test.state == pytest.approx(hardening, abs=1e-12)
    _, stress = triaxial(test, -0.0008, 20)
    assert stress[-1, 0] == pytest.approx(top, rel=1e-6)
    assert test.state == pytest.approx(hardening, abs=1e-9)


@pytest.mark.parametrize("soil", [sand, clay])
def test_oedometer_has_its_modulus_and_k0_at_the_reference_pressure(soil):
    law = soil()
    a = attraction(law)
    k0 = 1 - np.sin(np.radians(law.friction_angle))
    test = mpm.ElementTest(law, [-0.98 * REFERENCE, *[-0.98 * k0 * REFERENCE] * 2, 0, 0, 0])
    strain, stress = [], []
    while test.stress[0] > -1.02 * REFERENCE:
        test.step([-1e-5, 0, 0, 0, 0, 0])
        strain.append(-test.strain[0])
        stress.append(-test.stress)
    stress = np.array(stress)
    modulus, lateral = (np.polyfit(stress[:, 0] - REFERENCE, y, 1)[0] for y in (np.array(strain), stress[:, 1]))
    assert 1 / modulus == pytest.approx(law.oedometer_modulus, rel=0.01)
    assert lateral == pytest.approx(k0, rel=0.01)
    if a > 0:
        return  # K0 of first loading then differs with the stress
    test = mpm.ElementTest(law, [-4 * REFERENCE, *[-4 * k0 * REFERENCE] * 2, 0, 0, 0])
    for _ in range(20):
        test.step([-1e-5, 0, 0, 0, 0, 0])
    before, before_strain = test.stress[0], test.strain[0]
    for _ in range(20):
        test.step([-1e-5, 0, 0, 0, 0, 0])
    factor = 4**law.exponent
    found = (test.stress[0] - before) / (test.strain[0] - before_strain)
    assert found == pytest.approx(factor * law.oedometer_modulus, rel=0.03)


@pytest.mark.parametrize("soil", [sand, clay])
def test_ground_under_its_own_weight_is_normally_consolidated(soil):
    # From zero stress, in one increment and in many: K0 of first loading, where there is no cohesion
    law, results = soil(), {}
    for steps in (1, 10, 100, 1000):
        test = mpm.ElementTest(law, np.zeros(6))
        for step in range(steps):
            test.step([None, 0, 0, 0, 0, 0], stress=[-200e3 * (step + 1) / steps, 0, 0, 0, 0, 0])
        results[steps] = test.stress[1] / test.stress[0], test.strain[0]
    k0, strain = results[1000]
    if law.cohesion == 0:
        assert k0 == pytest.approx(1 - np.sin(np.radians(law.friction_angle)), rel=0.01)
        # e = sigma^(1 - m) reference^m / ((1 - m) Eoed)
        exact = np.sqrt(200e3 * REFERENCE) / (0.5 * law.oedometer_modulus)
        assert -strain == pytest.approx(exact, rel=0.01)
    assert results[1] == pytest.approx(results[1000], rel=0.03 if law.cohesion == 0 else 0.07)
    assert results[10] == pytest.approx(results[1000], rel=0.015)
    assert results[100] == pytest.approx(results[1000], rel=0.005)


DIRECTIONS = {
    "triaxial compression": [-1.0, None, None, 0, 0, 0],
    "triaxial extension": [1.0, None, None, 0, 0, 0],
    "plane strain": [-1.0, None, 0, 0, 0, 0],
    "true triaxial": [-1.0, -0.2, None, 0, 0, 0],
}


@pytest.mark.parametrize("direction", DIRECTIONS.values(), ids=DIRECTIONS.keys())
@pytest.mark.parametrize("soil", [sand, clay])
def test_the_strength_is_that_of_mohr_and_coulomb_in_all_directions(soil, direction):
    law = soil()
    test = mpm.ElementTest(law, isotropic(100e3))
    for _ in range(400):
        test.step([None if e is None else 5e-4 * e for e in direction])
    smallest, difference = differences(test.stress)
    assert difference == pytest.approx(strength(law, smallest), rel=0.004)


def test_soil_at_failure_dilates_by_its_angle_and_contracts_before():
    law = sand()
    sine = np.sin(np.radians(law.dilation_angle))
    strain, _ = triaxial(mpm.ElementTest(law, isotropic(100e3)), -0.06, 600)
    volume = -strain[:, :3].sum(axis=1)
    rate = (volume[-1] - volume[-100]) / (strain[-100, 0] - strain[-1, 0])
    assert rate == pytest.approx(-2 * sine / (1 - sine), rel=1e-4)
    assert volume[:20].max() > 0 and (np.diff(volume[:5]) > 0).all()
    no_dilation, _ = triaxial(mpm.ElementTest(sand(dilation_angle=0.0), isotropic(100e3)), -0.06, 600)
    assert (np.diff(-no_dilation[:, :3].sum(axis=1)) > -1e-9).all()


def test_dilatancy_before_failure_is_rowes():
    law = sand(dilation_angle=10.0)
    phi, psi = np.radians([law.friction_angle, law.dilation_angle])
    critical = (np.sin(phi) - np.sin(psi)) / (1 - np.sin(phi) * np.sin(psi))
    strain, stress = triaxial(preloaded(law, 100e3), -0.03, 3000)
    q, volume = -stress[:, 0] - 100e3, -strain[:, :3].sum(axis=1)
    plastic_axial = -strain[:, 0] - q / law.unloading_modulus
    plastic_volume = volume - q * (1 - 2 * law.poisson) / law.unloading_modulus
    rows = np.flatnonzero((q > 0.5 * q[-1]) & (q < 0.97 * q[-1]))
    d_gamma = 2 * np.diff(plastic_axial) - np.diff(plastic_volume)
    mobilised = q / (q + 200e3)  # sin(phi_m) = q / (s1 + s3)
    rowe = np.maximum((mobilised - critical) / (1 - mobilised * critical), 0)
    assert rowe[rows].min() == 0 and rowe[rows].max() > 0.1
    assert (-np.diff(plastic_volume) / d_gamma)[rows] == pytest.approx(rowe[rows + 1], abs=2e-3)


@pytest.mark.parametrize("angle", [0.0, 8.0, 20.0, 35.0])
def test_soil_at_failure_dilates_by_its_angle_in_plane_strain_and_extension(angle):
    # sin(psi) = -de_v / sum of |de_i|, as of the planes of Mohr and Coulomb; plane strain: -de_v / (de_1 - de_3)
    law, sine = sand(dilation_angle=angle), np.sin(np.radians(angle))
    for direction, sign in (([-1.0, None, 0, 0, 0, 0], 1), ([1.0, None, None, 0, 0, 0], -1)):
        test = mpm.ElementTest(law, isotropic(100e3))
        for _ in range(300):
            test.step([None if e is None else 1e-3 * e for e in direction])
        before, plastic = test.strain.copy(), test.state[0]
        for _ in range(20):
            test.step([None if e is None else 1e-3 * e for e in direction])
        strain = (test.strain - before)[:3]  # elastic strains do not change
        assert strain.sum() / np.abs(strain).sum() == pytest.approx(sine, abs=0.01 * sine + 1e-6)
        assert (
            test.stress[:3] @ strain > -0.01 * 100e3 * np.abs(strain).sum()
        )  # zero for associated flow without cohesion
        assert test.state[0] > plastic and sign * strain[0] < 0


def test_soil_is_as_stiff_as_in_unloading_up_to_its_preconsolidation():
    before, law = 200e3, sand(vertical_preconsolidation=200e3)
    test = mpm.ElementTest(law, isotropic(50e3))
    stress, modulus = [], []
    for _ in range(900):
        vertical, strain = test.stress[0], test.strain[0]
        test.step([-1e-5, 0, 0, 0, 0, 0])
        stress.append(-test.stress)
        modulus.append((test.stress[0] - vertical) / (test.strain[0] - strain))
    stress, modulus = np.array(stress), np.array(modulus)
    constrained = (1 - law.poisson) / ((1 + law.poisson) * (1 - 2 * law.poisson)) * law.unloading_modulus
    elastic = stress[:, 0] < 0.7 * before
    assert modulus[elastic] == pytest.approx(constrained * stiffness_factor(law, stress[elastic, 1]), rel=2e-3)
    # beyond it the oedometer modulus of first loading, which grows with the root of the stress
    virgin = (stress[:, 0] > 1.5 * before) & (stress[:, 0] < 2 * before)
    assert virgin.sum() > 20
    assert modulus[virgin] == pytest.approx(law.oedometer_modulus * np.sqrt(stress[virgin, 0] / REFERENCE), rel=0.1)


def test_points_that_begin_with_stress_are_normally_consolidated_and_keep_it():
    law = sand()
    start = np.array([[-150e3, -70e3, -60e3, 20e3, 10e3, 0.0], [-80e3, -80e3, -80e3, 0, 0, 0]])
    stress, state = start.copy(), np.zeros((2, 3))
    assert law.update(np.zeros((2, 6)), stress, state).failed == 0
    assert np.abs(stress - start).max() < 1e-6
    known = mpm.hardening_soil_state(law, start)
    assert state[:, 1] == pytest.approx(known["shear_hardening"]) and state[:, 2] == pytest.approx(
        known["log_preconsolidation"]
    )
    # the first loading of each yields, also after unloading
    for strain in (1e-5, -2e-5):
        report = law.update(np.outer([1, 1], [strain, 0, 0, 0, 0, 0]), stress, state)
    assert report.plastic == 2


def test_overconsolidated_points_are_elastic_up_to_their_ratio():
    law = sand()
    k0 = 0.6
    start = np.array([[-100e3, -k0 * 100e3, -k0 * 100e3, 0, 0, 0]])
    state = np.zeros((1, 3))
    for name, values in mpm.hardening_soil_state(law, start, 3.0).items():
        state[:, law.state_names.index(name)] = values
    assert law.update(np.array([[-5e-4, 0, 0, 0, 0, 0]]), start.copy(), state.copy()).plastic == 0
    same = sand(vertical_preconsolidation=300e3)
    fresh = np.zeros((1, 3))
    one, other = start.copy(), start.copy()
    for _ in range(20):
        law.update(np.array([[-5e-4, 0, 0, 0, 0, 0]]), one, state)
        same.update(np.array([[-5e-4, 0, 0, 0, 0, 0]]), other, fresh)
    assert one == pytest.approx(other, rel=1e-6) and state[0, 0] > 0


def test_soil_that_is_pulled_apart_has_no_stress_and_closes_again():
    for law, least in ((sand(), 0.0), (clay(), -attraction(clay())), (clay(tension_cutoff=0.0), 0.0)):
        test = mpm.ElementTest(law, isotropic(50e3))
        for _ in range(50):
            test.step([1e-3, 1e-3, 1e-3, 0, 0, 0])
        assert -test.stress[:3] == pytest.approx(least, abs=2e-4 * (REFERENCE + attraction(law)))
        for _ in range(200):
            test.step([-1e-3, -1e-3, -1e-3, 0, 0, 0])
        assert test.stress[:3].max() < -100e3


def test_tension_is_cut_off_in_each_direction():
    law = clay(tension_cutoff=0.0)
    start, uncut = [-15e3, -10e3, -10e3, 0, 0, 0], []
    for soil in (law, clay()):
        test = mpm.ElementTest(soil, start)
        for _ in range(200):
            test.step([None, 1e-3, 0.0, 0, 0, 0])
        assert test.stress[0] == pytest.approx(-15e3)
        uncut.append(test.stress[1])
    # without cut-off Mohr and Coulomb have s3 + a = (s1 + a) / (1 + N)
    a = attraction(law)
    assert uncut[0] == pytest.approx(0.0, abs=1.0)
    assert uncut[1] == pytest.approx(a - (15e3 + a) / (1 + strength(law, 1.0 - a)), rel=5e-3)


def test_strength_reduction_divides_cohesion_and_tangent():
    law, factor = clay(), 1.3
    reduced = mpm.MohrCoulomb(young=1e6, poisson=0.2, cohesion=8e3, friction_angle=24.0)
    weaker = bridge.reduced_strength(law, factor)
    assert weaker.strength_factor == factor
    strong = bridge.reduced_strength(reduced, factor)
    _, stress = triaxial(mpm.ElementTest(weaker, isotropic(50e3)), -0.2, 400)
    sine = np.sin(np.radians(strong.friction_angle))
    expected = 2 * sine / (1 - sine) * (50e3 + strong.cohesion / np.tan(np.radians(strong.friction_angle)))
    assert -stress[-1, 0] - 50e3 == pytest.approx(expected, rel=4e-3)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"unloading_modulus": 50e6}, r"unloading_modulus = 5e\+07, but it must be above the initial modulus"),
        ({"oedometer_modulus": 80e6}, r"oedometer_modulus = 8e\+07, but it must be below"),
        ({"normal_k0": 0.2}, "normal_k0 = 0.2, but it must be so large"),
        ({"normal_k0": 1.1}, r"normal_k0 = 1.1, but it must be in \[0, 1\)"),
        ({"exponent": 1.2}, r"exponent = 1.2, but it must be in \[0, 1\]"),
        ({"failure_ratio": 1.0}, r"failure_ratio = 1, but it must be in \(0, 1\)"),
        ({"friction_angle": 0.0}, r"friction_angle = 0, but it must be in \(0, 90\)"),
    ],
)
def test_parameters_that_do_not_fit_together_are_named(changes, text):
    with pytest.raises(mpm.InputError, match=text):
        sand(**changes)


def test_the_largest_oedometer_modulus_is_one_that_can_be_reached():
    with pytest.raises(mpm.InputError) as error:
        sand(oedometer_modulus=1e9)
    most = float(str(error.value).split("below ")[1].split(" Pa")[0])
    sand(oedometer_modulus=0.999 * most)
    assert SAND["oedometer_modulus"] < most
    with pytest.raises(mpm.InputError):
        sand(oedometer_modulus=1.001 * most)
    sand(oedometer_modulus=1.001 * most, secant_modulus=1.05 * SAND["secant_modulus"])  # as the message says
    sand(oedometer_modulus=1.001 * most, unloading_modulus=1.1 * SAND["unloading_modulus"])


def test_bad_states_are_asked_for_by_name():
    with pytest.raises(mpm.InputError, match="overconsolidation is 0.5, expected at least 1"):
        mpm.hardening_soil_state(sand(), isotropic(1e3)[None], 0.5)
    with pytest.raises(mpm.InputError, match=r"stress has shape \(1, 3\)"):
        mpm.hardening_soil_state(sand(), np.zeros((1, 3)))


def test_one_increment_from_a_hundredth_of_the_stress_has_the_strain_of_the_oedometer_modulus():
    """With an exponent of 1 and without cohesion the first step of Newton's method is too long for the law, by dozens of percent of strain."""
    law = mpm.HardeningSoil(
        secant_modulus=4e6,
        oedometer_modulus=3e6,
        unloading_modulus=12e6,
        cohesion=0.0,
        friction_angle=24.0,
        exponent=1.0,
    )
    k0 = 1 - np.sin(np.radians(24.0))
    test = mpm.ElementTest(law, stress=[-1e3, -k0 * 1e3, -k0 * 1e3, 0.0, 0.0, 0.0])
    test.step([None, 0.0, 0.0, 0.0, 0.0, 0.0], stress=[-100e3, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert -test.strain[0] == pytest.approx(100e3 / 3e6 * np.log(100.0), rel=1e-3)


def test_values_that_vary_and_do_not_fit_to_the_other_parameters_are_named():
    law = mpm.Heterogeneous(
        mpm.HardeningSoil(
            secant_modulus=10e6, oedometer_modulus=10e6, unloading_modulus=30e6, cohesion=4e3, friction_angle=26.0
        ),
        ["friction_angle"],
    )
    model = mpm.Model(box([2, 2], body=([0.0, 0.0], [1.0, 1.0])), law)
    model.seed(density=1800.0, per_cell=1)
    with pytest.raises(mpm.InputError, match="with the values of friction_angle, oedometer_modulus = .*must be below"):
        model.set_parameter("friction_angle", 44.0)
