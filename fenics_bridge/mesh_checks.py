"""Checks of mesh arrays before DOLFINx sees them: it ends with an obscure error, or not at all, on cells that fit no mesh."""

from __future__ import annotations

import numpy as np

from fenics_bridge.errors import InputError


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
