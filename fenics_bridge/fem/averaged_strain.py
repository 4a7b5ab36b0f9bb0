"""Strain of linear simplices with its volumetric part averaged over nodes, and the forces that go with it, in sparse factors."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc


class AveragedStrain:
    """The strain of `AveragedKinematics` as an operator on displacements, and forces by its transpose. Collective.

    It is B + m f (M - 1) m^T B / d, with the plain strain B, the ones m of the d normal components, the fractions f by which
    cells are averaged, and the means M over nodes, weighted by f V, and back over cells. With these weights a uniform strain or
    stress remains as it is, also where soils of different fractions meet. Multiplied out, its rows reach over two rings of cells
    (60 times d entries in three dimensions); B and the two factors of M have 3 to 12.

    Cells of different groups are averaged apart: each group has a mean of its own at a node. Equilibrium gives soils of
    different stiffness different strains where they meet.

    Args:
        comm: ranks of the body.
        n_own: numbers of this rank's own degrees of freedom and nodes.
        dofs: global numbers of the degrees of freedom for the displacements of the nodes of this rank's cells, (n, D + 1, D).
        nodes: global numbers of these nodes, (n, D + 1).
        gradients: gradients of the shape functions [1/m], (n, D + 1, D).
        volumes: volumes of the cells, those of one radian in an axisymmetric body, (n,).
        radii: radii of the centroids [m] in an axisymmetric body, (n,), else None.
        present: whether a cell is there, (n,); others take no part in the means.
        groups: number of the group of each cell, from 0, (n,).
        n_groups: number of groups over all ranks.
    """

    def __init__(
        self,
        comm: MPI.Comm,
        n_own: tuple[int, int],
        dofs: NDArray[np.integer],
        nodes: NDArray[np.integer],
        gradients: NDArray[np.float64],
        volumes: NDArray[np.float64],
        radii: NDArray[np.float64] | None,
        present: NDArray[np.bool_],
        groups: NDArray[np.integer],
        n_groups: int,
    ) -> None:
        (n, corners, dim), (n_dofs, n_nodes) = gradients.shape, n_own
        self.size = 4 if dim == 2 else 6
        """Components of strain"""
        self.normal = dim if radii is None else 3
        """Components that are averaged, the first ones"""
        self.volumes = volumes
        """Volumes of the cells (n,)"""
        self.of_strains, self.of_forces = np.ones(n), np.ones(n)
        """Fraction by which a cell's strains, and its forces, are averaged, (n,)"""
        rows, columns = _strain_rows(gradients, radii), np.repeat(dofs.reshape(n, corners * dim), self.size, axis=0)
        self.plain = matrix(comm, (n * self.size, n_dofs), columns, rows)
        """The plain strain"""
        means = nodes * n_groups + groups[:, None]
        self.mean_of_vertices = matrix(comm, (n, n_nodes * n_groups), means, 1 / corners)
        """The mean over a cell's vertices, of the values that its group has there"""
        self._present, self.corners = present, corners
        self._strain_of, self._over_nodes = _Product(self.plain), _Product(self.mean_of_vertices)
        # Products with PETSc's own transposes would add up what ranks send in the order in which it arrives.
        self._forces_of = _Product(self.plain.transpose(PETSc.Mat()))
        self._to_nodes = _Product(self.mean_of_vertices.transpose(PETSc.Mat()))

    def weights(self, fractions: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Weights of the means over the cells around a node: the volume of each cell in its own, and one over the sum of each mean.

        Collective.

        Args:
            fractions: by which the cells are averaged, (n,).

        Returns:
            Shapes (n,) [m^D] and (nodes * groups,) [1/m^D]; the second is zero where no cell around a node is averaged.
        """
        volumes = fractions * self.volumes * self._present
        around = self.corners * self._to_nodes(volumes)
        return volumes, np.divide(1.0, around, out=np.zeros_like(around), where=around > 0)

    def of(self, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
        """Averaged strain of a displacement of this rank's own dofs: (n, S). Collective."""
        strain = self._strain_of(displacement).reshape(-1, self.size)
        volumetric = strain[:, : self.normal].sum(axis=1)
        volumes, per_volume = self.weights(self.of_strains)
        mean = self._over_nodes(self.corners * per_volume * self._to_nodes(volumes * volumetric))
        strain[:, : self.normal] += (self.of_strains * (mean - volumetric))[:, None] / self.normal
        return strain

    def forces(self, stress: NDArray[np.float64]) -> NDArray[np.float64]:
        """Forces on this rank's own dofs of a stress (n, S). Collective."""
        return self._forces_of((self.volumes[:, None] * self.averaged_stress(stress)).ravel())

    def averaged_stress(self, stress: NDArray[np.float64]) -> NDArray[np.float64]:
        """A stress (n, S) with its mean over the normal components averaged as the forces have it: (n, S). Collective."""
        averaged = stress.copy()
        mean = averaged[:, : self.normal].sum(axis=1) / self.normal
        volumes, per_volume = self.weights(self.of_forces)
        of_nodes = self._over_nodes(self.corners * per_volume * self._to_nodes(self.of_forces * self.volumes * mean))
        averaged[:, : self.normal] += (self.of_forces * (self._present * of_nodes - mean))[:, None]
        return averaged


class _Product:
    """Matrix times vector, of this rank's own entries.

    The vectors are kept: PETSc holds those that Python drops until it collects garbage, which is after the solution of a system.
    """

    def __init__(self, operator: PETSc.Mat) -> None:
        self._operator = operator
        self._right, self._left = operator.createVecs()

    def __call__(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        self._right.array[:] = values
        self._operator.mult(self._right, self._left)
        return np.array(self._left.array_r)


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


def matrix(comm: MPI.Comm, local_size: Any, columns: NDArray[np.integer], values: Any) -> Any:
    """Sparse matrix of this rank's rows, each with up to k nonzero entries: global columns and values, both (rows, k)."""
    made = PETSc.Mat().create(comm)
    made.setSizes([(n, None) for n in local_size])
    made.setType("aij")
    values = np.broadcast_to(values, columns.shape)
    kept = values != 0
    start = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
    made.setPreallocationCSR((start.astype(np.int32), columns[kept].astype(np.int32), values[kept]))
    made.assemble()
    return made


def compressed(columns: NDArray[np.integer], values: NDArray[np.float64]) -> tuple[Any, ...]:
    """Compressed rows of equal length, with their zeros: columns and values, both (rows, k)."""
    start = np.arange(0, columns.size + 1, columns.shape[1]) if columns.size else np.zeros(len(columns) + 1)
    return start.astype(np.int32), columns.ravel().astype(np.int32), np.ascontiguousarray(values).ravel()
