"""Structural members in pictures of bodies: what the body hides of them, and their forces."""

import csv

import matplotlib.pyplot as plt
import numpy as np
import pytest
import study_main
from common.plots import curve_look, name_curves
from common.solids import member_forces
from common.solids.members import DASHES, draw_members_of_section, hidden, hidden_by_particles, joined, parted
from common.solids.plots import Shown, draw_body, main_section
from common.solids.view import picture_axes, set_view
from matplotlib.colors import Normalize
from mpl_toolkits.mplot3d import proj3d
from test_site_solid import cube
from test_site_solid_input import block

import mpm_core as mpm

SIDES = [(1.0, 0.0), (0.0, -1.0), (-1.0, 1.0)]


def behind_unit_cube(points, towards):
    """Whether the way from points to the eye passes through the unit cube, and the length of it there: by the slabs between its sides."""
    ends = np.sort([(0 - points) / towards, (1 - points) / towards], axis=0)
    first, last = np.maximum(ends[0].max(axis=1), 0.0), ends[1].min(axis=1)
    return last > first, last - first


@pytest.mark.parametrize("side", SIDES)
def test_the_view_is_that_of_the_picture(side):
    """Vectors to the right and upwards have the same length in the picture, and the one to the eye has none."""
    figure = plt.figure(figsize=(6, 4))
    try:
        axes = figure.add_subplot(projection="3d")
        low, high = np.array([1.0, 2.0, -3.0]), np.array([9.0, 5.0, 2.0])
        set_view(axes, np.array([low, high]), np.array(side))
        figure.canvas.draw()
        places = np.vstack([low, low + picture_axes(np.array(side))])
        drawn = axes.transData.transform(np.column_stack(proj3d.proj_transform(*places.T, axes.get_proj())[:2]))
        right, up, towards = drawn[1:] - drawn[0]
        assert right[0] > 10 and abs(right[1]) < 1e-6 * right[0]
        assert up[1] == pytest.approx(right[0], rel=1e-6) and abs(up[0]) < 1e-6 * up[1]
        assert np.linalg.norm(towards) < 1e-6 * right[0]
    finally:
        plt.close(figure)


@pytest.mark.parametrize("side", SIDES)
def test_what_lies_behind_or_in_a_body_is_hidden(side):
    view, solid = picture_axes(np.array(side)), cube()
    points = np.random.default_rng(1).uniform(-0.7, 1.7, (2000, 3))
    through, length = behind_unit_cube(points, view[2])
    clear = ~through | (length > 0.03)  # others are close below the surface
    assert 300 < through.sum() < 1700
    found = hidden(points, solid.points[solid.surface()[0]], view)
    assert (found == through)[clear].all()
    grid = (np.stack(np.meshgrid(*3 * [np.arange(20)]), axis=-1).reshape(-1, 3) + 0.5) / 20
    by_particles = hidden_by_particles(points, grid, 0.07, view)
    assert (by_particles == through)[
        ~through | (length > 0.25)
    ].mean() > 0.97  # but for those beside its edges in the picture


def test_a_bar_through_a_body_is_full_outside_and_dashed_inside():
    """Seen from 35 degrees beside the x axis, a bar 0.4 m inside of the nearer side of a cube of 1 m is hidden from 0.4 / tan(35) behind it."""
    bar = np.array([(-1.0, 0.4, 0.6), (0.2, 0.4, 0.6), (2.0, 0.4, 0.6)])
    solid, side = cube(), np.array([1.0, 0.0])
    seen, unseen = parted([bar], lambda points: (points[:, 0] > 0) & (points[:, 0] < 1), 0.01)
    length = [[np.linalg.norm(np.diff(line, axis=0), axis=1).sum() for line in lines] for lines in (seen, unseen)]
    assert length[0] == pytest.approx([1.0, 1.0], abs=0.02) and length[1] == pytest.approx([1.0], abs=0.02)
    assert len(unseen[0]) > 90 and np.isin(0.2, unseen[0][:, 0])  # its corners stay
    solid.members = [bar]
    figure = plt.figure()
    try:
        axes = figure.add_subplot(projection="3d")
        draw_body(axes, solid, Shown(solid.lengths(), False, Normalize(0, 3), "viridis"), main_section(solid), side)
        full, dashed = axes.collections[-2:]
        # Matplotlib has no other way to the lines.
        inside, beyond, before = (line[:, 0] for one in (dashed, full) for line in one._segments3d)
        hidden_from = -0.4 / np.tan(np.radians(35.0))
        assert (beyond[0], beyond[-1]) == (-1.0, pytest.approx(hidden_from, abs=0.02))
        assert inside[[0, -1]] == pytest.approx([hidden_from, 1.0], abs=0.02)
        assert before[[0, -1]] == pytest.approx([1.0, 2.0], abs=0.02)
        assert dashed.get_linestyle()[0][1] is not None and full.get_linestyle()[0][1] is None
    finally:
        plt.close(figure)


def test_members_beside_a_section_are_dashed():
    figure, axes = plt.subplots()
    try:
        nails = [np.array([(0.0, y, 1.0), (4.0, y, 0.0)]) for y in (0.2, 1.5)]
        draw_members_of_section(axes, nails, axis=1, at=0.0, near=0.5)
        full, dashed = axes.collections
        assert [len(one.get_segments()) for one in (full, dashed)] == [1, 1]
        assert full.get_segments()[0][[0, -1]] == pytest.approx(np.array([(0.0, 1.0), (4.0, 0.0)]))
        assert full.get_linestyle()[0][1] is None and len(dashed.get_linestyle()[0][1]) == len(DASHES[1])
    finally:
        plt.close(figure)


def test_segments_that_follow_one_another_are_joined():
    lines = [np.random.default_rng(k).random((n, 3)) for k, n in enumerate((2, 5, 3))]
    segments = np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in lines])
    assert all(np.array_equal(one, other) for one, other in zip(joined(segments), lines, strict=True))
    assert joined(np.empty((0, 2, 3))) == []


STRUT = """
[supports]
base = "fixed"
[members.strut]
kind = "strut"
points = [[2.0, 2.0, 3.0], [2.0, 2.0, 0.0]]
axial_stiffness = 1e6
[[stages]]
name = "in situ"
fill = ["clay"]
[[stages]]
name = "load"
install = ["strut"]
pressure = {top = 20e3}
"""


def test_forces_in_a_body_are_drawn_as_the_table_has_them(tmp_path, monkeypatch):
    kept = []
    monkeypatch.setattr(member_forces, "_draw_along", lambda axes, forces: kept.append(forces))
    path = block(tmp_path, text=STRUT)
    assert study_main.main("excavation", ["--site", path, "--no-compare", "--output", tmp_path / "out"]) == 0
    for name in ("members", "stages_displacement"):
        assert (tmp_path / "out" / f"{name}.png").stat().st_size > 20_000
    assert "Axial force of each structural member" in (tmp_path / "out" / "report.html").read_text()
    with open(tmp_path / "out" / "members.csv", newline="") as file:
        last = list(csv.DictReader(file))[-1]
    assert (
        float(kept[0]["strut"].axial_force[-1]) == pytest.approx(float(last["axial_force_N"]), rel=1e-5)
        and float(last["axial_force_N"]) < -1e3
    )


def test_forces_are_drawn_along_members_in_kN_by_their_distance():
    """A bar of 3 and 4 m along two axes is 5 m long; its first segment has 30 kN and its second one none."""
    places = np.array([(0.0, 0.0, 0.0), (1.5, 0.0, 2.0), (3.0, 0.0, 4.0)])
    force = mpm.MemberForces(
        positions=places, displacement=0 * places, axial_force=np.array([30e3, 0.0]), moment=np.zeros(3)
    )
    figure, axes = plt.subplots()
    try:
        member_forces._draw_along(axes, {"nail": force})
        assert axes.lines[0].get_xdata() == pytest.approx([0.0, 2.5, 2.5, 5.0])
        assert axes.lines[0].get_ydata() == pytest.approx([30.0, 30.0, 0.0, 0.0])
    finally:
        plt.close(figure)


@pytest.mark.parametrize("count, beside", [(3, False), (25, True)])
def test_many_curves_differ_and_are_named_beside_their_axes(count, beside):
    figure, axes = plt.subplots(layout="constrained")
    try:
        for k in range(count):
            axes.plot([0, 1], [0, k], label=f"nail {k}", **curve_look(k))
        name_curves(axes, fontsize=8)
        figure.canvas.draw()
        legend, within = axes.get_legend().get_window_extent(), axes.get_window_extent()
        assert (legend.x0 > within.x1) == beside and legend.x1 <= figure.bbox.x1 and legend.y0 >= 0
        looks = [(line.get_color(), line.get_linestyle()) for line in axes.lines[:18]]
        assert len(set(looks)) == len(looks)
    finally:
        plt.close(figure)
