"""Mesh of the soil body."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from dolfinx import la
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import PARTED, agree, require_mesh
from fenics_bridge.mesh.names import name_tags, names_of, tag_numbers
from fenics_bridge.mesh.tagged import MeshArrays, distributed_mesh, owned_cells, require_tags_of, tag_values
from fenics_bridge.mesh.walls import lines_of, parted, require_along, warn_of_absent
from fenics_bridge.types import MeshTags
from mpm_core.mesh import Tag


def soil_mesh(
    domain: Mesh,
    cell_tags: MeshTags,
    facet_tags: MeshTags | None = None,
    tag: Tag = 1,
    walls: Iterable[Any] = (),
) -> tuple[Mesh, MeshTags, MeshTags]:
    """Mesh of the cells of one tag or several, with a partition of its own, so that the work is distributed over all ranks.

    Soils of several tags are one body: they share the nodes of their borders. (DOLFINx's `create_submesh` keeps the
    partition and is not reliable on several ranks before 0.8.) Collective.

    Args:
        domain: background mesh of DOLFINx.
        cell_tags: tags of its cells.
        facet_tags: tags of its facets; None where none is tagged.
        tag: number or name of a soil, or a sequence of them, e.g. ["clay", "fill"].
        walls: lines (k, 2) [m], or structural members along them, in a list or by name, at which the soil on both sides is parted: the water of a
            `water.Seepage`, for which alone such a mesh is, does not flow through them. The mesh, of triangles, must follow them.

    Returns:
        The mesh of the soil, the tags of its cells and those of its facets, which are the tags that they have in the background
        mesh, with their names.

    Raises:
        InputError: no cell has a tag, tags of other entities or of another mesh, or a wall that the mesh does not follow. Raised on all ranks alike.
    """
    require_mesh(domain)
    dim = domain.topology.dim
    require_tags_of(domain, cell_tags, dim)
    require_tags_of(domain, facet_tags, dim - 1)
    numbers = tag_numbers(domain.comm, cell_tags, tag, "tag", "cell")
    values = tag_values(domain, cell_tags, dim)[: owned_cells(domain)]
    cells = np.flatnonzero(np.isin(values, numbers))
    nodes = compat.cell_nodes(domain)[cells]
    number, points = _numbered_nodes(domain, nodes)
    of_cells, lines = number[nodes], lines_of(domain.comm, walls)
    if lines:
        agree(
            domain.comm,
            None if dim == 2 else "walls is given in three dimensions, expected none: they are for triangles",
        )
        corners = domain.geometry.x[nodes, :dim]
        require_along(domain.comm, corners, lines)
        warn_of_absent(domain.comm, corners, lines)
        of_cells, points = _parted(domain.comm, of_cells, corners, list(lines.values()), points)
    arrays = MeshArrays(points, of_cells, values[cells], *_facets_of(domain, cells, of_cells, facet_tags))
    body, body_cells, body_facets = distributed_mesh(domain.comm, arrays, dim)
    setattr(body, PARTED, bool(lines) or getattr(domain, PARTED, False))
    for there, here in ((cell_tags, body_cells), (facet_tags, body_facets)):
        name_tags(here, names_of(there))
    return body, body_cells, body_facets


def _numbered_nodes(domain: Mesh, nodes: NDArray[np.integer]) -> tuple[Any, ...]:
    """Numbers without gaps, over all ranks, of the nodes in use, and this rank's part of their coordinates.

    Args:
        domain: background mesh of DOLFINx.
        nodes: local nodes in use.

    Returns:
        The number of each local node (-1: not in use), and the coordinates of the nodes that this rank owns, shape (n, D) [m].
    """
    index_map = domain.geometry.index_map()
    n_owned = index_map.size_local
    used = la.vector(index_map, 1)
    used.array[:] = 0.0
    used.array[nodes.ravel()] = 1.0
    compat.add_shared(used)
    mine = np.flatnonzero(used.array[:n_owned] > 0)
    first = domain.comm.scan(len(mine)) - len(mine)
    used.array[:n_owned] = -1.0
    used.array[mine] = first + np.arange(len(mine))
    compat.forward(used)
    points = domain.geometry.x[mine, : domain.topology.dim]
    return np.rint(used.array).astype(np.int64), points


def _parted(comm: Any, cells: Any, corners: Any, lines: Any, points: Any) -> tuple[Any, Any]:
    """Nodes of this rank's cells, doubled along lines, and its part of the coordinates: the last rank has those of the copies."""
    counts = comm.allgather(len(points))
    first = sum(counts[: comm.rank])
    cells, twins = parted(comm, cells, corners, lines, sum(counts))
    here = (twins >= first) & (twins < first + len(points))
    copies = np.zeros((len(twins), points.shape[1]))
    copies[here] = points[twins[here] - first]
    copies = comm.allreduce(copies)
    return cells, np.concatenate([points, copies]) if comm.rank == comm.size - 1 else points


def _facets_of(
    domain: Mesh, cells: NDArray[np.integer], numbers: NDArray[np.int64], facet_tags: MeshTags
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Nodes and tags of the tagged facets of given cells, whose nodes have these numbers (m, D + 1); two ranks may list a facet."""
    dim = domain.topology.dim
    if facet_tags is None:
        return np.empty((0, dim), np.int64), np.empty(0, np.int32)
    domain.topology.create_connectivity(dim, dim - 1)
    facets = domain.topology.connectivity(dim, dim - 1).array.reshape(-1, dim + 1)[cells]
    rows, opposite = np.nonzero(np.isin(facets, facet_tags.indices))
    others = np.array([np.delete(np.arange(dim + 1), k) for k in range(dim + 1)])  # facet k is opposite to node k
    nodes = np.sort(numbers[rows[:, None], others[opposite]], axis=1)
    at = np.searchsorted(facet_tags.indices, facets[rows, opposite])
    _, once = np.unique(nodes, axis=0, return_index=True)
    return nodes[once], np.array(facet_tags.values[at[once]], dtype=np.int32)
