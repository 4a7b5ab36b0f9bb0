"""Which unknowns of a body of finite elements are the displacements of its nodes: of all, or of a part as beside pore pressures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.mesh.background import global_numbers


@dataclass(frozen=True)
class Unknowns:
    """The displacements of a body's nodes among the unknowns of its solution."""

    space: Any
    """Lagrange space of the displacement"""
    numbers: NDArray[np.integer]
    """Global numbers of the unknowns, by node on this rank, ghosts included, and component: (nodes, D)"""
    own: int
    """Number of this rank's own unknowns"""
    first: int
    """Global number of the first of them"""
    size: int
    """Number of all unknowns"""


def unknowns_of(solution: Any, displacement: Any = None, dofs: ArrayLike | None = None) -> Unknowns:
    """The displacements among the unknowns of a space.

    Args:
        solution: space of the solution.
        displacement: Lagrange space of the displacement, where the solution has other parts beside; None where it is this.
        dofs: dofs in the space of the solution for those of the displacement, ghosts included, as `collapse` returns them.
    """
    index_map, block = solution.dofmap.index_map, solution.dofmap.index_map_bs
    nodes = global_numbers(index_map, index_map.size_local + index_map.num_ghosts)
    numbers = (block * nodes[:, None] + np.arange(block)).ravel()
    if displacement is not None:
        numbers = numbers[np.asarray(dofs)]
    space = displacement or solution
    by_node = numbers.reshape(-1, space.mesh.geometry.dim)
    ranges = index_map.size_local * block, index_map.local_range[0] * block, index_map.size_global * block
    return Unknowns(space, by_node, *ranges)
