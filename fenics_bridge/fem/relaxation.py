"""Viscous relaxation: equilibrium where Newton's method finds none, or evidence of failure.

The body is given a viscosity in proportion to its elastic stiffness (Kelvin-Voigt) and follows the load in pseudo-time,
its stresses updated step by step: f_ext = f_int(sigma) + tau K_el du/dt. With a time increment of tau / theta each step
solves

    f_ext - f_int(sigma_n + d_sigma(du)) - theta K_el du = 0.

The tangent of non-associated flow may lose its positive definiteness, which makes Newton's method chatter. With n and m the
normals of yield surface and potential, at the angle alpha in the metric of the elastic stiffness, the smallest eigenvalue
of the symmetric part of the elasto-plastic tangent is (1 - 1/cos(alpha))/2 of the elastic one, so a larger theta leaves one
solution to each step, and Newton's method finds it. (It is 0.08 for phi = 20, psi = 0; 0.5 for angles of some
40 degrees; a step whose iteration fails is repeated with three times the theta.) The iteration begins from the motion of the
step before, at the same rate: from rest its first tangent would be the elastic one. As the body comes to rest theta is
lowered towards zero, and what remains is the equilibrium. A body that does not come to rest flows in a mechanism.

Sources: Zienkiewicz, Cormeau (1974), IJNME 8, 821-845 (viscoplastic strains as a way to plastic equilibrium); Kelley,
Keyes (1998), SIAM J. Numer. Anal. 35, 508-523 (pseudo-transient continuation: the step grows as the residual falls).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.newton import line_search
from numpy.typing import NDArray

from fenics_bridge.fem.equilibrium import Body, EquilibriumStep
from fenics_bridge.fem.solver import Solver
from fenics_bridge.types import Law

FIRST, LARGEST = 0.3, 100.0
"""theta at the start, and the one at which the relaxation ends without a result [-]"""

ELASTIC = 4.0
"""Elastic displacements under a change of load that the growth must exceed before it counts as failure"""

RUN_AWAY = 5.0
"""Growth over the reference, at which the motion counts as failure even if its rate still changes"""

CORRECTIONS = 6
"""Largest number of iterations of Newton's method in a step"""

NEXT_THETA = 0.3, 0.5, 0.8, 1.0, 1.5, 1.5
"""Factor of theta after a step that took 1, 2, ... iterations"""

AFTER_FAILURE = 3.0
"""Factor of theta with which a step that did not converge is repeated"""

REDUCTION = 0.15, 0.3
"""Fractions of the residual: target of a step of relaxation, and limit at which it is still accepted"""

LACKING, FINEST = 1e-2, 1.5e-3
"""Fraction of its strength that a cell may lack in equilibrium; where one lacks more, the tolerance of the out-of-balance force falls
in tenths, as long as it is above this fraction of the one that was given [-]"""

SETTLED = 2e-4
"""Out-of-balance force, and fraction of its strength that a cell lacks, below which a body is at rest that has moved far, or in the last step
[-]: its motion dies away without end, as that of soil without cohesion beside a loaded surface, and factors are less accurate than that"""

STEADY = 0.8
"""Fraction of the residual, and of the rate of the displacement, of half the time before, above which the motion counts as steady"""


@dataclass
class Relaxation:
    """Result of a relaxation; lists have one entry for each step that was accepted."""

    outcome: str = "undecided"
    """How it ended: "equilibrium", "failure" (the displacement grows at a steady rate) or "undecided" (neither was shown)"""
    reason: str = ""
    """Why there is no equilibrium, in words"""
    time: list[float] = field(default_factory=list)
    """Pseudo-time in units of the viscous time tau [-]"""
    residual: list[float] = field(default_factory=list)
    """Out-of-balance force over the forces at work [-], with one entry more where Newton's method could refine the end"""
    growth: list[float] = field(default_factory=list)
    """Largest displacement of a node since the start [m]"""
    carried: list[float] = field(default_factory=list)
    """Power of the stresses over that of the load on the step's motion [-]; in a mechanism, the factor by which the load would
    have to be multiplied to be carried"""
    balanced: bool = False
    """Whether the out-of-balance force is below its tolerance at the end"""
    missing: list[float] = field(default_factory=list)
    """Largest fraction of the strength that is missing in a cell that yields, see `missing_stress` [-]"""
    iterations: int = 0
    """Linear systems solved"""
    motion: NDArray[np.float64] | None = None
    """Displacement increments of the last step, per degree of freedom [m]"""


def relax(
    body: Body,
    laws: Sequence[Law],
    external: Any,
    before: Any,
    displacement: float,
    solver: Solver,
    reference: float,
) -> Relaxation:
    """Relax a body under a load, from its present state. Collective.

    The body stays in the state in which the relaxation ended, whatever the outcome.

    Args:
        body: the body.
        laws: laws in the order of the body's points.
        external: nodal forces of the load.
        before: nodal forces of the load before it.
        displacement: fraction of the prescribed displacements [-].
        solver: tolerances at which the body counts as at rest, and the largest number of steps of pseudo-time.
        reference: displacement at the start [m]; the growth must exceed it, and some times the elastic displacement of the
            change of load besides, before it counts as failure.
    """
    result, theta, scale = Relaxation(), FIRST, None
    tolerance = solver.relaxed_tolerance
    rate: np.ndarray | None = None
    start, moved = body.solution.x.array.copy(), False
    for _ in range(solver.max_steps):
        step = EquilibriumStep(body, laws, external, before, displacement, theta, scale)
        residuals = _solve_step(step, tolerance, None if rate is None else rate / theta)
        result.iterations += len(residuals) - 1
        if step.moves_supports:
            step.measure_reactions()
            moved = True
        scale = step.scale
        if not residuals[-1] <= REDUCTION[1] * residuals[0] and not residuals[-1] <= 0.3 * tolerance:
            theta *= AFTER_FAILURE
            if theta > LARGEST:
                result.reason = (
                    step.reason or f"no step of the relaxation converged at a residual of {residuals[0]:.1e}"
                )
                return result
            continue
        motion = _record(result, body, step, theta, start)
        rate = None if step.moves_supports else theta * motion  # the next step leaves them where they are
        if len(result.time) == 1:  # the elastic displacement under the change of load, which theta has slowed down
            reference += ELASTIC * (1 + theta) * result.growth[0]
        result.balanced = result.residual[-1] <= tolerance
        # A small part of a heavy body, as the soil below a footing, may fail under forces that are nothing to those of the whole.
        # Soil that supports move does not fail by its load.
        lacks = not moved and result.missing[-1] > LACKING
        if result.balanced and lacks and tolerance > FINEST * solver.relaxed_tolerance:
            tolerance, result.balanced = 0.1 * tolerance, False
        # Soil that is still elastic lacks nothing, however far the body is from equilibrium: both must be small.
        enough = max(solver.missing_tolerance, SETTLED if result.growth[-1] > reference else 0.0)
        if result.balanced or max(result.residual[-1], result.missing[-1]) <= enough:
            result.outcome = "equilibrium"
            return result
        if _flows(result, reference):
            result.outcome = "failure"
            result.reason = (
                f"a mechanism: the displacement grew by {result.growth[-1]:.3g} m at a steady rate under an out-of-balance "
                f"force of {result.residual[-1]:.1e}"
            )
            if not np.isnan(result.carried[-1]):  # as where a prestress moves the soil against the load
                result.reason += f"; the stresses carry {result.carried[-1]:.2%} of the load"
            return result
        theta *= NEXT_THETA[len(residuals) - 2]
    if result.residual and max(result.residual[-1], result.missing[-1]) <= SETTLED:
        result.outcome = "equilibrium"
        return result
    last = result.residual[-1] if result.residual else np.inf
    result.reason = f"residual {last:.1e} after {solver.max_steps} steps of relaxation"
    return result


def _solve_step(step: EquilibriumStep, tolerance: float, motion: Any) -> Any:
    """Newton's method for one viscous step, to a fraction of the residual at its start; returns the residuals.

    Args:
        step: the EquilibriumStep.
        tolerance: out-of-balance force over the forces at work at which the body counts as at rest [-].
        motion: increment that the iteration begins from, per degree of freedom [m], or None.
    """
    residuals = [step.start()]
    if motion is not None:
        step.begin_from(motion)
    aim = max(REDUCTION[0] * residuals[0], 0.3 * tolerance)
    while residuals[-1] > aim and len(residuals) <= CORRECTIONS or len(residuals) == 1:
        if not step.correction():
            return [*residuals, np.inf]
        residuals.append(line_search(step, max_halvings=3))
        step.keep()
    return residuals


def _record(result: Relaxation, body: Body, step: EquilibriumStep, theta: float, start: Any) -> Any:
    """Accept a step and add it to the result; returns its motion."""
    result.residual.append(step.out_of_balance())
    result.carried.append(step.carried_fraction())
    result.missing.append(step.missing_fraction())
    result.motion = body.increment.x.array.copy()
    body.accept()
    moved = np.abs(body.solution.x.array - start).max(initial=0.0)
    result.growth.append(body.solution.function_space.mesh.comm.allreduce(float(moved), MPI.MAX))
    result.time.append((result.time[-1] if result.time else 0.0) + 1 / theta)
    return result.motion


def _flows(result: Relaxation, reference: float) -> bool:
    """Whether the displacement has grown beyond the reference, at a rate that falls no more.

    The residual alone does not show it: steps of Newton's method leave some of it, which is most of it where the motion dies away slowly, as
    that of soil without cohesion beside a loaded surface.
    """
    if result.growth[-1] <= reference or result.missing[-1] <= SETTLED:
        return False
    time, growth = np.array([0.0, *result.time]), np.array([0.0, *result.growth])
    rate = np.diff(growth) / np.diff(time)
    steady = all(
        values[-1] > STEADY * float(np.interp(0.5 * time[-1], time[1:], values)) for values in (result.residual, rate)
    )
    return steady or result.growth[-1] > RUN_AWAY * reference
