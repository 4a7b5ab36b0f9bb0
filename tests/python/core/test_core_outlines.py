"""Outlines of rigid surfaces: lengths, areas and volumes in closed form, where they are cut, and how they move with the body."""

import h5py
import meshio
import numpy as np
import pytest
from core_cases import box
from mpm_core.body_output import BodyOutput
from mpm_core.outlines import outline
from mpm_core.output import ModelOutput

import mpm_core as mpm

ALL = mpm.Box((0.2, 0.1), (0.5, 0.8)), mpm.Disc((1.0, 2.0), 0.5), mpm.Polyline([(0, 0), (1, 0), (0, 1)], closed=True)
ALL_3D = mpm.Box((0.2, 0.1, 0.3), (0.5, 0.8, 0.4)), mpm.Sphere((1.0, 2.0, 3.0), 0.5)


def enclosed(points, cells):
    """The volume, or area, that a closed outline bounds, and its length or area; by the divergence theorem."""
    corners = points[cells]
    if points.shape[1] == 2:
        a, b = corners[:, 0], corners[:, 1]
        return 0.5 * np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.linalg.norm(b - a, axis=1).sum()
    a, b, c = (corners[:, k] for k in range(3))
    return np.sum(a * np.cross(b, c)) / 6, np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize(
    ("surface", "volume", "area", "tolerance"),
    [
        (ALL[0], 0.21, 2.0, 1e-12),
        (ALL[1], np.pi / 4, np.pi, 1e-3),  # 1 - (2 pi / 96)^2 / 6
        (ALL[2], 0.5, 2 + 2**0.5, 1e-12),
        (ALL_3D[0], 0.021, 2 * (0.21 + 0.03 + 0.07), 1e-12),
        (ALL_3D[1], np.pi / 6, np.pi, 1.25e-2),  # 1 - (pi / 20)^2 / 2, ten squares along a quarter of a circle
    ],
)
def test_closed_outlines_bound_what_the_surface_does(surface, volume, area, tolerance):
    dim = 2 if np.size(getattr(surface, "centre", getattr(surface, "lower", (0, 0)))) == 2 else 3
    points, cells = outline(surface, np.zeros(dim), np.ones(dim))
    assert enclosed(points, cells) == pytest.approx((volume, area), rel=tolerance)
    assert mpm.distances(surface, points) == pytest.approx(np.zeros(len(points)), abs=1e-12)


@pytest.mark.parametrize("normal", [(0, 0, 1), (1, 0, 0), (1, 1, 0), (1, 1, 1), (-1, -2, -4)])
def test_a_plane_is_shown_where_it_cuts_the_box(normal):
    # A plane with the unit normal n through the middle of the unit cube: its area is the derivative of the volume below it.
    plane, unit = mpm.Plane((0.5, 0.5, 0.5), normal), np.array(normal) / np.linalg.norm(normal)
    points, cells = outline(plane, np.zeros(3), np.ones(3))
    assert mpm.distances(plane, points) == pytest.approx(np.zeros(len(points)), abs=1e-12)
    areas = {(0, 0, 1): 1, (1, 0, 0): 1, (1, 1, 0): 2**0.5, (1, 1, 1): 0.75 * 3**0.5, (-1, -2, -4): 21**0.5 / 4}
    assert enclosed(points, cells)[1] == pytest.approx(areas[normal], rel=1e-12)
    a, b, c = points[cells[0]]
    assert np.cross(b - a, c - a) @ unit > 0  # the soil is on the normal's side
    assert len(outline(mpm.Plane((0, 0, 5), (0, 0, 1)), np.zeros(3), np.ones(3))[1]) == 0


def test_open_lines_reach_the_sides_of_the_box():
    line = mpm.Polyline([(1.0, 1.0), (2.0, 2.0), (3.0, 2.0)])
    points, cells = outline(line, (0.0, 0.0), (10.0, 4.0))
    assert points.tolist() == [[0, 0], [1, 1], [2, 2], [3, 2], [10, 2]] and cells.tolist() == [
        [0, 1],
        [1, 2],
        [2, 3],
        [3, 4],
    ]
    points, _ = outline(line, (1.5, 1.5), (2.5, 2.5))  # a line that is longer than the box stays as it is
    assert points.tolist() == [[1, 1], [2, 2], [3, 2]]
    points, _ = outline(mpm.Plane((0.0, 1.0), (1.0, 1.0)), (0.0, 0.0), (10.0, 4.0))
    assert sorted(points.tolist()) == [[0, 1], [1, 0]]


@pytest.fixture
def two_bodies():
    """A disc that flies and spins, and a plane at rest, far from some soil."""
    model = mpm.Model(box((4, 4), (8.0, 40.0)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([[7.0, 39.0]], [1e-3], density=1000.0)
    model.set_gravity((0.0, -9.81))
    model.add_contact(mpm.Disc((2.0, 3.0), 0.5), velocity=(1.0, 0.5), spin=np.pi)
    model.add_contact(mpm.Plane((0.0, 0.5), (0.0, 1.0)))
    return model


def test_outlines_and_velocities_are_those_of_a_rigid_body(two_bodies):
    model, disc = two_bodies, two_bodies.contacts[0]
    before = disc.outline()[0]
    list(model.explicit(0.5, dt=0.005))
    after = disc.outline()[0]  # turned by a right angle
    arm = before - (2.0, 3.0)
    assert after == pytest.approx(np.column_stack([-arm[:, 1], arm[:, 0]]) + (2.5, 3.25), abs=1e-12)
    turned = after - (2.5, 3.25)
    expected = np.array([1.0, 0.5]) + np.pi * np.column_stack([-turned[:, 1], turned[:, 0]])
    assert disc.velocity_at(after) == pytest.approx(expected, rel=1e-12)


def test_meshio_reads_the_bodies_over_time(two_bodies, tmp_path):
    model = two_bodies
    with ModelOutput(model, tmp_path / "particles", bodies=tmp_path / "bodies", float32=False) as output:
        output.write()
        frames = [np.concatenate([contact.outline()[0] for contact in model.contacts])]
        for _ in model.explicit(0.2, every=0.1, dt=0.005):
            output.write()
            frames.append(np.concatenate([contact.outline()[0] for contact in model.contacts]))
    for number, points in enumerate(frames):
        with h5py.File(tmp_path / "bodies" / f"{number:06d}.h5") as file:
            assert file["points"][()][:, :2] == pytest.approx(points)
            assert file["velocity"][()][-2:] == pytest.approx(np.zeros((2, 3)))
    with meshio.xdmf.TimeSeriesReader(tmp_path / "bodies.xdmf") as reader:
        points, cells = reader.read_points_cells()
        assert points[:, :2] == pytest.approx(frames[0]) and reader.num_steps == 3
        assert cells[0].type == "line" and len(cells[0].data) == 96 + 1


def test_bodies_at_rest_are_stored_once(tmp_path):
    model = mpm.Model(box((2, 2)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points([[0.7, 0.7]], [1e-3], density=1000.0)
    with pytest.raises(mpm.InputError, match="no contact"):
        BodyOutput(model, tmp_path / "bodies")
    model.add_contact(mpm.Box((0.1, 0.1), (0.2, 0.3)))
    with BodyOutput(model, tmp_path / "bodies") as output:
        for _ in range(2):
            output.write()
    with h5py.File(tmp_path / "bodies" / "000001.h5") as file:
        assert "points" not in file and "cells" not in file
    assert (tmp_path / "bodies.xdmf").read_text().count("000000.h5:/points") == 2
