"""Meshes whose cells do not meet node to node are refused by the place, before anything is computed on them."""

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


def msh(path, points, cells):
    """A mesh file of gmsh, version 2.2."""
    nodes = "".join(f"{k + 1} {x} {y} 0\n" for k, (x, y) in enumerate(points))
    elements = "".join(f"{k + 1} 2 2 0 1 {a + 1} {b + 1} {c + 1}\n" for k, (a, b, c) in enumerate(cells))
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
