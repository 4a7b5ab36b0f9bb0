"""Collisions of rigid bodies with one another."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from . import _core
from ._core import InputError
from .checks import positive, within
from .collective import collectively
from .input_warnings import warn_of_friction

if TYPE_CHECKING:
    from .model import Model
    from .rigid_contact import RigidContact

_BALLS = ("Disc", "Sphere")


def add_collision(ball: RigidContact, other: RigidContact, friction: float, restitution: float) -> None:
    """See `RigidContact.add_collision`."""
    model = ball.model

    def entry() -> dict[str, Any]:
        if getattr(other, "model", None) is not model:
            raise InputError(f"other is {other!r}, expected a rigid surface of the same model")
        if ball._number == other._number:
            raise InputError("other is the body itself, expected another one")
        numbers = sorted((ball._number, other._number), key=lambda k: _kind(model, k) not in _BALLS)
        kinds = [_kind(model, k) for k in numbers]
        if kinds[0] not in _BALLS:
            raise InputError(f"the bodies are a {kinds[0]} and a {kinds[1]}, expected one to be a Disc or a Sphere")
        if not any(_moves_freely(model, k) for k in numbers):
            raise InputError(
                f"surfaces {numbers[0]} and {numbers[1]} move as prescribed, expected one to be a FreeBody"
            )
        if any({one["ball"], one["other"]} == set(numbers) for one in model._collisions):
            raise InputError(f"surfaces {numbers[0]} and {numbers[1]} collide already")
        positive("friction", friction, "(a coefficient)", zero=True)
        within("restitution", restitution, 0, 1)
        gap = _core.distance_between(model._core, *numbers)
        if gap < 0:
            raise InputError(f"surfaces {numbers[0]} and {numbers[1]} overlap by {-gap:.6g} m, expected them apart")
        return {"ball": numbers[0], "other": numbers[1], "friction": float(friction), "restitution": float(restitution)}

    new = collectively(model.comm, entry)
    warn_of_friction(model.comm, new["friction"])
    set_collisions(model, [*model._collisions, new])


def _kind(model: Model, number: int) -> str:
    return str(model._contacts[number]["surface"]["kind"])


def _moves_freely(model: Model, number: int) -> bool:
    body = model._contacts[number]["body"]
    return 1 in body["drive"] or bool(body["rotates"])


def set_collisions(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give the model these collisions, of which it may have the first ones already."""
    for entry in entries[len(model._collisions) :]:
        _core.add_collision(model._core, entry["ball"], entry["other"], entry["friction"], entry["restitution"])
    model._collisions = entries
