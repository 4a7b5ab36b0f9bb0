"""One step of consolidation: Newton's method, and where water leaves the soil at atmospheric pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from mpm_core.newton import EASY_ITERATIONS, newton

from fenics_bridge.fem.equilibrium import EquilibriumStep

MOST_SETS = 30
"""Guesses of where a pressure is at its upper bound, in a step."""

SLACK = 1e-9
"""By how much, relative to the largest, a head may exceed its bound or a flow have the wrong sign."""


@dataclass(frozen=True)
class ConsolidationReport:
    """How a step of consolidation went.

    time: at its end [s]; dt: its length [s]; iterations: of Newton's method, in all
    residuals: before each of its last iterations and at the end, the larger of out-of-balance forces over forces at work, and
        of out-of-balance water over the water that is exchanged [-]
    water_error: change of the stored water less what entered [m3], [m2] in plane flow
    reason: why the step was not made; empty where it was, and otherwise everything is as it was before
    """

    time: float
    dt: float
    iterations: int
    residuals: list[float]
    water_error: float = 0.0
    reason: str = ""

    @property
    def converged(self):
        return not self.reason

    @property
    def easy(self):
        """Whether Newton's method converged in a few iterations."""
        return self.converged and self.iterations <= EASY_ITERATIONS


class CoupledStep(EquilibriumStep):
    """A step of displacement and pressure, whose out-of-balance forces and volumes of water have each their own measure."""

    def __init__(self, body, laws, external, before, displacement, parts, gravity_flow):
        """parts: owned dofs of displacement and pressure; gravity_flow: (m,) what the weight of water makes flow in the step."""
        super().__init__(body, laws, external, before, displacement)
        self._parts, self._gravity_flow = parts, gravity_flow
        stress = body.points.stress
        self._of_stress = body.kinematics.internal_forces(stress).array.copy()
        self._of_stress -= body.kinematics.internal_forces(np.zeros_like(stress)).array

    def _forces_at_work(self, out_of_balance):
        """Norms by which residuals of displacement and pressure are divided: the largest ones that take part.

        A volume of water times the unit of pressure counts as a force, so that the error of a volumetric strain weighs as much
        as that of the stress that belongs to it.
        """
        arrays = self._external, self._before, out_of_balance, self._of_stress
        force = max(self._norm(array[self._parts[0]]) for array in arrays)
        return force, max(force, self._norm(out_of_balance[self._parts[1]]), self._norm(self._gravity_flow))

    def _relative(self, out_of_balance):
        norms = (self._norm(out_of_balance[dofs]) for dofs in self._parts)
        return max(norm / scale if scale > 0 else 0.0 for norm, scale in zip(norms, self.scale))


def solve_step(step, constraints, bounds, active, state_of, solver):
    """Solve a step where pressures p <= upper are bounded: inflow is nil below the bound and at most nil at it.

    step: function that returns a new CoupledStep; constraints: CoupledConstraints; solver: Solver
    bounds: (fixed, values, upper), each (m,): which pressures are prescribed, these, and upper bounds of the others
    active: (m,) bool, pressures that are taken to be at their bound; state_of: function that returns pressures and inflows (m,)
    Guesses which pressures are at their bound until the guess is right (primal-dual active set method, Hintermueller, Ito and
    Kunisch 2002). Returns (NewtonReport, active, iterations, why it failed). Collective.
    """
    comm, (fixed, values, upper) = constraints.comm, bounds
    bounded, iterations = np.isfinite(upper) & ~fixed, 0
    at_bound, active = np.where(bounded, upper, 0.0), active & bounded
    for _ in range(MOST_SETS):
        constraints.hold(fixed | active, np.where(fixed, values, at_bound))
        report = newton(step(), solver.tolerance, solver.max_iterations)
        iterations += report.iterations
        if not report.converged or not comm.allreduce(bool(bounded.any())):
            return report, active, iterations, report.reason
        pressures, inflows = state_of()
        sizes = [np.abs(array).max(initial=0.0) for array in (pressures, inflows)]
        slack = SLACK * np.max(comm.allgather(sizes), axis=0)
        right = bounded & np.where(active, inflows <= slack[1], pressures > at_bound + slack[0])
        if not comm.allreduce(bool(np.any(right != active))):
            return report, active, iterations, ""
        active = right
    return report, active, iterations, f"where water leaves was not found in {MOST_SETS} guesses"
