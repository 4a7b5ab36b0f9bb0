"""Stiffness of strains that are averaged over nodes: multiplied out for direct solvers, in factors for iterative ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from fenics_bridge.fem.averaged_strain import AveragedStrain, compressed, matrix


class AssembledStiffness:
    """The stiffness as a matrix of PETSc. Collective.

    Args:
        strain: the averaged strain.
    """

    def __init__(self, strain: AveragedStrain) -> None:
        self._strain = strain
        self._comm = strain.plain.comm.tompi4py()
        size, n = strain.size, len(strain.volumes)
        first = self._comm.scan(n) - n
        of_normal = np.tile(np.arange(size) < strain.normal, n)[:, None] / strain.normal
        part = matrix(self._comm, (n * size, n), np.repeat(first + np.arange(n), size)[:, None], of_normal)
        self._of_normal = part
        self._divergence = part.copy().transpose().matMult(strain.plain)
        self._divergence.scale(strain.normal)
        self._around_nodes = strain.mean_of_vertices.transpose(PETSc.Mat())
        components = size * (first + np.arange(n))[:, None] + np.arange(size)
        self._columns = np.repeat(components, size, axis=0)
        self._tangent = matrix(self._comm, (n * size, n * size), self._columns, 1.0)
        self._stresses: PETSc.Mat | None = None
        self._product: PETSc.Mat | None = None
        self._averages: NDArray[np.float64] | None = None

    def with_tangent(
        self, tangent: NDArray[np.float64], held: NDArray[np.integer], more: PETSc.Mat | None = None
    ) -> PETSc.Mat:
        """The matrix of a tangent. Collective.

        Args:
            tangent: tangent of the cells (n, S, S) [Pa].
            held: places of the prescribed dofs among this rank's own ones, whose rows and columns are those of the identity.
            more: matrix that is added; None for none.
        """
        self._follow()
        weighted = self._strain.volumes[:, None, None] * tangent
        self._tangent.setValuesCSR(*compressed(self._columns, weighted.reshape(-1, self._strain.size)))
        self._tangent.assemble()
        self._stresses = self._tangent.matMult(self._whole, self._stresses)
        product = self._transposed.matMult(self._stresses, self._product)
        self._product, found = product, product.copy()  # the places of the first are kept for the next product
        if more is not None:
            found.axpy(1.0, more, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        found.zeroRowsColumns((self._strain.plain.getOwnershipRangeColumn()[0] + held).astype(np.int32), 1.0)
        return found

    def _follow(self) -> None:
        """The strain, and the transpose for the forces, of the fractions by which cells are averaged now."""
        now = np.stack([self._strain.of_strains, self._strain.of_forces])
        same = self._averages is not None and np.array_equal(now, self._averages)
        if self._comm.allreduce(same, MPI.LAND):
            return
        self._averages = now
        self._whole = self._averaged_by(now[0])
        # PETSc's triple product would add up what ranks send in the order in which it arrives.
        self._transposed = self._averaged_by(now[1]).transpose(PETSc.Mat())
        self._stresses = self._product = None

    def _averaged_by(self, fractions: NDArray[np.float64]) -> PETSc.Mat:
        """Strain of cells that are averaged by these fractions (n,)."""
        strain, around = self._strain, self._around_nodes.copy()
        volumes, per_volume = strain.weights(fractions)
        around.diagonalScale(L=_vector(around.createVecLeft(), per_volume), R=_vector(around.createVecRight(), volumes))
        around.scale(strain.corners)
        change = strain.mean_of_vertices.matMult(around.matMult(self._divergence))
        change.axpy(-1.0, self._divergence)
        change.diagonalScale(L=_vector(change.createVecLeft(), fractions))
        operator = self._of_normal.matMult(change)
        operator.axpy(1.0, strain.plain)
        return operator


def _vector(vector: PETSc.Vec, values: NDArray[np.float64]) -> PETSc.Vec:
    """A vector with these values of this rank."""
    vector.array[:] = values
    return vector


class FactoredStiffness:
    """The stiffness as an operator that is not multiplied out, preconditioned by the stiffness of strains without averages.

    The preconditioner is stiffer, and takes some two to three times as many iterations as that of the matrix itself would.
    Collective.

    Args:
        strain: the averaged strain.
        held: places of the supported dofs among this rank's own ones.
        plain: finite elements of the same space without averages, `Kinematics`.
        tangent: tangent of the cells (n, S, S) [Pa].
    """

    def __init__(
        self, strain: AveragedStrain, held: NDArray[np.integer], plain: Any, tangent: NDArray[np.float64]
    ) -> None:
        self._strain, self._held, self._plain, self._tangent = strain, held, plain, tangent

    @property
    def operator(self) -> PETSc.Mat:
        """Matrix of PETSc that can only multiply."""
        sizes = self._strain.plain.getSizes()[1]
        return PETSc.Mat().createPython((sizes, sizes), self, comm=self._strain.plain.comm)

    @property
    def preconditioner(self) -> PETSc.Mat:
        """Matrix without averages of the same tangent."""
        return self._plain.stiffness_of(self._tangent)

    def mult(self, _: PETSc.Mat, displacement: PETSc.Vec, forces: PETSc.Vec) -> None:
        """Forces of a displacement, called by PETSc. Collective."""
        free = np.array(displacement.array_r)
        held = free[self._held]
        free[self._held] = 0.0
        stress = np.einsum("nij,nj->ni", self._tangent, self._strain.of(free))
        forces.array[:] = self._strain.forces(stress)
        forces.array[self._held] = held

    def createVecs(self) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Vectors for it, as of a matrix of PETSc."""
        return self._strain.plain.createVecRight(), self._strain.plain.createVecRight()

    def copy(self) -> FactoredStiffness:
        """The stiffness of a copy of the tangent. Collective."""
        return FactoredStiffness(self._strain, self._held, self._plain, self._tangent.copy())

    def axpy(self, factor: float, other: FactoredStiffness, *_: Any) -> None:
        """Add a multiple of another one, as to a matrix of PETSc."""
        self._tangent = self._tangent + factor * other._tangent
