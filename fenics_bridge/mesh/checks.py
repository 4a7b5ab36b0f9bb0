"""Checks of mesh arrays before DOLFINx sees them: it ends with an obscure error, or not at all, on cells that fit no mesh."""

from __future__ import annotations

import numpy as np

from fenics_bridge.errors import InputError

NEAR = 1e-6
"""Of the length of a side: what is nearer to it lies on it"""


def check_cells_fit(cells, name):
    """Refuse cells that no mesh can have: a node twice in one, the same cell twice, more than two at one facet.

    cells: (m, D + 1) node numbers; name stands for the mesh in the message, which gives the first such cell.
    """
    nodes = np.sort(cells, axis=1)
    flat = (np.diff(nodes, axis=1) == 0).any(axis=1)
    if flat.any():
        raise InputError(f"{name}: cell {np.argmax(flat)} has a node twice")
    _, first, counts = np.unique(nodes, axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        raise InputError(f"{name}: cell {first[np.argmax(counts > 1)]} is there {counts.max()} times")
    facets = np.concatenate([np.delete(nodes, k, axis=1) for k in range(nodes.shape[1])])
    _, first, counts = np.unique(facets, axis=0, return_index=True, return_counts=True)
    if (counts > 2).any():
        cell = first[np.argmax(counts > 2)] % len(cells)
        raise InputError(f"{name}: cell {cell} has a facet that {counts.max()} cells share, expected at most 2")


def check_conforming(points, cells, name):
    """Refuse plane cells that do not meet node to node: with a node within the side of another cell, the mesh is torn there.

    points: (n, 2); cells: (m, 3). Each side of one cell alone is a boundary; no node of the boundary may lie on it between
    its ends, nearer than a millionth of its length. The message gives the first such place.
    """
    sides = np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1)
    alone, counts = np.unique(sides, axis=0, return_counts=True)
    alone = alone[counts == 1]
    nodes = np.unique(alone)
    nodes = nodes[np.argsort(points[nodes, 0], kind="stable")]
    places = points[nodes]
    start, along = points[alone[:, 0]], points[alone[:, 1]] - points[alone[:, 0]]
    length = np.maximum(np.linalg.norm(along, axis=1), 1e-300)
    low = np.minimum(start[:, 0], start[:, 0] + along[:, 0]) - NEAR * length
    first = np.searchsorted(places[:, 0], low)
    last = np.searchsorted(places[:, 0], low + np.abs(along[:, 0]) + 2 * NEAR * length, side="right")
    for k in range(len(alone)):
        offset = places[first[k] : last[k]] - start[k]
        position = offset @ along[k] / length[k] ** 2
        distance = np.abs(offset[:, 0] * along[k, 1] - offset[:, 1] * along[k, 0]) / length[k]
        inside = (distance < NEAR * length[k]) & (position > NEAR) & (position < 1 - NEAR)
        if inside.any():
            x, y = places[first[k] + np.argmax(inside)]
            raise InputError(
                f"{name}: the node at ({x:g}, {y:g}) lies within a side of another cell; cells must meet node to node, or the mesh is "
                "torn there"
            )
