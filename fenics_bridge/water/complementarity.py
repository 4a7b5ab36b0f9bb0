"""Nonlinear problems with upper bounds, solved by PETSc's semismooth Newton method for variational inequalities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem import petsc
from mpm_core.petsc import defaults, direct_options
from numpy.typing import NDArray
from petsc4py import PETSc

from fenics_bridge.fem.fields import assembled

RELATIVE, MOST_ITERATIONS = 1e-12, 30
"""Tolerance of the residual, over the largest one of the problem's solution so far, and Newton's iterations at most."""


class BoundedProblem:
    """Find u <= upper with F(u) = 0 where u is below its bound, F(u) <= 0 where it is at it, and u given where it is fixed.

    F is a nonlinear form of the unknown function and one test function; `residual` is F without the fixed values and bounds,
    summed over ranks: the reactions there.

    Args:
        form: F, UFL.
        tangents: UFL bilinear forms, the exact one first, then those to fall back on where it fails without a line search and with one.
        unknown: function u.
        options_prefix: prefix of the PETSc options of the solver.
    """

    def __init__(self, form: Any, tangents: Sequence[Any], unknown: fem.Function, options_prefix: str) -> None:
        self.unknown, self._space = unknown, unknown.function_space
        self._form, self._tangents = fem.form(form), [fem.form(tangent) for tangent in tangents]
        self._n = self._space.dofmap.index_map.size_local
        self._vector = assembled(self._form, self._space)
        self._matrix = petsc.create_matrix(self._tangents[0])
        self._matrix.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        self._prefix = options_prefix
        self.iterations = 0

    def solve(
        self, fixed: NDArray[np.bool_], values: NDArray[np.float64], upper: NDArray[np.float64], scale: float
    ) -> str | None:
        """Solve from the unknown's present values. Collective.

        Args:
            fixed: which dofs of this rank are fixed, shape (m,).
            values: their values, shape (m,).
            upper: upper bounds of the others, shape (m,), infinite where there is none.
            scale: size of the entries of F below which, times `RELATIVE`, the problem is solved.

        Returns:
            Why it failed, in words; None where it did not.
        """
        self._fixed, self._values, self._scale = fixed[: self._n], values, scale
        start = self.unknown.x.array.copy()
        exact, *others = self._tangents
        failure = None
        # Where a bound or a fixed value jumps, only a search for a lower residual finds the way; elsewhere it costs iterations.
        for tangent, search in [(exact, "basic"), (exact, "bt"), *((other, "basic") for other in others)]:
            self.unknown.x.array[:] = np.where(fixed, values, np.minimum(start, upper))
            self._tangent = tangent
            failure = self._attempt(upper, search)
            if not failure:
                return None
        self.unknown.x.array[:] = start
        return failure

    def residual(self) -> NDArray[np.float64]:
        """F of the unknown as it is, (m,) on the dofs of this rank, ghosts included. Collective."""
        return assembled(self._form, self._space, into=self._vector).array

    def _attempt(self, upper: NDArray[np.float64], search: str) -> Any:
        comm = self._space.mesh.comm
        snes = PETSc.SNES().create(comm)
        snes.setOptionsPrefix(self._prefix)
        snes.setType("vinewtonrsls")
        right = self._matrix.createVecLeft()
        snes.setFunction(self._function, right)
        snes.setJacobian(self._jacobian, self._matrix)
        snes.setTolerances(rtol=0.0, atol=RELATIVE * self._scale, stol=0.0, max_it=MOST_ITERATIONS)
        low, high = right.duplicate(), right.duplicate()
        low.set(PETSc.NINFINITY)
        high.array[:] = np.where(np.isfinite(upper[: self._n]) & ~self._fixed, upper[: self._n], PETSc.INFINITY)
        snes.setVariableBounds(low, high)
        solution = right.duplicate()
        solution.array[:] = self.unknown.x.array[: self._n]
        linear = direct_options(comm.size, alone=False)
        options = {"snes_linesearch_type": search, **linear}
        with defaults(self._prefix, options):
            snes.setFromOptions()
            snes.solve(None, solution)
        reason, self.iterations = snes.getConvergedReason(), snes.getIterationNumber()
        norm = snes.getFunctionNorm()
        self._set(solution)
        snes.destroy()
        if reason > 0 and np.isfinite(norm):
            return None
        return f"Newton's method ended after {self.iterations} iterations with a residual of {norm:.3g} (PETSc's reason {reason})"

    def _set(self, x: Any) -> None:
        self.unknown.x.array[: self._n] = x.array_r[: self._n]
        self.unknown.x.scatter_forward()

    def _function(self, snes: Any, x: Any, f: Any) -> None:
        self._set(x)
        f.array[:] = np.where(self._fixed, x.array_r - self._values[: self._n], self.residual()[: self._n])

    def _jacobian(self, snes: Any, x: Any, jacobian: Any, preconditioner: Any) -> None:
        self._matrix.zeroEntries()
        petsc.assemble_matrix(self._matrix, self._tangent)
        self._matrix.assemble()
        first = self._matrix.getOwnershipRange()[0]
        self._matrix.zeroRows(first + np.flatnonzero(self._fixed).astype(np.int32), 1.0)
        return PETSc.Mat.Structure.SAME_NONZERO_PATTERN
