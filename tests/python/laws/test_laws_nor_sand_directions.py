"""NorSand in other directions than triaxial compression: critical state, dilatancy, tangent where the Lode angle turns."""

import numpy as np
import pytest
from law_cases import Batch, assert_tangent, principal, random_points
from nor_sand_cases import (
    CHI,
    DENSE,
    LOOSE,
    SAND,
    M,
    critical,
    direction_factor,
    drained,
    element,
    excess,
    p_and_q,
    residual_pressure,
    sand,
    states_of,
)

SINE = 3 * M / (6 + M)
"""Of the friction angle of triaxial compression"""
PLANE = ((1 + (1 + M / 3) ** 4) / 2) ** 0.25
"""g where the stress out of the plane is the mean of the others, theta = 30 degrees"""


def mobilised_sine(stress):
    """Sine of the mobilised friction angle, by the largest and the smallest principal stress."""
    major, _, minor = principal(np.atleast_2d(stress)).T
    return (major - minor) / -(major + minor)


def sheared(law, psi, strain, steps, pressure=100e3):
    test = element(law, pressure, psi)
    for _ in range(steps):
        test.step(np.array(strain) / steps)
    return test


def deviator(theta):
    """Diagonal of unit q, compression negative: theta = 0 in triaxial compression along x, 60 degrees in extension along z."""
    return -2 / 3 * np.cos(np.radians(theta) - np.radians([0, 120, 240]))


@pytest.mark.parametrize("psi", [LOOSE, -0.05])
def test_extension_ends_at_the_friction_angle_of_compression(psi):
    # q = 3 M / (3 + M) p, which is 6 sin / (3 + sin) of Mohr and Coulomb, at the pressure that belongs to the void ratio
    test = sheared(SAND, psi, [3.0, -1.5, -1.5, 0, 0, 0], 6000)
    (p,), (q,) = p_and_q(test.stress)
    assert p == pytest.approx(residual_pressure(psi), rel=0.01)
    assert 3 * M / (3 + M) == pytest.approx(6 * SINE / (3 + SINE))
    assert q / p == pytest.approx(3 * M / (3 + M), rel=1e-3)
    assert mobilised_sine(test.stress) == pytest.approx(SINE, rel=1e-3)


@pytest.mark.parametrize("strain", [[-3.0, 3.0, 0, 0, 0, 0], [0, 0, 0, 6.0, 0, 0]], ids=["biaxial", "simple shear"])
def test_critical_state_in_plane_strain(strain):
    # Without plastic strain along z, and flow along the deviator, s_zz = 0: q = M / g p with cos(3 theta) = 0, and q = sqrt(3) times
    # the largest shear stress; 35.0 degrees for 31.1 in compression. Matsuoka and Nakai: sin = 2 S / sqrt(3 + S^2).
    test = sheared(SAND, LOOSE, strain, 6000)
    (p,), sine = p_and_q(test.stress)[0], mobilised_sine(test.stress)
    assert p == pytest.approx(residual_pressure(LOOSE), rel=0.01)
    assert sine == pytest.approx(M / PLANE / np.sqrt(3), rel=1e-3)
    assert sine == pytest.approx(2 * SINE / np.sqrt(3 + SINE**2), rel=3e-3)
    assert test.stress[2] == pytest.approx(-p, rel=1e-3)
    if strain[3]:
        assert -test.stress[3] / test.stress[1] == pytest.approx(M / PLANE / np.sqrt(3), rel=2e-3)


@pytest.mark.parametrize("theta", [0, 10, 20, 30, 40, 50, 60])
def test_critical_state_between_compression_and_extension(theta):
    # A constant direction of strain without change of volume is that of the stress in the end. Matsuoka and Nakai, I1 I2 / I3 =
    # (9 - S^2) / (1 - S^2) = k: (k - 9) - (k - 3) / 3 (q/p)^2 + 2 k / 27 cos(3 theta) (q/p)^3 = 0, its smallest positive root
    test = sheared(SAND, LOOSE, [*3 * deviator(theta), 0, 0, 0], 4000)
    (p,), (q,) = p_and_q(test.stress)
    assert test.stress[:3] + p == pytest.approx(q * deviator(theta), abs=2e-3 * q)
    cosine, extension = np.cos(np.radians(3 * theta)), (1 + M / 3) ** 4
    assert q / p == pytest.approx(M / ((1 + extension) / 2 - (extension - 1) / 2 * cosine) ** 0.25, rel=2e-3)
    k = (9 - SINE**2) / (1 - SINE**2)
    roots = np.roots([2 * k / 27 * cosine, (3 - k) / 3, 0, k - 9])
    assert q / p == pytest.approx(roots[np.isreal(roots) & (roots.real > 0)].real.min(), rel=6e-3)


@pytest.mark.parametrize("psi", [-0.05, -0.1, -0.2])
def test_dense_sand_dilates_less_in_extension(psi):
    # As in compression, at the peak p_i = p_max: g q/p = M - chi psi_i and g D = chi psi_i
    law = sand(coupling=0.0)
    strain, p, q, e, image = drained(law, psi, 0.1, 1000)
    peak = (q / p).argmax()
    psi_image = e[peak] - critical(image[peak])
    assert 10 < peak < 990 and -0.25 < psi_image < -0.02
    assert q[peak] / p[peak] == pytest.approx((M - CHI * psi_image) / (1 + M / 3), rel=5e-4)
    change = strain[peak + 5] - strain[peak - 5]
    dilatancy = -change[:3].sum() / (2 / 3 * (change[0] - change[1]))
    assert dilatancy == pytest.approx(CHI * psi_image / (1 + M / 3), rel=0.02)


def test_isotropic_compression_does_not_depend_on_the_direction_of_a_small_deviator():
    # dm = de_v^p / M_i on the axis, and almost so next to it, whatever the Lode angle there
    increments = np.array([[*(-1e-3 + 1e-6 * deviator(theta)), 0, 0, 0] for theta in np.linspace(0, 60, 13)])
    stress = np.array([[-60e3] * 3 + [0.0] * 3]) + 1e5 * increments * [1, 1, 1, 0, 0, 0] + [100.0, 100, 100, 0, 0, 0]
    batch = Batch(SAND, stress, increments, states_of(SAND, stress, LOOSE))
    assert batch.report.plastic == 13
    assert np.ptp(batch.state[:, 1]) < 1e-3 * abs(batch.state[0, 1] - batch.start_state[0, 1])


def test_surface_is_convex_in_the_deviatoric_plane():
    # On the surface q = M / g p where p = p_i; between two stresses of it no increment yields, a little outside all do
    law = sand(critical_slope=1.8, coupling=0.0)
    stress, nothing = random_points(3, 4000, pressure=0.0, deviator=1.0, strain=0.0)
    stress[:, :3] -= stress[:, :3].mean(axis=1, keepdims=True)
    stress *= (1.8 * 100e3 / direction_factor(stress, 1.8) / p_and_q(stress)[1])[:, None]
    pressure = np.array([100e3] * 3 + [0.0] * 3)
    assert Batch(law, (1 + 1e-6) * stress - pressure, nothing).report.plastic == 4000
    for near in (1.0, 0.1, 0.01):  # the second of a pair, at a distance of this order
        other = stress + near * np.roll(stress, 1, axis=0)
        other *= (1.8 * 100e3 / direction_factor(other, 1.8) / p_and_q(other)[1])[:, None]
        between = (1 - 1e-9) * 0.5 * (stress + other)
        assert Batch(law, between - pressure, nothing).report.plastic == 0


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("axis", [[-2.0, 1, 1], [2.0, -1, -1]], ids=["compression", "extension"])
def test_tangent_is_continuous_where_the_lode_angle_is_at_its_limit(axis, dim):
    # cos(3 theta) is 1 or -1, and rounding beyond that must not matter
    width, turned = (4 if dim == 2 else 6), np.array([0, 1e-16, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4])
    turn = np.random.default_rng(5).normal(size=width)
    turn[:3] -= turn[:3].mean()
    deviators = np.array([*axis, *[0.0] * (width - 3)]) + np.outer(turned, turn)
    stress = 9e3 * deviators - 60e3 * np.array([1, 1, 1, *[0] * (width - 3)])
    batch = Batch(SAND, stress, 1e-4 * deviators, states_of(SAND, stress, LOOSE))
    assert batch.report.plastic == len(turned) and np.isfinite(batch.tangent).all()
    size = SAND.p_wave_modulus
    assert np.abs(batch.tangent - batch.differences(1e-8)).max() < 1e-6 * size
    change = np.abs(batch.tangent - batch.tangent[0]).max(axis=(1, 2))
    assert (change < (10 * turned + 1e-12) * size).all()


@pytest.mark.parametrize("theta", [0, 1, 15, 30, 45, 59, 60])
def test_tangent_along_the_whole_range_of_lode_angles(theta):
    # Stresses on the surface, sheared on in random directions
    rng = np.random.default_rng(6)
    stress = np.zeros((200, 6))
    stress[:, :3] = -60e3 + 30e3 * deviator(theta)
    for psi in (LOOSE, DENSE):
        increment = 5e-4 * deviator(theta) @ np.eye(3, 6) + rng.normal(0.0, 2e-4, stress.shape)
        batch = Batch(SAND, stress, increment, states_of(SAND, stress, psi))
        assert batch.report.plastic > 100 and batch.report.failed == 0
        assert excess(SAND, batch.stress, batch.state).max() < 1e-9
        assert_tangent(batch, 1e-8, tolerance=1e-5, share=0.9)
