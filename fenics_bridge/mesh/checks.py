"""Checks of mesh arrays before DOLFINx sees them: it ends with an obscure error, or not at all, on cells that fit no mesh."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenics_bridge.errors import InputError

NEAR = 1e-6
"""Tolerance as a fraction of the size of a side or face: points nearer than this lie on it"""


def check_cells_fit(cells: NDArray[np.integer], name: str) -> None:
    """Refuse cells that no mesh can have: a node twice in one, the same cell twice, more than two at one facet.

    Args:
        cells: node numbers of the cells, shape (m, D + 1).
        name: name of the mesh in the message, which gives the first such cell.

    Raises:
        InputError: there is such a cell.
    """
    nodes = np.sort(cells, axis=1)
    flat = (np.diff(nodes, axis=1) == 0).any(axis=1)
    if flat.any():
        raise InputError(f"{name}: cell {np.argmax(flat)} has a node twice")
    first, counts = _distinct(nodes)
    if (counts > 1).any():
        raise InputError(f"{name}: cell {first[np.argmax(counts > 1)]} is listed {counts.max()} times")
    facets = np.concatenate([np.delete(nodes, k, axis=1) for k in range(nodes.shape[1])])
    first, counts = _distinct(facets)
    if (counts > 2).any():
        cell = first[np.argmax(counts > 2)] % len(cells)
        raise InputError(f"{name}: cell {cell} has a facet that {counts.max()} cells share, expected at most 2")


def check_conforming(points: NDArray[np.float64], cells: NDArray[np.integer], name: str) -> None:
    """Refuse cells that do not meet node to node: the mesh is torn where a node lies within a side or face of another cell.

    Each facet of one cell alone is a boundary. No node of the boundary may lie on such a facet away from its corners, nearer
    than a millionth of its size, nor may two such facets overlap, as two halves of a square that are cut along different
    diagonals do. Nor may a node of the boundary lie within a cell, as where two soils fill the same place.

    Args:
        points: coordinates of the nodes [m], shape (n, D).
        cells: node numbers of the cells, shape (m, D + 1).
        name: name of the mesh in the message, which gives the first such place.

    Raises:
        InputError: there is such a place.
    """
    facets = _boundary_facets(cells)
    nodes = np.unique(facets)
    on = _point_in_cell(points[nodes], points, cells)
    if on is not None:
        raise InputError(
            f"{name}: the node at {_place(points[nodes[on]])} lies within a cell; two parts of the mesh fill the same place there: "
            "in gmsh cut surfaces or volumes that overlap by Coherence or BooleanFragments, and give each piece to one soil"
        )
    on = _point_on_facet(points[nodes], nodes, points, facets)
    kind = "a side" if cells.shape[1] == 3 else "a face"
    if on is not None:
        raise InputError(
            f"{name}: the node at {_place(points[nodes[on]])} lies within {kind} of another cell; cells must meet node to node, "
            "otherwise the mesh has a gap there"
        )
    centres = points[facets].mean(axis=1)
    on = _point_on_facet(centres, None, points, facets)
    if on is not None:
        raise InputError(
            f"{name}: {kind} of a cell overlaps that of another at {_place(centres[on])}; cells must meet node to node, "
            "otherwise the mesh has a gap there"
        )


def _place(point: Any) -> str:
    return "(" + ", ".join(f"{x:g}" for x in point) + ")"


def _boundary_facets(cells: NDArray[np.integer]) -> NDArray[np.integer]:
    """Facets of one cell alone, as rows of nodes in ascending order: (k, D)."""
    facets = np.sort(np.concatenate([np.delete(cells, k, axis=1) for k in range(cells.shape[1])]), axis=1)
    first, counts = _distinct(facets)
    return facets[first[counts == 1]]


def _distinct(rows: NDArray[np.integer]) -> tuple[Any, ...]:
    """Position of the first of each distinct row, in ascending order of the rows, and the number of equal rows."""
    order = np.lexsort(rows.T[::-1])
    starts = np.ones(len(rows), dtype=bool)
    starts[1:] = (rows[order[1:]] != rows[order[:-1]]).any(axis=1)
    starts = np.flatnonzero(starts)
    return order[starts], np.diff(np.append(starts, len(rows)))


def _point_on_facet(
    places: NDArray[np.float64],
    nodes: NDArray[np.integer] | None,
    points: NDArray[np.float64],
    facets: NDArray[np.integer],
) -> int | None:
    """Row of the first of some places that lies on a facet; None if none does.

    Args:
        places: positions [m], shape (n, D).
        nodes: their nodes, shape (n,), which may lie on the facets that they are corners of; None for centres of the facets, of
            which each may lie on its own.
        points: coordinates of the nodes of the mesh [m].
        facets: nodes of the facets, shape (k, D).
    """
    corners = points[facets]
    centres = corners.mean(axis=1)
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    first = len(places)
    for facet, place in _near_pairs(centres, size, places):
        near = np.linalg.norm(places[place] - centres[facet], axis=1) < size[facet]
        facet, place = facet[near], place[near]
        own = (facets[facet] == nodes[place, None]).any(axis=1) if nodes is not None else facet == place
        facet, place = facet[~own], place[~own]
        on = _lies_on(corners[facet], size[facet], places[place])
        first = min(first, place[on].min(initial=first))
    return first if first < len(places) else None


def _lies_on(corners: NDArray[np.float64], size: NDArray[np.float64], places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each place lies on the side or triangle beside it; corners: (k, D, D), size: (k,), places: (k, D)."""
    edges, offset = corners[:, 1:] - corners[:, :1], places - corners[:, 0]
    gram = edges @ edges.transpose(0, 2, 1)
    flat = np.linalg.det(gram) <= NEAR**2 * size ** (2 * gram.shape[1])  # of no length or area
    gram[flat] = np.eye(gram.shape[1])
    weights = np.linalg.solve(gram, (edges @ offset[:, :, None]))[:, :, 0]
    distance = np.linalg.norm(offset - (weights[:, :, None] * edges).sum(axis=1), axis=1)
    inside = (weights > -NEAR).all(axis=1) & (weights.sum(axis=1) < 1 + NEAR)
    return ~flat & inside & (distance < NEAR * size)


def _point_in_cell(places: NDArray[np.float64], points: NDArray[np.float64], cells: NDArray[np.integer]) -> int | None:
    """Row of the first of some places (n, D) within a cell, away from its sides or faces; None if none is."""
    corners = points[cells]
    centres, edges = corners.mean(axis=1), corners[:, 1:] - corners[:, :1]
    size = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    first = len(places)
    for cell, place in _near_pairs(centres, size, places):
        near = np.linalg.norm(places[place] - centres[cell], axis=1) < size[cell]
        cell, place = cell[near], place[near]
        offset = places[place] - corners[cell, 0]
        flat = abs(np.linalg.det(edges[cell])) <= NEAR * size[cell] ** edges.shape[1]  # of no area or volume
        sides = np.where(flat[:, None, None], np.eye(edges.shape[1]), edges[cell])
        weights = np.linalg.solve(sides.transpose(0, 2, 1), offset[:, :, None])[:, :, 0]
        inside = ~flat & (weights > NEAR).all(axis=1) & (weights.sum(axis=1) < 1 - NEAR)
        first = min(first, place[inside].min(initial=first))
    return first if first < len(places) else None


def _near_pairs(centres: NDArray[np.float64], size: float, places: NDArray[np.float64]) -> Iterator[Any]:
    """Pairs of numbers (facets, places) that hold all places within `size` of the centre of a facet, in portions."""
    level = np.ceil(np.log2(np.maximum(size, 1e-300)))
    for each in np.unique(level):
        chosen = np.flatnonzero(level == each)
        width, low = 2.0**each, np.minimum(places.min(axis=0), centres.min(axis=0))
        boxes = np.floor((places - low) / width).astype(np.int64) + 1
        strides = np.concatenate([[1], np.cumprod(boxes.max(axis=0)[:-1] + 2)])
        keys = boxes @ strides
        order = np.argsort(keys, kind="stable")
        home = np.minimum(np.floor((centres[chosen] - low) / width).astype(np.int64) + 1, boxes.max(axis=0))
        for shift in itertools.product((-1, 0, 1), repeat=places.shape[1]):
            key = (home + shift) @ strides
            begin, end = np.searchsorted(keys[order], key), np.searchsorted(keys[order], key, side="right")
            count = end - begin
            within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            yield np.repeat(chosen, count), order[np.repeat(begin, count) + within]
