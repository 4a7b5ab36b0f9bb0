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


def matrices(size):
    """Stiffness over the modulus, lumped masses over the density, and averages by the mass matrix, of a chain of elements."""
    n = len(size) + 1
    stiffness, mass = np.zeros((n, n)), np.zeros((n, n))
    for e, h in enumerate(size):
        stiffness[e : e + 2, e : e + 2] += np.array([[1.0, -1.0], [-1.0, 1.0]]) / h
        mass[e : e + 2, e : e + 2] += h / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    lumped = mass.sum(axis=1)
    return stiffness, lumped, mass / lumped[:, None]


def exact_reflection(ratio, averaged, per_wave=PER_WAVE):
    """|R| of a wave of one frequency where an infinite chain of elements h becomes one of elements ratio h.

    The nodal values obey M_L U'' = -K A U, with the averages A = M_L^-1 M, or 1 of a lumped chain. On either side U is a sum of
    z^j over the nodes j with (4 / h^2) s (1 - 2 s / 3) = w^2, s = (2 - z - 1/z) / 4: a wave, and with averages a part that dies
    out within some cells. Equations of the nodes around the border give their amplitudes.
    """
    sizes, part, reach = (1.0, float(ratio)), 2 / 3 if averaged else 0.0, 4
    s = np.sin(np.pi / per_wave) ** 2
    squared = 4 * s * (1 - part * s)

    def modes(h):  # outgoing or dying out away from the border
        roots = np.roots([-part, 1.0, -squared * h * h / 4]) if averaged else np.array([squared * h * h / 4])
        z = np.exp(1j * np.arccos(1 - 2 * np.sort(roots) + 0j))
        return np.where(np.abs(z) > 1 + 1e-9, 1 / z, z)

    j = np.arange(-reach, reach + 1.0)
    fine, coarse = modes(sizes[0]), modes(sizes[1])
    stiffness, lumped, average = matrices(np.repeat(sizes, reach))
    operator = squared * np.eye(len(j)) - stiffness / lumped[:, None] @ (average if averaged else np.eye(len(j)))
    outgoing = np.array([*(np.where(j <= 0, z**-j, 0) for z in fine), *(np.where(j > 0, z**j, 0) for z in coarse)])
    rows = slice(reach - 1, reach + 3) if averaged else slice(reach, reach + 2)
    incoming = np.where(j <= 0, fine[0] ** j, 0)
    return abs(np.linalg.solve(operator[rows] @ outgoing.T, -operator[rows] @ incoming)[0])


def chain(ratio, averaged):
    """The same of a chain of linear elements in one dimension, lumped, or with velocities averaged by the mass matrix."""
    x = edges(ratio)
    size, n = np.diff(x), len(x)
    gradient = np.diff(np.eye(n), axis=0) / size[:, None]
    _, lumped, average = matrices(size)
    average = average if averaged else np.eye(n)
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


@pytest.mark.parametrize("averaged", [False, True])
def test_a_chain_reflects_as_the_exact_solution_says(averaged):
    """That of one wave length; a train of waves has others beside it."""
    expected = exact_reflection(2, averaged)
    assert amplitude(chain(2, averaged) - chain(1, averaged)) == pytest.approx(expected, rel=0.1)


def test_the_exact_reflection_of_a_lumped_chain_is_the_closed_form():
    """R = (cos(k h1 / 2) - cos(k h2 / 2)) / (their sum), with the wave number of each side for the same frequency."""
    assert exact_reflection(1, True) < 1e-12 and exact_reflection(1, False) < 1e-12
    for per_wave in (20, 40):
        fine = np.pi / per_wave
        coarse = np.arcsin(2 * np.sin(fine))  # sin(k h / 2) / h is the same on both sides
        expected = (np.cos(fine) - np.cos(coarse)) / (np.cos(fine) + np.cos(coarse))
        assert exact_reflection(2, False, per_wave) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    "rests", [None, lambda x: x[:, 0] > 1.0, lambda x: x[:, 0] < 1.0], ids=["none", "stiff", "soft"]
)
def test_a_pulse_that_meets_twice_the_impedance_comes_back_by_a_third(rests):
    """Velocity returns as (Z1 - Z2) / (Z1 + Z2) = -1/3 and stress as 1/3; 2/3 and 4/3 go on. Compared are integrals over the
    pulses, which dispersion leaves alone."""
    laws = [mpm.LinearElastic(young=factor * YOUNG, poisson=0.0) for factor in (1.0, 2.0)]
    mesh = box((160, 1), (2.0, 1 / 80), diagonals="alternating", body=((1.0, 0.0), (2.0, 1.0)))
    model = mpm.Model(mesh, laws)
    model.seed(density=DENSITY, per_cell=3, cell_tag=0)
    model.seed(density=2 * DENSITY, per_cell=3, cell_tag=1, material=1)  # as fast, so that Z is twice as large
    wave, small = np.sqrt(moduli(YOUNG, 0.0)[2] / DENSITY), 1e-6
    p = model.particles
    pulse = small * np.exp(-(((p.position[:, 0] - 0.5) / 0.1) ** 2))
    p.set("velocity", pulse[:, None] * [1.0, 0.0])
    p.set("stress", -DENSITY * wave * pulse[:, None] * [1.0, 0.0, 0.0, 0.0])
    rollers(model, axes=[1])
    if rests is not None:
        model.rest(where=rests)
    whole = small * 0.1 * np.sqrt(np.pi)
    run(model, 1.0 / wave, conversion=None, energy_limit=None)
    model.convert()
    p = model.particles
    width, back = p.volume * 80, p.position[:, 0] < 1.0
    for side, velocity, stress in ((back, -1 / 3, 1 / 3), (~back, 2 / 3, 4 / 3)):
        assert (width * p.velocity[:, 0])[side].sum() / whole == pytest.approx(velocity, abs=1e-3)
        assert -(width * p.stress[:, 0])[side].sum() / whole / (DENSITY * wave) == pytest.approx(stress, abs=1e-3)
