"""Cylinders, cones and wedges: distances in closed form and outlines; loads on surfaces that do not follow the mesh."""

import numpy as np
import pytest
from core_cases import box
from mpm_core.outlines import outline

import mpm_core as mpm

BODIES = {
    "cylinder": (mpm.Cylinder((0.2, 0.1, 0.3), (0.9, 0.5, 1.1), 0.3), np.pi * 0.09 * 1.29**0.5, 1e-3),
    "cone": (mpm.Cone((0.2, 0.1, 0.3), (0.9, 0.5, 1.1), 0.3), np.pi / 3 * 0.09 * 1.29**0.5, 1e-3),
    "wedge": (mpm.Wedge((0.2, 0.1, 0.3), (0.2, 0.1, 1.1), 0.25, half_edge=(0.3, 0.4, 0.0)), 0.25 * 0.8 * 1.0, 1e-12),
}


@pytest.mark.parametrize("name", BODIES)
def test_outlines_bound_the_volume_and_lie_on_the_surface(name):
    surface, volume, tolerance = BODIES[name]
    points, cells = outline(surface, np.zeros(3), np.ones(3))
    a, b, c = (points[cells[:, k]] for k in range(3))
    assert np.sum(a * np.cross(b, c)) / 6 == pytest.approx(volume, rel=tolerance)
    assert mpm.distances(surface, points) == pytest.approx(np.zeros(len(points)), abs=1e-12)
    mpm.Triangles(points, cells)  # closed, and every triangle runs the same way


def test_distances_from_a_cylinder_are_those_of_its_parts():
    cylinder = mpm.Cylinder((1.0, 2.0, 0.5), (1.0, 2.0, 2.5), 0.4)
    points = np.random.default_rng(1).uniform((0, 1, -0.5), (2, 3, 3.5), (400, 3))
    beside = np.hypot(points[:, 0] - 1, points[:, 1] - 2) - 0.4
    beyond = np.abs(points[:, 2] - 1.5) - 1.0
    outside = np.hypot(np.maximum(beside, 0), np.maximum(beyond, 0))
    expected = np.where(np.maximum(beside, beyond) > 0, outside, np.maximum(beside, beyond))
    assert mpm.distances(cylinder, points) == pytest.approx(expected, abs=1e-12)


def test_distances_from_a_cone_are_those_of_a_triangle_in_its_section():
    cone, wedge = mpm.Cone((0, 0, 0), (0, 0, 2.0), 0.5), mpm.Wedge((0, 0), (0, 2.0), 0.5)
    points = np.random.default_rng(2).uniform(-1, 3, (400, 3))
    section = np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]])
    expected = mpm.distances(wedge, section)
    assert mpm.distances(cone, points) == pytest.approx(expected, abs=1e-12)
    assert mpm.distances(cone, [(0.0, 0.0, -0.7), (0.0, 0.0, 2.3)]) == pytest.approx([0.7, 0.3])
    half_edge = (0.0, 5.0, 0.0)
    prism = mpm.Wedge((0, 0, 0), (0, 0, 2.0), 0.5, half_edge=half_edge)
    assert mpm.distances(prism, np.column_stack([section[:, 0], 0 * section[:, 0], section[:, 1]])) == pytest.approx(
        expected
    )


@pytest.mark.parametrize(
    "surface, message",
    [
        (mpm.Cylinder((0, 0, 0), (0, 0, 0), 1.0), "end is .* expected another point than start"),
        (mpm.Cone((0, 0, 0), (0, 0, 1), -1.0), "radius"),
        (mpm.Wedge((0, 0, 0), (0, 0, 1), 0.5), "half_edge is None"),
        (mpm.Wedge((0, 0, 0), (0, 0, 1), 0.5, half_edge=(0, 1, 1)), "at right angles"),
    ],
)
def test_wrong_bodies_are_named(surface, message):
    with pytest.raises(mpm.InputError, match=message):
        mpm.distances(surface, np.zeros((1, 3)))


def test_a_pile_is_pushed_by_what_it_displaces():
    # A block falls on the tip of a cone, which stops it: the impulse is the momentum that it had.
    model = mpm.Model(box((5, 5, 5), shake=0.1), mpm.LinearElastic(young=1e5, poisson=0.2))
    grid = (np.indices((4, 4, 4)).reshape(3, -1).T + 0.5) * 0.1 + (0.3, 0.3, 0.5)
    model.seed_points(grid, np.full(len(grid), 1e-3), density=1000.0)
    model.particles.set("velocity", np.full((len(grid), 3), (0.0, 0.0, -1.0)))
    cone = model.add_contact(mpm.Cone((0.51, 0.49, 0.45), (0.51, 0.49, 0.1), 0.3), friction=0.3)
    *_, report = model.explicit(0.2)
    momentum = model.particles.mass @ model.particles.velocity
    assert -cone.impulse == pytest.approx(momentum + (0, 0, report.mass), abs=1e-10 * report.mass)
    assert cone.impulse[2] < -0.1 * report.mass


def loaded(surface, dim=2, geometry=None, **load):
    model = mpm.Model(box([6] * dim, shake=0.2), mpm.LinearElastic(young=1e6, poisson=0.3), geometry=geometry)
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


@pytest.mark.parametrize("away, missing", [(0.0, 0.0), (0.025, 0.17)])
def test_a_surface_that_particles_do_not_reach_everywhere_is_warned_of(away, missing, recwarn):
    # A round cavity in particles on a square grid of 0.05 m, which are left out where their centres are less than `away` outside.
    model = mpm.Model(box((8, 8), (2.4, 2.4)), mpm.LinearElastic(young=1e6, poisson=0.3))
    grid = (np.indices((48, 48)).reshape(2, -1).T + 0.5) * 0.05
    grid = grid[np.hypot(*(grid - 1.2).T) > 0.3 + away]
    model.seed_points(grid, np.full(len(grid), 0.05**2), density=1.0)
    area = model.load_surface(mpm.Disc((1.2, 1.2), 0.3), pressure=1.0)
    assert area == pytest.approx((1 - missing) * 2 * np.pi * 0.3, rel=0.02)
    said = [str(one.message) for one in recwarn if "carries no load" in str(one.message)]
    assert said == [] if missing == 0 else said[0].startswith("17% of the area of surface Disc(")


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
