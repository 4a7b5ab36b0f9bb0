"""Oscillations: one degree of freedom with local damping, and an elastic bar."""

import numpy as np
import pytest
from core_cases import DIMS, box, moduli, one_cell, rollers

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)


def oscillator(dim):
    """One cell, one particle; only the last vertex moves, only along the last axis. Returns it and its period.

    With N the vertex' shape function, its mass is m N and its force V M eps dN/dy; the particle's velocity, N a dt per
    step, is also that of the vertex, and the strain rate is v dN/dy with dN/dy = 1: omega^2 = V M / m = M / rho.
    """
    model = mpm.Model(one_cell(dim), ELASTIC)
    model.seed(density=DENSITY, per_cell=1)
    model.fix(dim + 1)
    for axis in range(dim - 1):
        model.roller(axis + 2, np.eye(dim)[axis])
    return model, 2 * np.pi * np.sqrt(DENSITY / moduli(YOUNG, POISSON)[2])


def turning_points(model, period, half_cycles, damping):
    """Sizes of the extreme stresses of an oscillation, and their times."""
    dt = period / 2000
    velocity = np.zeros((1, model.mesh.dim))
    velocity[0, -1] = 1e-3
    model.particles.set("velocity", velocity)
    sizes, times, before = [], [], velocity[0, -1]
    for report in model.explicit(half_cycles * period, dt=dt, every=dt, damping=damping):
        now = model.particles.velocity[0, -1]
        if now * before < 0:
            sizes.append(abs(model.particles.stress[0, model.mesh.dim - 1]))
            times.append(report.time - dt * now / (now - before))
        before = now
        if len(sizes) == half_cycles:
            break
    return np.array(sizes), np.array(times)


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("damping", [0.0, 0.3, 0.7, 0.75, 0.8])
def test_local_damping_reduces_each_half_cycle(dim, damping):
    # While the particle swings back the force on it is (1 - a) k u, afterwards (1 + a) k u: (1 - a) A^2 = (1 + a) B^2.
    model, period = oscillator(dim)
    sizes, times = turning_points(model, period, half_cycles=6, damping=damping)
    ratio = np.sqrt((1 - damping) / (1 + damping))
    assert len(sizes) == 6
    assert sizes[1:] / sizes[:-1] == pytest.approx(ratio, rel=0.01)
    # a quarter cycle at each of the two stiffnesses
    half = period / 4 * (1 / np.sqrt(1 - damping) + 1 / np.sqrt(1 + damping))
    assert np.diff(times) == pytest.approx(half, rel=0.01)


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("diagonals", ["one-way", "alternating"])
def test_period_of_a_bar_between_rollers(dim, nmd, diagonals):
    # Fixed at one end, free at the other, without lateral strain: T = 4 L / c with c = sqrt((K + 4G/3) / rho).
    length, squares = 4.0, 16
    mesh = box([squares] + [2] * (dim - 1), [length] + [length / squares * 2] * (dim - 1), diagonals=diagonals)
    model = mpm.Model(mesh, ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim])
    model.fix(1)
    rollers(model, axes=range(1, dim))
    velocity = np.zeros_like(model.particles.position)
    velocity[:, 0] = 1e-3 * np.sin(np.pi * model.particles.position[:, 0] / (2 * length))
    model.particles.set("velocity", velocity)
    period = 4 * length / np.sqrt(moduli(YOUNG, POISSON)[2] / DENSITY)
    times, momenta = [0.0], [model.report().momentum[0]]
    for report in model.explicit(2.1 * period, every=period / 200, nmd=nmd):
        times.append(report.time)
        momenta.append(report.momentum[0])
    times, momenta = np.array(times), np.array(momenta)
    change = np.flatnonzero(momenta[1:] * momenta[:-1] < 0)
    zeros = times[change] - momenta[change] * np.diff(times)[change] / np.diff(momenta)[change]
    assert len(zeros) == 4
    assert (zeros[-1] - zeros[0]) / 1.5 == pytest.approx(period, rel=0.01)
    assert zeros[0] == pytest.approx(period / 4 + report.dt / 2, rel=0.01)  # velocities are half a step behind
