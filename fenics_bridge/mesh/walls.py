"""Walls in a mesh of triangles: the facets that follow them, and nodes that are doubled there, so that a function may jump."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from fenics_bridge.errors import agree, real_numbers

ON_LINE = 0.02
"""Distance from a line up to which a node is on it, over the size of the cell: its corners are known by rounded coordinates only"""

EDGES = ((1, 2), (0, 2), (0, 1))
"""Corners of each edge of a triangle; the edge is opposite to the corner of its number"""


class Parting(NamedTuple):
    """Cells whose nodes are doubled along walls."""

    cells: NDArray[np.int64]
    """Numbers of the nodes of this rank's cells, (m, 3)"""
    twins: NDArray[np.int64]
    """Numbers of the nodes of which those after the last one are copies, in order, on all ranks: (k,)"""


def lines_of(comm: MPI.Comm, walls: Iterable[Any]) -> dict[str, NDArray[np.float64]]:
    """The lines (k, 2) [m] of walls by what messages call them; they are lines or structural members, perhaps by name. Collective.

    Raises:
        InputError: no list, or a line that is none of finite points, each other than the one before. Raised on all ranks alike.
    """
    alone = hasattr(walls, "points") or not isinstance(walls, Iterable)
    agree(comm, f"walls is {walls!r}, expected a list of lines or of members" if alone else None)
    given = walls.items() if isinstance(walls, Mapping) else ((f"the line {k}", wall) for k, wall in enumerate(walls))
    lines = {}
    for name, wall in given:
        line = real_numbers(comm, "walls", getattr(wall, "points", wall))
        good = line.ndim == 2 and len(line) > 1 and line.shape[1] == 2 and bool(np.isfinite(line).all())
        agree(
            comm,
            None if good else f"walls has {line.tolist()}, expected two or more finite points (x, y) [m] of each line",
        )
        twice = bool(np.any(np.all(np.diff(line, axis=0) == 0, axis=1)))
        agree(comm, f"walls has {line.tolist()}, expected points that differ from the one before" if twice else None)
        lines[f"walls: {name!r}" if isinstance(walls, Mapping) else f"walls: {name}"] = line
    return lines


def edges_on(corners: NDArray[np.float64], lines: Sequence[NDArray[np.float64]]) -> NDArray[np.bool_]:
    """Which edges of cells, with the corners (m, 3, 2) [m], lie on one of some lines: (m, 3), in the order of `EDGES`."""
    found = np.zeros((len(corners), 3), dtype=bool)
    for line in lines:
        for k, (a, b) in enumerate(EDGES):
            start, end = corners[:, a], corners[:, b]
            near = ON_LINE * np.linalg.norm(end - start, axis=1)
            on = np.ones(len(corners), dtype=bool)
            for part in (0.0, 0.5, 1.0):
                on &= distance_from(start + part * (end - start), line) <= near
            found[:, k] |= on
    return found


def require_along(comm: MPI.Comm, corners: NDArray[np.float64], lines: Mapping[str, NDArray[np.float64]]) -> None:
    """Require that the edges of a mesh follow lines, from one end to the other, as far as these are in its cells. Collective.

    Args:
        comm: the ranks.
        corners: corners of this rank's cells [m], (m, 3, 2).
        lines: the lines by what messages call them.

    Raises:
        InputError: a line goes through a cell, or ends between two nodes. Raised on all ranks alike.
    """
    here = next((f"{name} {text}" for name, line in lines.items() if (text := _beside(corners, line))), None)
    found = next(filter(None, comm.allgather(here)), None)
    agree(
        comm,
        found and f"{found}, expected a line of the mesh; in gmsh, fragment the ground with it and with its points",
    )


def is_along(corners: NDArray[np.float64], line: NDArray[np.float64]) -> bool:
    """Whether a line (k, 2) [m] goes through none of some cells with the corners (m, 3, 2) [m], and its corners are nodes of theirs."""
    return not _beside(corners, line)


def warn_of_absent(comm: MPI.Comm, corners: NDArray[np.float64], lines: Mapping[str, NDArray[np.float64]]) -> None:
    """Warn of walls that are nowhere in a mesh, whose cells have the corners (m, 3, 2) [m]. Collective."""
    there = np.any(comm.allgather([bool(edges_on(corners, [line]).any()) for line in lines.values()]), axis=0)
    absent = [name for name, found in zip(lines, there) if not found]
    if absent and comm.rank == 0:
        line = lines[absent[0]]
        warnings.warn(
            f"{absent[0]} from ({_written(line[0])}) to ({_written(line[-1])}) m is not in the soil, and holds no water back",
            RuntimeWarning,
            stacklevel=3,
        )


def parted(
    comm: MPI.Comm,
    cells: NDArray[np.int64],
    corners: NDArray[np.float64],
    lines: Sequence[NDArray[np.float64]],
    n_nodes: int,
) -> Parting:
    """Double the nodes of lines, so that cells on both sides no longer share them, but beyond an end in the soil. Collective.

    Cells around a node stay together where they meet at an edge that is not on a line. Each further group of them has a copy of the
    node, with a number from `n_nodes` on.

    Args:
        comm: the ranks.
        cells: numbers of the nodes of this rank's cells, (m, 3).
        corners: their coordinates [m], (m, 3, 2).
        lines: the lines, which the mesh follows.
        n_nodes: number of nodes on all ranks.
    """
    rows, edges = np.nonzero(edges_on(corners, lines))
    mine = np.sort(cells[rows[:, None], np.array(EDGES)[edges]], axis=1)
    walls = np.unique(np.concatenate(comm.allgather(mine)), axis=0)
    if not len(walls):
        return Parting(cells, np.empty(0, np.int64))
    beside = np.flatnonzero(np.isin(cells, walls).any(axis=1))
    everywhere = comm.allgather(cells[beside])
    around, rank = np.concatenate(everywhere), comm.rank
    at_wall, group = np.isin(around, walls), _groups(around, walls)
    # One row for each group at a node of a wall; the first of each node keeps its number.
    pairs = np.unique(np.stack([around[at_wall], group[at_wall]], axis=1), axis=0)
    further = np.concatenate([[False], pairs[1:, 0] == pairs[:-1, 0]])
    numbers = np.where(further, n_nodes - 1 + np.cumsum(further), pairs[:, 0])
    of_group = np.zeros(group.max() + 1, dtype=np.int64)
    of_group[pairs[:, 1]] = numbers
    start = sum(len(part) for part in everywhere[:rank])
    result, own = cells.copy(), slice(start, start + len(beside))
    result[beside] = np.where(at_wall[own], of_group[group[own]], cells[beside])
    return Parting(result, pairs[further, 0])


def _groups(cells: NDArray[np.int64], walls: NDArray[np.int64]) -> NDArray[np.integer]:
    """A number for each corner of cells (m, 3), the same for those at one node whose cells meet at edges that are on no wall."""
    m = len(cells)
    owner, edge = np.repeat(np.arange(m), 3), np.tile(np.arange(3), m)
    ends = np.array(EDGES)[edge]  # of each edge, the corners in its cell
    nodes = cells[owner[:, None], ends]
    order = np.argsort(nodes, axis=1)
    ends, nodes = np.take_along_axis(ends, order, axis=1), np.take_along_axis(nodes, order, axis=1)
    _, number, count = np.unique(nodes, axis=0, return_inverse=True, return_counts=True)
    number = number.ravel()
    wall = {tuple(pair) for pair in walls.tolist()}
    open_edge = (count[number] == 2) & np.array([tuple(pair) not in wall for pair in nodes.tolist()], dtype=bool)
    sort = np.argsort(number, kind="stable")
    pairs = sort[open_edge[sort]].reshape(-1, 2)  # both sides of each open edge
    corner = 3 * owner[:, None] + ends
    one, other = corner[pairs[:, 0]].ravel(), corner[pairs[:, 1]].ravel()
    graph = sparse.coo_matrix((np.ones(len(one)), (one, other)), (3 * m, 3 * m))
    return connected_components(graph, directed=False)[1].reshape(m, 3)


def _beside(corners: NDArray[np.float64], line: NDArray[np.float64]) -> str:
    """Where a line is not on edges of cells (m, 3, 2), in words; empty where it is."""
    if not len(corners):
        return ""
    for start, end in zip(line, line[1:]):
        inner = [_barycentric(corners, point) for point in (start, end)]
        rise = inner[1] - inner[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            at = (ON_LINE - inner[0]) / rise
        enters = np.where(rise > 0, at, np.where(inner[0] >= ON_LINE, -np.inf, np.inf)).max(axis=1)
        leaves = np.where(rise < 0, at, np.inf).min(axis=1)
        low, high = np.maximum(enters, 0.0), np.minimum(leaves, 1.0)
        through = np.flatnonzero(low < high)
        if len(through):
            middle = start + (low[through[0]] + high[through[0]]) / 2 * (end - start)
            return f"goes through a cell at ({_written(middle)}) m"
    for point in line:
        inside = _barycentric(corners, point).min(axis=1) >= -ON_LINE
        sizes = np.linalg.norm(corners[inside, 0] - corners[inside, 1], axis=1)
        apart = np.linalg.norm(corners[inside] - point, axis=2).min(axis=1)
        if np.any(inside) and np.all(apart > ON_LINE * sizes):
            return f"has the point ({_written(point)}) m between the nodes of the mesh"
    return ""


def _barycentric(corners: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Barycentric coordinates (m, 3) of a point (2,) in cells (m, 3, 2)."""
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    inner = np.linalg.solve(edges, (point - corners[:, 0])[:, :, None])[:, :, 0]
    return np.concatenate([1 - inner.sum(axis=1, keepdims=True), inner], axis=1)


def distance_from(points: NDArray[np.float64], line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of points (n, 2) from a line (k, 2) [m]: (n,)."""
    nearest = np.full(len(points), np.inf)
    for start, end in zip(line, line[1:]):
        along = end - start
        part = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
        nearest = np.minimum(nearest, np.linalg.norm(points - start - part[:, None] * along, axis=1))
    return nearest


def _written(point: NDArray[np.float64]) -> str:
    return ", ".join(f"{x:.6g}" for x in point)
