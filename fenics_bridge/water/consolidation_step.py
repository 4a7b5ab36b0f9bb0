"""One step of consolidation: Newton's method, and where water leaves the soil at atmospheric pressure."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from mpm_core.newton import EASY_ITERATIONS, Conservation, NewtonReport, newton
from numpy.typing import NDArray

from fenics_bridge.fem.equilibrium import Body, EquilibriumStep
from fenics_bridge.fem.solver import Solver
from fenics_bridge.types import Law

MOST_SETS = 30
"""Guesses of where a pressure is at its upper bound, in a step."""

COLLAPSE = 0.1
"""Of the size of a body, by which soil does not move in a quasi-static step, nor sideways in all, and beyond which strains are not small."""

SLACK = 1e-9
"""By how much, relative to the largest, a head may exceed its bound or a flow have the wrong sign."""


@dataclass(frozen=True)
class ConsolidationReport:
    """How a step of consolidation went."""

    time: float
    """Time at the end of the step [s]"""
    dt: float
    """Length of the step [s]"""
    iterations: int
    """Iterations of Newton's method, in all"""
    residuals: list[float]
    """Before each of the last iterations and at the end: the larger of out-of-balance forces over forces at work, and of
    out-of-balance water over the water that is exchanged [-]"""
    water_error: float = 0.0
    """Change of the stored water less what entered [m3], [m2] in plane flow"""
    reason: str = ""
    """Why the step was not made; empty where it was, and otherwise everything is as it was before"""

    def __repr__(self) -> str:
        why = f"; not made: {self.reason}" if self.reason else ""
        return f"<ConsolidationReport: t = {self.time:g} s, step of {self.dt:.3g} s, {self.iterations} iterations{why}>"

    @property
    def converged(self) -> bool:
        """Whether the step was made."""
        return not self.reason

    @property
    def easy(self) -> bool:
        """Whether Newton's method converged in a few iterations."""
        return self.converged and self.iterations <= EASY_ITERATIONS


class CoupledStep(EquilibriumStep):
    """A step of displacement and pressure, whose out-of-balance forces and volumes of water have each their own measure.

    Args:
        body: the body.
        laws: laws in the order of the body's points.
        external: nodal forces of the load at the end of the step.
        before: nodal forces of the load at its start.
        displacement: fraction of the displacements that the supports prescribe.
        parts: owned dofs of displacement and of pressure.
        gravity_flow: what the weight of water makes flow in the step, shape (m,).
        stored: volume of the water in the body, times the unit of pressure.
    """

    def __init__(
        self,
        body: Body,
        laws: list[Law],
        external: Any,
        before: Any,
        displacement: float,
        parts: Sequence[NDArray[np.integer]],
        gravity_flow: NDArray[np.float64],
        stored: float,
    ) -> None:
        super().__init__(body, laws, external, before, displacement)
        self._parts, self._gravity_flow, self._stored, self._water = parts, gravity_flow, stored, Conservation()
        stress = body.points.stress
        self._of_stress = body.kinematics.internal_forces(stress).array.copy()
        self._of_stress -= body.kinematics.internal_forces(np.zeros_like(stress)).array

    def _forces_at_work(self, out_of_balance: Any) -> Any:
        """Norms by which residuals of displacement and pressure are divided: the largest ones that take part.

        A volume of water times the unit of pressure counts as a force, so that the error of a volumetric strain weighs as much
        as that of the stress that belongs to it.
        """
        arrays = self._external, self._before, out_of_balance, self._of_stress
        force = max(self._norm(array[self._parts[0]]) for array in arrays)
        return force, max(force, self._norm(out_of_balance[self._parts[1]]), self._norm(self._gravity_flow))

    def _relative(self, out_of_balance: Any) -> Any:
        lost = self._comm.allreduce(float(np.abs(out_of_balance[self._parts[1]]).sum()))
        self._water.lost = lost / self._stored if self._stored > 0 else 0.0
        norms = (self._norm(out_of_balance[dofs]) for dofs in self._parts)
        return max(norm / scale if scale > 0 else 0.0 for norm, scale in zip(norms, self.scale))

    def wants_more(self, tolerance: float) -> bool:
        """Whether water is out of balance where forces are not."""
        return self._water.wants_more(tolerance)


def solve_step(
    step: Callable[[], CoupledStep],
    constraints: Any,
    bounds: tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]],
    active: NDArray[np.bool_],
    state_of: Callable[[], tuple[NDArray[np.float64], NDArray[np.float64]]],
    solver: Solver,
) -> tuple[Any, NDArray[np.bool_], int, str]:
    """Solve a step where pressures p <= upper are bounded: inflow is nil below the bound and at most nil at it. Collective.

    Guesses which pressures are at their bound until the guess is right (primal-dual active set method, Hintermueller, Ito and
    Kunisch 2002).

    Args:
        step: function that returns a new step.
        constraints: the CoupledConstraints of the step.
        bounds: which pressures are prescribed, their values, and upper bounds of the others, each of shape (m,).
        active: pressures that are taken to be at their bound, shape (m,).
        state_of: function that returns pressures and inflows, each of shape (m,).
        solver: tolerances.

    Returns:
        Report of Newton's method, the pressures at their bound, iterations in all, and why it failed (empty if it did not).
    """
    comm, (fixed, values, upper) = constraints.comm, bounds
    bounded, iterations = np.isfinite(upper) & ~fixed, 0
    at_bound, active = np.where(bounded, upper, 0.0), active & bounded
    for _ in range(MOST_SETS):
        constraints.hold(fixed | active, np.where(fixed, values, at_bound))
        report = accepted(newton(step(), solver.tolerance, solver.max_iterations), solver)
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


def accepted(report: NewtonReport, solver: Solver) -> NewtonReport:
    """A report that takes forces for balanced which Newton's method brings no further, as a relaxation without water does.

    Where soil yields whose dilation angle is below its friction angle, its iterates often alternate about an equilibrium, at
    1e-8 to 1e-6 of the forces at work, however short the step.
    """
    if report.converged or not solver.relaxation or not report.residuals[-1] <= solver.relaxed_tolerance:
        return report
    return report._replace(converged=True, reason="")


def collapsed(step: NDArray[np.float64], before: NDArray[np.float64], domain: Mesh) -> str:
    """Why the displacements [m] of a step are none of equilibrium; empty where they may be. Collective.

    At collapse residuals hardly depend on the motion of the mechanism, so that Newton's method may end anywhere along it. Soft ground may settle by
    more than a tenth of its thickness, but a mechanism moves sideways as well.

    Args:
        step: displacements in the step, shape (n * D,).
        before: displacements at its start.
        domain: the mesh.
    """
    sideways = (before + step).reshape(-1, domain.geometry.dim)[:, :-1]
    largest, most = max(_largest(step, domain), _largest(sideways, domain)), COLLAPSE * float(_extents(domain).max())
    return f"it collapses: soil would move by {largest:.2g} m, more than {most:.2g} m" if largest > most else ""


def warn_of_large_strains(displacements: NDArray[np.float64], domain: Mesh) -> bool:
    """Warn where displacements [m] are beyond what small strains are; returns whether they are. Collective.

    Ground is compressed over its height, which is often a small part of its width.
    """
    largest, most = _largest(displacements, domain), COLLAPSE * float(_extents(domain)[domain.geometry.dim - 1])
    if largest > most:
        warnings.warn(
            f"soil has moved by {largest:.2g} m, more than a tenth of the height of the body: finite elements take strains for small, and refer them to "
            "the undeformed ground, so that settlements are too large by about half of the strain; particles (`--particles`) move with the soil",
            RuntimeWarning,
            stacklevel=2,
        )
    return largest > most


def _largest(displacements: NDArray[np.float64], domain: Mesh) -> float:
    """The largest displacement [m]. Collective."""
    return max(domain.comm.allgather(float(np.abs(displacements).max(initial=0.0))))


def _extents(domain: Mesh) -> NDArray[np.float64]:
    """The size of the body along each axis [m]. Collective."""
    x, comm = domain.geometry.x, domain.comm
    ends = (-x.min(axis=0), x.max(axis=0)) if len(x) else (np.full(3, -np.inf),) * 2
    size: NDArray[np.float64] = np.max(comm.allgather(ends), axis=0).sum(axis=0)
    return size
