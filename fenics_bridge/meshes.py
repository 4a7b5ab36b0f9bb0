"""Meshes from gmsh: read from .msh, or made from .geo."""

from __future__ import annotations

import contextlib
import re
import signal
import tempfile
from pathlib import Path

import gmsh
import numpy as np

from fenics_bridge.errors import InputError, agree, on_root
from fenics_bridge.mesh_checks import check_cells_fit
from fenics_bridge.tagged import MeshArrays, distributed_mesh, empty_arrays

_SIMPLEX = {2: "triangles", 3: "tetrahedra"}
_GMSH_SIMPLEX = {1: 1, 2: 2, 3: 4}  # dimension -> element type of the linear simplex in gmsh


def read_mesh(path, comm, dim=2, parameters=None):
    """Mesh and tags from a file of gmsh; rank 0 reads, DOLFINx partitions.

    path: .msh (any version that gmsh reads) or .geo (meshed here)
    comm: MPI communicator; dim: 2 for triangles in the plane z = 0, 3 for tetrahedra
    parameters: for .geo, values for its `DefineConstant` names, e.g. {"cell_size": 0.1}
    Returns (domain, cell_tags, facet_tags). Tags are gmsh's physical groups. When the file has physical groups of
    dimension `dim`, only their cells belong to the mesh, as when gmsh saves a mesh; otherwise all do, untagged.
    Raises InputError, on all ranks, for a file that is missing or cannot be read, another extension, a mesh without
    cells, of another dimension, with quadrilaterals or hexahedra, or with curved (second-order) elements.
    Collective.
    """
    _check_arguments(comm, path, dim, parameters)
    arrays = on_root(comm, lambda: _arrays_from_file(Path(path), dim, parameters or {}))
    return distributed_mesh(comm, arrays if arrays is not None else empty_arrays(dim), dim)


@contextlib.contextmanager
def gmsh_session():
    """gmsh, silent; its handling of Ctrl-C is undone."""
    handler = signal.getsignal(signal.SIGINT)
    gmsh.initialize(["gmsh", "-v", "0"], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        yield gmsh.model
    finally:
        gmsh.finalize()
        signal.signal(signal.SIGINT, handler if handler is not None else signal.SIG_DFL)


def arrays_from_model(dim, name):
    """MeshArrays of gmsh's current model; `name` stands for the model in error messages."""
    cells, cell_values = _entities(dim, name)
    check_cells_fit(cells, name)
    facets, facet_values = _entities(dim - 1, name, only_groups=True)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = coordinates.reshape(-1, 3)
    if dim == 2 and np.ptp(points[np.isin(tags, cells), 2]) > 1e-9 * np.ptp(points):
        raise InputError(f"{name}: dim=2 expects a plane mesh, but the nodes have different z")
    order = np.argsort(tags)
    used = np.unique(cells)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    inside = np.isin(facets, used).all(axis=1)
    return MeshArrays(
        points[rows, :dim],
        np.searchsorted(used, cells),
        cell_values,
        np.searchsorted(used, facets[inside]),
        facet_values[inside],
    )


def _check_arguments(comm, path, dim, parameters):
    message = None
    suffix = Path(path).suffix.lower()
    if dim not in (2, 3):
        message = f"dim: got {dim!r}, expected 2 or 3"
    elif suffix not in (".msh", ".geo"):
        message = f"path: got {str(path)!r}, expected a gmsh file ending in .msh or .geo"
    elif parameters and suffix != ".geo":
        message = f"parameters: only a .geo file takes them, got path {str(path)!r}"
    agree(comm, message)


def _arrays_from_file(path, dim, parameters):
    if not path.is_file():
        raise InputError(f"path: there is no file {str(path)!r}")
    try:
        text = path.read_bytes()
    except OSError as error:
        raise InputError(f"path: {str(path)!r} cannot be read: {error.strerror}") from error
    if path.suffix.lower() == ".msh" and not text.lstrip().startswith(b"$MeshFormat"):
        raise InputError(f"path: {str(path)!r} is not a gmsh mesh (it does not begin with $MeshFormat)")
    constants = _constants(parameters, text, path)
    with gmsh_session(), tempfile.TemporaryDirectory() as folder:
        try:
            gmsh.open(str(_with_constants(path, constants, folder)))
            if path.suffix.lower() == ".geo":
                gmsh.model.mesh.generate(dim)
        except Exception as error:  # gmsh's Python interface raises nothing more special
            raise InputError(f"path: gmsh cannot read {str(path)!r}: {gmsh_message(error)}") from error
        return arrays_from_model(dim, str(path))


def gmsh_message(error):
    """What gmsh says about an error, on one line."""
    return " ".join(str(error).split()) or gmsh.logger.getLastError()


def _constants(parameters, text, path):
    """Lines of a .geo file that set its constants: `DefineConstant` leaves alone what has a value."""
    lines = []
    for name, value in parameters.items():
        if not (name.isidentifier() and re.search(rf"\b{name}\b".encode(), text)):
            raise InputError(f"parameters: {str(path)!r} has no constant {name!r}")
        if not np.isfinite(value):
            raise InputError(f"parameters: {name}={value!r}, expected a finite number")
        lines.append(f"{name} = {float(value)!r};\n")
    return "".join(lines)


def _with_constants(path, constants, folder):
    """A file that sets the constants and includes `path`; gmsh would keep them from one session to the next
    if they came by its command line."""
    if not constants:
        return path
    wrapper = Path(folder) / "with_constants.geo"
    wrapper.write_text(f'{constants}Include "{path.resolve()}";\n')
    return wrapper


def _entities(dim, name, only_groups=False):
    """Node tags (m, dim + 1) and physical groups (m,) of the model's elements of one dimension."""
    groups = gmsh.model.getPhysicalGroups(dim)
    blocks = [(entity, tag) for _, tag in groups for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
    twice = len(blocks) != len({entity for entity, _ in blocks})
    if twice:
        raise InputError(f"{name}: an entity of dimension {dim} is in two physical groups; a tag must be single")
    if not groups and not only_groups:
        blocks = [(entity, 0) for _, entity in gmsh.model.getEntities(dim)]
    nodes, values = [np.empty((0, dim + 1), np.int64)], [np.empty(0, np.int32)]
    for entity, tag in blocks:
        for kind, _, element_nodes in zip(*gmsh.model.mesh.getElements(dim, entity)):
            _check_element(kind, dim, name)
            nodes.append(np.asarray(element_nodes, dtype=np.int64).reshape(-1, dim + 1))
            values.append(np.full(len(nodes[-1]), tag, dtype=np.int32))
    if not only_groups:
        _check_cells(nodes, dim, name)
    return np.concatenate(nodes), np.concatenate(values)


def _check_element(kind, dim, name):
    if kind == _GMSH_SIMPLEX[dim]:
        return
    text, _, order, *_ = gmsh.model.mesh.getElementProperties(kind)
    if order > 1:
        raise InputError(f"{name}: has elements of order {order} ({text}), expected straight ones (order 1)")
    expected = _SIMPLEX.get(dim, "lines")
    raise InputError(f"{name}: has elements of type {text!r}, expected only {expected}")


def _check_cells(nodes, dim, name):
    found = sum(len(block) for block in nodes)
    higher = dim == 2 and len(gmsh.model.mesh.getElements(3)[0]) > 0
    if higher:
        raise InputError(f"{name}: has cells of dimension 3, but dim=2 was asked for")
    if not found:
        lower = dim == 3 and len(gmsh.model.mesh.getElements(2)[0]) > 0
        detail = ", its cells have dimension 2" if lower else ""
        raise InputError(f"{name}: has no cells of dimension {dim}{detail}")
