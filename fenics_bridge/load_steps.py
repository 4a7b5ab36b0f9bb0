"""Following an equilibrium as a load, or a strength, changes: steps that shrink on failure and grow on success."""

from __future__ import annotations

import sys
from typing import NamedTuple

from mpi4py import MPI
from mpm_core.newton import NewtonReport

_MOST_STEPS = 1000
_EASY = 8
"""Iterations of Newton's method up to which a step counts as easy."""


class LoadStep(NamedTuple):
    """One attempted step. value: what was changed, at the end of the step; report: of Newton's method."""

    number: int
    value: float
    size: float
    report: NewtonReport

    @property
    def converged(self):
        return self.report.converged


def advance(equilibrate, start, end, first_step, tolerance, progress=None):
    """Move a value up from `start` towards `end`, keeping equilibrium, until it is there or no further step succeeds.

    equilibrate: function of the value that returns a NewtonReport
    first_step: size of the first step, in the units of the value; a step that fails is halved, and until one has
    failed two easy ones double it. tolerance: size, as a share of the value (or of the first step, if that is more),
    below which it is not halved any further
    progress: called with each LoadStep, or None. Returns all steps; the last converged one is the last equilibrium.
    """
    steps: list[LoadStep] = []
    value, size, easy, failed = start, min(first_step, end - start), 0, False
    while value < end and len(steps) < _MOST_STEPS:
        target = end if size >= (end - value) * (1 - 1e-12) else value + size
        steps.append(LoadStep(len(steps) + 1, target, target - value, equilibrate(target)))
        if progress is not None:
            progress(steps[-1])
        if steps[-1].converged:
            value = target
            easy = easy + 1 if steps[-1].report.iterations <= _EASY else 0
            if easy == 2 and not failed:
                size, easy = 2 * size, 0
        else:
            failed = True
            size = (target - value) / 2
            if size < tolerance * max(abs(value), first_step):
                break
    return steps


def print_step(step):
    """Progress line, from rank 0: number of the step, value, size, iterations of Newton, last residual."""
    if MPI.COMM_WORLD.rank != 0:
        return
    report = step.report
    state = "ok" if step.converged else f"failed, halved ({report.reason})"
    print(
        f"step {step.number:3d}  value {step.value:<12.6g} size {step.size:<10.3g} "
        f"Newton {report.iterations:2d}  residual {report.residuals[-1]:.1e}  {state}",
        file=sys.stderr,
        flush=True,
    )


def raise_load(model, load, first_step, tolerance, progress):
    """Raise the load of a model from its present one to the given one, by `advance` over the share of the way.

    Sets `converged` of the model to whether the load was reached. Returns a list of LoadStep. Collective.
    """
    start = model.load
    steps = advance(
        lambda share: model.equilibrate(start.towards(load, share)), 0.0, 1.0, first_step, tolerance, progress
    )
    model.converged = bool(steps) and steps[-1].converged and steps[-1].value == 1.0
    return steps
