"""Transient relaxation of an implicit step: the paper's iteration and its accelerated forms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI

from ._core import RelaxationKind
from .solution import Solution, relative

_AT_ONCE = 500
"""Iterations between checks for signals such as Ctrl-C."""


@dataclass(frozen=True)
class Relaxation:
    """Transient relaxation (21)-(24): pseudo-time iteration on the nodes, without a matrix.

    ``RICHARDSON`` is the iteration of the paper with the density that makes it stable; the second-order kinds reach the same root
    in far fewer iterations.
    """

    kind: RelaxationKind = RelaxationKind.VISCOUS
    tolerance: float = 1e-8
    """|r| at which a step is solved, relative to the largest of |f_ext|, |f_int| and inertia"""
    max_iterations: int = 200_000

    def solver(self, comm: MPI.Comm, dim: int) -> RelaxationSolver:
        """Solver of the steps of a run."""
        return RelaxationSolver(self)


class RelaxationSolver:
    """Relaxation over the steps of a run; nothing is kept from step to step."""

    def __init__(self, options: Relaxation) -> None:
        self._options = options

    def solve(self, step: Any, dt: float, changed: bool) -> Solution:
        """Solve r = 0 for a started step; see ``NewtonSolver.solve``."""
        options = self._options
        report = step.start_relaxation(options.kind)
        if report["failed"]:  # v0 carried on over the whole step is too much; begin at rest
            step.iterate = np.zeros_like(step.iterate)
            report = step.start_relaxation(options.kind)
        solution = Solution([relative(report)])
        done = 0
        while solution.residuals[-1] > options.tolerance and done < options.max_iterations and not report["failed"]:
            now = min(_AT_ONCE, options.max_iterations - done)
            count, report = step.relax(options.tolerance, now)
            done += count
            solution.residuals.append(relative(report))
        solution.iterations = done
        solution.converged = solution.residuals[-1] <= options.tolerance and not report["failed"]
        solution.easy = done <= options.max_iterations // 4
        if report["failed"]:
            solution.reason = report["reason"]
        elif not solution.converged:
            solution.reason = f"|r| is {solution.residuals[-1]:.2e} after {done} iterations"
        return solution
