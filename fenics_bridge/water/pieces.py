"""Pieces into which walls part the soil: water flows in each of them alone."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from fenics_bridge import compat
from fenics_bridge.errors import PARTED
from fenics_bridge.mesh.background import global_numbers
from fenics_bridge.mesh.tagged import owned_cells


def pieces_of(space: Any) -> NDArray[np.integer]:
    """A number, from 0 on, of the piece of the mesh in which each dof on this rank is, ghosts included: (m,). Collective.

    Only meshes that are parted along walls are looked at; others count as one piece.

    Args:
        space: scalar space on the mesh.
    """
    domain, index_map = space.mesh, space.dofmap.index_map
    numbers = global_numbers(index_map, index_map.size_local + index_map.num_ghosts)
    if not getattr(domain, PARTED, False):
        return np.zeros(len(numbers), dtype=np.int32)
    dofs = numbers[compat.cell_dofs(space)[: owned_cells(domain)]]
    every = np.concatenate(domain.comm.allgather(dofs))
    first, others = np.repeat(every[:, 0], every.shape[1]), every.ravel()
    graph = sparse.coo_matrix((np.ones(len(first)), (first, others)), (index_map.size_global,) * 2)
    return connected_components(graph, directed=False)[1][numbers]
