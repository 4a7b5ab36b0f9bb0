"""Ends of beams: rings, which have none, and ends that are clamped where an axis of symmetry cuts the beam."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4


def body(lengths, counts, young, supports):
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, lengths, counts)
    soil = mpm.LinearElastic(young=young, poisson=0.0)
    return bridge.QuasiStatic(domain, soil, facet_tags, supports, cell_tags=cell_tags)


@pytest.mark.parametrize("backwards", [False, True])
def test_half_of_a_beam_bends_as_the_whole_where_it_is_clamped_at_the_axis_of_symmetry(backwards):
    """Half of a beam of 2 a = 4 m on two supports under p: the moment at the axis is p (2 a)^2 / 8, not 0 as at a free end."""
    half, pressure, stiffness = 2.0, 1e3, 1e6
    fem = body((half, 0.5), (8, 2), 1e-3, [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (0, 1))])
    points = [(0.0, 0.5), (half, 0.5)]
    clamped = {"clamped_end": True} if backwards else {"clamped_start": True}
    fem.reconfigure(members={"beam": mpm.beam(points[::-1] if backwards else points, 1e8, stiffness, **clamped)})
    fem.solve(bridge.Load(pressure={TOP: pressure}))
    forces = fem.member_forces("beam")
    axis = -1 if backwards else 0
    # Loaded from above, which is on its left only where it runs to the right
    assert forces.moment[axis] * (-1 if backwards else 1) == pytest.approx(pressure * (2 * half) ** 2 / 8, rel=1e-4)
    assert forces.moment[-1 - axis if not backwards else 0] == 0.0
    assert -forces.displacement[axis, 1] == pytest.approx(5 * pressure * (2 * half) ** 4 / (384 * stiffness), rel=0.01)


def test_a_ring_bends_where_it_closes_as_elsewhere():
    """A ring is symmetric about both axes, so that it carries as much at its sides, and does so wherever its line begins."""
    supports = [bridge.roller(BOTTOM, (0, 1)), bridge.prescribed(LEFT, (0.0, None))]

    def moments(start):
        angle = np.radians(start + np.arange(0, 361, 15))
        ring = np.column_stack([2 + np.cos(angle), 2 + np.sin(angle)])  # closed but for round-off
        fem = body((4.0, 4.0), (16, 16), 1e6, supports)
        fem.reconfigure(members={"ring": mpm.beam(ring, 1e8, 1e6, spacing=1.0)})
        fem.solve(bridge.Load(pressure={TOP: 1e3}))
        moment = fem.member_forces("ring").moment
        assert moment[0] == moment[-1]
        return moment[:-1]

    from_side = moments(0)
    assert from_side[0] == pytest.approx(from_side[12], rel=0.05)  # the mesh is symmetric by half a turn only
    assert abs(from_side[0]) > 0.9 * np.abs(from_side).max() > 100.0
    assert np.allclose(np.roll(moments(90), 6), from_side, rtol=0, atol=1e-6 * np.abs(from_side).max())


def test_rings_and_clamped_beams_among_particles_are_errors_that_name_them():
    model = mpm.Model(
        bridge.background_mesh(*bridge.box_mesh(MPI.COMM_WORLD, (4.0, 4.0), (8, 8))),
        mpm.LinearElastic(young=1e6, poisson=0.2),
    )
    model.seed(density=2000.0, per_cell=3)
    ring = [(1, 1), (3, 1), (3, 3), (1, 3), (1, 1)]
    with pytest.raises(mpm.InputError, match="'lining' is closed, expected a beam with free ends"):
        model.install({"lining": mpm.beam(ring, 1e8, 1e6)})
    with pytest.raises(mpm.InputError, match="'raft' is clamped, expected a beam with free ends"):
        model.install({"raft": mpm.beam([(0, 4), (2, 4)], 1e8, 1e6, clamped_start=True)})
    model.install({"geogrid": mpm.bar(ring, 1e6)})  # bars do not bend
    with pytest.raises(mpm.InputError, match="clamped_start or clamped_end of a line whose last point is its first"):
        mpm.beam(ring, 1e8, 1e6, clamped_end=True)


@pytest.mark.parametrize(
    ("degree", "cells", "spacing", "warns"),
    [(1, 8, 0.25, True), (1, 8, None, False), (1, 8, 0.5, False), (2, 8, 0.25, False)],
)
def test_segments_within_linear_elements_are_a_warning_as_the_beam_cannot_bend_there(
    degree, cells, spacing, warns, recwarn
):
    """With two segments in each element of 0.5 m there is half of the curvature: the beam on two supports sags by half as much."""
    length, pressure, stiffness = 4.0, 1e3, 1e6
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (length, 0.5), (cells, 2))
    supports = [bridge.roller(LEFT, (0, 1)), bridge.prescribed(RIGHT, (0.0, 0.0))]
    soil = mpm.LinearElastic(young=1e-3, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, cell_tags=cell_tags, degree=degree)
    fem.reconfigure(members={"beam": mpm.beam([(0.0, 0.5), (length, 0.5)], 1e8, stiffness, spacing=spacing)})
    said = [str(w.message) for w in recwarn if "the beam 'beam' cannot bend at 53% of its nodes" in str(w.message)]
    assert bool(said) == warns  # 8 of 15 inner nodes
    fem.solve(bridge.Load(pressure={TOP: pressure}))
    sag = -fem.member_forces("beam").displacement[:, 1].min() / (5 * pressure * length**4 / (384 * stiffness))
    assert sag == pytest.approx(0.5 if warns else 1.0, abs=0.02)


def test_a_free_end_on_an_axis_of_symmetry_is_a_warning(recwarn):
    fem = body((2.0, 0.5), (8, 2), 1e6, [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (0, 1))])
    raft = [(0.0, 0.5), (2.0, 0.5)]
    fem.reconfigure(
        members={
            "clamped": mpm.beam(raft, 1e8, 1e6, clamped_start=True),
            "wall": mpm.beam([(1.0, 0.5), (1.0, 0.1)], 1e8, 1e6),
        }
    )
    assert not [w for w in recwarn if "hinge" in str(w.message)]
    fem.reconfigure(members={"raft": mpm.beam(raft, 1e8, 1e6)})
    said = [str(w.message) for w in recwarn if "hinge" in str(w.message)]
    assert len(said) == 1 and "'raft' ends at (0, 0.5) m" in said[0] and "clamped_start=True" in said[0]
    fem.reconfigure(members=fem.members, off=[])  # it is there already
    assert len([w for w in recwarn if "hinge" in str(w.message)]) == 1


@pytest.mark.parametrize(("spacing", "warns"), [(None, False), (0.1, True)])
def test_segments_within_cells_of_particles_are_a_warning(spacing, warns, recwarn):
    model = mpm.Model(
        bridge.background_mesh(*bridge.box_mesh(MPI.COMM_WORLD, (4.0, 4.0), (8, 8))),
        mpm.LinearElastic(young=1e6, poisson=0.2),
    )
    model.seed(density=2000.0, per_cell=3)
    for name, x in (("on a line of the mesh", 1.0), ("between", 1.2)):
        model.install({name: mpm.beam([(x, 4.0), (x, 1.0)], 1e8, 1e6, spacing=spacing)})
        said = [w for w in recwarn if f"the beam '{name}' cannot bend at" in str(w.message)]
        assert bool(said) == warns


def test_a_body_on_a_strut_that_space_holds_is_not_said_to_fall_freely(recwarn):
    model = mpm.Model(
        bridge.background_mesh(*bridge.box_mesh(MPI.COMM_WORLD, (4.0, 4.0), (8, 8))),
        mpm.LinearElastic(young=1e6, poisson=0.2),
    )
    model.seed(density=2000.0, per_cell=3)
    model.set_gravity((0.0, -10.0))
    model.install({"tie": mpm.strut((2.0, 2.0), (2.0, 6.0), 1e6, fixed_end=True)})
    model.explicit(until=1e-4).last()
    assert not [w for w in recwarn if "fall freely" in str(w.message)]


def test_a_strut_between_the_nodes_of_a_coarse_beam_is_a_warning(recwarn):
    """It acts on the soil at (1, 1.5) m, and the beam has nodes at 2, 1 and 0 m; elements of 0.25 m have nodes at 0.125 m."""
    fem = body((2.0, 2.0), (8, 8), 1e6, [bridge.fixed(BOTTOM)])
    strut = mpm.strut((1.0, 1.5), (-3.0, 1.5), 1e6, fixed_end=True)
    beams = {
        "coarse": mpm.beam([(1.0, 2.0), (1.0, 0.0)], 1e9, 1e7, spacing=1.0),
        "fine": mpm.beam([(1.0, 2.0), (1.0, 0.0)], 1e9, 1e7),
        "with a point there": mpm.beam([(1.0, 2.0), (1.0, 1.5), (1.0, 0.0)], 1e9, 1e7, spacing=1.0),
        "elsewhere": mpm.beam([(1.4, 2.0), (1.4, 0.0)], 1e9, 1e7, spacing=1.0),
    }
    for name, beam in beams.items():
        fem.reconfigure(members={name: beam, "strut": strut})
        said = [str(w.message) for w in recwarn if f"on the beam '{name}'" in str(w.message)]
        assert said == [text for text in said if "'strut' ends at (1, 1.5) m" in text and "0.5 m from" in text]
        assert bool(said) == (name == "coarse")
        fem.reconfigure(members={})
