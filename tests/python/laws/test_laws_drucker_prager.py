"""Drucker-Prager, von Mises and Tresca: paths by closed form, tangent, admissibility, bad parameters."""

import numpy as np
import pytest
from law_cases import Batch, assert_tangent, mean_and_radius, principal, random_points, triaxial, walk

import mpm_core as mpm

ELASTIC = {"young": 20e6, "poisson": 0.3}
SHEAR, BULK = 20e6 / 2.6, 20e6 / 1.2
SOIL = {**ELASTIC, "cohesion": 10e3, "friction_angle": 30.0}
OUTER, INNER, PLANE_STRAIN = mpm.ConeMatch.OUTER, mpm.ConeMatch.INNER, mpm.ConeMatch.PLANE_STRAIN
LAWS = {
    "von Mises": mpm.von_mises(**ELASTIC, yield_stress=30e3),
    "no dilation": mpm.matched_drucker_prager(**SOIL),
    "associated": mpm.matched_drucker_prager(**SOIL, dilation_angle=30.0, match=INNER),
    "cut-off": mpm.matched_drucker_prager(**SOIL, dilation_angle=10.0, match=PLANE_STRAIN, tension_cutoff=5e3),
    "no tension": mpm.DruckerPrager(**ELASTIC, strength=0.0, friction=0.4, dilation=0.1, tension_cutoff=0.0),
}


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def law(request):
    return request.param


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("pressure", [-40e3, 0.0, 60e3])
def test_tangent_is_the_derivative_of_the_stress(law, dim, pressure):
    stress, strain = random_points(dim, 400, pressure=pressure, deviator=20e3, strain=2e-3)
    batch = Batch(law, stress, strain)
    assert batch.report.plastic > 100
    assert_tangent(batch, 1e-8)


@pytest.mark.parametrize("dim", [2, 3])
def test_stress_stays_admissible(law, dim):
    stress, _ = random_points(dim, 1000, pressure=50e3, deviator=20e3, strain=0.0)
    stress, _ = walk(law, stress, 2e-3, 100)
    p, radius = mean_and_radius(stress)
    scale = np.abs(p) + radius + 1.0
    assert np.max((radius + law.friction * p - law.strength) / scale) < 1e-10
    assert np.max((p - law.tension_cutoff) / scale) < 1e-10


def test_initial_stress_inside_is_kept(law):
    stress, strain = random_points(3, 1000, pressure=100e3, deviator=3e3, strain=0.0)
    batch = Batch(law, stress, strain)
    inside = np.array(mean_and_radius(stress)).T @ [law.friction, 1] < law.strength
    assert inside.sum() > 500
    assert (batch.stress[inside] == stress[inside]).all()
    assert batch.report.plastic == (~inside).sum()


@pytest.mark.parametrize("match, sign", [(OUTER, -1), (INNER, 1)])
def test_matched_cone_has_the_strength_of_mohr_coulomb_on_its_meridian(match, sign):
    n, cell = 3.0, 50e3  # (1 + sin 30) / (1 - sin 30); axial stress at failure by Mohr-Coulomb
    strong, weak = cell * n + 2 * 10e3 * np.sqrt(n), (cell - 2 * 10e3 * np.sqrt(n)) / n
    test = mpm.ElementTest(mpm.matched_drucker_prager(**SOIL, match=match), [-cell] * 3 + [0.0] * 3)
    _, stress = triaxial(test, sign * 0.05, 100)
    assert stress[-1, 0] == pytest.approx(-strong if sign < 0 else -weak, rel=1e-9)


def test_plane_strain_match_fails_at_the_mohr_coulomb_strength():
    # Associated flow in plane strain: (s1 - s3)/2 = -(s1 + s3)/2 sin(phi) + c cos(phi)
    law = mpm.matched_drucker_prager(**SOIL, dilation_angle=30.0, match=PLANE_STRAIN)
    test = mpm.ElementTest(law, [-50e3, -50e3, -50e3, 0.0])
    for _ in range(400):
        test.step([-5e-4, None, 0.0, 0.0])
    n = 3.0
    assert test.stress[0] == pytest.approx(-(50e3 * n + 20e3 * np.sqrt(n)), rel=1e-6)


def test_dilation_is_the_slope_of_the_plastic_volume():
    # On the cone d(e_v^p) = multiplier * dilation and the plastic deviatoric strain is multiplier / sqrt(3).
    law = LAWS["cut-off"]
    test = mpm.ElementTest(law, [-50e3] * 3 + [0.0] * 3)
    triaxial(test, -0.02, 20)
    before, plastic = test.strain[:3].sum(), test.state[0]
    test.step([-1e-3, None, None, 0.0, 0.0, 0.0])
    assert test.strain[:3].sum() - before == pytest.approx(
        law.dilation * np.sqrt(3) * (test.state[0] - plastic), rel=1e-9
    )


def test_simple_shear_of_von_mises_ends_at_its_shear_strength():
    test = mpm.ElementTest(LAWS["von Mises"], [0.0] * 4)
    test.step([0, 0, 0, 1e-3])
    assert test.stress[3] == pytest.approx(SHEAR * 1e-3)
    for _ in range(20):
        test.step([0, 0, 0, 1e-3])
    assert test.stress[3] == pytest.approx(30e3 / np.sqrt(3), rel=1e-12)
    yielded = 30e3 / np.sqrt(3) / SHEAR
    assert test.state[0] == pytest.approx((21e-3 - yielded) / np.sqrt(3), rel=1e-9)


def test_oedometer_of_von_mises():
    # Beyond yield the stress difference keeps the yield stress and the mean stress follows the bulk modulus.
    test = mpm.ElementTest(LAWS["von Mises"], [0.0] * 6)
    for _ in range(10):
        test.step([-1e-3, 0, 0, 0, 0, 0])
    p = -BULK * 1e-2
    assert test.stress[0] == pytest.approx(p - 2 / 3 * 30e3, rel=1e-12)
    assert test.stress[1] == pytest.approx(p + 1 / 3 * 30e3, rel=1e-12)


def test_undrained_triaxial_of_tresca_fails_at_its_shear_strength():
    law = mpm.tresca(young=20e6, poisson=0.49, shear_strength=15e3)
    test = mpm.ElementTest(law, [-80e3] * 3 + [0.0] * 3)
    _, stress = triaxial(test, -0.02, 20, drained=False)
    s = principal(stress)
    assert (s[-1, 0] - s[-1, 2]) / 2 == pytest.approx(15e3, rel=1e-9)
    assert stress[-1, :3].mean() == pytest.approx(-80e3, rel=1e-9)


def test_bad_parameters_are_named_with_value_and_range():
    good = {**ELASTIC, "strength": 1e3, "friction": 0.4}
    for name, value in [("young", -1.0), ("poisson", 0.5), ("strength", -2.0), ("friction", -0.5), ("dilation", 0.5),
                        ("tension_cutoff", -3.0), ("strength", np.inf), ("friction", np.nan)]:  # fmt: skip
        with pytest.raises(mpm.InputError, match=f"^{name} = {value:g}, but it must be "):
            mpm.DruckerPrager(**{**good, name: value})
    with pytest.raises(mpm.InputError, match="^shear_strength is 0.0 Pa, "):
        mpm.tresca(young=1e6, poisson=0.3, shear_strength=0.0)
    with pytest.raises(mpm.InputError, match="^yield_stress is -1.0 Pa, "):
        mpm.von_mises(young=1e6, poisson=0.3, yield_stress=-1.0)
    with pytest.raises(mpm.InputError, match="^friction_angle = 95, "):
        mpm.matched_drucker_prager(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=95.0)


def test_arguments_of_another_kind_are_named():
    with pytest.raises(mpm.InputError, match="match is 'outer', expected one of ConeMatch.OUTER"):
        mpm.matched_drucker_prager(young=1e7, poisson=0.3, cohesion=1e3, friction_angle=30.0, match="outer")
    with pytest.raises(mpm.InputError, match=r"strain_increment has shape \(3,\), expected \(4,\)"):
        mpm.ElementTest(mpm.LinearElastic(young=1e7, poisson=0.3), np.zeros(4)).step([1e-3, 0.0, 0.0])
