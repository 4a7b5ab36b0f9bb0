"""Newton's method with a line search, for any system that gives its residual and solves with its tangent."""

from __future__ import annotations

from typing import NamedTuple

_RUN_AWAY = 10.0


class NewtonReport(NamedTuple):
    """How an iteration went.

    residuals: relative to the forces at work, one before each iteration and one at the end
    reason: why it did not converge; empty when it did
    """

    converged: bool
    residuals: list
    reason: str = ""

    @property
    def iterations(self):
        return len(self.residuals) - 1


def newton(system, tolerance=1e-8, max_iterations=25, max_halvings=5):
    """Bring a system to equilibrium.

    system: has `start()`, which takes the first residual; `correction()`, which solves the tangent system for it and
    tells whether that worked; `move(step)`, which adds a share of the correction to the last point of the iteration
    and takes the residual there, infinite for a `reason`; `work()`, the residual times the correction; `keep()`, which
    makes this the last point. Residuals are relative.
    The full correction is halved until the work of the residual has fallen to 0.8 of what it was (Matthies, Strang
    1979, IJNME 14, 1613-1626); when no share does that, the one with the smallest residual is taken. Unlike a search
    that wants the residual itself to fall, this goes on near collapse and with non-associated flow. An iteration whose
    residual reaches ten times the forces at work is given up.
    """
    residuals = [system.start()]
    while residuals[-1] > tolerance or len(residuals) == 1:
        if len(residuals) > max_iterations:
            return NewtonReport(False, residuals, f"residual {residuals[-1]:.1e} after {max_iterations} iterations")
        if not system.correction():
            return NewtonReport(False, residuals, "the linear solver failed")
        residual = _line_search(system, max_halvings)
        if residual == float("inf"):
            return NewtonReport(False, residuals, system.reason)
        if residual > _RUN_AWAY:
            return NewtonReport(False, residuals, f"residual {residual:.1e}: the iteration ran away")
        system.keep()
        residuals.append(residual)
    return NewtonReport(True, residuals)


def _line_search(system, max_halvings):
    """Move by a share of the correction; returns the residual there."""
    work = abs(system.work())
    best_step, best_residual = 1.0, float("inf")
    for halving in range(max_halvings + 1):
        step = 0.5**halving
        residual = system.move(step)
        if residual < float("inf") and abs(system.work()) <= 0.8 * work:
            return residual
        if residual < best_residual:
            best_step, best_residual = step, residual
    return system.move(best_step)
