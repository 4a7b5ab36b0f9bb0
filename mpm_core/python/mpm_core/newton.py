"""Newton's method for an implicit step."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from .linear import Tangent
from .solution import Solution, relative

EASY_ITERATIONS = 8
"""of a step after which one twice as long is tried, up to dt"""

MOST_GROWTH = 5.0
"""of |r| in an iteration whose correction does not lower it"""


@dataclass(frozen=True)
class Newton:
    """Newton's method with the consistent tangent and a line search; linear systems by PETSc.

    The default linear solver is direct where the system is small and GMRES with algebraic multigrid where it is large.
    PETSc options change it, for instance ``-implicit_ksp_type gmres -implicit_pc_type gamg``.
    """

    tolerance: float = 1e-8
    """|r| at which a step is solved, relative to the largest of |f_ext|, |f_int| and inertia"""
    max_iterations: int = 25
    max_halvings: int = 6
    """of a correction that does not lower |r|"""
    prefix: str = "implicit_"
    """of the PETSc options"""

    def solver(self, comm: MPI.Comm, dim: int) -> NewtonSolver:
        """What solves the steps of a run."""
        return NewtonSolver(self, comm, dim)


class NewtonSolver:
    """Newton's method over the steps of a run: keeps the matrices while the active cells stay the same."""

    def __init__(self, options: Newton, comm: MPI.Comm, dim: int) -> None:
        self._options, self._comm, self._dim = options, comm, dim
        self._tangent: Tangent | None = None

    def solve(self, step: Any, dt: float, changed: bool) -> Solution:
        """Bring a started step to r = 0.

        Args:
            step: the core's implicit step, started.
            dt: its length [s].
            changed: whether its active nodes or cells differ from those of the last step solved.
        """
        if changed:
            self._tangent = None
        report = step.trial(tangents=True)
        if report["failed"]:  # v0 carried on over the whole step is too much; begin at rest
            step.velocity = np.zeros_like(step.velocity)
            report = step.trial(tangents=True)
        solution = Solution([relative(report)])
        while report["failed"] or solution.residuals[-1] > self._options.tolerance:
            if report["failed"]:
                solution.reason = report["reason"]
                return solution
            if solution.iterations >= self._options.max_iterations:
                solution.reason = f"|r| is {solution.residuals[-1]:.2e} after {solution.iterations} iterations"
                return solution
            correction = self._correction(step, dt, solution)
            if correction is None:
                solution.reason = "the linear solver failed"
                return solution
            solution.iterations += 1
            report = self._search(step, correction, report)
            if isinstance(report, str):
                solution.reason = report
                return solution
            solution.residuals.append(relative(report))
        solution.converged = True
        solution.easy = solution.iterations <= EASY_ITERATIONS
        return solution

    def _correction(self, step: Any, dt: float, solution: Solution) -> NDArray[np.float64] | None:
        """Change of v1 that the linearised residual asks for."""
        step.assemble()
        if self._tangent is None:
            self._tangent = Tangent(step, self._comm, self._dim, self._options.prefix)
        self._tangent.update(step)
        du = self._tangent.solve(step.residual)
        if du is None:
            return None
        solution.linear_iterations.append(self._tangent.iterations)
        return np.asarray(du / dt, dtype=np.float64)

    def _search(self, step: Any, correction: NDArray[np.float64], before: dict) -> dict | str:
        """Move by the largest of 1, 1/2, 1/4, ... of the correction that lowers |r|.

        Where none does, |r| has a kink in between, as plastic points begin to yield or change their edge; the one with
        the least |r| leads over it. Why there is none, when all fail or |r| becomes much larger.
        """
        start = step.velocity
        tried: list[tuple[float, float]] = []
        for halvings in range(self._options.max_halvings + 1):
            share = 0.5**halvings
            step.velocity = start + share * correction
            report = step.trial(tangents=halvings == 0)
            if report["failed"]:
                continue
            lower = report["residual"] < (1 - 1e-4 * share) * before["residual"]
            if lower or relative(report) <= self._options.tolerance:
                return report if halvings == 0 else step.trial(tangents=True)
            tried.append((report["residual"], share))
        if not tried:
            return report["reason"]
        if min(tried)[0] > MOST_GROWTH * before["residual"]:
            return f"every part of the correction makes |r| = {relative(before):.2e} much larger"
        step.velocity = start + min(tried)[1] * correction
        return step.trial(tangents=True)
