"""Load steps: equilibrium under a changing load or strength, with steps that shrink on failure and grow on success."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from mpi4py import MPI
from mpm_core.checks import positive
from mpm_core.step_control import StepControl, first_part

from fenics_bridge.errors import InputError
from fenics_bridge.fem.equilibration import EquilibriumReport
from fenics_bridge.fem.loads import Load

_MOST_STEPS = 1000
FIRST_STEP = 0.25
"""First step that applies a load, as a fraction of the way [-], unless soil has a small-strain stiffness"""
FAR = 1e6
"""Way in first steps beyond which a value without a bound has shown no failure"""

LOADING = "part of the load"
"""Quantity of steps that apply a load"""


class LoadStep(NamedTuple):
    """One attempted load step."""

    number: int
    """Number of the step, from 1 on"""
    value: float
    """Value that was changed, such as the load factor, at the end of the step"""
    size: float
    """Amount of the change"""
    report: EquilibriumReport
    """How the equilibrium was found, or why there is none"""
    quantity: str = "value"
    """What the value is: the fraction of a load that is being applied, or else what the caller changes"""

    def __repr__(self) -> str:
        return f"<LoadStep {self.number}: to {self.value:.6g} by {self.size:.3g}; {self.report!r}>"

    @property
    def converged(self) -> bool:
        """Whether the step ended in equilibrium."""
        return self.report.converged


def advance(
    equilibrate: Callable[[float], EquilibriumReport],
    start: float,
    end: float,
    first_step: float,
    tolerance: float,
    progress: Callable[[LoadStep], Any] | None = None,
    quantity: str = "value",
) -> list[LoadStep]:
    """Increase a value from `start` towards `end` in equilibrium, until the end is reached or no further step succeeds.

    Args:
        equilibrate: function of the value that returns an EquilibriumReport.
        start: value at the start, in equilibrium.
        end: value to reach; infinite to go on up to failure, or until the value is `FAR` first steps away.
        first_step: size of the first step, in the units of the value. Two easy steps in a row double it, a step without
            equilibrium halves it. A value at which the body fails is never passed; below it values are bisected.
        tolerance: size, as a fraction of the value (or of the first step, if that is more), below which steps end.
        progress: function that is called with each load step.
        quantity: what the value is, for the steps.

    Returns:
        All steps; the last converged one is the last equilibrium.

    Raises:
        InputError: first_step is not positive, or tolerance not between 0 and 1.
    """
    _check_steps(first_step, tolerance)
    steps: list[LoadStep] = []
    value, easy, failed_at, undecided = start, 0, math.inf, False
    control = StepControl(math.inf, min(first_step, end - start))
    limit = start + FAR * max(first_step, tolerance * abs(start)) if math.isinf(end) else end
    while value < limit and len(steps) < _MOST_STEPS:
        smallest = tolerance * max(abs(value), first_step)
        if control.cuts == 0:  # a first step below the tolerance is no reason to end
            control.length = max(control.length, smallest)
        size = control.length = min(control.length, 0.5 * (failed_at - value))
        if size < smallest:
            break
        target = end if size >= (end - value) * (1 - 1e-12) else value + size
        steps.append(LoadStep(len(steps) + 1, target, target - value, equilibrate(target), quantity))
        if progress is not None:
            progress(steps[-1])
        if steps[-1].converged:
            value = target
            easy = easy + 1 if steps[-1].report.easy else 0
            if easy == 2:
                control.grow()
                easy = 0
            if failed_at < math.inf and not undecided:
                control.length = 0.5 * (failed_at - value)
        else:
            control.cut(target - value)
            easy = 0
            undecided = undecided or steps[-1].report.outcome == "undecided"
            if steps[-1].report.outcome == "failure":
                failed_at = target
                control.length = max(_below_failure(value, target, steps[-1].report.carried), smallest)
    return steps


def _check_steps(first_step: Any, tolerance: Any) -> None:
    positive("first_step", first_step, "(in the units of the value)")
    if not 0 < positive("tolerance", tolerance, "(a fraction)") < 1:
        raise InputError(f"tolerance is {tolerance}, expected a fraction between 0 and 1")


def _below_failure(value: float, failed_at: float, carried: float) -> float:
    """Size of the step after a failure: half of the way, or less where the mechanism carries less than that.

    Args:
        value: last value in equilibrium.
        failed_at: value at which the body failed.
        carried: fraction of the load that the stresses carry in the mechanism [-]; times the load an estimate of the collapse
            load, mostly from above.
    """
    gap = failed_at - value
    return float(np.clip(np.nan_to_num(carried, nan=1.0) * failed_at - value, 0.1 * gap, 0.5 * gap))


def print_step(step: LoadStep) -> None:
    """Print a line on a load step to standard error, from rank 0.

    It gives the number of the step, the value by its name and its change, the linear systems solved or explicit steps made, the last
    residual, and the outcome.

    Args:
        step: the load step.
    """
    if MPI.COMM_WORLD.rank != 0:
        return
    report = step.report
    cause = report.cause or report.reason
    why = cause if np.isnan(report.carried) else f"the stresses carry {report.carried:.2%} of the load"
    state = {"equilibrium": "ok", "failure": f"fails: {why}"}.get(report.outcome, f"undecided ({cause})")
    print(
        f"step {step.number:3d}  {step.quantity} {step.value:<12.6g} size {step.size:<10.3g} "
        f"{report.method} {report.iterations:2d}  residual {report.residuals[-1]:.1e}  {state}",
        file=sys.stderr,
        flush=True,
    )


def raise_load(
    model: Any, load: Load, first_step: float | None, tolerance: float, progress: Callable[[LoadStep], Any] | None
) -> list[LoadStep]:
    """Raise the load of a model from its present one to the given one, by `advance` over the fraction of the way.

    Sets `converged` of the model to whether the load was reached, and warns if it was not. Without a first step it follows from the laws of the
    model. Collective.
    """
    start = model.load
    first_step = first_part(model.laws, FIRST_STEP) if first_step is None else first_step
    _warn_of_unmoved(model, load)
    steps = advance(
        lambda fraction: model.equilibrate(start.towards(load, fraction)),
        0.0,
        1.0,
        first_step,
        tolerance,
        progress,
        LOADING,
    )
    model.converged = bool(steps) and steps[-1].converged and steps[-1].value == 1.0
    if not model.converged and MPI.COMM_WORLD.rank == 0:
        warnings.warn(_not_reached(steps), RuntimeWarning, stacklevel=3)
    return steps


def _warn_of_unmoved(model: Any, load: Load) -> None:
    """Warn of a load that leaves prescribed displacements out, or takes them back."""
    moved = next((support for support in model.supports if any(support.displacement or ())), None)
    if moved and load.displacement == 0 and MPI.COMM_WORLD.rank == 0:
        warnings.warn(
            f"displacement of the load is 0, so that {moved} is held at zero; Load(displacement=1.0) prescribes its displacement",
            RuntimeWarning,
            stacklevel=4,
        )


def _not_reached(steps: list[LoadStep]) -> str:
    """Remainder of a load that was to be applied."""
    reached = max((step.value for step in steps if step.converged), default=0.0)
    # Steps below it that failed were passed by smaller ones.
    above = (step for step in steps if not step.converged and step.value > reached)
    failed = min(above, key=lambda step: step.value, default=None)
    reason = f": at {failed.value:.3%} {failed.report.reason}" if failed is not None else ""
    return (
        f"the load was not reached, `converged` is False: displacements and stresses are those of the last equilibrium, "
        f"{reached:.3%} of the way from the load before{reason}"
    )
