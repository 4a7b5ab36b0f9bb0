"""Collapse load and factor of safety: the last equilibrium as the load rises, or as the strength falls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from fenics_bridge.errors import agree
from fenics_bridge.fem.load_steps import advance
from fenics_bridge.fem.strength import reduced_strength


@dataclass(frozen=True)
class Collapse:
    """The last equilibrium below collapse, and the evidence of failure above it.

    value: of the load or of the factor of safety there
    failed: whether the body was shown to fail at `failed_at`: it flows in a mechanism under a load that its stresses do not
        carry. If not, the solver did not converge there, and `value` is a lower bound only; reason: in words
    failed_at: smallest value above `value` at which it was shown to fail, or that was tried if it was shown at none
    carried: fraction of the load that the stresses carry in the mechanism at `failed_at` [-], below 1; NaN if not shown
    residual: largest out-of-balance force that was accepted on the way, over the forces at work [-]
    curve: (k, 2), value and largest displacement of a node [m] at every equilibrium on the way
    mechanism: function, displacement of the mechanism where failure was shown, otherwise increment of the last step with
        equilibrium; scaled to a largest displacement of 1
    steps: every LoadStep that was tried
    """

    value: float
    failed_at: float
    failed: bool
    reason: str
    carried: float
    residual: float
    curve: np.ndarray
    mechanism: fem.Function
    steps: list


def collapse_load(model, load_of, first_step, start=0.0, tolerance=2e-3, progress=None):
    """Raise a load to the last equilibrium: steps double while they converge easily; below a value that fails they bisect.

    model: QuasiStatic, in equilibrium under `load_of(start)`, e.g. fresh and unloaded
    load_of: function of a number, the load's value, that returns the Load
    first_step: of the value; tolerance: width of the last step as a fraction of the value [-]
    Returns a Collapse, whose `failed` says whether failure was shown. Raises InputError when not even the first steps
    find equilibrium. Collective.
    """
    return _follow(model, lambda value: model.equilibrate(load_of(value)), start, first_step, tolerance, progress)


def factor_of_safety(
    model, load, start=0.5, first_step=0.1, tolerance=2e-3, progress=None, unreduced=(), reduce=reduced_strength
):
    """Factor by which the strength can be divided before equilibrium under a load is lost.

    model: QuasiStatic, unloaded or in equilibrium under a load on the way to `load`, with any law that `reduce` knows
    start: factor to begin with; the body must carry the load with its strength divided by it (below 1: raised)
    first_step: of the factor; tolerance: width of the last step as a fraction of the factor [-]
    unreduced: cell tags whose laws keep their strength
    reduce: function (law, factor, unreduced) that returns the law, or laws by cell tag, with less strength
    Returns a Collapse whose value is the factor, and whose `failed` says whether failure was shown above it. Raises
    InputError when the load is not carried at the start. The model keeps the reduced law. Collective.
    """
    law = model.law
    model.law = reduce(law, start, unreduced)
    steps = model.solve(load, progress=progress)
    agree(model.domain.comm, None if model.converged else _not_carried(start, steps))

    def weaken(factor):
        return model.equilibrate(load, law=reduce(law, factor, unreduced))

    return _follow(model, weaken, start, first_step, tolerance, progress)


def _not_carried(start, steps):
    """Message: why the load is not carried at the start, and possible remedies."""
    last = next((step for step in reversed(steps) if not step.converged), steps[-1])
    carried = max((step.value for step in steps if step.converged), default=0.0)
    return (
        f"start: with the strength divided by {start!r} only {carried:.1%} of the load is carried; at {last.value:.1%}: "
        f"{last.report.reason}, or take a smaller start"
    )


def _follow(model, equilibrate, start, first_step, tolerance, progress):
    """Increase the value from `start` until no step succeeds; records all steps."""
    comm, dim = model.domain.comm, model.domain.geometry.dim
    curve = [(start, _largest(model.displacement, comm, dim))]
    mechanism = fem.Function(model.displacement.function_space, name="mechanism")

    def attempt(value):
        report = equilibrate(value)
        if report.converged:
            curve.append((value, _largest(model.displacement, comm, dim)))
        if report.converged or report.outcome == "failure":
            mechanism.x.array[:] = model.increment.x.array
        return report

    steps = advance(attempt, start, math.inf, first_step, tolerance, progress)
    above = [step for step in steps if step.value > curve[-1][0]]
    failures = [step for step in above if step.report.outcome == "failure"]
    last = min(failures or above, key=lambda step: step.value)
    agree(
        comm,
        None
        if len(curve) > 1
        else f"first_step: no equilibrium was found above {start!r}, {last.report.reason}; take a smaller one",
    )
    largest = _largest(mechanism, comm, dim)
    mechanism.x.array[:] /= largest if largest > 0 else 1.0
    return Collapse(
        value=curve[-1][0],
        failed_at=last.value,
        failed=last.report.outcome == "failure",
        reason=last.report.reason,
        carried=last.report.carried,
        residual=max(step.report.residuals[-1] for step in steps if step.converged),
        curve=np.array(curve),
        mechanism=mechanism,
        steps=steps,
    )


def _largest(function, comm, dim):
    """Largest displacement of a node [m]."""
    lengths = np.linalg.norm(function.x.array.reshape(-1, dim), axis=1)
    return max(comm.allgather(float(lengths.max(initial=0.0))))
