"""The implicit scheme over time: steps that are cut when they fail and grow again when they are easy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._core import InputError, RunError
from .checks import within
from .ghost import GhostPenalty
from .report import ImplicitReport
from .solution import Solution

if TYPE_CHECKING:
    from .model import Model

MAX_CUTS = 10
"""A step is not made shorter than dt / 2^MAX_CUTS."""


def implicit_options(
    model: Model, damping: float, pic: float, nmd: bool, quasi_static: bool, ghost: GhostPenalty | None
) -> Any:
    """The core's options of the scheme; see `Model.implicit`."""
    options = _core.ImplicitOptions()
    options.damping = within("damping", damping, 0, 1, open_above=True)
    options.pic_share = within("pic", pic, 0, 1)
    options.mixed_discretisation = bool(nmd)
    options.quasi_static = bool(quasi_static)
    options.ghost = (ghost or GhostPenalty()).options()
    if model.comm.allreduce(len(model.particles)) == 0:
        raise InputError("the model has no particles, seed some first")
    return options


class Stepper:
    """Implicit steps of a model, with what they took since the last report.

    Args:
        model: the model.
        solver: how to solve a step, such as ``Newton()``.
        options: the core's options of the scheme.
        dt: longest step [s].
    """

    def __init__(self, model: Model, solver: Any, options: Any, dt: float) -> None:
        self._model, self._core = model, model._core
        self._step = (_core.ImplicitStep2 if model.mesh.dim == 2 else _core.ImplicitStep3)(model._core)
        self._solver = solver.solver(model.comm, model.mesh.dim)
        self._options = options
        self._longest = self._dt = dt
        self._changed = True
        self._iterations = self._cuts = 0
        self.last = Solution()
        """How the last step tried was solved"""

    def advance(self, until: float) -> None:
        """One step towards a time, cut as often as it must be.

        Raises:
            RunError: the shortest step failed too; with the reason. The particles are as they were.
        """
        while True:
            left = until - self._core.time
            dt = left / max(1, int(np.ceil(left / self._dt - 1e-6)))
            reason = self.attempt(dt)
            if not reason:
                break
            self._cuts += 1
            self._dt = dt / 2
            if self._dt < self._longest / 2**MAX_CUTS:
                raise RunError(
                    f"the implicit step at t = {self._core.time:.9g} s failed with all lengths from {self._longest:.3g} s "
                    f"down to {dt:.3g} s: {reason}"
                )
        if self.last.easy:
            self._dt = min(self._longest, 2 * self._dt)

    def attempt(self, dt: float) -> str:
        """Try one step; the particles change only when it succeeds. Returns why it did not, or nothing."""
        self._changed |= self._step.start(self._options, dt)
        self.last = self._solver.solve(self._step, dt, self._changed)
        self._changed = False
        self._iterations += self.last.iterations
        return self._step.finish() if self.last.converged else self.last.reason

    def report(self) -> ImplicitReport:
        """Where the run stands; counts begin anew."""
        report = ImplicitReport(
            **vars(self._model.report()),
            iterations=self._iterations,
            cuts=self._cuts,
            residual=self.last.residuals[-1],
        )
        self._iterations = self._cuts = 0
        return report


def run_implicit(
    model: Model, solver: Any, options: Any, *, until: float, dt: float, interval: float | None
) -> Iterator[ImplicitReport]:
    """Step until a time; reports at intervals, or after each step."""
    stepper = Stepper(model, solver, options, dt)
    start, close = model.time, 1e-9 * abs(until)
    length = until - start if interval is None else interval
    count = 1 if interval is None else max(1, int(np.ceil((until - start) / length - 1e-9)))
    for k in range(1, count + 1):
        target = until if k == count else start + k * length
        while target - model.time > close:
            stepper.advance(target)
            if target - model.time <= close:
                model._core.time = target
            if interval is None:
                yield stepper.report()
        if interval is not None:
            yield stepper.report()


def settle(model: Model, solver: Any, options: Any, tolerance: float, max_steps: int) -> ImplicitReport:
    """Quasi-static steps at the present time until the particles balance their loads.

    Only the first moves the particles. One that moves again may cross into the next cell and back for ever, each time with a
    jump of the nodal forces that sends it there.
    """
    stepper = Stepper(model, solver, options, 1.0)
    time = model.time
    for _ in range(max_steps):
        model._core.time = time - 1.0  # loads are those of the step's end
        reason = stepper.attempt(1.0)
        model._core.time = time
        options.hold_positions = True
        if reason:
            raise RunError(f"no equilibrium at t = {time:.9g} s: {reason}")
        report = stepper.report()
        if report.unbalanced_ratio <= tolerance:
            return report
    raise RunError(
        f"out-of-balance ratio is {report.unbalanced_ratio:.3g} after {max_steps} steps without load, expected {tolerance:.3g}"
    )
