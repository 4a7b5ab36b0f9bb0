"""Saturated soil that flows without draining keeps its strength, whatever its water and whichever way it is computed."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

BASE = 3
POROSITY, WATER, SATURATED, GRAVITY = 0.45, 1000.0, 1907.5, 9.81
HEIGHT, CREST, SLOPE = 3.0, 4.0, np.tan(np.radians(12.0))


def liquefied_slope(law, modulus, conductivity=None):
    """A slope on a fixed base, whose pore pressures have risen by 0.9 of its effective stresses; of pore water if it has a
    conductivity, of the law Undrained otherwise."""
    mesh = box((100, 9), (40.0, 3.6), diagonals="alternating")
    model = mpm.Model(mesh, law if conductivity else mpm.Undrained(law, water_modulus=modulus, porosity=POROSITY))
    x, y = (np.arange(300) + 0.5) * 0.4 / 3, (np.arange(27) + 0.5) * 0.4 / 3
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + [1e-3, 2e-3]
    depth = np.clip(HEIGHT - (points[:, 0] - CREST) * SLOPE, 0, HEIGHT) - points[:, 1]
    model.seed_points(points[depth > 0], np.full((depth > 0).sum(), (0.4 / 3) ** 2), density=SATURATED)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -GRAVITY))
    p = model.particles
    depth = np.clip(HEIGHT - (p.position[:, 0] - CREST) * SLOPE, 0, HEIGHT) - p.position[:, 1]
    vertical = (SATURATED - WATER) * GRAVITY * depth
    pressure = WATER * GRAVITY * depth + 0.9 * vertical
    effective = -vertical[:, None] * np.array([0.05, 0.1, 0.05, 0.0])
    if conductivity:
        model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
        p.set("pore_pressure", pressure)
        p.set("stress", effective)
    else:
        p.set("stress", effective - pressure[:, None] * np.array([1.0, 1.0, 1.0, 0.0]))
        model.set_state("excess_pore_pressure", pressure)
    return model


def run_out(model, until):
    """How far the particle beyond which a hundredth of the soil lies has moved [m]."""
    start = np.quantile(model.particles.position[:, 0], 0.99)
    model.explicit(until, nmd=True, integration=mpm.Integration.MIXED, pic=0.0005).last()
    return np.quantile(model.particles.position[:, 0], 0.99) - start


SAND = mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=100.0, friction_angle=33.0, dilation_angle=0.0)


def test_sand_that_flows_undrained_does_not_regain_strength():
    """Neither law nor water change the mean effective stress of sand that does not dilate. Pressures that nodes do not feel
    strain it in turns, and where it cannot carry tension, that would raise the mean: to more than three times the start.
    """
    model = liquefied_slope(SAND, 2e7)

    def mean_effective_stress():
        p = model.particles
        return p.volume @ (-p.stress[:, :3].mean(axis=1) - p.state[:, -1]) / p.volume.sum()

    start = mean_effective_stress()
    volume = model.particles.volume.sum()
    assert run_out(model, 3.0) > 3.5
    assert mean_effective_stress() < 1.2 * start
    assert model.particles.volume.sum() == pytest.approx(volume, rel=1e-3)


def test_water_that_hardly_flows_moves_with_its_soil():
    """As far as soil with the law Undrained; also along a fixed base, and where particles of other pressures come into a cell."""
    undrained = run_out(liquefied_slope(SAND, 2e7), 3.0)
    assert run_out(liquefied_slope(SAND, 2e7, conductivity=1e-8), 3.0) == pytest.approx(undrained, rel=0.05)


def test_sheared_soil_loses_pressures_that_nodes_do_not_feel(n=40):
    """Pressures that alternate between the two triangles of each square fade by 1 - exp(-c gamma) in the shear strain gamma of
    five steps, in the first of them; a linear part remains as it is."""
    c, skeleton = 100.0, mpm.LinearElastic(young=1.0, poisson=0.0)
    model = mpm.Model(box((n, n), (1.0, 1.0)), mpm.Undrained(skeleton, water_modulus=1e6, porosity=POROSITY))
    model.seed(density=2000.0, per_cell=1)
    p, rate = model.particles, 0.2
    p.set("velocity", np.stack([rate * p.position[:, 1], 0 * p.volume], axis=1))
    sign = np.where(p.position[:, 0] * n % 1 > p.position[:, 1] * n % 1, 1.0, -1.0)
    pressure = 50.0 * p.position[:, 0] + sign
    p.set("stress", -pressure[:, None] * np.array([1.0, 1.0, 1.0, 0.0]))
    model.set_state("excess_pore_pressure", pressure)
    model.set_gravity((50.0 / 2000.0, 0.0))  # which the linear part balances
    order, inside = p.id.copy(), np.abs(p.position - 0.5).max(axis=1) < 0.1
    dt = 0.5 * model.critical_time_step()
    for steps in (1, 5):  # cells give way in one of five steps
        model.explicit(steps * dt, dt=dt, nmd=True).last()
        after = model.particles.state[np.argsort(model.particles.id), -1][order]
        faded = 1 - np.exp(-c * 5 * dt * rate)
        np.testing.assert_allclose((after - pressure)[inside], -faded * sign[inside], rtol=1e-3)
    assert 0.01 < faded < 0.2
