"""Nodes of beams along lines of the mesh: those of the soil, so that shear forces are those of equilibrium."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.structures.line_nodes import shared_nodes

LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
LENGTH = 4.0
CELLS = 12
MESHES = Path(__file__).parents[3] / "meshes"


def stretched():
    """A block 4 m long and 0.5 m high whose cells become longer from left to right."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (LENGTH, 0.5), (CELLS, 2))
    domain.geometry.x[:, 0] = LENGTH * (domain.geometry.x[:, 0] / LENGTH) ** 1.5
    return domain, cell_tags, facet_tags


EDGES = LENGTH * np.linspace(0, 1, CELLS + 1) ** 1.5
"""Where its cells end [m]"""


@pytest.mark.parametrize("degree", [1, 2, 4])
def test_the_shear_force_of_a_beam_on_the_mesh_is_that_of_equilibrium(degree):
    """A beam on two supports under p has V = p (L / 2 - x): between two nodes there is what lies on one side of their middle.

    Of a quadratic edge of the length h the middle carries 2/3 p h and each end p h / 6, so that V is off by p h / 12 at most, and
    by less with the weights of Lobatto, 1/20, 49/180 and 16/45, at the nodes of degree 4.
    """
    pressure = 1e3
    domain, cell_tags, facet_tags = stretched()
    supports = [bridge.roller(LEFT, (0, 1)), bridge.prescribed(RIGHT, (0.0, 0.0))]
    soil = mpm.LinearElastic(young=1e-3, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=degree, cell_tags=cell_tags)
    fem.reconfigure(members={"beam": mpm.beam([(0.0, 0.5), (LENGTH, 0.5)], 1e8, 1e6)})
    fem.solve(bridge.Load(pressure={TOP: pressure}))
    forces = fem.member_forces("beam")
    expected = pressure * (LENGTH / 2 - (forces.positions[1:, 0] + forces.positions[:-1, 0]) / 2)
    off = pressure * np.diff(EDGES).max() / 12
    assert len(forces.positions) == degree * CELLS + 1
    assert np.allclose(np.abs(forces.shear_force), np.abs(expected), rtol=0, atol=1.01 * off)


@pytest.mark.parametrize("backwards", [False, True])
def test_shared_nodes_are_those_of_the_mesh_with_the_corners_of_the_line(backwards):
    domain = stretched()[0]
    line = np.array([(0.0, 0.0), (0.0, 0.5), (EDGES[7], 0.5)])  # around a corner of the block
    expected = np.array([(0.0, 0.0), (0.0, 0.25), (0.0, 0.5), *((x, 0.5) for x in EDGES[1:8])])
    order = slice(None, None, -1 if backwards else 1)
    assert np.allclose(shared_nodes(domain, line[order], 1), expected[order], atol=1e-12)
    quadratic = shared_nodes(domain, line[order], 2)
    assert np.allclose(quadratic[::2], expected[order], atol=1e-12)
    assert np.allclose(quadratic[1::2], (expected[1:] + expected[:-1])[order] / 2, atol=1e-12)


@pytest.mark.parametrize("line", [
    [(0.1, 0.0), (0.1, 0.5)],  # through cells
    [(0.0, 0.25), (1.0, 0.25)],  # ends between two nodes
    [(0.0, 0.5), (LENGTH + 1, 0.5)],  # beyond the mesh
    [(0.0, 0.7), (LENGTH, 0.7)],  # outside of it
])  # fmt: skip
def test_lines_that_the_mesh_does_not_follow_share_no_nodes(line):
    assert shared_nodes(stretched()[0], np.array(line), 2) is None


def test_a_spacing_of_the_beam_is_kept():
    domain, cell_tags, facet_tags = stretched()
    soil = mpm.LinearElastic(young=1e6, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed(BOTTOM)], degree=2, cell_tags=cell_tags)
    fem.reconfigure(members={"beam": mpm.beam([(0.0, 0.5), (LENGTH, 0.5)], 1e8, 1e6, spacing=0.5)})
    assert np.allclose(fem.member_forces("beam").positions[:, 0], np.linspace(0, LENGTH, 9))


@pytest.mark.parametrize(("spacing", "warns"), [(None, False), (0.2, False), (1.0, True)])
def test_a_beam_whose_nodes_are_farther_apart_than_those_of_the_soil_is_a_warning(spacing, warns, recwarn):
    """Quadratic elements of 0.5 m have nodes every 0.25 m."""
    domain, cell_tags, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (4.0, 2.0), (8, 4))
    soil = mpm.LinearElastic(young=1e6, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed(BOTTOM)], degree=2, cell_tags=cell_tags)
    fem.reconfigure(members={"wall": mpm.beam([(2.0, 2.0), (2.0, 0.5)], 1e8, 1e6, spacing=spacing)})
    said = [str(w.message) for w in recwarn if "soil moves between its nodes" in str(w.message)]
    assert bool(said) == warns
    assert not warns or "'wall' has nodes 0.75 m apart, and the soil beside it has them" in said[0]


def ring(parts):
    """Corners of a ring of the radius 1 m about (2, 2) m."""
    angle = np.linspace(0, 2 * np.pi, parts + 1)
    return 2.0 + np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize(("parts", "beside"), [(40, False), (36, True), (52, True)])
def test_a_ring_of_other_parts_than_those_of_the_mesh_is_a_warning(parts, beside, recwarn, tmp_path):
    """The mesh has a circle of 40 parts, of which the chords are 3 mm away from the arc and 157 mm long."""
    (tmp_path / "ring.geo").write_text(
        """
        SetFactory("OpenCASCADE");
        Rectangle(1) = {0, 0, 0, 4, 4};
        Disk(2) = {2, 2, 0, 1};
        BooleanFragments{ Surface{1, 2}; Delete; }{}
        Physical Surface("soil") = {Surface{:}};
        Physical Curve("base") = {Curve In BoundingBox{-0.01, -0.01, -0.01, 4.01, 0.01, 0.01}};
        circle() = Curve In BoundingBox{0.9, 0.9, -0.01, 3.1, 3.1, 0.01};
        Transfinite Curve{circle()} = 41;
        Mesh.MeshSizeMax = 0.4;
    """
    )
    domain, cell_tags, facet_tags = bridge.read_mesh(tmp_path / "ring.geo", MPI.COMM_WORLD)
    soil = mpm.LinearElastic(young=1e6, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed("base")], degree=2, cell_tags=cell_tags)
    fem.reconfigure(members={"lining": mpm.beam(ring(parts), 1e9, 1e6)})
    assert bool([w for w in recwarn if "'lining' goes along edges of the mesh, but its" in str(w.message)]) == beside
    assert (len(fem.member_forces("lining").positions) == 2 * 40 + 1) == (not beside)


def test_a_beam_across_cells_goes_along_no_edges(recwarn):
    domain, cell_tags, facet_tags = stretched()
    soil = mpm.LinearElastic(young=1e6, poisson=0.0)
    fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed(BOTTOM)], degree=2, cell_tags=cell_tags)
    fem.reconfigure(members={"beam": mpm.beam([(0.1, 0.13), (3.7, 0.41)], 1e8, 1e6)})
    assert not [w for w in recwarn if "goes along edges" in str(w.message)]


def test_the_shear_force_of_a_ring_is_the_mean_of_the_sides_of_its_polygon():
    """A ring under uniform pressure has a thrust N alone. The sides of its polygon bend between their ends: the moment goes up and down by N s^2 / 12 R."""
    arcs = 12
    mesh = bridge.read_mesh(
        MESHES / "cylinder.geo", MPI.COMM_SELF, parameters={"inner": 1.0, "outer": 2.0, "rings": 6, "arcs": arcs}
    )
    soil, supports = mpm.LinearElastic(young=50e6, poisson=0.3), [
        bridge.roller("bottom", (0, 1)),
        bridge.roller("left", (1, 0)),
    ]
    fem = bridge.QuasiStatic(mesh[0], soil, mesh[2], supports, degree=2)
    angle = np.linspace(0, np.pi / 2, arcs + 1)
    lining = mpm.beam(np.column_stack([np.cos(angle), np.sin(angle)]), 1e9, 1e6, clamped_start=True, clamped_end=True)
    fem.reconfigure(members={"lining": lining})
    fem.solve(bridge.Load(pressure={"outer": 100e3}))
    forces = fem.member_forces("lining")
    thrust, side = -forces.axial_force.mean(), 2 * np.sin(np.pi / 4 / arcs)
    assert forces.per_side == 2 and len(forces.positions) == 2 * arcs + 1
    within = np.diff(forces.moment) / (side / 2)
    assert np.allclose(np.abs(within), thrust * side / 3, rtol=0.05)
    assert np.abs(forces.shear_force).max() < 0.02 * np.abs(within).max()
