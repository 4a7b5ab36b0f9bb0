"""The tangent of an implicit step as a PETSc matrix, and the solution of its linear systems."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

from .field_split import FieldSplit, split_options
from .petsc import (
    ALONE_LIMIT,
    DIRECT_LIMIT,
    coo_matrix,
    defaults,
    direct_options,
    multigrid_options,
    new_solver,
    rigid_body_motions,
    set_values,
    solved,
)

RTOL = 1e-6
"""Relative residual to which multigrid solves the linear systems"""


class Tangent:
    """J = d (f_int + inertia) / du of an implicit step; with pore water also by pressures, and the balance of the water by both.

    With nodal mixed discretisation J = K + K_p G, where G gives the nodes' averaged volumetric strain: the product grows the
    stencil to two rings. Where mean stresses are averaged too, J = K + K_p G + G^T (L + H G), over three rings.

    Args:
        step: the core's implicit step, assembled.
        comm: its ranks.
        dim: 2 or 3.
        prefix: of the PETSc options of solver and preconditioner.

    Note:
        Collective, as its methods are.
    """

    def __init__(self, step: Any, comm: MPI.Comm, dim: int, prefix: str) -> None:
        n = step.unknowns
        means, dofs = step.owned_means, step.owned_nodes * n
        self._stiffness = coo_matrix(comm, (dofs, dofs), (n, n), step.stiffness_places())
        self._averaged = comm.allreduce(len(step.volumetric_force_values())) > 0
        self._product: PETSc.Mat | None = None
        if self._averaged:
            self._force = coo_matrix(comm, (dofs, means), (n, 1), step.volumetric_force_places())
            self._strain = coo_matrix(comm, (means, dofs), (1, n), step.volumetric_strain_places())
        self._conjugate = comm.allreduce(len(step.mean_stress_values())) > 0
        if self._conjugate:
            self._mean_stress = coo_matrix(comm, (means, dofs), (1, n), step.mean_stress_places())
            self._mean_stress_by_strain = coo_matrix(comm, (means, means), (1, 1), step.mean_stress_by_strain_places())
        self._prefix = prefix
        coupled = n > dim
        splits = coupled and PETSc.Options(prefix).getString("pc_type", "") == "fieldsplit"
        direct = step.total_nodes <= DIRECT_LIMIT[dim] and not splits
        alone = step.total_nodes <= ALONE_LIMIT[dim]
        iterative = split_options if coupled else multigrid_options
        self._options = direct_options(comm.size, alone) if direct else iterative(dim, RTOL)
        self._comm = comm
        self._ksp = new_solver(comm, prefix)
        motions = rigid_body_motions(step.points, comm)
        self._near_null_space = None if coupled else motions
        kind = PETSc.Options(prefix).getString("pc_type", self._options["pc_type"])
        self._split = FieldSplit(self._stiffness, dim, motions) if coupled and kind == "fieldsplit" else None
        self.iterations = 0
        """Krylov iterations of the last solution."""
        self.failure = ""
        """Reason why the last solution failed; empty if it did not"""

    def update(self, step: Any) -> None:
        """Assemble the tangent of the step's present iterate."""
        set_values(self._stiffness, step.stiffness_values())
        self.matrix = self._stiffness
        if self._averaged:
            set_values(self._force, step.volumetric_force_values())
            set_values(self._strain, step.volumetric_strain_values())
            self._product = self._force.matMult(self._strain, self._product)
            self._product.axpy(1.0, self._stiffness, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            self.matrix = self._product
        if self._conjugate:
            set_values(self._mean_stress, step.mean_stress_values())
            set_values(self._mean_stress_by_strain, step.mean_stress_by_strain_values())
            work = self._mean_stress_by_strain.matMult(self._strain)
            work.axpy(1.0, self._mean_stress, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            self.matrix = self._strain.transposeMatMult(work)
            self.matrix.setBlockSize(self._stiffness.getBlockSize())
            self.matrix.axpy(1.0, self._product, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        if self._near_null_space is not None:
            self.matrix.setNearNullSpace(self._near_null_space)
        self._ksp.setOperators(self.matrix)
        if self._split is not None:
            self._split.attach(self._ksp.getPC(), self.matrix)
        with defaults(self._prefix, self._options):
            self._ksp.setFromOptions()
            self._ksp.setUp()

    def by_displacement(self, by_strain: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rows by the nodes' averaged volumetric strains, (k, means of this rank), as rows by displacements, (k, unknowns)."""
        if not self._averaged:
            return np.zeros((len(by_strain), self.matrix.getLocalSize()[0]))
        rows = []
        for row in by_strain:
            x, b = self._strain.createVecs()
            b.array[:] = row
            self._strain.multTranspose(b, x)
            rows.append(x.array.copy())
        return np.array(rows)

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """J^-1 times this rank's part of a vector; None if the solver failed, with the reason in `failure`."""
        x, b = self.matrix.createVecs()
        b.array[:] = right
        self.failure = solved(self._ksp, b, x)
        self.iterations = self._ksp.getIterationNumber()
        if self.failure:
            self._ksp = new_solver(self._comm, self._prefix)
            return None
        return x.array.copy()
