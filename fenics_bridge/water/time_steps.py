"""Following a consolidation in time, with steps that grow and shrink."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from mpm_core.step_control import StepControl

from fenics_bridge.errors import agree, is_finite
from fenics_bridge.water.consolidation_pace import Pace
from fenics_bridge.water.drainage import warn_of_coarse_cells

SHORTEST = 1e-4
"""Step, over the first one, below which a run gives up."""


def run(
    model: Any,
    until: float,
    first_step: float,
    growth: float,
    longest: float,
    progress: Callable[[Any], Any] | None,
    accuracy: float | None,
) -> list[Any]:
    """Do what `Consolidation.run` says."""
    agree(model.domain.comm, _mistake(until, model.time, first_step, growth, longest, accuracy))
    if model.motion is None and not model._named_coarse_cells:
        model._named_coarse_cells = warn_of_coarse_cells(model, min(first_step, longest), until)
    reports, control = [], StepControl(longest, min(first_step, longest))
    displacements = lambda: model._body.solution.x.array[model._displacements[1]]  # a copy
    model._pace = _pace(model._pace, control.length, accuracy)
    while model.time < until * (1 - 1e-12) and control.length >= SHORTEST * first_step:
        step, start = min(control.length, until - model.time), displacements()
        reports.append(model.advance(step))
        if progress is not None:
            progress(reports[-1])
        if not reports[-1].converged:
            control.cut(step)
            continue
        if reports[-1].easy:
            control.grow(growth)
        if model._pace is not None:
            now = displacements()
            control.length = model._pace.next_length(step, control.length, now - start, now, model.domain.comm)
    return reports


def _pace(before: Pace | None, first_step: float, accuracy: float | None) -> Pace | None:
    """The pace of a run, which goes on with that of the run before unless its first step is shorter, as after a change of the load."""
    if accuracy is None:
        return None
    if before is None or first_step < before.recent * (1 - 1e-9):
        return Pace(first_step, accuracy)
    before.accuracy = accuracy
    return before


def _mistake(
    until: float, time: float, first_step: float, growth: float, longest: float, accuracy: float | None
) -> str | None:
    if not (is_finite(until) and until > time):
        return f"until is {until!r} s, expected a time after the present one, {time:g} s"
    if not (is_finite(first_step) and first_step > 0):
        return f"first_step is {first_step!r} s, expected a positive number"
    if not longest > 0:
        return f"longest is {longest!r} s, expected a positive number"
    if accuracy is not None and not (is_finite(accuracy) and accuracy > 0):
        return f"accuracy is {accuracy!r}, expected a positive number, or None"
    return None if is_finite(growth) and growth >= 1 else f"growth is {growth!r}, expected 1 or more"
