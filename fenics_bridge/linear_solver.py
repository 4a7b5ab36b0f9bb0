"""Linear systems, solved by PETSc."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc


class LinearSolver:
    """Solution of linear systems on a displacement space by PETSc.

    The default is a direct solver (LU); PETSc options with `options_prefix` change it, for instance
    -elastic_ksp_type cg -elastic_pc_type gamg.
    """

    def __init__(self, space, options_prefix, factor=None):
        """factor: PETSc's name of the package for LU, e.g. "mumps"; by default PETSc's own choice."""
        self._comm = space.mesh.comm
        self._n_owned = space.dofmap.index_map.size_local * space.dofmap.index_map_bs
        self._ksp = PETSc.KSP().create(self._comm)
        self._ksp.setOptionsPrefix(options_prefix)
        self._ksp.setType("preonly")
        self._ksp.getPC().setType("lu")
        if factor is not None:
            self._ksp.getPC().setFactorSolverType(factor)
        elif self._comm.size == 1:  # half the time of PETSc's default, nested dissection
            self._ksp.getPC().setFactorOrdering("amd")
        self._ksp.setFromOptions()

    def solve(self, matrix, residual, increment):
        """Write matrix^-1 residual to `increment`. True when the solver converged.

        residual: vector (`dolfinx.la`); increment: function on the same space. Collective.
        """
        right, left = matrix.createVecs()
        left.array[:] = residual.array[: self._n_owned]
        self._ksp.setOperators(matrix)
        try:
            self._ksp.solve(left, right)
            solved = self._ksp.getConvergedReason() > 0 and bool(np.all(np.isfinite(right.array_r)))
        except PETSc.Error:  # a factorisation that gave up
            solved = False
        if not self._comm.allreduce(int(solved), MPI.MIN):
            self._ksp.reset()  # MUMPS cannot be used again after a singular matrix
            return False
        increment.x.array[: self._n_owned] = right.array_r
        increment.x.scatter_forward()
        return True
