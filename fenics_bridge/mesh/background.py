"""A DOLFINx mesh as the arrays that the particle core takes."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.errors import require_mesh
from fenics_bridge.mesh.names import names_of
from fenics_bridge.mesh.tagged import owned_cells, require_tags_of, tag_values
from fenics_bridge.types import MeshTags


def background_arrays(
    domain: Mesh, cell_tags: MeshTags | None = None, facet_tags: MeshTags | None = None
) -> dict[str, NDArray]:
    """This rank's part of a mesh as NumPy arrays: owned cells first, then ghosts; owned nodes first, then ghosts.

    Cells are numbered as where the mesh was made (see `original_cells`), so that what is numbered by cells, such as
    particles, does not depend on the partition.

    Args:
        domain: mesh of triangles or tetrahedra.
        cell_tags: tags of its cells; None where all are untagged.
        facet_tags: tags of its facets; None where none is tagged.

    Returns:
        The arguments of `mpm_core.Mesh` by name: points, shape (n, D) [m]; cells, shape (m, D + 1), int32 local nodes; cell_tags,
        shape (m,), int32, 0 where untagged; facets, shape (k, D), int32 local nodes of the tagged facets; facet_tags, shape (k,),
        int32; global_nodes, shape (n,), int64; global_cells, shape (m,), int64; cell_owners, shape (m,), int32 ranks.

    Raises:
        InputError: tags of other entities, or of another mesh. Raised on all ranks alike.
    """
    require_mesh(domain)
    dim = domain.topology.dim
    require_tags_of(domain, facet_tags, dim - 1)
    nodes = domain.geometry.index_map()
    n_nodes = nodes.size_local + nodes.num_ghosts
    cells = domain.topology.index_map(dim)
    n_cells = cells.size_local + cells.num_ghosts
    tagged = np.empty(0, np.int32) if facet_tags is None else facet_tags.indices
    owners = np.concatenate([np.full(cells.size_local, domain.comm.rank), np.asarray(cells.owners)])
    return {
        "points": np.ascontiguousarray(domain.geometry.x[:n_nodes, :dim]),
        "cells": np.ascontiguousarray(compat.cell_nodes(domain), dtype=np.int32),
        "cell_tags": tag_values(domain, cell_tags, dim),
        "facets": compat.facet_nodes(domain, tagged),
        "facet_tags": np.empty(0, np.int32) if facet_tags is None else np.array(facet_tags.values, dtype=np.int32),
        "global_nodes": global_numbers(nodes, n_nodes),
        "global_cells": np.array(domain.topology.original_cell_index[:n_cells], dtype=np.int64),
        "cell_owners": owners.astype(np.int32),
    }


def background_mesh(domain: Mesh, cell_tags: MeshTags | None = None, facet_tags: MeshTags | None = None) -> mpm.Mesh:
    """The background mesh of particles that a DOLFINx mesh stands for, with its tags, their names, and its partition. Collective.

    Args:
        domain: mesh of triangles or tetrahedra.
        cell_tags: tags of its cells, with the names that `name_tags` gave them; None where all are untagged.
        facet_tags: tags of its facets, likewise; None where none is tagged.

    Returns:
        The mesh; its attribute `domain` is the mesh of DOLFINx.

    Raises:
        InputError: a mesh that is parted along walls, or tags of other entities or of another mesh. Raised on all ranks alike.
    """
    require_mesh(domain, connected=True)
    arrays = background_arrays(domain, cell_tags, facet_tags)
    mesh = mpm.Mesh(**arrays, cell_names=names_of(cell_tags), facet_names=names_of(facet_tags), comm=domain.comm)
    mesh.domain = domain  # type: ignore[attr-defined]  # it owns the communicator
    return mesh


def original_cells(domain: Mesh) -> NDArray[np.int64]:
    """Number that each owned cell had where the mesh was made, since DOLFINx renumbers the cells.

    Args:
        domain: mesh of DOLFINx.

    Returns:
        Shape (m,), by the local number of the cell.
    """
    require_mesh(domain)
    return np.array(domain.topology.original_cell_index[: owned_cells(domain)], dtype=np.int64)


def global_numbers(index_map: Any, count: int) -> NDArray[np.int64]:
    """Global numbers of the first `count` local indices of an index map of DOLFINx, shape (count,)."""
    return np.asarray(index_map.local_to_global(np.arange(count, dtype=np.int32)), dtype=np.int64)
