"""The background mesh of a box, in two and three dimensions."""

from __future__ import annotations

from itertools import permutations, product
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.checks import real_numbers
from mpm_core.collective import on_first_rank
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.errors import InputError
from fenics_bridge.mesh.tagged import MeshArrays, distributed_mesh, empty_arrays
from fenics_bridge.types import MeshTags

BODY = 1
"""Cell tag of the body in a box mesh."""


def box_mesh(
    comm: MPI.Comm,
    lengths: ArrayLike,
    counts: ArrayLike,
    diagonals: str = "alternating",
    body: tuple[ArrayLike, ArrayLike] | None = None,
) -> tuple[Mesh, MeshTags, MeshTags]:
    """Background mesh of a box with its lower corner at the origin: squares or cubes, each divided into D! simplices (Kuhn 1960).

    Collective.

    Args:
        comm: the ranks that share the mesh.
        lengths: lengths of the box along the axes [m], shape (D,) with D = 2 or 3.
        counts: number of squares or cubes along each axis, shape (D,).
        diagonals: "alternating" from square to square, or "one-way".
        body: low and high corner of a box [m]; cells with their centre in there have the tag BODY. By default all cells have it.

    Returns:
        The mesh, the tags of its cells, and the tags of its facets: 2 axis + 1 on the low side along an axis (counted from 0),
        and 2 axis + 2 on the high side.

    Raises:
        InputError: lengths or counts are not positive or not as many, or diagonals has another value. Raised on all ranks alike.
    """
    dim = len(np.atleast_1d(lengths))
    result = on_first_rank(comm, lambda: _arrays(lengths, counts, diagonals, body))
    return distributed_mesh(comm, result if result is not None else empty_arrays(dim), dim)


def _arrays(lengths: Any, counts: Any, diagonals: str, body: Any) -> Any:
    lengths, counts = real_numbers("lengths", lengths), np.asarray(counts)
    dim = len(lengths)
    if dim not in (2, 3) or not (np.isfinite(lengths).all() and (lengths > 0).all()):
        raise InputError(f"lengths is {lengths.tolist()} m, expected two or three positive lengths")
    if counts.shape != lengths.shape or not np.issubdtype(counts.dtype, np.integer) or (counts < 1).any():
        raise InputError(f"counts is {counts.tolist()}, expected {dim} whole numbers from 1 on")
    if diagonals not in ("alternating", "one-way"):
        raise InputError(f"diagonals is {diagonals!r}, expected 'alternating' or 'one-way'")
    grid = np.indices(counts + 1).reshape(dim, -1).T
    points, cells = grid * (lengths / counts), _simplices(counts, diagonals == "alternating")
    centres = points[cells].mean(axis=1)
    low, high = real_numbers("body", [[-np.inf] * dim, [np.inf] * dim] if body is None else body)
    inside = ((centres > low) & (centres < high)).all(axis=1)
    return MeshArrays(points, cells, np.where(inside, BODY, 0).astype(np.int32), *_sides(grid, cells, counts))


def _simplices(counts: Any, alternating: bool) -> NDArray[np.integer]:
    """Each cube is cut along its diagonal from a corner to the opposite one; (m, D + 1) numbers of nodes."""
    dim = len(counts)
    cubes = np.indices(counts).reshape(dim, -1).T
    turned = cubes % 2 if alternating else np.zeros_like(cubes)
    cells = []
    for order in permutations(range(dim)):
        corner = cubes + turned
        nodes = [corner.copy()]
        for axis in order:
            corner[:, axis] += 1 - 2 * turned[:, axis]
            nodes.append(corner.copy())
        cells.append(np.stack([np.ravel_multi_index(tuple(n.T), counts + 1) for n in nodes], axis=1))
    return np.stack(cells, axis=1).reshape(-1, dim + 1).astype(np.int64)


def _sides(grid: Any, cells: NDArray[np.integer], counts: Any) -> tuple[Any, ...]:
    """Facets on the sides of the box, (k, D) nodes, and their tags."""
    facets, tags = [], []
    for vertex, axis, end in product(range(cells.shape[1]), range(len(counts)), (0, 1)):
        nodes = np.delete(cells, vertex, axis=1)
        on_side = (grid[nodes][:, :, axis] == end * counts[axis]).all(axis=1)
        facets.append(nodes[on_side])
        tags.append(np.full(on_side.sum(), 2 * axis + 1 + end, np.int32))
    return np.concatenate(facets), np.concatenate(tags)
