"""The tangent of a problem and PETSc's solution with it."""

from __future__ import annotations

import numpy as np
from dolfinx import fem, la
from mpi4py import MPI
from petsc4py import PETSc


class LinearSolver:
    """Matrix of a bilinear form under supports, solved by PETSc.

    The default is a direct solver (LU); PETSc options with `options_prefix` change it, for instance
    -elastic_ksp_type cg -elastic_pc_type gamg.
    """

    def __init__(self, form, space, constraints, options_prefix):
        self._comm, self._form, self._constraints = space.mesh.comm, form, constraints
        self._n_owned = space.dofmap.index_map.size_local * space.dofmap.index_map_bs
        self._matrix = fem.petsc.create_matrix(form)
        self._matrix.setBlockSize(space.dofmap.index_map_bs)
        self._ksp = PETSc.KSP().create(self._comm)
        self._ksp.setOptionsPrefix(options_prefix)
        self._ksp.setType("preonly")
        self._ksp.getPC().setType("lu")
        if self._comm.size == 1:  # half the time of PETSc's default, nested dissection
            self._ksp.getPC().setFactorOrdering("amd")
        self._ksp.setFromOptions()
        self._right, self._left = self._matrix.createVecs()

    def assemble(self):
        """Assemble the matrix from the form's present coefficients. Collective."""
        self._matrix.zeroEntries()
        fem.petsc.assemble_matrix(self._matrix, self._form, bcs=self._constraints.bcs)
        self._matrix.assemble()
        self._ksp.setOperators(self._matrix)

    def solve(self, residual, increment):
        """Write matrix^-1 residual to `increment`; zero where supports hold. True when the solver converged.

        residual: vector (`dolfinx.la`); increment: function on the same space. Collective.
        """
        self._left.array[:] = residual.array[: self._n_owned]
        try:
            self._ksp.solve(self._left, self._right)
            solved = self._ksp.getConvergedReason() > 0 and bool(np.all(np.isfinite(self._right.array_r)))
        except PETSc.Error:  # a factorisation that gave up
            solved = False
        if not self._comm.allreduce(int(solved), MPI.MIN):
            self._ksp.reset()  # MUMPS cannot be used again after a singular matrix
            return False
        increment.x.array[: self._n_owned] = self._right.array_r
        increment.x.scatter_forward()
        return True
