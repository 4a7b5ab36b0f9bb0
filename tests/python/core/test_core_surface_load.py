"""Loads on surfaces that do not follow the mesh: the pressure times the area beside soil, wherever the particles are."""

import numpy as np
import pytest
from core_cases import box
from mpm_core.outlines import outline

import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)


def loaded(surface, dim=2, geometry=None, **load):
    model = mpm.Model(box([6] * dim, shake=0.2), ELASTIC, geometry=geometry)
    grid = (np.indices([10] * dim).reshape(dim, -1).T + 0.5) * 0.05 + 0.25
    model.seed_points(grid, 0.05**dim * (grid[:, 0] if geometry else np.ones(len(grid))), density=1.0)
    return model, model.load_surface(surface, **load)


def test_forces_on_a_surface_are_its_area_times_the_load():
    top = mpm.Polyline([(0.75, 0.75), (0.25, 0.75)])
    model, area = loaded(top, traction=(3.0, -2.0))
    assert area == pytest.approx(0.5 + 0.05, abs=0.03)  # and up to half a particle beyond each end
    assert model.particles.traction.sum(axis=0) == pytest.approx(area * np.array([3.0, -2.0]))
    lid = mpm.Triangles(*outline(mpm.Box((0.25, 0.25, 0.75), (0.75, 0.75, 0.9)), np.zeros(3), np.ones(3)))
    model, area = loaded(lid, dim=3, pressure=4.0)
    assert area == pytest.approx(0.25)
    assert model.particles.traction.sum(axis=0) == pytest.approx([0, 0, -1.0])
    model, area = loaded(mpm.Box((0.1, 0.75), (0.751, 0.9)), geometry=mpm.Geometry.AXISYMMETRIC, pressure=4.0)
    assert model.particles.traction.sum(axis=0) == pytest.approx([0, -4.0 * area])
    assert area == pytest.approx((0.75**2 - 0.25**2) / 2, rel=0.05)


def test_loads_need_soil_and_one_kind():
    with pytest.raises(mpm.InputError, match="pressure is 1.0 and traction"):
        loaded(mpm.Plane((0, 0.75), (0, -1)), pressure=1.0, traction=(0, 0))
    with pytest.raises(mpm.InputError, match="no soil beside it"):
        loaded(mpm.Plane((0, 0.95), (0, -1)), pressure=1.0)
    with pytest.raises(mpm.InputError, match="no soil beside it"):  # nor within the mesh
        loaded(mpm.Plane((0, 2.0), (0, -1)), pressure=1.0)


def resultant(model, at):
    """Force and moment about a point of all particles; in two dimensions the moment has one component."""
    forces, arms = model.particles.traction, model.particles.position - at
    return forces.sum(axis=0), np.atleast_1d(np.cross(arms, forces).sum(axis=0))


def mean_of_arms(model, area):
    """Three times the standard deviation of the mean of arms, of half a side each, of the particles that carry an area."""
    side = model.particles._sides().mean()
    return 1.5 * side / np.sqrt(area / side ** (model.mesh.dim - 1))


@pytest.mark.parametrize("per_cell", [1, 4, 8, 10])
@pytest.mark.parametrize("layers", [6, 12, 36])  # cells as high as wide, and flatter
@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.3, 0.2, 1.0), (1.0, 1.0, 1.2)])
def test_a_patch_on_tetrahedra_is_loaded_all_over(per_cell, layers, normal, recwarn):
    # Whether it lies on sides of cells or cuts them, the load is the pressure times its area, and acts at its centre.
    centre, half, pressure = np.full(3, 0.5), 0.25, 3.0
    n = np.array(normal) / np.linalg.norm(normal)
    u = np.cross(n, (1.0, 0.3, 0.1))
    u /= np.linalg.norm(u)
    v = np.cross(n, u)
    model = mpm.Model(box((6, 6, layers), shake=0.2 if n[2] < 1 else 0.0), ELASTIC)
    model.seed(density=1.0, per_cell=per_cell)
    model.remove((model.particles.position - centre) @ n > 0)
    corners = [centre + half * (i * u + j * v) for i, j in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
    area = model.load_surface(mpm.Triangles(corners, [(0, 1, 2), (0, 2, 3)]), pressure=pressure)
    assert area == pytest.approx(4 * half**2, rel=1e-12)
    force, moment = resultant(model, centre)
    assert force == pytest.approx(-pressure * area * n, abs=1e-12)
    assert np.abs(moment).max() < pressure * area * mean_of_arms(model, area)
    assert not [one for one in recwarn if "carries no load" in str(one.message)]


@pytest.mark.parametrize("per_cell", [1, 3, 6, 12])
@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8])
def test_a_slab_on_triangles_presses_with_its_whole_face(per_cell, angle, recwarn):
    n, u = np.array([np.sin(angle), np.cos(angle)]), np.array([np.cos(angle), -np.sin(angle)])
    model = mpm.Model(box((8, 16), shake=0.2), ELASTIC)
    model.seed(density=1.0, per_cell=per_cell)
    model.remove((model.particles.position - 0.5) @ n > 0)
    slab = [0.5 - 0.21 * u, 0.5 - 0.21 * u + 0.2 * n, 0.5 + 0.21 * u + 0.2 * n, 0.5 + 0.21 * u]
    area, side = model.load_surface(mpm.Polyline(slab, closed=True), pressure=2.0), model.particles._sides().max()
    force, _ = resultant(model, 0.5)
    assert force @ n == pytest.approx(-2.0 * 0.42, rel=1e-12)
    assert 0.42 * (1 - 1e-12) < area < 0.42 + 2 * side  # the faces that rise from the soil count until a side above it
    assert abs(force @ u) < 2.0 * side
    assert not [one for one in recwarn if "carries no load" in str(one.message)]


@pytest.mark.parametrize("sides, bridged", [(1, True), (2, True), (4, False), (8, False)])
def test_a_surface_over_a_trench_is_loaded_beside_it(sides, bridged):
    # A trench so many particles wide. One that particles hardly resolve counts as soil; over others it ends as at any soil's end.
    h = 0.025
    model = mpm.Model(box((12, 12)), ELASTIC)
    grid = (np.indices((40, 10)).reshape(2, -1).T + 0.5) * h
    in_trench = np.abs(grid[:, 0] - 0.5) < 0.5 * sides * h
    model.seed_points(grid[~in_trench], np.full((~in_trench).sum(), h**2), density=1.0)
    area = model.load_surface(mpm.Plane((0.0, 10 * h), (0.0, -1.0)), pressure=1.0)
    assert area == pytest.approx(1.0 if bridged else 1.0 - sides * h + 2 * 0.5 * h, abs=0.5 * h)


@pytest.mark.parametrize("away", [0.0, 0.025, 0.07])
def test_a_surface_that_particles_do_not_reach_everywhere_is_warned_of(away, recwarn):
    # A round cavity in particles on a square grid of 0.05 m, which are left out where their centres are less than `away` outside.
    model = mpm.Model(box((8, 8), (2.4, 2.4)), ELASTIC)
    side, radius = 0.05, 0.3
    grid = (np.indices((48, 48)).reshape(2, -1).T + 0.5) * side
    grid = grid[np.hypot(*(grid - 1.2).T) > radius + away]
    model.seed_points(grid, np.full(len(grid), side**2), density=1.0)
    area = model.load_surface(mpm.Disc((1.2, 1.2), radius), pressure=1.0)
    # Not loaded are points two sides from any particle, and gaps, one to two sides from any, that such a point is near.
    angle = 2 * np.pi * np.arange(1000) / 1000
    circle = 1.2 + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    nearest = np.linalg.norm(circle[:, None] - grid, axis=2).min(axis=1)
    bare = circle[nearest > 2 * side].reshape(-1, 1, 2)
    beside_bare = (np.linalg.norm(bare - circle, axis=2) < side).any(axis=0)
    is_missing = (nearest > side) & beside_bare
    missing, ends = np.mean(is_missing), np.sum(is_missing != np.roll(is_missing, 1))
    assert missing > 0.5 if away > 0.05 else missing == 0
    whole = 96 * 2 * radius * np.sin(np.pi / 96)  # of the polygon that stands for the circle
    assert area / whole == pytest.approx(
        1 - missing, abs=1e-12 + ends * 0.5 * (side / 4) / whole
    )  # of four points to a side
    said = [str(one.message) for one in recwarn if "carries no load" in str(one.message)]
    assert said == [] if missing == 0 else said[0].startswith(f"{1 - area / whole:.0%} of the area of surface Disc(")


def test_a_cavity_in_a_tied_ring_widens_as_lame_says():
    # An annulus from a to b on a mesh that knows nothing of it: p on the inside, which acts on the innermost particles, and a
    # rigid ring, which holds the outermost ones at b - h/2. u = A r + B / r, sigma_r = 2 (lambda + G) A - 2 G B / r^2.
    a, b, p, young, nu, rings, around = 0.5, 1.0, 1e3, 1e6, 0.3, 16, 144
    model = mpm.Model(box((31, 31), (2.4, 2.4), shake=0.1), mpm.LinearElastic(young=young, poisson=nu))
    h = (b - a) / rings
    r, angle = a + h * (np.arange(rings) + 0.5), 2 * np.pi * (np.arange(around) + 0.5) / around
    x = (r[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).reshape(-1, 2)
    model.seed_points(x + 1.2, np.repeat(r * h * 2 * np.pi / around, around), density=1.0)
    assert model.load_surface(mpm.Disc((1.2, 1.2), a), pressure=p) == pytest.approx(2 * np.pi * a, rel=1e-3)
    corners = 2 * np.pi * np.arange(around) / around
    circle = 1.2 + b * np.column_stack([np.cos(corners), np.sin(corners)])
    ring = model.add_contact(mpm.Polyline(circle, closed=True), bonded=True)
    list(model.implicit(1.0, dt=1.0, quasi_static=True))
    shear, lame = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
    first, last = a + h / 2, b - h / 2
    c = -p * a / first / (2 * (lame + shear) + 2 * shear * (last / first) ** 2)
    x = model.particles.position - model.particles.displacement - 1.2
    radius = np.linalg.norm(x, axis=1)
    u = np.einsum("ij,ij->i", model.particles.displacement, x) / radius
    for at in (3, 8, 13):  # rings
        here = np.isclose(radius, r[at])
        assert u[here].mean() == pytest.approx(c * (r[at] - last**2 / r[at]), abs=0.02 * u.max())
    force = -c * (2 * lame + 4 * shear) * 2 * np.pi * last
    assert ring.pressure * ring.area == pytest.approx(force, rel=0.03)
    assert np.abs(ring.force).max() < 1e-2 * p * a
