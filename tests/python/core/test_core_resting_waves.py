"""Waves over a border between particles and resting cells where the cells become twice as large."""

import numpy as np
import pytest
from core_cases import box, moduli, rollers, run

import mpm_core as mpm

YOUNG, DENSITY = 1e6, 1000.0
WAVES, PER_WAVE = 14, 20
"""Waves that fit into each half of the bar, and fine cells in a wave; the bar begins to be coarse at x = 0"""


def shape(x):
    """A train of waves of unit length in the middle of the fine half."""
    return np.exp(-(((x + WAVES / 2) * 8 / WAVES) ** 2)) * np.cos(2 * np.pi * (x + WAVES / 2))


def edges(ratio):
    h = 1.0 / PER_WAVE
    return np.concatenate(
        [-h * np.arange(WAVES * PER_WAVE, 0, -1), ratio * h * np.arange(WAVES * PER_WAVE // ratio + 1)]
    )


def bar(ratio, rest=None):
    """Velocities in the fine cells after the waves have reached the border and what comes back is where they began."""
    places = edges(ratio)
    count = len(places) - 1

    def place(points):
        return np.column_stack([np.interp(points[:, 0] * count, np.arange(count + 1), places), points[:, 1] / PER_WAVE])

    law = mpm.LinearElastic(young=YOUNG, poisson=0.0)
    model = mpm.Model(box((count, 1), (1.0, 1.0), diagonals="alternating", place=place), law)
    model.seed(density=DENSITY)
    wave, small = np.sqrt(moduli(YOUNG, 0.0)[2] / DENSITY), 1e-6
    particles = model.particles
    of_cell = np.bincount(particles.cell, shape(particles.position[:, 0])) / np.bincount(particles.cell)
    stress = -small * DENSITY * wave * of_cell[particles.cell]
    particles.set("velocity", small * shape(particles.position[:, :1]) * [1.0, 0.0])
    particles.set("stress", stress[:, None] * [1.0, 0.0, 0.0, 0.0])
    rollers(model, axes=[1])
    if rest is not None:
        model.rest(where=rest)
    run(model, WAVES / wave, conversion=None, energy_limit=None)
    model.convert()
    fine = model.particles.position[:, 0] < 0
    cells = np.floor(-model.particles.position[fine, 0] * PER_WAVE).astype(int)
    return np.bincount(cells, model.particles.velocity[fine, 0])[::-1] / np.bincount(cells)[::-1] / small


def chain(ratio, averaged):
    """The same of a chain of linear elements in one dimension, lumped, or with velocities averaged by the mass matrix."""
    x = edges(ratio)
    size, n = np.diff(x), len(x)
    gradient = np.zeros((n - 1, n))
    mass = np.zeros((n, n))
    for e, h in enumerate(size):
        gradient[e, e : e + 2] = np.array([-1.0, 1.0]) / h
        mass[e : e + 2, e : e + 2] += h / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    lumped = mass.sum(axis=1)
    average = mass / lumped[:, None] if averaged else np.eye(n)
    force, strain = -(gradient * size[:, None]).T / lumped[:, None], gradient @ average
    steps = int(WAVES * PER_WAVE / 0.3)
    velocity, stress, dt = shape(x), -shape(0.5 * (x[1:] + x[:-1])), WAVES / steps
    for _ in range(steps):
        velocity = velocity + dt * (force @ stress)
        stress = stress + dt * (strain @ velocity)
    return (average @ velocity)[: WAVES * PER_WAVE]


def amplitude(values):
    """Largest value of the envelope of a train of waves."""
    parts = np.fft.fft(values)
    parts[len(values) // 2 :] = 0
    return 2 * np.abs(np.fft.ifft(parts)).max()


def test_a_border_where_cells_grow_reflects_what_the_mesh_reflects_and_no_more():
    rests = {"particles": None, "coarse rests": lambda x: x[:, 0] > 0, "fine rests": lambda x: x[:, 0] < 0}
    reflected = {name: bar(2, where) - bar(1) for name, where in rests.items()}
    for name in ("coarse rests", "fine rests"):  # the border of both kinds adds nothing
        assert amplitude(reflected[name] - reflected["particles"]) < 1e-3
    of_chain = amplitude(chain(2, averaged=True) - chain(1, averaged=True))
    assert amplitude(reflected["coarse rests"]) < of_chain + 1e-3
    assert amplitude(reflected["coarse rests"]) == pytest.approx(of_chain, abs=1e-3)


def test_a_lumped_chain_reflects_as_the_closed_form_says():
    """R = (cos(k h1 / 2) - cos(k h2 / 2)) / (their sum) for one wave length; a train of waves has others beside it."""
    fine, coarse = np.cos(np.pi / PER_WAVE), np.cos(2 * np.pi / PER_WAVE)
    expected = (fine - coarse) / (fine + coarse)
    assert amplitude(chain(2, averaged=False) - chain(1, averaged=False)) == pytest.approx(expected, rel=0.1)
