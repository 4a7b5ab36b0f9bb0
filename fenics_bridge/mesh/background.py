"""A DOLFINx mesh as the arrays that the particle core takes."""

from __future__ import annotations

import numpy as np

from fenics_bridge import compat
from fenics_bridge.mesh.names import names_of
from fenics_bridge.mesh.tagged import owned_cells, tag_values


def background_arrays(domain, cell_tags=None, facet_tags=None):
    """This rank's part of a mesh as NumPy arrays: owned cells first, then ghosts; owned nodes first, then ghosts.

    Returns a dictionary with the arguments of `mpm_core.Mesh`:
    points (n, D) [m], cells (m, D + 1) int32 local nodes, cell_tags (m,) int32, 0 where untagged,
    facets (k, D) int32 local nodes of the tagged facets, facet_tags (k,) int32,
    global_nodes (n,) int64, global_cells (m,) int64, cell_owners (m,) int32 ranks.
    Cells are numbered as where the mesh was made (see `original_cells`), so that what is numbered by cells, such as
    particles, does not depend on the partition.
    """
    dim = domain.topology.dim
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


def background_mesh(domain, cell_tags=None, facet_tags=None):
    """`mpm_core.Mesh` of a DOLFINx mesh with its tags, their names, and its partition. Collective."""
    import mpm_core as mpm

    names = {"cell_names": names_of(cell_tags), "facet_names": names_of(facet_tags)}
    mesh = mpm.Mesh(**background_arrays(domain, cell_tags, facet_tags), **names, comm=domain.comm)
    mesh.domain = domain  # type: ignore[attr-defined]  # it owns the communicator
    return mesh


def original_cells(domain):
    """Number that each owned cell had where the mesh was made (DOLFINx renumbers them): (m,) int64."""
    return np.array(domain.topology.original_cell_index[: owned_cells(domain)], dtype=np.int64)


def global_numbers(index_map, count):
    """Global numbers of the first `count` local indices: int64."""
    return np.asarray(index_map.local_to_global(np.arange(count, dtype=np.int32)), dtype=np.int64)
