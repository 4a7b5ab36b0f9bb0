"""Newton's method with a line search: for an implicit step, and for any other system that gives residual and tangent."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from .linear import Tangent
from .solution import Solution, relative

EASY_ITERATIONS = 8
"""Iterations of a step up to which the next one may be twice as long, at most dt"""


NOT_HELD = (
    "nothing holds a rigid body that forces move: without inertia it must touch the soil from the start; Model.gap says how far "
    "it is, and explicit steps bring a Servo there; a smooth round body, which nothing keeps from turning, needs rotates=False"
)

FLOATING = 1e12
"""Stiffness of a rigid body in contact, over that with the soil around it, beyond which nothing holds it"""


RUN_AWAY = 10.0
"""Relative residual at which an iteration is abandoned"""


CONSERVED = 1e-2
"""Water that may be out of balance at the end of a step, over that of the pores, as a fraction of the tolerance of forces"""


class Conservation:
    """Whether water that is still out of balance, where forces are in balance, is worth another correction.

    It is as long as corrections reduce it tenfold; what round-off leaves is accepted.
    """

    def __init__(self) -> None:
        self.lost = 0.0
        """Water out of balance at the last point, over that of the pores [-]"""
        self._before = np.inf

    def wants_more(self, tolerance: float) -> bool:
        """Whether to go on; called where the residual is below the tolerance."""
        more = self.lost > CONSERVED * tolerance and self.lost < 0.1 * self._before
        self._before = self.lost
        return more


class System(Protocol):
    """A system of equations that `newton` solves.

    Residuals are relative; one that cannot be computed is infinite, with a `reason`.
    """

    reason: str

    def start(self) -> float:
        """The first residual."""

    def correction(self) -> bool:
        """Solve the tangent system for the residual. Returns whether it was solved; `reason` says why not."""

    def move(self, fraction: float) -> float:
        """Add a fraction of the correction to the last point of the iteration; returns the residual there."""

    def work(self) -> float:
        """The residual times the correction."""

    def keep(self) -> None:
        """Make this the last point."""

    def wants_more(self, tolerance: float) -> bool:
        """Whether, below the tolerance, another correction is worth while for the sake of the water."""


MOST_SURFACES = 30
"""Guesses of where water leaves the surface of soil that may dry, in a step"""

ROUGH = 0.1
"""Residual at which such a guess can be judged; a solution is only wanted of the last one"""


class NewtonReport(NamedTuple):
    """Course of an iteration.

    residuals: relative to the forces at work, one before each iteration and one at the end
    reason: why it did not converge; empty when it did
    """

    converged: bool
    residuals: list[float]
    reason: str = ""

    @property
    def iterations(self) -> int:
        """Number of corrections made."""
        return len(self.residuals) - 1


def newton(
    system: System,
    tolerance: float = 1e-8,
    max_iterations: int = 25,
    max_halvings: int = 5,
    min_iterations: int = 1,
    patience: int | None = None,
) -> NewtonReport:
    """Solve a system by Newton's method with a line search.

    The full correction is halved until the work of the residual has fallen to 0.8 of what it was (Matthies, Strang
    1979, IJNME 14, 1613-1626); when no fraction does that, the one with the smallest residual is taken. Unlike a search
    for a decrease of the residual itself, this one continues near collapse and with non-associated flow. An iteration whose
    residual reaches ten times the forces at work is abandoned, and so is one whose least residual has not halved within
    `patience` iterations, if that is given.
    """
    residuals = [system.start()]
    if residuals[0] == float("inf"):
        return NewtonReport(False, residuals, system.reason)
    while residuals[-1] > tolerance or len(residuals) <= min_iterations or system.wants_more(tolerance):
        if len(residuals) > max_iterations and residuals[-1] <= tolerance:
            break
        if len(residuals) > max_iterations:
            return NewtonReport(False, residuals, f"residual {residuals[-1]:.1e} after {max_iterations} iterations")
        if patience and len(residuals) > patience and min(residuals[-patience:]) > 0.5 * min(residuals[:-patience]):
            return NewtonReport(
                False, residuals, f"residual {residuals[-1]:.1e}: the iterates alternate and do not converge"
            )
        if not system.correction():
            return NewtonReport(False, residuals, system.reason or "the linear solver failed")
        residual = line_search(system, max_halvings)
        if residual == float("inf"):
            return NewtonReport(False, residuals, system.reason)
        if residual > RUN_AWAY:
            return NewtonReport(False, residuals, f"residual {residual:.1e}: the iteration diverges")
        system.keep()
        residuals.append(residual)
    return NewtonReport(True, residuals)


def line_search(system: System, max_halvings: int) -> float:
    """Add a fraction of the correction to a system, chosen as in `newton`; returns the residual there."""
    work = abs(system.work())
    best_fraction, best_residual = 1.0, float("inf")
    for halving in range(max_halvings + 1):
        fraction = 0.5**halving
        residual = system.move(fraction)
        if residual < float("inf") and abs(system.work()) <= 0.8 * work:
            return residual
        if residual < best_residual:
            best_fraction, best_residual = fraction, residual
    return system.move(best_fraction)


@dataclass(frozen=True)
class Newton:
    """Newton's method with the consistent tangent and a line search; linear systems by PETSc.

    The default linear solver is direct where the system is small and GMRES with algebraic multigrid where it is large.
    PETSc options change it, for instance ``-implicit_ksp_type gmres -implicit_pc_type gamg``.
    """

    tolerance: float = 1e-8
    """|r| at which a step is solved, relative to the largest of |f_ext|, |f_int| and inertia"""
    max_iterations: int = 25
    max_halvings: int = 5
    """Halvings of a correction that does not lower the work of the residual"""
    prefix: str = "implicit_"
    """Prefix of the PETSc options"""

    def solver(self, comm: MPI.Comm, dim: int) -> NewtonSolver:
        """Solver of the steps of a run."""
        return NewtonSolver(self, comm, dim)


class NewtonSolver:
    """Newton's method over the steps of a run: keeps the matrices while the active cells stay the same."""

    def __init__(self, options: Newton, comm: MPI.Comm, dim: int) -> None:
        self._options, self._comm, self._dim = options, comm, dim
        self._tangent: Tangent | None = None

    def solve(self, step: Any, dt: float, changed: bool) -> Solution:
        """Solve r = 0 for a started step.

        Args:
            step: the core's implicit step, started.
            dt: its length [s].
            changed: whether its active nodes or cells differ from those of the last step solved.
        """
        if changed:
            self._tangent = None
        system = _StepSystem(self, step, dt)
        tolerances = [self._options.tolerance]
        if step.has_surface:
            tolerances.insert(0, max(ROUGH, self._options.tolerance))
        iterations = 0
        for tolerance in tolerances:
            report, revised, more = self._with_surface(system, step, tolerance)
            iterations += more
            if revised or not report.converged:
                break
        return Solution(
            report.residuals,
            iterations=iterations,
            converged=report.converged and not revised,
            easy=iterations <= EASY_ITERATIONS,
            reason=f"where water leaves was not found in {MOST_SURFACES} guesses" if revised else report.reason,
            linear_iterations=system.linear_iterations,
        )

    def _with_surface(self, system: _StepSystem, step: Any, tolerance: float) -> tuple[NewtonReport, bool, int]:
        """Solve, with guesses of where water leaves; returns the last course, whether the guess is wrong, and all iterations."""
        o, iterations = self._options, 0
        for _ in range(MOST_SURFACES):
            report = newton(system, tolerance, o.max_iterations, o.max_halvings, min_iterations=0)
            iterations += report.iterations
            revised = report.converged and step.has_surface and step.revise_surface()
            if not revised:
                break
        return report, revised, iterations

    @property
    def tolerance(self) -> float:
        """Tolerance of the residual."""
        return self._options.tolerance

    def tangent_of(self, step: Any) -> Tangent:
        """The tangent at a step's iterate."""
        step.assemble()
        if self._tangent is None:
            self._tangent = Tangent(step, self._comm, self._dim, self._options.prefix)
        self._tangent.update(step)
        return self._tangent

    def with_bodies(
        self, step: Any, tangent: Tangent, du: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], ...] | None:
        """The corrections of nodes and of rigid bodies that forces move; None where they cannot be found.

        The bodies have few unknowns dq, so that du is eliminated: with J Z = B, (E - C Z) dq = R - C J^-1 r and
        du = J^-1 r - Z dq (implicit/driven_bodies.h).

        Args:
            step: the core's implicit step, with its tangents.
            tangent: J.
            du: J^-1 r, of this rank's nodes.
        """
        right = step.body_residual
        n = len(right)
        if n == 0:
            return du, right
        columns, rows = (vectors.reshape(n, -1) for vectors in (step.body_columns, step.body_rows))
        rows = rows + tangent.by_displacement(step.body_rows_by_strain.reshape(n, -1))
        solved = [tangent.solve(column) for column in columns]
        if any(z is None for z in solved):
            return None
        z = np.array(solved)
        products = self._comm.allreduce(np.column_stack([rows @ z.T, rows @ du]))
        block = step.body_block.reshape(n, n)
        remaining = block - products[:, :n]
        if np.linalg.cond(remaining) > FLOATING or not remaining.diagonal().min() > block.diagonal().max() / FLOATING:
            return None
        dq = np.linalg.solve(remaining, right - products[:, n])
        return du - dq @ z, dq

    def sum(self, value: float) -> float:
        """Over all ranks."""
        return self._comm.allreduce(value)


class _StepSystem:
    """An implicit step as a system for `newton`."""

    def __init__(self, solver: NewtonSolver, step: Any, dt: float) -> None:
        self._solver, self._step, self._dt = solver, step, dt
        self._has_tangents = False
        self._last, self._reduction = np.inf, 1.0
        self._water = Conservation()
        self.reason = ""
        self.linear_iterations: list[int] = []

    def start(self) -> float:
        residual = self._trial(tangents=True)
        if residual == float("inf"):  # v0 carried on over the whole step is too much; begin at rest
            self._step.iterate = np.zeros_like(self._step.iterate)
            self._step.body_velocity = np.zeros_like(self._step.body_velocity)
            residual = self._trial(tangents=True)
        self._base, self._last = self._step.iterate, residual
        self._base_bodies = self._step.body_velocity
        return residual

    def correction(self) -> bool:
        if not self._has_tangents:
            self._trial(tangents=True)
        tangent = self._solver.tangent_of(self._step)
        du = tangent.solve(self._step.residual)
        self.linear_iterations.append(tangent.iterations)
        if du is None:
            self.reason = tangent.failure
            return False
        found = self._solver.with_bodies(self._step, tangent, du)
        if found is None:
            self.reason = tangent.failure or NOT_HELD
            return False
        self._correction, self._body_correction = (change / self._dt for change in found)
        return True

    def move(self, fraction: float) -> float:
        self._step.iterate = self._base + fraction * self._correction
        self._step.body_velocity = self._base_bodies + fraction * self._body_correction
        return self._trial(tangents=fraction == 1.0 and not self._ends_next())

    def work(self) -> float:
        bodies = float(self._step.body_residual @ self._body_correction)  # the same on all ranks
        return self._solver.sum(float(self._step.residual @ self._correction)) + bodies

    def keep(self) -> None:
        self._base, self._base_bodies = self._step.iterate, self._step.body_velocity
        self._reduction, self._last = self._residual / self._last, self._residual

    def _ends_next(self) -> bool:
        """Whether the next residual will be the last one, if the iteration converges quadratically; it needs no tangents."""
        return self._last * self._reduction**2 < self._solver.tolerance

    def _trial(self, tangents: bool) -> float:
        report = self._step.trial(tangents=tangents)
        self._has_tangents = tangents
        if report["failed"]:
            self.reason = report["reason"]
            return float("inf")
        self._residual, self._water.lost = relative(report), report["lost_water"]
        return self._residual

    def wants_more(self, tolerance: float) -> bool:
        return self._water.wants_more(tolerance)
