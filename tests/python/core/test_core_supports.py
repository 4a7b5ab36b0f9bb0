"""Supports: rollers along any direction, prescribed velocities, corners, contradictions."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY, GRAVITY = 1e6, 0.3, 2000.0, 9.81
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)


def block_on_a_plane(dim, degrees=0.0):
    """A block that lies at the left end of a long mesh, with the base of it and the mesh inclined to fall along +x."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rotation = np.eye(dim)
    rotation[[0, 0, -1, -1], [0, -1, 0, -1]] = c, s, -s, c
    across = [0.5] * (dim - 2)
    body = ([0.25] + [0.0] * (dim - 1), [0.75] + across + [0.25])
    mesh = box([12] + [2] * (dim - 1), [3.0, *across, 0.5], body=body, place=lambda x: x @ rotation.T)
    model = mpm.Model(mesh, ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim], cell_tag=1)
    return model, rotation


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("nmd", [False, True])
def test_block_slides_on_an_inclined_roller_with_g_sin_a(dim, nmd):
    model, rotation = block_on_a_plane(dim, degrees=30)
    along, normal = rotation[:, 0], rotation[:, -1]
    model.roller(2 * dim - 1, 3.0 * normal)
    model.set_gravity([0.0] * (dim - 1) + [-GRAVITY])
    start = model.particles.mass @ model.particles.position @ along
    report = run(model, 0.5, nmd=nmd)
    # The roller gives no force along the plane, whatever the block does on it: M g sin(a) t
    assert report.momentum @ along == pytest.approx(report.mass * GRAVITY * 0.5 * 0.5, rel=1e-12)
    slid = (model.particles.mass @ model.particles.position @ along - start) / report.mass
    # velocities first: dt^2 n (n + 1) / 2
    assert slid == pytest.approx(GRAVITY * 0.5 * 0.5 * (0.5 + report.dt) / 2, rel=1e-3)
    height = model.particles.position @ normal
    assert height.min() > 0 and height.max() < 0.26


@pytest.mark.parametrize("dim", DIMS)
def test_nodes_on_a_roller_keep_to_its_plane(dim):
    model, rotation = block_on_a_plane(dim, degrees=20)
    normal = rotation[:, -1]
    model.roller(2 * dim - 1, normal)
    model.set_gravity([0.0] * (dim - 1) + [-GRAVITY])
    run(model, 0.1)
    velocity, on_plane = model.nodal("velocity"), np.abs(model.mesh.points @ normal) < 1e-12
    size = np.abs(velocity).max()
    assert size > 0.1 and np.abs(velocity[on_plane] @ normal).max() < 1e-14 * size
    assert np.abs(velocity[~on_plane] @ normal).max() > 1e-6 * size


@pytest.mark.parametrize("dim", DIMS)
def test_prescribed_velocity_carries_a_rigid_block(dim):
    model, _ = block_on_a_plane(dim)
    velocity = np.array([1.5] + [0.0] * (dim - 1))
    model.prescribe(2 * dim - 1, velocity)
    model.particles.set("velocity", np.broadcast_to(velocity, model.particles.position.shape))
    start = by_id(model, "position")
    report = run(model, 1.0)
    assert np.allclose(by_id(model, "position"), start + velocity, rtol=0, atol=1e-11)
    assert np.abs(model.particles.stress).max() < 1e-9 * YOUNG
    assert abs(report.support_work) < 1e-9 * report.kinetic_energy


@pytest.mark.parametrize("dim", DIMS)
def test_a_smooth_plate_compresses_a_block_uniaxially(dim, tmp_path):
    """One component is prescribed and the others are free: sigma = E u / h, and the block bulges by nu times that."""
    model = mpm.Model(box([2] * dim), mpm.LinearElastic(young=YOUNG, poisson=0.25))
    model.seed(density=DENSITY, per_cell=3 if dim == 2 else 4)
    for axis in range(dim):
        model.roller(2 * axis + 1, np.eye(dim)[axis])
    model.prescribe(2 * dim, [None] * (dim - 1) + [-1e-3])
    path = tmp_path / "plate.h5"
    for _ in model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True):
        model.save(path)
    lateral = 0.25 / 0.75 if dim == 2 else 0.25  # plane strain
    expected = 1e-3 * np.append(np.full(dim - 1, lateral), -1.0) * model.mesh.points
    np.testing.assert_allclose(model.nodal("velocity"), expected, rtol=0, atol=1e-12)
    again = mpm.Model(model.mesh, model.laws)
    again.restore(path)
    assert again._conditions == model._conditions
    again.prescribe(2 * dim, [None] * (dim - 1) + [-2e-3])
    assert len(again._conditions) == len(model._conditions)
    with pytest.raises(mpm.InputError, match="velocity is nan"):
        model.prescribe(2 * dim, [None] * (dim - 1) + [np.nan])
    with pytest.raises(mpm.InputError, match="velocity has shape"):
        model.prescribe(2 * dim, 1.0)


@pytest.mark.parametrize("dim", DIMS)
def test_prescribed_velocity_takes_a_block_along_from_rest(dim):
    model, _ = block_on_a_plane(dim)
    model.prescribe(2 * dim - 1, [1.0] + [0.0] * (dim - 1))
    report = run(model, 1.5, damping=0.5, pic=0.05)
    assert report.momentum[0] / report.mass == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("dim", DIMS)
def test_rollers_that_meet_hold_the_corner(dim):
    # Every side is a roller: it keeps to its plane, edges where two meet keep to both, corners are fixed.
    model = mpm.Model(box([3] * dim), ELASTIC)
    model.seed(density=DENSITY, per_cell=4)
    for axis in range(dim):
        for tag in (2 * axis + 1, 2 * axis + 2):
            model.roller(tag, np.eye(dim)[axis])
    model.set_gravity(np.full(dim, -GRAVITY))
    run(model, 0.01)
    velocity = model.nodal("velocity")
    on_side = (model.mesh.points < 1e-12) | (model.mesh.points > 1 - 1e-12)
    assert np.all(velocity[on_side] == 0)
    assert np.all(velocity[~on_side] != 0)


def test_oblique_rollers_that_meet_fix_the_node():
    model = mpm.Model(box([2, 2]), ELASTIC)
    model.seed(density=DENSITY, per_cell=3)
    model.roller(1, (1, 0.5))
    model.roller(3, (-0.2, 1))
    model.set_gravity((1.0, -GRAVITY))
    run(model, 0.02)
    points, velocity = model.mesh.points, model.nodal("velocity")
    left, base = points[:, 0] < 1e-12, points[:, 1] < 1e-12
    assert np.abs(velocity[left] @ (1, 0.5)).max() < 1e-15
    assert np.abs(velocity[base] @ (-0.2, 1)).max() < 1e-15
    assert np.abs(velocity[left & base]).max() < 1e-15


@pytest.mark.parametrize("dim", DIMS)
def test_supports_that_follow_from_others_are_taken_and_contradictions_refused(dim):
    model = mpm.Model(box([2] * dim), ELASTIC)
    model.seed(density=DENSITY, per_cell=1)
    model.fix(1)
    model.fix(1)
    model.roller(1, np.eye(dim)[0])
    model.roller(3, np.eye(dim)[1])  # shares nodes with the fixed side
    with pytest.raises(mpm.InputError, match="facet tag 1 .*contradicts"):
        model.prescribe(1, [0.1] + [0.0] * (dim - 1))
    with pytest.raises(mpm.InputError, match="facet tag 3 .*contradicts"):
        model.prescribe(3, [0.1] * dim)
    model.prescribe(2, [0.1] + [0.0] * (dim - 1))  # along the roller with which it shares nodes
    run(model, 1e-3)
    velocity, x = model.nodal("velocity"), model.mesh.points
    assert np.all(velocity[x[:, 0] < 1e-12] == 0)
    assert np.allclose(velocity[x[:, 0] > 1 - 1e-12], [0.1] + [0.0] * (dim - 1), rtol=0, atol=1e-16)
