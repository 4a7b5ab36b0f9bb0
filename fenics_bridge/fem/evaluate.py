"""Values of DOLFINx functions at points, whichever ranks have the points and their cells."""

from __future__ import annotations

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpm_core.rows import exchange_rows
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, real_numbers, require_mesh
from fenics_bridge.mesh.tagged import owned_cells

_TOLERANCE = 1e-9
"""How far outside a cell, in barycentric coordinates, a point may be and still count as inside."""


class PointSearch:
    """Points of each rank, found in the cells of a mesh wherever those are owned. Collective.

    The constructor searches the cells; `values` then evaluates any number of functions.

    Args:
        domain: mesh of DOLFINx.
        points: positions of this rank's points [m], shape (n, D).
        active: function that is 1 in the cells that points between cells prefer and 0 in the others; None for no preference.

    Raises:
        InputError: points has another shape or a value that is not finite. Raised on all ranks alike.
    """

    def __init__(self, domain: Mesh, points: ArrayLike, active: fem.Function | None = None) -> None:
        require_mesh(domain)
        self._domain = domain  # it owns the communicator
        self._comm, dim = domain.comm, domain.geometry.dim
        points = real_numbers(self._comm, "points", points)
        good = points.ndim == 2 and points.shape[1] == dim and np.all(np.isfinite(points))
        agree(self._comm, None if good else f"points has shape {points.shape}, expected finite (n, {dim})")
        self.points = points
        boxes = self._comm.allgather(_owned_box(domain))
        near = np.array([np.all((points >= low) & (points <= high), axis=1) for low, high in boxes])
        self._ranks, self._rows = np.nonzero(near)  # that may have a point, by rising rank
        asked, self._askers = exchange_rows(self._comm, self._ranks, points[self._rows])
        preferred = np.ones(owned_cells(domain))
        if active is not None:
            preferred = active.x.array[compat.cell_dofs(active.function_space)[: len(preferred), 0]]
        cells = local_cells(domain, asked, preferred)
        self._inside = cells >= 0
        self._cells = cells[self._inside]
        self._at = np.zeros((len(self._cells), 3))
        self._at[:, :dim] = asked[self._inside]
        self.found = np.zeros(len(points), dtype=bool)
        ranking = np.where(self._inside, 1.0 + preferred[cells], 0.0) if len(preferred) else np.zeros(len(cells))
        ranking = self._returned(ranking[:, None])[:, 0]
        # The best come last and prevail where several ranks have a point; among equals the lowest rank does.
        there = np.flatnonzero(ranking)[::-1]
        self._there = there[np.argsort(ranking[there], kind="stable")]
        self.found[self._rows[self._there]] = True

    def require_all(self, argument: str = "points") -> None:
        """Require that all points lie in the mesh. Collective.

        Args:
            argument: name of the points in the message.

        Raises:
            InputError: a point is outside the mesh; the message names the first one. Raised on all ranks alike.
        """
        lost = np.flatnonzero(~self.found)
        message = None
        if len(lost):
            where = ", ".join(f"{x:.9g}" for x in self.points[lost[0]])
            message = (
                f"{argument}: point {lost[0]} on rank {self._comm.rank} at ({where}) m is outside the mesh "
                f"({len(lost)} of {len(self.points)} points there are)"
            )
        agree(self._comm, message)

    def __repr__(self) -> str:
        return f"<PointSearch: {len(self.points)} points of this rank, {len(self._cells)} points found in its cells>"

    def values(self, function: fem.Function) -> NDArray[np.float64]:
        """Values of a function at the points. Collective.

        Args:
            function: function on the mesh.

        Returns:
            Shape (n, components); NaN at points outside the mesh.
        """
        size = int(np.prod(function.ufl_shape)) if function.ufl_shape else 1
        values = np.full((len(self._inside), size), np.nan)
        if len(self._cells):
            values[self._inside] = np.asarray(function.eval(self._at, self._cells)).reshape(-1, size)
        result = np.full((len(self.points), size), np.nan)
        result[self._rows[self._there]] = self._returned(values)[self._there]
        return result

    def cell_sums(self, amounts: NDArray[np.float64]) -> NDArray:
        """Sums over the points in each cell that this rank owns; a point outside the mesh counts nowhere. Collective.

        (A conservative transfer: it keeps the total.)

        Args:
            amounts: one number for each of this rank's points, shape (n,).

        Returns:
            Shape (m,), by the owned cells.
        """
        rank_of = np.full(len(self.points), -1)
        rank_of[self._rows[self._there]] = self._ranks[self._there]
        sent = np.where(rank_of[self._rows] == self._ranks, amounts[self._rows], 0.0)
        received, _ = exchange_rows(self._comm, self._ranks, sent[:, None])
        return np.bincount(self._cells, received[self._inside, 0], owned_cells(self._domain))

    def _returned(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Values (m, k) at the points that other ranks asked for, sent back to them; in the order of `_rows`. Collective."""
        return exchange_rows(self._comm, self._askers, values)[0]


def evaluate_at(
    points: ArrayLike, active: fem.Function | None = None, /, **functions: fem.Function
) -> dict[str, NDArray[np.float64]]:
    """Values of several functions of one mesh at points; the points and their cells may be on different ranks. Collective.

    Args:
        points: positions of this rank's points [m], shape (n, D).
        active: as for `PointSearch`.
        **functions: functions by the names that their values are to have.

    Returns:
        Values by name, each of shape (n, components).

    Raises:
        InputError: a point is outside the mesh; the message names it. Raised on all ranks alike.
    """
    domain = next(iter(functions.values())).function_space.mesh
    search = PointSearch(domain, points, active)
    search.require_all()
    return {name: search.values(function) for name, function in functions.items()}


def local_cells(
    domain: Mesh, points: NDArray[np.float64], preferred: NDArray[np.float64], tolerance: float = _TOLERANCE
) -> NDArray[np.int32]:
    """Owned cell that contains each point, -1 if there is none on this rank: (n,).

    A point on the border of several cells goes to a preferred one, by a number for each cell, and among these to the one in
    which it lies deepest. It counts as inside up to a tolerance in barycentric coordinates.
    """
    rows, cells, depth = cells_around(domain, points, tolerance)
    found = np.full(len(points), -1, dtype=np.int32)
    order = np.lexsort((depth, preferred[cells], rows))
    found[rows[order]] = cells[order]  # the deepest comes last and holds
    return found


def cells_around(
    domain: Mesh, points: NDArray[np.float64], tolerance: float
) -> tuple[NDArray[np.intp], NDArray[np.int32], NDArray[np.float64]]:
    """All owned cells that contain points (n, D) [m], up to a tolerance in barycentric coordinates.

    Returns:
        Number of the point, cell, and smallest barycentric coordinate of the point in it, each of shape (k,).
    """
    dim, n_cells = domain.geometry.dim, owned_cells(domain)
    if n_cells == 0 or len(points) == 0:
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.int32), np.empty(0)
    corners = domain.geometry.x[compat.cell_nodes(domain)[:n_cells], :dim]
    padded = np.zeros((len(points), 3))
    padded[:, :dim] = points
    size = np.ptp(corners.reshape(-1, dim), axis=0).max()
    offsets, cells = compat.candidate_cells(domain, np.arange(n_cells), padded, tolerance * size)
    rows = np.repeat(np.arange(len(points)), np.diff(offsets))
    depth = _depth(corners[cells], points[rows])
    near = depth >= -tolerance
    return rows[near], cells[near], depth[near]


def _depth(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest barycentric coordinate of points in cells: negative outside."""
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    inner = np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])[:, :, 0]
    return np.minimum(inner.min(axis=1), 1 - inner.sum(axis=1)) if len(points) else np.empty(0)


def _owned_box(domain: Mesh) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    n_cells, dim = owned_cells(domain), domain.geometry.dim
    if n_cells == 0:
        return np.full(dim, np.inf), np.full(dim, -np.inf)
    x = domain.geometry.x[np.unique(compat.cell_nodes(domain)[:n_cells]), :dim]
    margin = _TOLERANCE * np.ptp(x, axis=0).max()
    return x.min(axis=0) - margin, x.max(axis=0) + margin
