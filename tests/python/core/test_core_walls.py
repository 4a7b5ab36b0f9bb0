"""Earth pressure: of soil at rest, and on a rigid wall that moves away from it or into it (Rankine's coefficients)."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

G = 9.81
WEIGHT, HEIGHT, LENGTH, COHESION = 1800.0 * G, 1.0, 1.5, 50.0


def retained(friction_angle):
    """Soil behind a smooth wall at x = 0.5, on a smooth base, so that Rankine's state is that of all of it."""
    cell, left = 0.1, 0.5
    mesh = box((20, 14), (2.0, 1.4), diagonals="alternating")
    soil = mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=COHESION, friction_angle=friction_angle, dilation_angle=0.0)
    model = mpm.Model(mesh, soil)
    d = cell / 4
    points = d * (np.indices((round(LENGTH / d), round(HEIGHT / d))).reshape(2, -1).T + 0.5) + (left, 0.0)
    model.seed_points(points, np.full(len(points), d * d), density=1800.0)
    model.roller(2, normal=(1, 0))
    model.roller(3, normal=(0, 1))
    model.set_gravity((0.0, -G), ramp=0.2)
    return model, mpm.Box((left - 0.3, -1.0), (left - 1e-9, 1.5))


def coefficient(wall, before, seconds):
    """2 F / (gamma H^2) with the mean force over a time."""
    return float(before - wall.impulse[0]) / seconds / (0.5 * WEIGHT * HEIGHT**2)


def run(model, until, damping):
    list(model.explicit(until, damping=damping, pic=0.01, energy_limit=np.inf))


@pytest.mark.parametrize("passive, friction_angle", [(p, phi) for p in (False, True) for phi in (25.0, 30.0, 35.0)])
def test_a_smooth_wall_feels_rankines_pressure(passive, friction_angle):
    # K = tan^2(45 -+ phi / 2), less or more 4 c sqrt(K) / (gamma H). Soil without dilation becomes as much higher as it becomes
    # shorter.
    model, surface = retained(friction_angle)
    speed = 0.02 if passive else -0.01
    wall = model.add_contact(surface, velocity=([0.6, 0.7], [(0.0, 0.0), (speed, 0.0)]))
    run(model, 0.6, 0.7)  # comes to rest
    first, last = (1.5, 1.9) if passive else (1.0, 1.8)
    run(model, first, 0.1)
    before, start = wall.impulse[0], wall.displacement[0]
    run(model, last, 0.1)
    sign = 1 if passive else -1
    root = np.tan(np.radians(45 + sign * friction_angle / 2))
    higher = 1 + 0.5 * (start + wall.displacement[0]) / LENGTH
    expected = root**2 * higher**2 + sign * 4 * COHESION * root * higher / (WEIGHT * HEIGHT)
    assert coefficient(wall, before, last - first) == pytest.approx(expected, rel=0.05)


def soil_at_rest(filling, dilation_angle, integration):
    """Soil between smooth walls under its weight, far from failure at K0, with averaged strains."""
    soil = mpm.MohrCoulomb(
        young=1e7, poisson=0.3, cohesion=COHESION, friction_angle=30.0, dilation_angle=dilation_angle
    )
    height = 1.0 if filling == "even" else 1.4
    model = mpm.Model(box((15, round(10 * height)), (LENGTH, height), diagonals="alternating"), soil)
    if filling == "even":
        model.seed(density=1800.0, per_cell=6)
    else:  # a grid has points on the diagonals: triangles hold 6 or 10 of them, 0.75 or 1.25 of their volume
        points = (np.indices((60, 40)).reshape(2, -1).T + 0.5) / 40
        model.seed_points(points, np.full(len(points), 1 / 1600), density=1800.0)
    for side in (1, 2):
        model.roller(side, normal=(1, 0))
    model.roller(3, normal=(0, 1))
    model.set_gravity((0.0, -G), ramp=0.2)
    list(model.explicit(0.4, damping=0.7, pic=0.01, nmd=True, integration=integration))
    return model


@pytest.mark.parametrize(
    "filling, dilation_angle, integration",
    [
        ("even", 0.0, mpm.Integration.PARTICLES),
        ("even", 30.0, mpm.Integration.PARTICLES),
        ("uneven", 0.0, mpm.Integration.PARTICLES),
        ("uneven", 0.0, mpm.Integration.MIXED),
        ("uneven", 30.0, mpm.Integration.MIXED),
    ],
)
def test_averaged_soil_at_rest_keeps_its_earth_pressure(filling, dilation_angle, integration):
    # K0 = nu / (1 - nu) as no cell yields. Sums over uneven numbers of particles give cells uneven deviators, which
    # averaged pressures do not follow: with ("uneven", 30, PARTICLES) a third of the soil yields, and K is 0.49.
    model = soil_at_rest(filling, dilation_angle, integration)
    horizontal, vertical = model.particles.volume @ model.particles.stress[:, :2]
    assert horizontal / vertical == pytest.approx(3 / 7, rel=0.01)
