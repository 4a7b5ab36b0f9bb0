"""Hoek-Brown: the constants of rock masses, strengths by closed form, divided strength, tangent, flow, bad parameters."""

import numpy as np
import pytest
from law_cases import Batch, assert_tangent, principal, random_points, triaxial, walk
from scipy.optimize import brentq, minimize_scalar

import fenics_bridge as bridge
import mpm_core as mpm

SIZE = 20e6  # Pa, of the intact strength
ROCK = {
    "young": 5e9, "poisson": 0.25, "intact_strength": SIZE, "geological_strength_index": 45.0, "intact_constant": 10.0,
    "disturbance_factor": 0.3,
}  # fmt: skip


def rock(**changes) -> mpm.HoekBrown:
    return mpm.HoekBrown(**{**ROCK, **changes})


LAWS = {
    "no dilation": rock(),
    "some dilation": rock(dilation_ratio=0.4),
    "associated": rock(dilation_ratio=1.0),
    "no tension": rock(dilation_ratio=0.5, tension_cutoff=0.0),
    "cut-off": rock(dilation_ratio=0.2, tension_cutoff=5e3),
    "poor rock": rock(geological_strength_index=10.0, disturbance_factor=1.0, dilation_ratio=0.3),
    "intact": rock(geological_strength_index=100.0, dilation_ratio=0.2),
    "divided": bridge.reduced_strength(rock(dilation_ratio=0.4), 1.7),
    "divided, associated": bridge.reduced_strength(rock(dilation_ratio=1.0), 2.5),
    "raised": bridge.reduced_strength(rock(dilation_ratio=0.4), 0.6),
}


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def law(request):
    return request.param


def strength(law: mpm.HoekBrown, confinement):
    """Largest principal stress (positive in compression) under the smallest one, before the strength is divided."""
    q = law.intact_strength
    return confinement + q * np.maximum(law.m_b * confinement / q + law.s, 0) ** law.a


def tensile_strength(law: mpm.HoekBrown) -> float:
    return law.s * law.intact_strength / law.m_b


def envelope(law: mpm.HoekBrown, normal: float) -> float:
    """Shear strength under a normal stress: the smallest radius by which a circle of a state at failure reaches beyond it."""

    def radius_at(confinement):
        largest = strength(law, confinement)
        squared = ((largest - confinement) / 2) ** 2 - ((largest + confinement) / 2 - normal) ** 2
        return -np.sqrt(max(squared, 0.0))

    low = -tensile_strength(law)
    found = minimize_scalar(
        radius_at, bounds=(low, normal), method="bounded", options={"xatol": 1e-10 * law.intact_strength}
    )
    return -found.fun


def excess(law: mpm.HoekBrown, stress: np.ndarray) -> np.ndarray:
    """By how much stresses are outside of the criterion of an undivided law [Pa]."""
    s = -principal(stress)  # positive in compression
    largest, smallest = s.max(axis=1), s.min(axis=1)
    return largest - strength(law, smallest)


def test_constants_of_rock_masses():
    # The values of Hammah, Yacoub, Corkum and Curran (2005) for GSI 5, and intact rock
    poor = rock(geological_strength_index=5.0, intact_constant=2.0, disturbance_factor=0.0)
    assert (poor.m_b, poor.s, poor.a) == pytest.approx((0.067, 2.6e-5, 0.619), rel=0.01)
    intact = rock(geological_strength_index=100.0)
    assert (intact.m_b, intact.s, intact.a) == pytest.approx((10.0, 1.0, 0.5))
    blasted = rock(disturbance_factor=1.0)  # by the formulas of Hoek, Carranza-Torres and Corkum (2002)
    assert (blasted.m_b, blasted.s) == pytest.approx((10 * np.exp(-55 / 14), np.exp(-55 / 6)))


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("pressure", [-0.3, 0.0, 0.05, 1.0])
def test_tangent_is_the_derivative_of_the_stress(law, dim, pressure):
    size = strength(law, 0.0)
    stress, strain = random_points(dim, 300, pressure=pressure * size, deviator=0.5 * size, strain=2 * size / law.young)
    batch = Batch(law, stress, strain)
    assert batch.report.plastic > 50
    assert_tangent(batch, 1e-4 * size / law.young)


@pytest.mark.parametrize("dim", [2, 3])
def test_stress_stays_admissible(law, dim):
    if law.strength_factor != 1:
        pytest.skip("of laws whose strength is not divided")
    size = strength(law, 0.0)
    stress, _ = random_points(dim, 500, pressure=size, deviator=0.3 * size, strain=0.0)
    stress, _ = walk(law, stress, size / law.young, 100)
    scale = np.abs(principal(stress)).max(axis=1) + size
    assert (excess(law, stress) / scale).max() < 1e-9
    tension = min(law.tension_cutoff, tensile_strength(law))
    assert ((principal(stress).max(axis=1) - tension) / scale).max() < 1e-9


def test_stress_inside_is_kept(law):
    stress, strain = random_points(3, 500, pressure=strength(law, 0.0), deviator=0.02 * strength(law, 0.0), strain=0.0)
    batch = Batch(law, stress, strain)
    assert (batch.stress == stress).all() and batch.report.plastic == 0


def test_stress_that_was_returned_is_elastic_afterwards(law):
    size = strength(law, 0.0)
    stress, strain = random_points(3, 500, pressure=size, deviator=size, strain=size / law.young)
    once = Batch(law, stress, strain)
    again = Batch(law, once.stress, np.zeros_like(strain))
    assert once.report.plastic > 100
    assert again.stress == pytest.approx(once.stress, rel=1e-9, abs=1e-9 * size)


@pytest.mark.parametrize("confinement", [0.0, 0.2e6, 3e6])
def test_triaxial_strengths(confinement):
    law = rock()
    test = mpm.ElementTest(law, [-confinement] * 3 + [0.0] * 3)
    _, stress = triaxial(test, -0.05, 50)
    assert -stress[-1, 0] == pytest.approx(strength(law, -stress[-1, 1]), rel=1e-9)  # under the pressure that it holds
    # Extension: the cell pressure is the largest stress of the criterion.
    test = mpm.ElementTest(law, [-strength(law, confinement)] * 3 + [0.0] * 3)
    _, stress = triaxial(test, 0.05, 50)
    assert -stress[-1, 0] == pytest.approx(confinement, abs=1e-8 * SIZE)


def test_tensile_strengths():
    law = rock()
    test = mpm.ElementTest(law, [0.0] * 6)
    test.step([1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0])
    tension = tensile_strength(law)
    assert test.stress[:3] == pytest.approx([tension] * 3, rel=1e-5)  # which it approaches but for a millionth
    test = mpm.ElementTest(law, [0.0] * 6)
    _, stress = triaxial(test, 0.01, 20)
    alone = brentq(lambda s: strength(law, -s), 0.5 * tension, tension)  # no stress in the other directions
    assert stress[-1, 0] == pytest.approx(alone, rel=1e-6)
    cut = mpm.ElementTest(rock(tension_cutoff=10e3), [0.0] * 6)
    _, stress = triaxial(cut, 0.01, 20)
    assert stress[-1, 0] == pytest.approx(10e3, rel=1e-9)


@pytest.mark.parametrize("factor", [0.7, 1.0, 1.5, 3.0])
@pytest.mark.parametrize("confinement", [0.1e6, 2e6])
def test_divided_strength_is_the_shear_strength_under_each_normal_stress(factor, confinement):
    # At failure Mohr's circle touches the envelope that is divided, and crosses it nowhere.
    law = rock()
    test = mpm.ElementTest(bridge.reduced_strength(law, factor), [-confinement] * 3 + [0.0] * 3)
    _, stress = triaxial(test, -0.05, 50)
    largest = -stress[-1, 0]
    centre, radius = (largest + confinement) / 2, (largest - confinement) / 2

    def distance(normal):  # from the circle to the divided envelope
        return envelope(law, normal) / factor - np.sqrt(max(radius**2 - (normal - centre) ** 2, 0.0))

    normals = np.linspace(centre - radius, centre, 401)
    nearest = normals[np.argmin([distance(n) for n in normals])]
    found = minimize_scalar(distance, bounds=(nearest - radius / 200, nearest + radius / 200), method="bounded")
    assert found.fun == pytest.approx(0.0, abs=1e-5 * radius)


@pytest.mark.parametrize("ratio", [0.0, 0.3, 1.0])
def test_dilation_angle_follows_the_friction_angle(ratio):
    law = rock(dilation_ratio=ratio)
    confinement = 1e6
    test = mpm.ElementTest(law, [-confinement] * 3 + [0.0] * 3)
    triaxial(test, -0.02, 20)
    before = test.strain[:3].sum(), test.strain[0]
    test.step([-1e-3, None, None, 0.0, 0.0, 0.0])
    # At constant stress all strain is plastic: de_v = -2 sin(psi) / (1 - sin(psi)) de_1, with the friction angle of the tangent.
    slope = law.a * law.m_b * (law.m_b * confinement / SIZE + law.s) ** (law.a - 1)
    sine = ratio * slope / (2 + slope)
    assert test.strain[:3].sum() - before[0] == pytest.approx(
        -2 * sine / (1 - sine) * (test.strain[0] - before[1]), abs=1e-9
    )


def test_fraction_of_associated_flow_is_the_ratio(law):
    assert mpm._core.associated_fraction(law) == law.dilation_ratio


def test_bad_parameters_are_named_with_value_and_range():
    for name, value in [("intact_strength", 0.0), ("geological_strength_index", 3.0), ("geological_strength_index", 101.0),
                        ("intact_constant", 0.5), ("disturbance_factor", 1.2), ("dilation_ratio", 1.5), ("tension_cutoff", -1.0)]:  # fmt: skip
        with pytest.raises(mpm.InputError, match=f"^{name} = {value:g}, but it must be "):
            rock(**{name: value})
