"""Cells beside lines, such as walls, with tags of their own: soil whose friction and adhesion on a wall are less than its strength."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx import mesh
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, require_mesh
from fenics_bridge.mesh.names import name_tags, names_of
from fenics_bridge.mesh.tagged import require_tags_of, retagged, tag_values
from fenics_bridge.mesh.walls import ON_LINE, distance_from, lines_of, require_along
from fenics_bridge.types import MeshTags


def tags_beside(domain: mesh.Mesh, cell_tags: MeshTags, wall: Any) -> tuple[MeshTags, dict[int, int]]:
    """Give the cells that touch a line, on both of its sides, tags of their own. Collective.

    Soil slides along a wall where the friction and the adhesion between both are exceeded, usually two thirds of the strength of the
    soil. Where the cells beside the wall have a law of this strength, they yield first, and shear like an interface that is one cell
    thick. The names of the soils stand for these cells too, and no longer for a tag that has lost all of its cells to a new one. Cells
    below the end of a line are none of them.

    Args:
        domain: mesh of triangles, which follows the line as far as this is in it.
        cell_tags: tags of its cells.
        wall: line (k, 2) [m], or a structural member.

    Returns:
        The new cell tags, and for each new tag the one that its cells had before.

    Raises:
        InputError: no line, tags of another mesh, another dimension, or a line that the mesh does not follow. Raised on all ranks alike.

    Example:
        >>> tags, before = bridge.tags_beside(domain, cell_tags, wall)
        >>> laws |= {new: bridge.reduced_strength(laws[old], 3 / 2) for new, old in before.items()}
    """
    require_mesh(domain)
    dim, comm = domain.topology.dim, domain.comm
    require_tags_of(domain, cell_tags, dim)
    agree(comm, None if dim == 2 else f"domain has {dim} dimensions, expected triangles")
    line = next(iter(lines_of(comm, [wall]).values()))
    corners = domain.geometry.x[compat.cell_nodes(domain), :dim]
    require_along(comm, corners, {"wall": line})
    tags = tag_values(domain, cell_tags, dim)
    rows = np.flatnonzero(_beside(corners, line) & (tags > 0))
    old = sorted(set().union(*comm.allgather(set(tags[rows].tolist()))))
    first = 1 + max(comm.allgather(int(cell_tags.values.max(initial=0))))
    tags[rows] = first + np.searchsorted(old, tags[rows])
    before = dict(zip(range(first, first + len(old)), old))
    there = set().union(*comm.allgather(set(tags.tolist())))
    names = {  # without tags of which all cells are beside the line
        name: tuple(
            n for n in (*numbers, *(new for new, one in before.items() if one in numbers)) if n in there or n not in old
        )
        for name, numbers in names_of(cell_tags).items()
    }
    return name_tags(retagged(domain, cell_tags, tags), names), before


def _beside(corners: NDArray[np.float64], line: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which cells, with the corners (m, 3, 2) [m], touch a line and lie beside it, not beyond its ends: (m,)."""
    size = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    centre, beside = corners.mean(axis=1), np.zeros(len(corners), dtype=bool)
    ring, last = np.array_equal(line[0], line[-1]), len(line) - 2
    for k, (start, end) in enumerate(zip(line, line[1:])):
        apart = np.min([distance_from(corners[:, j], line[k : k + 2]) for j in range(3)], axis=0)
        along = end - start
        part = (centre - start) @ along / (along @ along)
        # Around a corner of the line there are cells that lie beyond the ends of both of its sides, and touch the line all the same.
        inside = ((part >= 0) | ring | (k > 0)) & ((part <= 1) | ring | (k < last))
        beside |= (apart <= ON_LINE * size) & inside
    return beside
