"""Solution of one equilibrium: Newton's method and, where it does not converge, relaxation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.newton import EASY_ITERATIONS, newton
from numpy.typing import NDArray

from fenics_bridge.errors import InputError
from fenics_bridge.fem.equilibrium import Body, EquilibriumStep
from fenics_bridge.fem.relaxation import Relaxation, relax
from fenics_bridge.types import Law

PATIENCE = 8
"""Iterations in which the least residual of Newton's method must halve; relaxation takes over otherwise"""


@dataclass(frozen=True)
class Solver:
    """Solver of an equilibrium and its tolerances. Out-of-balance forces are over the forces at work [-].

    `PRACTICE` is the level that is customary in practice, 1 % out of balance.

    Raises:
        InputError: a value out of its range.
    """

    tolerance: float = 1e-8
    """Out-of-balance force at which Newton's method ends [-]"""
    max_iterations: int = 25
    """Largest number of iterations of Newton's method in a step"""
    relaxation: bool = True
    """Whether `relaxation.relax` takes over where Newton's method does not converge"""
    relaxed_tolerance: float = 1e-5
    """Out-of-balance force at which a relaxation ends [-]"""
    max_steps: int = 80
    """Largest number of steps of a relaxation"""

    def __post_init__(self):
        for name in ("tolerance", "relaxed_tolerance"):
            if not 0 < getattr(self, name) < 1:
                raise InputError(f"{name}: got {getattr(self, name)!r}, expected a number between 0 and 1")
        for name in ("max_iterations", "max_steps"):
            if not (isinstance(getattr(self, name), int) and getattr(self, name) > 0):
                raise InputError(f"{name}: got {getattr(self, name)!r}, expected a whole number above 0")


PRACTICE = Solver(tolerance=1e-2, relaxed_tolerance=1e-2)
"""Accepts an out-of-balance ratio of 1 %, as is customary in practice. Factors of safety become some per cent higher, and more
where the soil that fails is a small part of the body, because the ratio is over the forces of all of it."""


@dataclass(frozen=True)
class EquilibriumReport:
    """Result of one step to equilibrium."""

    outcome: str
    """How the step ended: "equilibrium", "failure" (the body flows in a mechanism) or "undecided" (neither could be shown)"""
    residuals: list[float]
    """Out-of-balance force over the forces at work [-], before each iteration of Newton's method (or step of relaxation) and at
    the end"""
    reason: str
    """Why there is no equilibrium; empty otherwise"""
    iterations: int
    """Linear systems solved"""
    relaxation: Relaxation | None = None
    """The relaxation; None where Newton's method sufficed"""
    motion: NDArray[np.float64] | None = field(default=None, repr=False)
    """Displacement of the step, or of the mechanism where it fails, per degree of freedom [m]"""

    @property
    def converged(self) -> bool:
        """Whether the step ended in equilibrium."""
        return self.outcome == "equilibrium"

    @property
    def carried(self) -> float:
        """Fraction of the load that the stresses carry in the mechanism of a failure [-]; NaN otherwise."""
        return self.relaxation.carried[-1] if self.outcome == "failure" and self.relaxation else np.nan

    @property
    def easy(self) -> bool:
        """Whether Newton's method converged in a few iterations."""
        return self.converged and self.relaxation is None and self.iterations <= EASY_ITERATIONS


def find_equilibrium(
    body: Body, laws: Sequence[Law], external: Any, before: Any, displacement: float, solver: Solver
) -> EquilibriumReport:
    """Bring a body to equilibrium under a load, from its last equilibrium on; without equilibrium it does not change.

    `body.increment` is the displacement of the whole step.

    Args:
        body: the body.
        laws: laws in the order of the body's points.
        external: nodal forces of the load.
        before: nodal forces of the load before it.
        displacement: fraction of the displacements that the supports prescribe [-].
        solver: tolerances.

    Note:
        Collective.
    """
    step = EquilibriumStep(body, laws, external, before, displacement)
    patience = PATIENCE if solver.relaxation else None
    report = newton(step, solver.tolerance, solver.max_iterations, patience=patience)
    if report.converged:
        motion = body.increment.x.array.copy()
        body.accept()
        return EquilibriumReport("equilibrium", report.residuals, "", report.iterations, motion=motion)
    if not solver.relaxation:
        return EquilibriumReport("undecided", report.residuals, report.reason, report.iterations)
    return _relaxed(body, laws, external, before, displacement, solver, report)


def _relaxed(body, laws, external, before, displacement, solver, newton_report):
    """The report of a relaxation after Newton's method did not converge."""
    start = body.snapshot()
    comm = body.solution.function_space.mesh.comm
    reference = comm.allreduce(float(np.abs(start[0]).max(initial=0.0)), MPI.MAX)
    result = relax(body, laws, external, before, displacement, solver.relaxed_tolerance, solver.max_steps, reference)
    if result.outcome == "equilibrium":
        _refine(body, laws, external, displacement, solver, result)
    motion = body.solution.x.array - start[0] if result.outcome == "equilibrium" else result.motion
    reason = result.reason
    if result.outcome != "equilibrium":
        body.restore(start)
    if result.outcome == "undecided":
        reason = f"Newton's method: {newton_report.reason}; relaxation: {result.reason}"
    if motion is not None:
        body.increment.x.array[:] = motion
    residuals = [newton_report.residuals[0], *result.residual]
    iterations = newton_report.iterations + result.iterations
    return EquilibriumReport(result.outcome, residuals, reason, iterations, result, motion)


def _refine(body, laws, external, displacement, solver, result):
    """Newton's method from the end of a relaxation, where it often converges."""
    report = newton(EquilibriumStep(body, laws, external, external, displacement), solver.tolerance, EASY_ITERATIONS)
    result.iterations += report.iterations
    if report.converged:
        body.accept()
        result.residual.append(report.residuals[-1])
