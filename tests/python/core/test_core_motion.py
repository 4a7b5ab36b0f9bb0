"""Motion without deformation: falling and turning bodies."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, moduli, run

import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
DENSITY = 2000.0

SCHEMES = pytest.mark.parametrize(
    "scheme",
    [
        {},
        {"nmd": True},
        {"pic": 0.2},
        {"stress_update": mpm.StressUpdate.FIRST},
        {"integration": mpm.Integration.MIXED},
        {"integration": mpm.Integration.DUAL_DOMAIN},
        {"transfer": mpm.Transfer.AFFINE},
    ],
    ids=["MUSL", "NMD", "PIC fraction", "USF", "mixed integration", "dual domains", "affine"],
)


def falling_body(dim):
    body = ([0.3] * (dim - 1) + [0.6], [0.7] * (dim - 1) + [0.9])
    model = mpm.Model(box([6] * dim, shake=0.15, body=body), ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 6, 3: 4}[dim], cell_tag=1)
    return model


@pytest.mark.parametrize("dim", DIMS)
@SCHEMES
def test_free_fall_is_exact(dim, scheme):
    model = falling_body(dim)
    gravity = np.array([0.5, -3.0] if dim == 2 else [0.5, 0.2, -3.0])
    model.set_gravity(gravity)
    start = by_id(model, "position")
    steps, dt = 200, 0.4 / 200
    report = run(model, 0.4, dt=dt, **scheme)
    assert report.steps == steps
    assert np.allclose(model.particles.velocity, gravity * 0.4, rtol=0, atol=1e-12)
    # x_n = x_0 + dt sum_{k=1}^{n} (k dt g): velocities first, then positions with them
    fall = gravity * dt**2 * steps * (steps + 1) / 2
    assert np.allclose(by_id(model, "position"), start + fall, rtol=0, atol=1e-12)
    assert np.allclose(by_id(model, "displacement"), fall, rtol=0, atol=1e-12)
    assert np.abs(model.particles.stress).max() < 1e-9 * ELASTIC.young


@SCHEMES
def test_particles_exactly_on_sides_of_cells_are_not_strained(scheme):
    # On a regular mesh whole rows of particles come to lie on sides of cells, to the last bit: the nodes opposite to these have
    # next to no mass. Were they to stand still, the cells would be strained by dt v / h at once, and the block torn.
    model = mpm.Model(box((24, 12), (6.0, 3.0), diagonals="alternating", body=((0.0, 0.0), (1.0, 1.0))), ELASTIC)
    model.seed(density=DENSITY, per_cell=3, cell_tag=1)
    velocity = np.tile([1.0, 0.3], (len(model.particles), 1))
    model.particles.set("velocity", velocity)
    smallest = np.inf
    for _ in model.explicit(0.6, every_steps=1, dt=0.6 / 441, **scheme):
        mass = model.nodal("mass")
        smallest = min(smallest, np.min(mass[mass > 0], initial=np.inf) / model.particles.mass.max())
    assert smallest < 1e-12  # it has happened
    np.testing.assert_allclose(model.particles.velocity, velocity, rtol=0, atol=1e-10)


def fliers(cells, distance):
    """Single particles that fly along sides of cells, at a distance that round-off of positions (cells * 1e-16) hardly resolves or
    that resolves it well, and their velocities. The node opposite to the side has next to no mass."""
    model = mpm.Model(box((cells, 4), (float(cells), 4.0)), ELASTIC)
    places = np.arange(cells - 12, cells - 3, 3) + distance
    points = np.concatenate(
        [np.stack([places + 0.3, np.full(3, 1.3)], 1), np.stack([places - 0.5, np.full(3, 1.5)], 1)]
    )
    model.seed_points(points, np.full(6, 0.1), density=DENSITY)
    velocity = np.tile([1.0, 1.0], (6, 1))
    model.particles.set("velocity", velocity)
    return model, velocity


NEAR_SIDES = pytest.mark.parametrize("distance", [0.0, 1e-13, 1e-11, 1e-9, 1e-7, 1e-5])


@pytest.mark.parametrize("cells", [16, 512])
@NEAR_SIDES
@SCHEMES
def test_particles_near_sides_of_cells_are_not_strained(scheme, distance, cells):
    # When the velocity of the light node, which is made of round-off, strained a particle, its stress threw it out of the mesh.
    model, velocity = fliers(cells, distance)
    model.explicit(0.9, **scheme).last()
    np.testing.assert_allclose(model.particles.velocity, velocity, rtol=0, atol=1e-9)
    assert np.abs(model.particles.stress).max() < 1e-6 * ELASTIC.young


@NEAR_SIDES
@pytest.mark.parametrize("second_order", [False, True])
def test_implicit_steps_do_not_slow_particles_near_sides_of_cells(second_order, distance):
    # The acceleration of a light node counts from the velocities around it, not from rest.
    model, velocity = fliers(512, distance)
    model.implicit(0.9, dt=0.1, second_order=second_order).last()
    np.testing.assert_allclose(model.particles.velocity, velocity, rtol=0, atol=1e-9)
    assert np.abs(model.particles.stress).max() < 1e-9 * ELASTIC.young


def test_a_body_that_falls_apart_with_stresses_updated_last_is_told_why():
    # USL divides forces of round-off by masses of nearly nothing; by MUSL the same fall is exact, above
    model = falling_body(3)
    model.set_gravity((0.5, 0.2, -3.0))
    with pytest.raises(
        mpm.RunError, match="with stress_update LAST particles near nodes of little mass are thrown out"
    ):
        run(model, 0.4, courant=0.9, stress_update=mpm.StressUpdate.LAST, energy_limit=None)


@pytest.mark.parametrize("dim", DIMS)
def test_gravity_rises_linearly_over_its_ramp(dim):
    model = falling_body(dim)
    gravity = np.array([0.0] * (dim - 1) + [-3.0])
    model.set_gravity(gravity, ramp=0.2)
    ramp_steps, dt = 100, 0.002
    run(model, 0.2, dt=dt)
    # each step takes the gravity at its start: g dt sum_{k=0}^{n-1} k / n
    ramped = gravity * dt * (ramp_steps - 1) / 2
    assert np.allclose(model.particles.velocity, ramped, rtol=0, atol=1e-12)
    run(model, 0.3, dt=dt)
    assert np.allclose(model.particles.velocity, ramped + gravity * 0.1, rtol=0, atol=1e-12)


def spinning_block(dim, cells, omega):
    """A square block in the middle of its mesh, some ``cells`` from its axis to its corners, turning about z."""
    across = 4.0 / (4 * cells) * 6
    size = np.array([4.0, 4.0, across][:dim])
    half = np.array([0.75, 0.75, across / 6][:dim])
    body = (size / 2 - half, size / 2 + half)
    model = mpm.Model(box([4 * cells] * 2 + [6] * (dim - 2), size, body=body), ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 12, 3: 10}[dim], cell_tag=1)
    x = model.particles.position - size / 2
    velocity = np.zeros_like(x)
    velocity[:, 0], velocity[:, 1] = -omega * x[:, 1], omega * x[:, 0]
    model.particles.set("velocity", velocity)
    return model


def turned_and_stretched(before, after):
    """Angle about z [rad] and principal stretches of the affine map nearest to the motion."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    gradient = np.linalg.lstsq(a, b, rcond=None)[0].T
    left, stretches, right = np.linalg.svd(gradient)
    rotation = left @ right
    return np.arctan2(rotation[1, 0], rotation[0, 0]) % (2 * np.pi), stretches


@pytest.mark.parametrize(("dim", "cells", "turns", "lag"), [(2, 12, 0.98, 0.02), (3, 6, 0.25, 0.05)])
def test_spinning_block_keeps_its_shape_without_stress(dim, cells, turns, lag):
    # omega R / c = 0.05. The block is under the stress of its spin, of the order rho omega^2 R^2, and its strains are
    # of the order (omega R / c)^2 = 0.0025; those of a scheme that takes turning for strain would be of order 1.
    _, _, confined = moduli(ELASTIC.young, ELASTIC.poisson)
    omega = 0.05 * np.sqrt(confined / DENSITY)
    model = spinning_block(dim, cells, omega)
    start = by_id(model, "position")
    run(model, turns * 2 * np.pi / omega)
    angle, stretches = turned_and_stretched(start, by_id(model, "position"))
    assert angle == pytest.approx(turns * 2 * np.pi, rel=lag)  # the lumped mass of few cells costs spin
    assert stretches == pytest.approx(1, abs=0.01)
    assert np.abs(model.particles.stress).mean(axis=0).max() < DENSITY * omega**2


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("pic", [0.05, 1.0])
@pytest.mark.parametrize("courant", [0.1, 0.25, 0.5, 1.0])
def test_pic_takes_the_same_in_the_same_time_whatever_the_step(dim, pic, courant):
    # Two particles in one place with opposite velocities: the nodes see none, so that the particles lose theirs, a fraction
    # `pic` in each critical time step, and keep their place.
    model = mpm.Model(box([2] * dim), ELASTIC)
    place = np.full(dim, 0.4) + 0.05 * np.arange(dim)
    model.seed_points([place, place], [0.05, 0.05], density=DENSITY)
    velocity = np.outer([1.0, -1.0], np.arange(1, dim + 1))
    model.particles.set("velocity", velocity)
    run(model, 12 * model.critical_time_step(), courant=courant, pic=pic)
    assert np.allclose(by_id(model, "velocity"), velocity * (1 - pic) ** 12, rtol=1e-9, atol=1e-12)
    assert np.allclose(by_id(model, "position"), place, rtol=0, atol=1e-12)


@pytest.mark.parametrize("steps", [1, 3, 10])
def test_pic_of_implicit_steps_is_that_of_the_time_they_take(steps):
    model = mpm.Model(box([2, 2]), ELASTIC)
    model.seed_points([[0.4, 0.45], [0.4, 0.45]], [0.05, 0.05], density=DENSITY)
    velocity = np.outer([1.0, -1.0], [1.0, 2.0])
    model.particles.set("velocity", velocity)
    until = 30 * model.critical_time_step()
    list(model.implicit(until, dt=until / steps, pic=0.05))
    assert np.allclose(by_id(model, "velocity"), velocity * 0.95**30, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("dim", DIMS)
def test_a_cell_that_would_lose_its_volume_ends_the_run(dim):
    # The strain increment of a step of dt with v = -k x is -k dt in each direction; its trace is -1 at k = 1 / (dim dt).
    def closing(rate, dt=1e-3):
        model = mpm.Model(box([2] * dim), mpm.LinearElastic(young=1.0, poisson=0.0))
        model.seed(density=2000.0, per_cell=4 if dim == 2 else 10)
        model.particles.set("velocity", rate * (0.5 - model.particles.position))
        run(model, dt, dt=dt, transfer=mpm.Transfer.AFFINE, energy_limit=None)

    closing(0.9 / (dim * 1e-3))
    with pytest.raises(mpm.RunError, match="is in a cell that would lose its volume by the strain increment"):
        closing(1.1 / (dim * 1e-3))
