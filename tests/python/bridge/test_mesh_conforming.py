"""Meshes whose cells do not meet node to node are refused by the place, before anything is computed on them."""

import re

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge.mesh.checks import check_conforming

#   3---4---5      the left square has one side where the right one has two
#   |  /|  /|
#   | / 6 / |
#   |/  |/  |
#   0---1---2
POINTS = np.array([(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1), (1, 0.5)], float)
LEFT = [(0, 1, 4), (0, 4, 3)]
RIGHT = [(1, 2, 6), (6, 2, 5), (6, 5, 4)]


def msh(path, points, cells, tag=0):
    """A mesh file of gmsh, version 2.2, of triangles or tetrahedra."""
    points = np.column_stack([points, np.zeros((len(points), 3 - points.shape[1]))])
    nodes = "".join(f"{k + 1} {x} {y} {z}\n" for k, (x, y, z) in enumerate(points))
    kind = {3: 2, 4: 4}[len(cells[0])]
    elements = "".join(
        f"{k + 1} {kind} 2 {tag} 1 {' '.join(str(node + 1) for node in cell)}\n" for k, cell in enumerate(cells)
    )
    path.write_text(f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{len(points)}\n{nodes}$EndNodes\n"
                    f"$Elements\n{len(cells)}\n{elements}$EndElements\n")  # fmt: skip
    return path


def test_a_hanging_node_is_named_by_its_place(tmp_path):
    with pytest.raises(
        bridge.InputError, match=r"torn.msh.*: the node at \(1, 0.5\) lies within a side of another cell"
    ):
        bridge.read_mesh(msh(tmp_path / "torn.msh", POINTS, LEFT + RIGHT), MPI.COMM_SELF)


def test_cells_that_meet_node_to_node_are_taken(tmp_path):
    whole = [(0, 1, 6), (0, 6, 4), (0, 4, 3), *RIGHT]
    domain, _, _ = bridge.read_mesh(msh(tmp_path / "whole.msh", POINTS, whole), MPI.COMM_SELF)
    assert domain.topology.index_map(2).size_local == 6


def turned(points, angle):
    c, s = np.cos(angle), np.sin(angle)
    return 1e3 * points @ np.array([(c, -s), (s, c)]) + 7


@pytest.mark.parametrize("angle", np.linspace(0, 2 * np.pi, 9))
def test_neither_direction_nor_scale_matters(angle):
    with pytest.raises(bridge.InputError, match="lies within a side"):
        check_conforming(turned(POINTS, angle), np.array(LEFT + RIGHT), "mesh")
    check_conforming(turned(POINTS, angle), np.array(LEFT), "mesh")  # its boundary has no node but its own
    check_conforming(turned(POINTS, angle), np.array(RIGHT), "mesh")


# --- tetrahedra ------------------------------------------------------------------------------------------------------

#  Two tetrahedra above and two below the unit square z = 0, whose corners are 0 to 3; 4 is above and 5 below it.
CUBE = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.4, 0.6, 1), (0.4, 0.6, -1), (0.5, 0.5, 0), (0.6, 0.2, 0)]
)
ABOVE = [(0, 1, 2, 4), (0, 2, 3, 4)]
BELOW = {
    "along the same diagonal": [(0, 1, 2, 5), (0, 2, 3, 5)],
    "along the other diagonal": [(0, 1, 3, 5), (1, 2, 3, 5)],
    "node on the diagonal": [(0, 1, 6, 5), (1, 2, 6, 5), (2, 3, 6, 5), (3, 0, 6, 5)],
    "node within a face": [(0, 1, 7, 5), (1, 2, 7, 5), (0, 7, 2, 5), (0, 2, 3, 5)],
}
MESSAGES = {
    "along the other diagonal": "a face of a cell overlaps that of another at ",
    "node on the diagonal": "the node at {} lies within a face of another cell",
    "node within a face": "the node at {} lies within a face of another cell",
}


def turned_in_space(points, angle):
    axis = np.array([1, 2, 2]) / 3
    cross = np.cross(np.eye(3), axis)
    return 1e3 * points @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross) + 7


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.5])
@pytest.mark.parametrize("below", BELOW)
def test_tetrahedra_on_both_sides_of_a_square(below, angle):
    points, cells = turned_in_space(CUBE, angle), np.array(ABOVE + BELOW[below])
    if below not in MESSAGES:
        check_conforming(points, cells, "mesh")
        return
    hanging = points[6 if "diagonal" in below else 7]
    place = re.escape("(" + ", ".join(f"{x:g}" for x in hanging) + ")")
    with pytest.raises(bridge.InputError, match="mesh: " + MESSAGES[below].format(place)):
        check_conforming(points, cells, "mesh")


def test_a_torn_mesh_of_tetrahedra_is_refused_on_reading(tmp_path):
    path = msh(tmp_path / "torn.msh", CUBE, ABOVE + BELOW["node on the diagonal"])
    with pytest.raises(bridge.InputError, match=r"torn.msh.*: the node at \(0.5, 0.5, 0\) lies within a face"):
        bridge.read_mesh(path, MPI.COMM_SELF, dim=3)


# --- parts that fill the same place ----------------------------------------------------------------------------------

SQUARES = """
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, 0, 6, 3};
Rectangle(2) = {0, BOTTOM, 0, 3, 2};
COHERENCE
Physical Surface("ground") = {1};
Physical Surface("bank") = {2};
Mesh.MeshSizeMax = 0.7;
"""


@pytest.mark.parametrize(("bottom", "coherence", "refused"), [(2.3, "", True), (3, "Coherence;", False)])
def test_soils_that_overlap_are_refused(tmp_path, bottom, coherence, refused):
    path = tmp_path / "soils.geo"
    path.write_text(SQUARES.replace("BOTTOM", str(bottom)).replace("COHERENCE", coherence))
    if refused:
        with pytest.raises(
            bridge.InputError, match=r"soils.geo.*lies within a cell; two parts of the mesh fill the same place"
        ):
            bridge.read_mesh(path, MPI.COMM_SELF)
    else:
        bridge.read_mesh(path, MPI.COMM_SELF)


@pytest.mark.parametrize("angle", [0.0, 0.4, 2.5])
@pytest.mark.parametrize("depth", [0.01, 0.5])
def test_a_corner_within_another_tetrahedron_is_refused(depth, angle):
    corner = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], float)
    other = np.array([0.3, 0.3, 0.4 - depth * 0.4]) + np.vstack(
        [np.zeros(3), np.array([(1, 2, 2), (2, 1, 2), (2, 2, 1)])]
    )
    cells, points = np.array([(0, 1, 2, 3), (4, 5, 6, 7)]), np.vstack([corner, other])
    with pytest.raises(bridge.InputError, match="lies within a cell"):
        check_conforming(turned_in_space(points, angle), cells, "mesh")
    points[4:] += 0.4 * depth + 0.01  # beyond the face of the first
    check_conforming(turned_in_space(points, angle), cells, "mesh")


# --- tags ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("tag", [2**31, 2**32 + 1, -(2**31), 10**20])
def test_tags_that_do_not_fit_are_refused_by_the_line(tmp_path, tag):
    # gmsh takes 2^32 + 1 for 1.
    path = msh(tmp_path / "tags.msh", POINTS, RIGHT, tag)
    first = path.read_text().split("\n").index(f"1 2 2 {tag} 1 2 3 7") + 1
    with pytest.raises(
        bridge.InputError, match=rf"line {first} has the number {tag} in \$Elements, expected tags from 1"
    ):
        bridge.read_mesh(path, MPI.COMM_SELF)


def test_the_largest_tag_is_kept(tmp_path):
    _, tags, _ = bridge.read_mesh(msh(tmp_path / "tags.msh", POINTS, RIGHT, 2**31 - 1), MPI.COMM_SELF)
    assert set(tags.values) == {2**31 - 1}


def test_a_tag_too_large_in_the_newer_format(tmp_path):
    gmsh.initialize(["gmsh", "-v", "0"], False)
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], 777)
    gmsh.model.mesh.generate(2)
    gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
    path = tmp_path / "four.msh"
    gmsh.write(str(path))
    gmsh.finalize()
    path.write_text(path.read_text().replace("777", str(2**32 + 3)))
    with pytest.raises(bridge.InputError, match=rf"has the number {2**32 + 3} in \$Entities"):
        bridge.read_mesh(path, MPI.COMM_SELF)


def test_a_tag_too_large_in_a_geometry(tmp_path):
    path = tmp_path / "tags.geo"
    path.write_text(
        'SetFactory("OpenCASCADE"); Rectangle(1) = {0, 0, 0, 1, 1};\nPhysical Surface(2^32 + 1) = {1};\nMesh.MeshSizeMax = 1;'
    )
    with pytest.raises(
        bridge.InputError, match="a physical group of dimension 2 has the tag .* expected tags from 1 to"
    ):
        bridge.read_mesh(path, MPI.COMM_SELF)
