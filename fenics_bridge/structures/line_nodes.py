"""Nodes of a mesh along a line that its edges follow, which a beam along this line shares with the soil."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.mesh.walls import EDGES, ON_LINE, distance_from, edges_on, is_along

INNER: dict[int, tuple[float, ...]] = {1: (), 2: (0.5,), 4: (0.5 - np.sqrt(3 / 28), 0.5, 0.5 + np.sqrt(3 / 28))}
"""Nodes within an edge by the degree of the elements, over its length: points of Gauss, Lobatto and Legendre"""

BESIDE = 0.05
"""Distance from a line up to which corners of cells are beside it, over the size of the cells"""
MANY = 0.7
"""Corners beside a line, over the number of cells along it, from which on the line goes along edges of the mesh"""


def shared_nodes(domain: Any, line: NDArray[np.float64], degree: int) -> NDArray[np.float64] | None:
    """Nodes of finite elements on a line of the mesh, in the line's order; None where the mesh does not follow it. Collective.

    A beam that has other nodes than the soil beside it moves with some of these only: its nodes and those of the soil press against
    one another in turns, its shear force jumps from segment to segment, and soil flows between nodes that are far apart.

    Args:
        domain: mesh of triangles; others are never followed.
        line: its corners [m], (k, 2).
        degree: of the elements, which have nodes within their edges from 2 on.

    Returns:
        Positions [m], (n, 2), among them the corners of the line as they are given.
    """
    comm = domain.comm
    if domain.geometry.dim != 2 or line.shape[1] != 2:
        return None
    corners = domain.geometry.x[compat.cell_nodes(domain), :2]
    if not all(comm.allgather(is_along(corners, line))):
        return None
    rows, edges = np.nonzero(edges_on(corners, [line]))
    ends = corners[rows[:, None], np.array(EDGES)[edges]]  # (m, 2, 2)
    ends = np.concatenate(comm.allgather(ends))
    parts = [line[:1]]
    for start, end in zip(line, line[1:]):
        places = _places(ends, start, end)
        if places is None:
            return None
        inner = INNER[degree]
        places = np.append((places[:-1, None] + np.outer(np.diff(places), [0.0, *inner])).ravel(), places[-1])
        parts.append(start + places[1:, None] * (end - start))
    return np.concatenate(parts)


def runs_beside(domain: Any, line: NDArray[np.float64], size: float) -> bool:
    """Whether a line goes along edges of a mesh without following them, as two polygons of one circle do. Collective.

    The corners of cells that the line cuts as it comes are hardly ever that near to it.

    Args:
        domain: mesh of triangles; of others it is false.
        line: its corners [m], (k, 2).
        size: of the cells along it [m].
    """
    if domain.geometry.dim != 2 or line.shape[1] != 2 or size == 0:
        return False
    points = domain.geometry.x[:, :2]
    near = points[distance_from(points, line) <= BESIDE * size]
    found = np.round(np.concatenate(domain.comm.allgather(near)) / (1e-3 * size))
    length = float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
    return bool(len(np.unique(found, axis=0)) > MANY * length / size)


def _places(
    ends: NDArray[np.float64], start: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Where the ends (m, 2, 2) of edges divide the straight line between two points, from 0 to 1; None where edges do not cover it."""
    along = end - start
    square = float(along @ along)
    part = (ends - start) @ along / square
    off = np.linalg.norm(ends - start - part[:, :, None] * along, axis=2)
    size = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    near = ON_LINE * size / np.sqrt(square)
    on = (
        (off <= ON_LINE * size[:, None]).all(axis=1)
        & (part >= -near[:, None]).all(axis=1)
        & (part <= 1 + near[:, None]).all(axis=1)
    )
    if not on.any():
        return None
    part, near = part[on], float(near[on].min())
    places = np.sort(part.ravel())
    places = places[np.concatenate([[True], np.diff(places) > near])]
    # Each edge once, whichever cells and ranks have it
    lengths = np.unique(np.round(np.sort(part, axis=1) / near), axis=0)
    covered = abs(places[0]) <= near and abs(places[-1] - 1) <= near and len(lengths) >= len(places) - 1
    if not covered:
        return None
    places[[0, -1]] = 0.0, 1.0
    return places
