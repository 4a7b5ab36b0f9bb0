"""Linear systems, solved by PETSc."""

from __future__ import annotations

from mpm_core.petsc import DIRECT_LIMIT, defaults, direct_options, solved
from petsc4py import PETSc


class LinearSolver:
    """Solution of linear systems on a displacement space by PETSc.

    The default is a direct solver (LU), on one rank unless the system is large; PETSc options with `options_prefix` change
    it, for instance -elastic_ksp_type cg -elastic_pc_type gamg.
    """

    def __init__(self, space, options_prefix, factor=None):
        """factor: PETSc's name of the package for LU, e.g. "mumps"; by default PETSc's own choice."""
        ranks, index_map, bs = space.mesh.comm.size, space.dofmap.index_map, space.dofmap.index_map_bs
        self._n_owned = index_map.size_local * bs
        dim = space.mesh.geometry.dim
        on_one = ranks == 1 or index_map.size_global * bs <= dim * DIRECT_LIMIT[dim]
        choice = {"pc_factor_mat_solver_type": factor} if factor else {}
        if on_one and not factor:  # half the time of PETSc's default, nested dissection
            choice["pc_factor_mat_ordering_type"] = "amd"
        self._options = direct_options(ranks if on_one else 1, choice)
        self._options_prefix = options_prefix
        self._ksp = PETSc.KSP().create(space.mesh.comm)
        self._ksp.setOptionsPrefix(options_prefix)

    def solve(self, matrix, residual, increment):
        """Write matrix^-1 residual to `increment`. True when the solver converged.

        residual: vector (`dolfinx.la`); increment: function on the same space. Collective.
        """
        right, left = matrix.createVecs()
        left.array[:] = residual.array[: self._n_owned]
        self._ksp.setOperators(matrix)
        with defaults(self._options_prefix, self._options):
            self._ksp.setFromOptions()
            if not solved(self._ksp, left, right):
                return False
        increment.x.array[: self._n_owned] = right.array_r
        increment.x.scatter_forward()
        return True
