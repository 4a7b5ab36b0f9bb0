"""Meshes with tags from arrays; all meshes of the bridge are made here."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from dolfinx.mesh import Mesh, meshtags
from mpi4py import MPI
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import InputError
from fenics_bridge.mesh.names import name_tags
from fenics_bridge.types import MeshTags


class MeshArrays(NamedTuple):
    """A rank's part of a mesh of linear simplices of dimension D."""

    points: np.ndarray
    """Coordinates of the nodes [m], shape (n, D), float64; nodes are numbered through in order of rank"""
    cells: np.ndarray
    """Nodes of the cells by those numbers, shape (m, D + 1), int64"""
    cell_values: np.ndarray
    """Tags of the cells, shape (m,), int32; 0 for none"""
    facets: np.ndarray
    """Nodes of the tagged facets, shape (k, D), int64"""
    facet_values: np.ndarray
    """Tags of the facets, shape (k,), int32"""
    cell_names: dict | None = None
    """Tags of cells by name; those of rank 0 hold"""
    facet_names: dict | None = None
    """Tags of facets by name; those of rank 0 hold"""


def empty_arrays(dim: int) -> MeshArrays:
    """The part of a rank without nodes and cells."""
    return MeshArrays(
        np.empty((0, dim)),
        np.empty((0, dim + 1), np.int64),
        np.empty(0, np.int32),
        np.empty((0, dim), np.int64),
        np.empty(0, np.int32),
    )


def distributed_mesh(comm: MPI.Comm, arrays: MeshArrays, dim: int) -> tuple[Mesh, MeshTags, MeshTags]:
    """Mesh, cell tags and facet tags from the ranks' parts, partitioned by DOLFINx.

    Cells of tag 0 and facets that are not listed stay untagged. Tags carry their names (see `name_tags`). Collective.
    """
    domain = compat.create_mesh(comm, arrays.points, arrays.cells, dim)
    tagged = arrays.cell_values != 0
    cell_tags = compat.tags_from_nodes(domain, dim, arrays.cells[tagged], arrays.cell_values[tagged])
    facet_tags = compat.tags_from_nodes(domain, dim - 1, arrays.facets, arrays.facet_values)
    cell_tags.name, facet_tags.name = "cell_tags", "facet_tags"
    names = comm.bcast((arrays.cell_names or {}, arrays.facet_names or {}))
    return domain, name_tags(cell_tags, names[0]), name_tags(facet_tags, names[1])


def owned_cells(domain: Mesh) -> int:
    """Number of cells that this rank owns; they come before the ghosts."""
    return domain.topology.index_map(domain.topology.dim).size_local


def cell_corners(domain: Mesh) -> NDArray[np.float64]:
    """Corners of the cells that this rank owns: (m, D + 1, D) [m]."""
    return domain.geometry.x[compat.cell_nodes(domain)[: owned_cells(domain)], : domain.geometry.dim]


def cell_volumes(domain: Mesh) -> NDArray[np.float64]:
    """Volumes of the cells that this rank owns: (m,) [m^D]."""
    corners = cell_corners(domain)
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / math.factorial(domain.geometry.dim)


def require_tags_of(domain: Mesh, tags: MeshTags | None, dim: int) -> None:
    """Require that tags, where there are any, are those of the cells, or of the facets, of a mesh.

    Args:
        domain: mesh of DOLFINx.
        tags: tags of its entities of dimension `dim`, or None.
        dim: dimension of the mesh for cells, one less for facets.

    Raises:
        InputError: they are tags of other entities, or of another mesh. Raised on all ranks alike.
    """
    if tags is None:
        return
    kind = "cell" if dim == domain.topology.dim else "facet"
    if getattr(tags, "dim", None) != dim:
        given = f"tags of entities of dimension {tags.dim}" if hasattr(tags, "dim") else repr(tags)
        raise InputError(f"{kind}_tags is {given}, expected tags of {kind}s, of dimension {dim}")
    if not compat.are_tags_of(tags, domain):
        raise InputError(
            f"{kind}_tags is of another mesh, expected tags of the {kind}s of this one, as `soil_mesh` returns them"
        )


def tag_values(domain: Mesh, tags: MeshTags | None, dim: int) -> NDArray[np.int32]:
    """Tag of every entity of dimension `dim` on this rank, ghosts too, 0 where untagged; see `require_tags_of`."""
    require_tags_of(domain, tags, dim)
    index_map = domain.topology.index_map(dim)
    values = np.zeros(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    if tags is not None:
        values[tags.indices] = tags.values
    return values


def retagged(domain: Mesh, cell_tags: MeshTags, values: NDArray[np.int32]) -> MeshTags:
    """Tags with other values, one for every cell on this rank, ghosts too, and 0 where untagged; without names of the values."""
    tagged = np.flatnonzero(values).astype(np.int32)
    result = meshtags(domain, cell_tags.dim, tagged, values[tagged])
    result.name = cell_tags.name
    return result


def numbered_anew(domain: Mesh, tags: MeshTags, groups: Sequence[Sequence[int]]) -> MeshTags:
    """Tags by which a form reads the same, and is compiled once, whatever the numbers of the tags that it is made for.

    Args:
        domain: mesh of the tags.
        tags: tags of its cells or facets.
        groups: numbers of the tags of each group, none in two groups.

    Returns:
        Tags that are 1 in the first group, 2 in the second and so on; the rest is untagged.
    """
    values = np.zeros(len(tags.values), dtype=np.int32)
    for number, group in enumerate(groups, start=1):
        values[np.isin(tags.values, group)] = number
    there = values > 0
    return meshtags(domain, tags.dim, tags.indices[there], values[there])
