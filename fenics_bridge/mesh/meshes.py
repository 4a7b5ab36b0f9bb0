"""Meshes from gmsh: read from .msh, or made from .geo."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.collective import on_first_rank

from fenics_bridge.errors import InputError, agree, is_finite
from fenics_bridge.mesh import gmsh_reader
from fenics_bridge.mesh.checks import check_cells_fit, check_conforming
from fenics_bridge.mesh.gmsh_process import Limits, read_apart
from fenics_bridge.mesh.tagged import MeshArrays, distributed_mesh, empty_arrays
from fenics_bridge.types import MeshTags

TIME_LIMIT = 600.0
"""[s] that gmsh may take for a file, unless given otherwise"""


def read_mesh(
    path: str | Path,
    comm: MPI.Comm,
    dim: int = 2,
    parameters: Mapping[str, float] | None = None,
    *,
    time_limit: float = TIME_LIMIT,
    memory_limit: float | None = None,
    allow_commands: bool = False,
) -> tuple[Mesh, MeshTags, MeshTags]:
    """Read a mesh and its tags from a file of gmsh; rank 0 reads, DOLFINx partitions. Collective.

    Tags are gmsh's physical groups, whose names stand for them wherever a tag is asked for. When the file has physical
    groups of dimension `dim`, only their cells belong to the mesh, as when gmsh saves a mesh; otherwise all do, untagged.
    Nodes at one place are merged, so that soils hold together.

    Args:
        path: .msh (any version that gmsh reads) or .geo (meshed here).
        comm: the ranks that share the mesh.
        dim: 2 for triangles in the plane z = 0, 3 for tetrahedra.
        parameters: for .geo, values for its `DefineConstant` names, e.g. {"cell_size": 0.1}.
        time_limit: time that gmsh may take [s].
        memory_limit: memory that gmsh may take [bytes], by default half of the machine's memory.
        allow_commands: let a .geo file run commands by `SystemCall`; it is a program, so trust it first.

    Returns:
        The mesh, the tags of its cells, and the tags of its facets.

    Raises:
        InputError: a file that is missing or cannot be read, another extension, a mesh without cells, of another dimension, with
            quadrilaterals or hexahedra, with curved (second-order) elements, with cells that do not meet node to node, or with
            tags that do not fit into 32 bits; one that runs commands, or that takes more time or memory than it may. Raised on
            all ranks alike.
    """
    _check_arguments(comm, path, dim, parameters)
    limits = Limits(time_limit, memory_limit, allow_commands)
    arrays = on_first_rank(comm, lambda: _arrays_from_file(Path(path), dim, parameters or {}, limits))
    return distributed_mesh(comm, arrays if arrays is not None else empty_arrays(dim), dim)


def arrays_from_model(dim: int, name: str) -> Any:
    """MeshArrays of gmsh's current model; `name` stands for the model in error messages."""
    try:
        arrays = gmsh_reader.model_arrays(dim)
    except gmsh_reader.MeshError as error:
        raise InputError(f"{name}: {error}") from error
    return _mesh_arrays(arrays, name)


def _check_arguments(comm: MPI.Comm, path: str | Path, dim: int, parameters: Mapping[str, float] | None) -> None:
    message = None
    suffix = Path(path).suffix.lower()
    if dim not in (2, 3):
        message = f"dim is {dim!r}, expected 2 or 3"
    elif suffix not in (".msh", ".geo"):
        message = f"path is {str(path)!r}, expected a gmsh file ending in .msh or .geo"
    elif parameters and suffix != ".geo":
        message = f"parameters: only a .geo file takes them, got path {str(path)!r}"
    agree(comm, message)


def _arrays_from_file(path: Path, dim: int, parameters: Mapping[str, float], limits: Limits) -> Any:
    if not path.is_file():
        raise InputError(f"path: there is no file {str(path)!r}")
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InputError(f"path: {str(path)!r} cannot be read: {error.strerror}") from error
    if path.suffix.lower() == ".msh" and not text.lstrip().startswith(b"$MeshFormat"):
        raise InputError(f"path: {str(path)!r} is not a gmsh mesh (it does not begin with $MeshFormat)")
    constants = _constants(parameters, text, path)
    with tempfile.TemporaryDirectory() as folder:
        given = _with_constants(path, constants, folder)
        arrays = read_apart(given, dim, Path(folder) / "arrays.npz", str(path), limits)
    return _mesh_arrays(arrays, str(path))


def _mesh_arrays(arrays: dict[str, Any], name: str) -> Any:
    check_cells_fit(arrays["cells"], name)
    check_conforming(arrays["points"], arrays["cells"], name)
    keys = "points", "cells", "cell_values", "facets", "facet_values"
    return MeshArrays(*(arrays[key] for key in keys), *(_names(arrays, kind) for kind in ("cell", "facet")))


def _names(arrays: dict[str, Any], kind: str) -> dict[str, Any]:
    """{name: tags} of the physical groups of cells or facets."""
    names: dict[str, tuple[int, ...]] = {}
    for name, number in zip(arrays[f"{kind}_names"].tolist(), arrays[f"{kind}_numbers"].tolist()):
        names[name] = (*names.get(name, ()), number)
    return names


def _constants(parameters: Mapping[str, float], text: Any, path: Path) -> str:
    """Lines of a .geo file that set its constants: `DefineConstant` leaves alone what has a value."""
    lines = []
    for name, value in parameters.items():
        if not (name.isidentifier() and re.search(rf"\b{name}\b".encode(), text)):
            raise InputError(f"parameters: {str(path)!r} has no constant {name!r}")
        if not is_finite(value):
            raise InputError(f"parameters: {name}={value!r}, expected a finite number")
        lines.append(f"{name} = {float(value)!r};\n")
    return "".join(lines)


def _with_constants(path: Path, constants: str, folder: str) -> Path:
    """A file that sets the constants and includes `path`.

    If the constants came by gmsh's command line, it would keep them from one session to the next.
    """
    if not constants:
        return path
    wrapper = Path(folder) / "with_constants.geo"
    wrapper.write_text(f'{constants}Include "{path.resolve()}";\n')
    return wrapper
