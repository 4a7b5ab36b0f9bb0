"""Points that are embedded in finite elements: each moves with the cell that contains it, by its shape functions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import basix
import numpy as np
from mpm_core.members import SAMPLES, samples_of
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.evaluate import cells_around, local_cells
from fenics_bridge.mesh.tagged import owned_cells
from fenics_bridge.structures.unknowns import Unknowns

TOLERANCE = 0.02
"""How far outside of the soil a point may be, in barycentric coordinates of the nearest cell: the corners of a line that the mesh
follows are known by rounded coordinates only"""


class Embedding:
    """The cells around some points, and the shape functions of their nodes there; the same on all ranks. Collective.

    Args:
        unknowns: displacements of the body's nodes.
        points: positions (n, D) [m], the same on all ranks.
        active: function that is 1 in cells that are there and 0 in others; None where all are.
        owners: what each point belongs to, for the message.

    Raises:
        InputError: a point is in no active cell. Raised on all ranks alike.
    """

    def __init__(self, unknowns: Unknowns, points: NDArray[np.float64], active: Any, owners: Sequence[str]) -> None:
        space, domain = unknowns.space, unknowns.space.mesh
        cells = _active_cells(domain, points, active)
        mine = _mine(domain, cells, points)
        weights = shape_functions(space, cells[mine], points[mine])
        dofs = unknowns.numbers[compat.cell_dofs(space)[cells[mine]]]
        found = domain.comm.allgather((mine, dofs, weights))
        order = np.concatenate([rows for rows, _, _ in found])
        lost = np.setdiff1d(np.arange(len(points)), order)
        if len(lost):
            where = ", ".join(f"{x:.6g}" for x in points[lost[0]])
            agree(
                domain.comm,
                f"{owners[lost[0]]}: the point ({where}) m is in no soil that is there, expected points in the soil",
            )
        back = np.argsort(order)
        self.dofs = np.concatenate([each for _, each, _ in found])[back]
        """Global numbers of the unknowns of each point's cell, by node and component, (n, k, D)"""
        self.weights = np.concatenate([each for _, _, each in found])[back]
        """Shape functions of these nodes at the point, (n, k)"""


def cell_sizes_along(domain: Any, lines: Sequence[NDArray[np.float64]]) -> list[float]:
    """Median length of the edges of the cells along each line (k, D) [m]; 0 where it is outside of the mesh. Collective.

    A line along edges of the mesh has the cells on both of its sides, on whichever rank they are.
    """
    if not lines:
        return []
    samples = np.concatenate([samples_of(line) for line in lines])
    rows, cells, _ = cells_around(domain, samples, TOLERANCE)
    first, second = np.triu_indices(domain.geometry.dim + 1, 1)
    sizes = []
    for number in range(len(lines)):
        found = cells[rows // SAMPLES == number]
        corners = domain.geometry.x[compat.cell_nodes(domain)[found], : domain.geometry.dim]
        edges = np.linalg.norm(corners[:, first] - corners[:, second], axis=2)
        every = np.concatenate(domain.comm.allgather(edges.ravel()))
        sizes.append(float(np.median(every)) if len(every) else 0.0)
    return sizes


def shape_functions(space: Any, cells: NDArray[np.int32], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shape functions (n, k) of a Lagrange space at points (n, D) in this rank's cells (n,)."""
    kind = basix.CellType.triangle if space.mesh.geometry.dim == 2 else basix.CellType.tetrahedron
    element = basix.create_element(
        basix.ElementFamily.P, kind, compat.degree_of(space), basix.LagrangeVariant.gll_warped
    )
    reference = _reference(space.mesh, cells, points)
    return element.tabulate(0, reference)[0].reshape(len(cells), element.dim)


def _reference(domain: Any, cells: NDArray[np.int32], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, D) in this rank's cells (n,), in the coordinates of the reference cell."""
    corners = domain.geometry.x[compat.cell_nodes(domain)[cells], : domain.geometry.dim]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    return np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])[:, :, 0]


def _active_cells(domain: Any, points: NDArray[np.float64], active: Any) -> NDArray[np.int32]:
    """This rank's active cell at each point; -1 where it has none."""
    there = np.ones(owned_cells(domain))
    if active is not None:
        there = active.x.array[compat.cell_dofs(active.function_space)[: len(there), 0]]
    cells = local_cells(domain, points, there, TOLERANCE)
    return np.where(there[cells] > 0, cells, -1).astype(np.int32) if len(there) else cells


def _mine(domain: Any, cells: NDArray[np.int32], points: NDArray[np.float64]) -> NDArray[np.integer]:
    """Points that lie deepest in a cell of this rank: another may have a cell from which they are a little outside."""
    here, depth = np.flatnonzero(cells >= 0), np.full(len(points), -np.inf)
    reference = _reference(domain, cells[here], points[here])
    depth[here] = np.minimum(reference.min(axis=1, initial=np.inf), 1 - reference.sum(axis=1))
    first = np.argmax(domain.comm.allgather(depth), axis=0)
    return here[first[here] == domain.comm.rank]
