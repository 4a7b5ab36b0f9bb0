"""Collapse load and factor of safety: the last equilibrium as the load rises, or as the strength falls."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import InputError, agree
from fenics_bridge.fem.deconfinement import warn_of_held
from fenics_bridge.fem.load_steps import LoadStep, advance
from fenics_bridge.fem.loads import Load
from fenics_bridge.fem.locking import warn_of_few_cells, warn_of_locking_at_failure
from fenics_bridge.fem.mixed import MixedQuasiStatic
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.fem.strength import reduced_strength
from fenics_bridge.mesh.names import names_of
from fenics_bridge.types import Laws

HALVINGS = 3
"""How often the first factor of safety is halved at most"""
LEAST_CARRIED = 0.1
"""Part of the load under which a body must fail for that to help"""


@dataclass(frozen=True)
class Collapse:
    """The last equilibrium below collapse, and the evidence of failure above it."""

    value: float
    """Value of the load or of the factor of safety at the last equilibrium"""
    failed_at: float
    """Smallest value above `value` at which the body was shown to fail, or that was tried if it was shown at none"""
    failed: bool
    """Whether the body was shown to fail at `failed_at`: it flows in a mechanism under a load that its stresses do not carry. If
    not, the solver did not converge there, and `value` is a lower bound only"""
    reason: str
    """Why there is no equilibrium at `failed_at`, in words"""
    carried: float
    """Fraction of the load that the stresses carry in the mechanism at `failed_at` [-], below 1; NaN if failure was not shown"""
    residual: float
    """Largest out-of-balance force that was accepted on the way, over the forces at work [-]"""
    missing: float
    """Largest fraction of its strength that was accepted as missing in a cell that yields, by `missing_tolerance` [-]"""
    curve: NDArray[np.float64]
    """Value and largest displacement of a node [m] at every equilibrium on the way, shape (k, 2)"""
    mechanism: fem.Function
    """Displacement of the mechanism where failure was shown, otherwise increment of the last step with equilibrium; scaled to a
    largest displacement of 1"""
    steps: list[LoadStep]
    """Every load step that was tried"""

    def __repr__(self) -> str:
        if math.isinf(self.failed_at):
            return f"<Collapse: no failure, in equilibrium at every value up to {self.value:.6g}; {len(self.steps)} load steps>"
        above = "failure shown" if self.failed else "no equilibrium found, failure not shown,"
        return (
            f"<Collapse: {self.value:.6g} at the last equilibrium, {above} at {self.failed_at:.6g}; "
            f"{len(self.steps)} load steps, out-of-balance ratio up to {self.residual:.2g}>"
        )


def collapse_load(
    model: QuasiStatic | MixedQuasiStatic,
    load_of: Callable[[float], Load],
    first_step: float,
    start: float = 0.0,
    tolerance: float = 2e-3,
    progress: Callable[[LoadStep], Any] | None = None,
) -> Collapse:
    """Raise a load until there is no equilibrium: steps double while they converge easily, and are bisected below a failure.

    Afterwards the model is in the last equilibrium, so that its `converged` is True. Collective.

    Args:
        model: finite elements in equilibrium under `load_of(start)`, e.g. fresh and unloaded.
        load_of: function of a number, the load's value, that returns the load.
        first_step: size of the first step, in the units of the value.
        start: value to begin with.
        tolerance: fraction of the value below which steps end [-]; `failed_at` is above the result by twice this fraction at most
            where failure was shown.
        progress: function that is called with each load step, e.g. `print_step`.

    Returns:
        The result, whose `failed` says whether failure was shown.

    Raises:
        InputError: `load_of` is no function, or not even the first steps find equilibrium. Raised on all ranks alike.
    """
    problem = f"load_of is {load_of!r}, expected a function of a number that returns a Load"
    agree(model.domain.comm, None if callable(load_of) else problem)
    warn_of_locking_at_failure(model)
    found = _follow(model, lambda value: model.equilibrate(load_of(value)), start, first_step, tolerance, progress)
    model.converged = True  # under the load of the last equilibrium, whatever the steps above it
    warn_of_few_cells(model, found.mechanism)
    return found


def factor_of_safety(
    model: QuasiStatic | MixedQuasiStatic,
    load: Load,
    start: float = 0.5,
    first_step: float = 0.1,
    tolerance: float = 2e-3,
    progress: Callable[[LoadStep], Any] | None = None,
    unreduced: Collection[int | str] = (),
    reduce: Callable[[Laws, float, Collection[int | str]], Laws] = reduced_strength,
) -> Collapse:
    """Factor by which the strength can be divided before equilibrium under a load is lost. Collective.

    Afterwards the model has its own laws again, and the stresses of the last equilibrium; its `converged` says whether these laws
    bear them, as they do if the factor is 1 or more.

    Args:
        model: finite elements, unloaded or in equilibrium under a load on the way to `load`, with any law that `reduce` knows.
        load: load under which the factor is found; forces that it holds after a stage with a deconfinement support the body, with a warning.
        start: factor to begin with, below 1 with more strength than the laws have. Where the body then carries a part of the load only, it is
            halved, up to three times.
        first_step: first increment of the factor.
        tolerance: fraction of the factor below which steps end [-]; `failed_at` is above the result by twice this fraction at most
            where failure was shown.
        progress: function that is called with each load step, e.g. `print_step`.
        unreduced: cell tags whose laws keep their strength.
        reduce: function of law, factor and `unreduced` that returns the law, or laws by cell tag, with less strength.

    Returns:
        The result, whose value is the factor, and whose `failed` says whether failure was shown above it.

    Raises:
        InputError: the model is another one, or the load is not carried at the start. Raised on all ranks alike.
    """
    if isinstance(model, mpm.Model) or not hasattr(model, "law"):
        raise InputError(
            f"model is {type(model).__name__}, expected a QuasiStatic or a MixedQuasiStatic; for particles there is "
            "particle_safety"
        )
    warn_of_held(model.domain.comm, load)
    law = model.law
    unreduced = _tags_of(model, law, unreduced)

    def weaken(factor: float) -> Any:
        return model.equilibrate(load, law=reduce(law, factor, unreduced))

    try:
        model.law = reduce(law, start, unreduced)
        warn_of_locking_at_failure(model)  # of the reduced laws, whose flow may be associated
        for halving in range(HALVINGS + 1):
            steps = model.solve(load, progress=progress)
            if model.converged or halving == HALVINGS or not _may_carry(steps):
                break
            start *= 0.5
            model.law = reduce(law, start, unreduced)
        agree(model.domain.comm, None if model.converged else _not_carried(start, steps))
        found = _follow(model, weaken, start, first_step, tolerance, progress)
        warn_of_few_cells(model, found.mechanism)
    finally:
        model.law = law
    model.converged = found.value >= 1.0
    return found


def _may_carry(steps: list[LoadStep]) -> bool:
    """Whether more strength may help a body that does not carry its load: it fails under a good part of it."""
    failed = any(step.report.outcome == "failure" for step in steps)
    return failed and max((step.value for step in steps if step.converged), default=0.0) > LEAST_CARRIED


def _tags_of(model: Any, law: Laws, unreduced: Collection[int | str]) -> Collection[int | str]:
    """Names of soils as the tags by which the body has its laws: a site with stages has them by number."""
    if not isinstance(law, dict) or isinstance(unreduced, (str, int)):
        return unreduced
    names = names_of(model.cell_tags)
    return [number for tag in unreduced for number in ((tag,) if tag in law else names.get(str(tag), (tag,)))]


def _not_carried(start: float, steps: list[LoadStep]) -> str:
    """Message: why the load is not carried at the start, and possible remedies."""
    last = next((step for step in reversed(steps) if not step.converged), steps[-1])
    carried = max((step.value for step in steps if step.converged), default=0.0)
    return (
        f"start: with the strength divided by {start!r} only {carried:.1%} of the load is carried; at {last.value:.1%}: "
        f"{last.report.reason}{', or take a smaller start' if carried > 0 else ''}"
    )


def _follow(
    model: Any,
    equilibrate: Callable[[float], Any],
    start: float,
    first_step: float,
    tolerance: float,
    progress: Callable[[LoadStep], Any] | None,
) -> Any:
    """Increase the value from `start` until no step succeeds; records all steps."""
    comm, dim = model.domain.comm, model.domain.geometry.dim
    curve = [(start, _largest(model.displacement, comm, dim))]
    mechanism = fem.Function(model.displacement.function_space, name="mechanism")

    def attempt(value: float) -> Any:
        report = equilibrate(value)
        if report.converged:
            curve.append((value, _largest(model.displacement, comm, dim)))
        if report.converged or report.outcome == "failure":
            mechanism.x.array[:] = model.increment.x.array
        return report

    steps = advance(attempt, start, math.inf, first_step, tolerance, progress)
    above = [step for step in steps if step.value > curve[-1][0]]
    failures = [step for step in above if step.report.outcome == "failure"]
    if not above:
        return _unlimited(steps, np.array(curve), mechanism)
    last = min(failures or above, key=lambda step: step.value)
    agree(
        comm,
        None
        if len(curve) > 1 or start > 0
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
        **_accepted(steps),
        curve=np.array(curve),
        mechanism=mechanism,
        steps=steps,
    )


def _unlimited(steps: list[LoadStep], curve: Any, mechanism: Any) -> Collapse:
    """The result where every step found equilibrium: a lower bound only."""
    reason = f"equilibrium at every value up to {curve[-1, 0]:.3g}: the body may not be able to fail in this way"
    return Collapse(
        curve[-1, 0],
        math.inf,
        False,
        reason,
        math.nan,
        **_accepted(steps),
        curve=curve,
        mechanism=mechanism,
        steps=steps,
    )


def _accepted(steps: list[LoadStep]) -> Any:
    """States that were accepted as equilibrium on the way; not a number where there was none beyond the start."""
    reports = [step.report for step in steps if step.converged]
    return {
        "residual": max((report.residuals[-1] for report in reports), default=math.nan),
        "missing": max((report.missing for report in reports), default=math.nan),
    }


def _largest(function: Any, comm: MPI.Comm, dim: int) -> float:
    """Largest displacement of a node [m]."""
    lengths = np.linalg.norm(function.x.array.reshape(-1, dim), axis=1)
    return max(comm.allgather(float(lengths.max(initial=0.0))))
