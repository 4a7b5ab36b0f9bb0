"""Softening Mohr-Coulomb: strength by plastic strain, energy by cell size, tangent, admissibility, input."""

import numpy as np
import pytest
from law_cases import Batch, assert_tangent, principal, random_points, triaxial, walk

import mpm_core as mpm

PEAK = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=20e3, friction_angle=30.0, dilation_angle=10.0)
RESIDUAL = {"residual_cohesion": 4e3, "residual_friction_angle": 20.0}
LAWS = {
    "exponential": mpm.SofteningMohrCoulomb(PEAK, **RESIDUAL, softening_strain=0.02, reference_length=0.1),
    "linear": mpm.SofteningMohrCoulomb(
        PEAK, **RESIDUAL, softening_strain=0.05, reference_length=0.1, shape=mpm.Softening.LINEAR
    ),
}
CLAY = mpm.SofteningMohrCoulomb(
    mpm.tresca(young=10e6, poisson=0.49, shear_strength=20e3),
    residual_cohesion=4e3, residual_friction_angle=0.0, softening_strain=0.1, reference_length=0.1,
)  # fmt: skip


@pytest.fixture(params=LAWS.values(), ids=LAWS.keys())
def law(request):
    return request.param


def strength_excess(law, stress, state):
    """Value of the yield function that holds at the points' plastic strain, by the scale of the stress."""
    s = principal(stress)
    excess = []
    for (s1, _, s3), (_, band_strain, deviation, _) in zip(s, state, strict=True):
        now = law.softened(band_strain, deviation)
        phi = np.radians(now.friction_angle)
        f = (s1 - s3) / 2 + (s1 + s3) / 2 * np.sin(phi) - now.cohesion * np.cos(phi)
        excess.append(f / (abs(s1) + abs(s3) + now.cohesion))
    return np.array(excess)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("strain", [1e-3, 5e-3])
def test_tangent_is_the_derivative_of_the_stress(law, dim, strain):
    stress, increment = random_points(dim, 300, pressure=50e3, deviator=20e3, strain=strain)
    state = np.random.default_rng(5).uniform(0, [0.02, 0.2, 0.3, 1e-4], (300, 4))
    batch = Batch(law, stress, increment, state)
    assert batch.report.plastic > 40
    assert_tangent(batch, 1e-8, tolerance=1e-4)


@pytest.mark.parametrize("dim", [2, 3])
def test_stress_stays_admissible_at_the_strength_that_is_left(law, dim):
    stress, _ = random_points(dim, 1000, pressure=50e3, deviator=20e3, strain=0.0)
    stress, state = walk(law, stress, 1e-3, 100)
    assert strength_excess(law, stress, state).max() < 1e-9
    assert state[:, 0].max() > 0.02


@pytest.mark.parametrize("dim", [2, 3])
def test_tension_cutoff_holds_while_strength_falls(dim):
    peak = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=20e3, friction_angle=30.0, tension_cutoff=2e3)
    law = mpm.SofteningMohrCoulomb(peak, **RESIDUAL, softening_strain=0.02, reference_length=0.1)
    stress, _ = random_points(dim, 1000, pressure=20e3, deviator=10e3, strain=0.0)
    stress, state = walk(law, stress, 1e-3, 100)
    assert strength_excess(law, stress, state).max() < 1e-9
    largest = principal(stress)[:, 0]
    assert largest.max() < 2e3 * (1 + 1e-9)
    assert np.isclose(largest, 2e3, rtol=1e-9).mean() > 0.05 and state[:, 1].max() > 0.02


def test_a_point_does_not_depend_on_those_beside_it(law):
    stress, increment = random_points(2, 300, pressure=50e3, deviator=20e3, strain=2e-3)
    state = np.random.default_rng(5).uniform(0, [0.02, 0.2, 0.3, 1e-4], (300, 4))
    together = Batch(law, stress, increment, state)
    for first in (0, 7, 131):
        alone = Batch(law, stress[first:][:5], increment[first:][:5], state[first:][:5])
        assert np.abs(alone.stress - together.stress[first:][:5]).max() < 1e-9 * 50e3
        assert np.abs(alone.state - together.state[first:][:5]).max() < 1e-12


def test_triaxial_strength_falls_as_prescribed(law):
    test = mpm.ElementTest(law, [-50e3] * 3 + [0.0] * 3)
    for _ in range(200):
        test.step([-1e-3, None, None, 0.0, 0.0, 0.0])
        if test.state[0] > 0:
            now = law.softened(test.state[0])
            n = (1 + np.sin(np.radians(now.friction_angle))) / (1 - np.sin(np.radians(now.friction_angle)))
            assert -test.stress[0] == pytest.approx(50e3 * n + 2 * now.cohesion * np.sqrt(n), rel=1e-7)
    n = (1 + np.sin(np.radians(20))) / (1 - np.sin(np.radians(20)))
    assert -test.stress[0] == pytest.approx(50e3 * n + 2 * 4e3 * np.sqrt(n), rel=1e-2)


def test_without_a_fall_it_is_mohr_coulomb():
    same = mpm.SofteningMohrCoulomb(
        PEAK, residual_cohesion=20e3, residual_friction_angle=30.0, residual_dilation_angle=10.0, softening_strain=0.1,
        reference_length=1.0,
    )  # fmt: skip
    stress, increment = random_points(3, 500, pressure=50e3, deviator=30e3, strain=1e-3)
    a, b = Batch(same, stress, increment), Batch(PEAK, stress, increment)
    assert np.abs(a.stress - b.stress).max() < 1e-6
    assert np.abs(a.tangent - b.tangent).max() < 1e-6 * 10e6
    assert np.abs(a.state[:, 0] - b.state[:, 0]).max() < 1e-12


def test_simple_shear_of_a_clay_softens_by_closed_form():
    # tau = c(k) with k = gamma_p / sqrt(3) and gamma = gamma_p + tau / G; constant volume
    test = mpm.ElementTest(CLAY, [-50e3, -50e3, -50e3, 0.0])
    shear = 10e6 / (2 * 1.49)
    for _ in range(100):
        test.step([0, 0, 0, 5e-3])
    plastic = (0.5 - test.stress[3] / shear) / np.sqrt(3)
    assert test.state[0] == pytest.approx(plastic, rel=1e-9)
    assert test.stress[3] == pytest.approx(4e3 + 16e3 * np.exp(-plastic / 0.1), rel=1e-9)


def shear_band_energy(cells):
    """Energy [J/m2] that a column 1 m high dissipates in shear when its softest cell takes all the softening."""
    size = 1.0 / cells
    tests = [mpm.ElementTest(CLAY, [0.0] * 4, [0.0, 0.0, 0.0 if k else -0.01, 0.0], cell_size=size) for k in range(2)]
    band, rest = tests
    work = 0.0
    displacement = 0.0
    for _ in range(3000):
        before = band.stress[3], displacement
        band.step([0, 0, 0, 2e-4 / size])  # the rest follows the shear stress of the band, elastic
        rest.step([0, 0, 0, None], [*rest.stress[:3], band.stress[3]])
        displacement = size * band.strain[3] + (1 - size) * rest.strain[3]
        work += (band.stress[3] + before[0]) / 2 * (displacement - before[1])
    assert rest.state[0] == 0
    stored = band.stress[3] ** 2 / (2 * 10e6 / (2 * 1.49))
    plastic = (band.strain[3] * size) - size * band.stress[3] / (10e6 / (2 * 1.49))
    return work - stored, plastic


def test_dissipated_energy_does_not_depend_on_the_cell_size():
    # By hand: the band's plastic slip s = sqrt(3) h k, so tau = r + (c - r) exp(-s / (sqrt(3) 0.1 * 0.1)) in any cell
    slip_scale = np.sqrt(3) * 0.1 * 0.1
    for cells in (5, 10, 20, 40):
        energy, slip = shear_band_energy(cells)
        by_hand = 0.99 * (4e3 * slip + 16e3 * slip_scale * (1 - np.exp(-slip / slip_scale)))
        assert energy == pytest.approx(by_hand, rel=5e-3)


def test_cohesion_may_deviate_from_point_to_point():
    for deviation in (-0.5, 0.0, 0.5):
        test = mpm.ElementTest(CLAY, [0.0] * 4, [0.0, 0.0, deviation, 0.0])
        test.step([0, 0, 0, 1.0])
        plastic = test.state[0]
        assert test.stress[3] == pytest.approx((1 + deviation) * (4e3 + 16e3 * np.exp(-plastic / 0.1)), rel=1e-9)


def test_undrained_triaxial_falls_to_the_residual_strength():
    test = mpm.ElementTest(CLAY, [-50e3] * 3 + [0.0] * 3)
    _, stress = triaxial(test, -1.5, 600, drained=False)
    s = principal(stress)
    assert (s[:, 0] - s[:, 2]).max() / 2 == pytest.approx(20e3, rel=2e-2)
    assert (s[-1, 0] - s[-1, 2]) / 2 == pytest.approx(4e3, rel=1e-3)


def test_bad_parameters_are_named_with_value_and_range():
    good = {**RESIDUAL, "softening_strain": 0.1, "reference_length": 1.0}
    for name, value in [("residual_cohesion", 30e3), ("residual_friction_angle", 31.0), ("softening_strain", 0.0),
                        ("residual_dilation_angle", 21.0), ("reference_length", -1.0)]:  # fmt: skip
        with pytest.raises(mpm.InputError, match=f"^{name} = {value:.0f}, but it must be "):
            mpm.SofteningMohrCoulomb(PEAK, **{**good, name: value})
