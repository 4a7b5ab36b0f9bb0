"""Nodal mixed discretisation: volumetric strains of linear simplices averaged over nodes, against locking."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem, la
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenics_bridge import compat
from fenics_bridge.fem.geometry import Geometry
from fenics_bridge.mesh.background import global_numbers
from fenics_bridge.types import Law
from mpm_core import _core

LITTLE_DILATION = 0.17
"""tan(psi) / tan(phi) of the reduced strength below which forces are not averaged: soil with little dilation carries too little
with averaged forces, soil with more of it without them. Measured: up to 0.16 and from 0.19 on (docs/fem.md)"""


class AveragedKinematics:
    """Strain of linear simplices whose volumetric part is averaged over nodes (paper, section 5; Detournay, Dzik).

    With theta_c = div u in a cell, theta_i the mean over the cells around a node by volume, and thetabar_c the mean of
    theta_i over a cell's nodes, the in-plane normal strains are raised by (thetabar_c - theta_c) / d; all three of them,
    with d = 3, in 3D and in axisymmetric bodies, whose hoop strain is that at the centroid.
    Strain is then a constant matrix times displacement, over two rings of cells, and the internal forces are its
    transpose times stress: the mean stress is averaged too, and the tangent is symmetric where the law's is.

    Soil with friction whose flow hardly dilates is an exception. Forces that are averaged do not feel pressures that alternate
    from cell to cell, and where flow does not change the volume a mechanism would pass through the cells of low pressure. So in
    cells of such soil the forces are those of the stress itself, by the transpose of the plain strains.

    Args:
        increment: displacement function of degree 1 whose strain is taken.
        points: the quadrature points.
        constraints: the boundary conditions.
        laws: the laws, by number; see `follow`.
        geometry: plane strain, axial symmetry or a solid.
    """

    def __init__(
        self,
        increment: fem.Function,
        points: Any,
        constraints: Any,
        laws: Sequence[Law],
        geometry: Geometry | None = None,
    ) -> None:
        self._increment, self._points, self._constraints = increment, points, constraints
        self._space, comm = increment.function_space, increment.function_space.mesh.comm
        dim, rows = increment.function_space.mesh.geometry.dim, points.n
        nodes, gradients, self._volumes, radii = self._cells(geometry == Geometry.AXISYMMETRIC)
        dofs = (dim * nodes[:, :, None] + np.arange(dim)).reshape(rows, -1)
        self._n_dofs = dim * self._space.dofmap.index_map.size_local
        cell = comm.scan(rows) - rows + np.arange(rows)
        in_divergence = gradients.copy()
        if radii is not None:  # the hoop strain at the centroid
            in_divergence[:, :, 0] += 1 / (3 * radii[:, None])
        divergence = _matrix(comm, (rows, self._n_dofs), dofs, in_divergence.reshape(rows, -1))
        spread = self._mean_over_nodes(comm, nodes).matMult(divergence)
        spread.axpy(-1.0, divergence)
        size = rows * points.size
        normal = dim if radii is None else 3
        in_plane = np.tile(np.arange(points.size) < normal, rows)[:, None] / normal
        part = _matrix(comm, (size, rows), np.repeat(cell, points.size)[:, None], in_plane)
        self._strain = _matrix(
            comm, (size, self._n_dofs), np.repeat(dofs, points.size, axis=0), _strain_rows(gradients, radii)
        )
        self._plain, self._spread = self._strain.copy(), part.matMult(spread)
        self._strain.axpy(1.0, self._spread)
        components = points.size * cell[:, None] + np.arange(points.size)
        self._columns = np.repeat(components, points.size, axis=0)
        self._tangent = _matrix(comm, (size, size), self._columns, 1.0)
        self._averaged: NDArray[np.bool_] | None = None
        self._change: PETSc.Mat | None = None
        self._forces = la.vector(self._space.dofmap.index_map, self._space.dofmap.index_map_bs)
        self._held = self._held_dofs()
        self.follow(laws)

    def follow(self, laws: Sequence[Law]) -> None:
        """Average forces as the laws ask for: in all cells but those of frictional soil with little dilation. Collective.

        Args:
            laws: the laws, by number.
        """
        of_law = np.array([_core.associated_fraction(law) < LITTLE_DILATION for law in laws])
        averaged = ~of_law[np.maximum(self._points.material, 0)]
        same = self._averaged is not None and np.array_equal(averaged, self._averaged)
        if self._space.mesh.comm.allreduce(same, MPI.LAND):
            return
        self._averaged = averaged
        operator, rows = self._spread.copy(), self._spread.createVecLeft()
        rows.array[:] = np.repeat(averaged, self._points.size)
        operator.diagonalScale(L=rows)
        operator.axpy(1.0, self._plain)
        # PETSc's triple product would add up what ranks send in the order in which it arrives.
        self._transposed = operator.transpose(PETSc.Mat())
        self._stiffness: PETSc.Mat | None = None

    def strain_increment(self) -> NDArray[np.float64]:
        """Averaged strain of the increment in each cell: (n, S)."""
        u, strain = self._strain.createVecs()
        u.array[:] = self._increment.x.array[: self._n_dofs]
        self._strain.mult(u, strain)
        return np.array(strain.array_r).reshape(self._points.n, self._points.size)

    def internal_forces(self, stress: NDArray[np.float64]) -> Any:
        """Nodal forces of a stress (n, S) as a vector (`dolfinx.la`), ghosts up to date. Collective."""
        forces, weighted = self._strain.createVecs()
        weighted.array[:] = (self._volumes[:, None] * stress).ravel()
        self._transposed.mult(weighted, forces)
        self._forces.array[: self._n_dofs] = forces.array_r
        compat.forward(self._forces)
        return self._forces

    def stiffness(self) -> PETSc.Mat:
        """Matrix of the cells' present tangent, without the rows and columns of the supports. Collective."""
        weighted = self._volumes[:, None, None] * self._points.tangent
        self._tangent.setValuesCSR(*_rows(self._columns, weighted.reshape(-1, self._points.size)))
        self._tangent.assemble()
        self._change = self._tangent.matMult(self._strain, self._change)
        self._stiffness = self._transposed.matMult(self._change, self._stiffness)
        matrix = self._stiffness.copy()  # whose places are kept for the next product
        matrix.zeroRowsColumns(self._held, 1.0)
        return matrix

    def _cells(self, axisymmetric: bool) -> tuple[Any, ...]:
        """Nodes, gradients of shape functions, volumes and radii of the owned cells.

        Returns:
            Global nodes (m, D + 1), gradients (m, D + 1, D) [1/m], volumes (m,), those of one radian in an axisymmetric body, and
            the radii (m,) of the centroids in such a body, else None.
        """
        dim = self._space.mesh.geometry.dim
        local = compat.cell_dofs(self._space)[self._points.cells]
        corners = self._space.tabulate_dof_coordinates()[local][:, :, :dim]
        edges = corners[:, 1:] - corners[:, :1]
        inner = np.swapaxes(np.linalg.inv(edges), 1, 2)
        gradients = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
        index_map = self._space.dofmap.index_map
        numbers = global_numbers(index_map, index_map.size_local + index_map.num_ghosts)
        volumes = np.abs(np.linalg.det(edges)) / (2 if dim == 2 else 6)
        if not axisymmetric:
            return numbers[local], gradients, volumes, None
        radii = corners[:, :, 0].mean(axis=1)
        return numbers[local], gradients, radii * volumes, radii

    def _mean_over_nodes(self, comm: MPI.Comm, nodes: NDArray[np.integer]) -> Any:
        """Matrix from cells to cells: to the nodes by volume, and back as the mean over a cell's nodes."""
        size = len(nodes), self._space.dofmap.index_map.size_local
        there = self._points.material >= 0  # cells that are switched off take no part
        to_nodes = _matrix(comm, size, nodes, (self._volumes * there)[:, None]).transpose()
        around = to_nodes.getRowSum()
        around.reciprocal()
        to_nodes.diagonalScale(L=around)
        return _matrix(comm, size, nodes, 1 / nodes.shape[1]).matMult(to_nodes)

    def _held_dofs(self) -> NDArray[np.integer]:
        """Global numbers of this rank's supported dofs."""
        mine = self._constraints.dofs[self._constraints.dofs < self._n_dofs]
        return (self._space.dofmap.index_map.local_range[0] * self._space.dofmap.index_map_bs + mine).astype(np.int32)


def _strain_rows(gradients: NDArray[np.float64], radii: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Strain operator of each cell, (m * S, (D + 1) * D): components of strain by components of nodal displacement."""
    m, corners, dim = gradients.shape
    pairs = [(0, 0), (1, 1), None, (0, 1)] if dim == 2 else [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
    rows = np.zeros((m, len(pairs), corners, dim))
    for component, pair in enumerate(pairs):
        if pair is None:
            continue
        a, b = pair
        rows[:, component, :, a] += gradients[:, :, b]
        if a != b:
            rows[:, component, :, b] += gradients[:, :, a]
    if radii is not None:
        rows[:, 2, :, 0] = 1 / (3 * radii[:, None])
    return rows.reshape(m * len(pairs), corners * dim)


def _matrix(comm: MPI.Comm, local_size: Any, columns: NDArray[np.integer], values: Any) -> Any:
    """Sparse matrix of this rank's rows, each with k entries: global columns and values, both (rows, k)."""
    matrix = PETSc.Mat().create(comm)
    matrix.setSizes([(n, None) for n in local_size])
    matrix.setType("aij")
    matrix.setPreallocationCSR(_rows(columns, values))
    matrix.assemble()
    return matrix


def _rows(columns: NDArray[np.integer], values: NDArray[np.float64]) -> tuple[Any, ...]:
    """Compressed rows of equal length."""
    start = np.arange(0, columns.size + 1, columns.shape[1]) if columns.size else np.zeros(len(columns) + 1)
    values = np.broadcast_to(values, columns.shape)
    return start.astype(np.int32), columns.ravel().astype(np.int32), np.ascontiguousarray(values).ravel()
