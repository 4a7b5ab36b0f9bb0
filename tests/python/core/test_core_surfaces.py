"""Cylinders, cones and wedges: distances in closed form, and outlines."""

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
