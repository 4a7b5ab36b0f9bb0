"""Solution of one equilibrium: Newton's method and, where it does not converge, relaxation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.newton import EASY_ITERATIONS, newton
from numpy.typing import NDArray

from fenics_bridge.fem.equilibrium import Body, EquilibriumStep
from fenics_bridge.fem.relaxation import Relaxation, relax
from fenics_bridge.fem.solver import Solver
from fenics_bridge.types import Law

PATIENCE = 8
"""Iterations in which the least residual of Newton's method must halve; relaxation takes over otherwise"""

SHORTEST_PART = 1 / 32
"""Fraction of a step that prescribes displacements below which it is not divided any further [-]"""

MOVING = 4
"""Times as many steps of a relaxation where supports move, since all of the soil that they push yields from the first step on"""


@dataclass(frozen=True)
class EquilibriumReport:
    """Result of one step to equilibrium."""

    outcome: str
    """How the step ended: "equilibrium", "failure" (the body flows in a mechanism) or "undecided" (neither could be shown)"""
    residuals: list[float]
    """Out-of-balance force over the forces at work [-], before each iteration of Newton's method (or step of relaxation) and at
    the end"""
    reason: str
    """Why there is no equilibrium, with place and advice; empty otherwise"""
    iterations: int
    """Linear systems solved, or explicit steps made"""
    relaxation: Relaxation | None = None
    """The relaxation; None where Newton's method sufficed"""
    motion: NDArray[np.float64] | None = field(default=None, repr=False)
    """Displacement of the step, or of the mechanism where it fails, per degree of freedom [m]"""
    explicit: bool = False
    """Whether the iterations are explicit steps of particles"""
    cause: str = ""
    """The reason without place and advice, for a line on one step of several; empty where the reason has none"""

    def __repr__(self) -> str:
        count = f"{self.iterations} {'explicit steps' if self.explicit else 'linear systems'}"
        balance = f", out-of-balance ratio {self.residuals[-1]:.2g}" if self.residuals else ""
        why = f": {self.reason}" if self.reason else ""
        return f"<EquilibriumReport: {self.outcome} after {count}{balance}{why}>"

    @property
    def converged(self) -> bool:
        """Whether the step ended in equilibrium."""
        return self.outcome == "equilibrium"

    @property
    def method(self) -> str:
        """What the iterations are, in a word for messages: Newton, relaxed or explicit."""
        if self.explicit:
            return "explicit"
        return "Newton" if self.relaxation is None else "relaxed"

    @property
    def carried(self) -> float:
        """Fraction of the load that the stresses carry in the mechanism of a failure [-]; NaN otherwise."""
        return self.relaxation.carried[-1] if self.outcome == "failure" and self.relaxation else np.nan

    @property
    def missing(self) -> float:
        """Largest fraction of its strength that a cell lacks, where `missing_tolerance` ended a relaxation [-]; 0 otherwise."""
        by_stress = self.converged and self.relaxation is not None and not self.relaxation.balanced
        return self.relaxation.missing[-1] if self.relaxation is not None and by_stress else 0.0

    @property
    def easy(self) -> bool:
        """Whether Newton's method converged in a few iterations."""
        return self.converged and self.method == "Newton" and self.iterations <= EASY_ITERATIONS


def find_equilibrium(
    body: Body, laws: Sequence[Law], external: Any, before: Any, displacement: float, solver: Solver
) -> EquilibriumReport:
    """Bring a body to equilibrium under a load, from its last equilibrium on; without equilibrium it does not change. Collective.

    `body.increment` is the displacement of the whole step.

    Args:
        body: the body.
        laws: laws in the order of the body's points.
        external: nodal forces of the load.
        before: nodal forces of the load before it.
        displacement: fraction of the displacements that the supports prescribe [-].
        solver: tolerances.
    """
    step = EquilibriumStep(body, laws, external, before, displacement)
    patience = PATIENCE if solver.relaxation else None
    report = newton(step, solver.tolerance, solver.max_iterations, patience=patience)
    if report.converged:
        motion = body.increment.x.array.copy()
        body.accept()
        return EquilibriumReport("equilibrium", report.residuals, "", report.iterations, motion=motion)
    if step.moves_supports:
        whole = _in_parts(body, laws, external, before, displacement, solver)
        if whole is not None:
            return replace(whole, iterations=report.iterations + whole.iterations)
    if not solver.relaxation:
        return EquilibriumReport("undecided", report.residuals, report.reason, report.iterations)
    if step.moves_supports:
        solver = replace(solver, max_steps=MOVING * solver.max_steps)
    return _relaxed(body, laws, external, before, displacement, solver, report)


def _in_parts(body: Body, laws: Sequence[Any], external: Any, before: Any, displacement: float, solver: Solver) -> Any:
    """The report of a step with prescribed displacements that is divided, or None where its parts do not converge either.

    A relaxation stops in the middle of such a motion, and the soil unloads as its viscous stresses vanish: reactions would be
    a few per cent too low.
    """
    start, duration = body.snapshot(), body.points.duration
    done, length, iterations, motion = 0.0, 0.5, 0, np.zeros_like(body.increment.x.array)
    now, residuals = before, []
    while done < 1.0:
        length = min(length, 1.0 - done)
        part = length / (1.0 - done)
        target = now + part * (external - now)
        body.points.duration = length * duration
        step = EquilibriumStep(body, laws, target, now, displacement, part=part)
        report = newton(step, solver.tolerance, solver.max_iterations, patience=PATIENCE)
        iterations += report.iterations
        if report.converged:
            motion += body.increment.x.array
            body.accept()
            done, now, residuals = done + length, target, report.residuals
        else:
            length /= 2
            if length < SHORTEST_PART:
                body.restore(start)
                break
    body.points.duration = duration
    if done < 1.0:
        return None
    body.increment.x.array[:] = motion
    return EquilibriumReport("equilibrium", residuals, "", iterations, motion=motion)


def _relaxed(
    body: Body, laws: Sequence[Any], external: Any, before: Any, displacement: float, solver: Solver, newton_report: Any
) -> Any:
    """The report of a relaxation after Newton's method did not converge."""
    start = body.snapshot()
    comm = body.solution.function_space.mesh.comm
    reference = comm.allreduce(float(np.abs(start[0]).max(initial=0.0)), MPI.MAX)
    result = relax(body, laws, external, before, displacement, solver, reference)
    if result.outcome == "equilibrium" and result.balanced:
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


def _refine(
    body: Body, laws: Sequence[Any], external: Any, displacement: float, solver: Solver, result: Relaxation
) -> Any:
    """Newton's method from the end of a relaxation, where it often converges."""
    report = newton(EquilibriumStep(body, laws, external, external, displacement), solver.tolerance, EASY_ITERATIONS)
    result.iterations += report.iterations
    if report.converged:
        body.accept()
        result.residual.append(report.residuals[-1])
