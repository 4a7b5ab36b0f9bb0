"""Meshes with tags from arrays; all meshes of the bridge are made here."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fenics_bridge import compat
from fenics_bridge.mesh.names import name_tags


class MeshArrays(NamedTuple):
    """A rank's part of a mesh of linear simplices of dimension D.

    points: (n, D) float64 [m]; nodes are numbered through in order of rank
    cells: (m, D + 1) int64 by those numbers; cell_values: (m,) int32 tags, 0 for none
    facets: (k, D) int64 by those numbers; facet_values: (k,) int32 tags
    cell_names, facet_names: {name: tags}, those of rank 0 hold
    """

    points: np.ndarray
    cells: np.ndarray
    cell_values: np.ndarray
    facets: np.ndarray
    facet_values: np.ndarray
    cell_names: dict | None = None
    facet_names: dict | None = None


def empty_arrays(dim):
    """The part of a rank without nodes and cells."""
    return MeshArrays(
        np.empty((0, dim)),
        np.empty((0, dim + 1), np.int64),
        np.empty(0, np.int32),
        np.empty((0, dim), np.int64),
        np.empty(0, np.int32),
    )


def distributed_mesh(comm, arrays, dim):
    """(domain, cell_tags, facet_tags) from the ranks' parts, partitioned by DOLFINx.

    Cells of tag 0 and facets that are not listed stay untagged. Tags carry their names (see `name_tags`). Collective.
    """
    domain = compat.create_mesh(comm, arrays.points, arrays.cells, dim)
    tagged = arrays.cell_values != 0
    cell_tags = compat.tags_from_nodes(domain, dim, arrays.cells[tagged], arrays.cell_values[tagged])
    facet_tags = compat.tags_from_nodes(domain, dim - 1, arrays.facets, arrays.facet_values)
    cell_tags.name, facet_tags.name = "cell_tags", "facet_tags"
    names = comm.bcast((arrays.cell_names or {}, arrays.facet_names or {}))
    return domain, name_tags(cell_tags, names[0]), name_tags(facet_tags, names[1])


def owned_cells(domain):
    """Number of cells that this rank owns; they come before the ghosts."""
    return domain.topology.index_map(domain.topology.dim).size_local


def cell_corners(domain):
    """Corners of the cells that this rank owns: (m, D + 1, D) [m]."""
    return domain.geometry.x[compat.cell_nodes(domain)[: owned_cells(domain)], : domain.geometry.dim]


def cell_volumes(domain):
    """Volumes of the cells that this rank owns: (m,) [m^D]."""
    corners = cell_corners(domain)
    return np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / math.factorial(domain.geometry.dim)


def tag_values(domain, tags, dim):
    """Tag of every entity of dimension `dim` on this rank, ghosts too, 0 where untagged: int32."""
    index_map = domain.topology.index_map(dim)
    values = np.zeros(index_map.size_local + index_map.num_ghosts, dtype=np.int32)
    if tags is not None:
        values[tags.indices] = tags.values
    return values
