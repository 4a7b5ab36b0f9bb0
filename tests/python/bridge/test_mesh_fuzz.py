"""Damaged mesh files: each is read or named in a clear error."""

import random

import gmsh
import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.mesh.checks import check_cells_fit


@pytest.fixture(scope="module")
def good_files(tmp_path_factory):
    """A square of triangles with physical groups, in both formats that gmsh writes as text."""
    folder = tmp_path_factory.mktemp("meshes")
    gmsh.initialize(["gmsh", "-v", "0"], False)
    gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
    gmsh.model.occ.synchronize()
    gmsh.model.addPhysicalGroup(2, [1], 7)
    gmsh.model.addPhysicalGroup(1, [1], 3)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
    gmsh.model.mesh.generate(2)
    for name, version in (("four.msh", 4.1), ("two.msh", 2.2)):
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        gmsh.write(str(folder / name))
    gmsh.finalize()
    return [(folder / name).read_bytes() for name in ("four.msh", "two.msh")]


def damaged(data, draw):
    """Bytes changed, lost or put in between, or a line in place of another."""
    data = bytearray(data)
    kind = draw.randrange(4)
    for _ in range(draw.choice([1, 1, 3, 10])):
        at = draw.randrange(len(data))
        if kind == 0:
            data[at] = draw.randrange(256)
        elif kind == 1:
            del data[at : at + draw.randrange(1, 40)]
        elif kind == 2:
            data[at:at] = bytes(draw.choice(b"0123456789- \n.e$") for _ in range(draw.randrange(1, 6)))
        else:
            lines = bytes(data).split(b"\n")
            lines[draw.randrange(len(lines))] = draw.choice(lines)
            data = bytearray(b"\n".join(lines))
    return bytes(data)


def test_damaged_files_end_in_a_clear_error(good_files, tmp_path):
    # Files of the last three seeds crash gmsh 4.8, which must not end this process.
    refused = 0
    for seed in (*range(12), 311, 375, 566):
        draw = random.Random(seed)
        path = tmp_path / "bad.msh"
        path.write_bytes(damaged(draw.choice(good_files), draw))
        try:
            bridge.background_mesh(*bridge.read_mesh(path, MPI.COMM_SELF))
        except mpm.InputError as error:
            refused += 1
            assert len(str(error)) > 20
    assert refused > 10


def test_a_node_without_a_place_is_named(tmp_path):
    path = tmp_path / "nan.msh"
    path.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 nan 0\n3 0 1 0\n$EndNodes\n"
                    "$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n")  # fmt: skip
    with pytest.raises(mpm.InputError, match=r"nan.msh'?: node 2 is at \(1.0, nan, 0.0\), expected finite coordinates"):
        bridge.read_mesh(path, MPI.COMM_SELF)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([[0, 1, 2], [2, 1, 1]], "cell 1 has a node twice"),
        ([[0, 1, 2], [2, 0, 1]], "is listed 2 times"),
        ([[0, 1, 2], [0, 1, 3], [1, 0, 4]], "has a facet that 3 cells share"),
    ],
)
def test_cells_that_fit_no_mesh(cells, message):
    with pytest.raises(mpm.InputError, match=message):
        check_cells_fit(np.array(cells), "a mesh")
