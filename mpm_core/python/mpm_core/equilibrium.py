"""Equilibrium of particles under their loads, by quasi-static steps without duration."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from ._core import InputError, Integration, RunError
from .implicit import Stepper
from .report import ImplicitReport
from .step_control import first_part

if TYPE_CHECKING:
    from .model import Model

FADING = 0.1
"""Factor on the ghost penalty between steps that only redistribute stresses"""


def beyond_equilibrium(model: Model, integration: Integration | None = None) -> str:
    """What `Model.equilibrate` does not support of a model and of an integration, in words; empty for nothing."""
    surfaces = ", ".join(entry["surface"]["kind"] for entry in model._contacts)
    fields = 1 + max(model._velocity_fields)
    beyond = {
        f"contact with rigid surfaces ({surfaces})": model._contacts,
        "structural members": model._members,
        "sides that absorb waves": model._absorbing,
        f"{fields} velocity fields": fields > 1,
        "pore water with a velocity of its own since explicit()": model._core.has_two_phases,
        "integration DUAL_DOMAIN": integration == Integration.DUAL_DOMAIN,
    }
    return " and ".join(name for name, there in beyond.items() if there)


def refuse_beyond_equilibrium(model: Model, integration: Integration | None) -> None:
    """Raises InputError for what `beyond_equilibrium` finds."""
    if beyond := beyond_equilibrium(model, integration):
        raise InputError(f"equilibrate() does not support {beyond}")


def find_equilibrium(model: Model, solver: Any, options: Any, tolerance: float, max_steps: int) -> ImplicitReport:
    """Quasi-static steps at the present time until the particles balance their loads.

    The out-of-balance force is applied at once, or in parts where that fails or soil has a small-strain stiffness. The steps that
    apply it move the particles; the steps that follow do not, because a particle could cross between two cells for ever, driven
    by the jump of the nodal forces at each crossing. The forces of the ghost penalty, which are part of a step's equilibrium but
    not of the particles', decrease from step to step. Supports with a prescribed velocity stand still.
    """
    with _standing_supports(model):
        return _found_equilibrium(model, solver, options, tolerance, max_steps)


@contextmanager
def _standing_supports(model: Model) -> Iterator[None]:
    """Hold supports with a prescribed velocity where they are: a step without duration has a nominal one of a second."""
    still = [(tag, whole, [v and 0.0 for v in vector] if whole else vector) for tag, whole, vector in model._conditions]
    model._core.set_supports(still)
    try:
        yield
    finally:
        model._core.set_supports(model._conditions)


def _found_equilibrium(model: Model, solver: Any, options: Any, tolerance: float, max_steps: int) -> ImplicitReport:
    """See `find_equilibrium`."""
    model._core.convert_near_surfaces(0.0)
    options.at_rest = True  # laws that depend on rate end where slow loading has them
    stepper = Stepper(model, solver, options, 1.0)
    control = stepper.control  # of the fraction of what is out of balance that a step applies
    control.length = first_part(model.laws, control.length)
    applied, ghost = 0.0, options.ghost
    for _ in range(max_steps):
        while True:
            part = min(control.length, 1.0 - applied)
            options.load_fraction = part / (1.0 - applied) if applied < 1.0 else 1.0
            reason = _attempt_without_time(stepper, model)
            if not reason:
                break
            control.cut(part)
            if control.is_too_short or applied == 1.0:
                error = RunError(
                    f"no equilibrium at t = {model.time:.9g} s with more than {applied:.4g} of the loads: {reason}"
                )
                error.applied = applied
                raise error
        applied = min(1.0, applied + part)
        if applied < 1.0:
            if model.report().unbalanced_ratio <= tolerance:
                return stepper.report()  # near collapse a step may find no equilibrium of what is nothing to speak of
            if stepper.last.easy:
                control.grow()
            continue
        if options.hold_positions:
            ghost.stiffness *= FADING
        else:
            options.count_displacement = False
        options.ghost, options.hold_positions = ghost, True
        if model.report().unbalanced_ratio <= tolerance:
            return stepper.report()
    error = RunError(
        f"out-of-balance ratio is {model.report().unbalanced_ratio:.3g} after {max_steps} steps, of which the last applied "
        f"{applied:.3g} of the loads, expected {tolerance:.3g}"
    )
    error.applied = applied
    raise error


def _attempt_without_time(stepper: Stepper, model: Model) -> str:
    time = model.time
    model._core.time = time - 1.0  # loads are those of the step's end
    try:
        return stepper.attempt(1.0)
    finally:
        model._core.time = time
