"""The description in a checkpoint, whose entries are all checked before they are used."""

from __future__ import annotations

import json
import math
from typing import Any

from ._core import Geometry, Integration, RunError
from .surfaces import KINDS


def parsed(path: str, text: bytes) -> dict[str, Any]:
    """The entries of a description.

    Raises:
        RunError: the text is not UTF-8 or not JSON, or an entry is missing or of another type; the message names file and entry.
    """
    try:
        there = json.loads(text.decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise RunError(f"cannot read checkpoint {path}: its description is damaged ({error})") from None
    if not isinstance(there, dict):
        raise RunError(f"cannot read checkpoint {path}: its description is no table of entries")
    for name, (shape, expected) in _ENTRIES.items():
        if not _has_shape(there.get(name), shape):
            raise RunError(
                f"cannot read checkpoint {path}: {name} in its description is {json.dumps(there.get(name))[:80]}, "
                f"expected {expected}"
            )
    vectors = {"gravity": [there["gravity"]], "supports": [vector for *_, vector in there["supports"] if vector]}
    for name, of_entry in vectors.items():
        if any(len(vector) != there["dimension"] for vector in of_entry):
            raise RunError(
                f"cannot read checkpoint {path}: {name} in its description is {json.dumps(there[name])[:80]}, expected "
                f"vectors of {there['dimension']} numbers"
            )
    last = len(there["supports"])
    if not all(name.lstrip("-").isdigit() and _is_count(k) and k < last for name, k in there["prescribed"].items()):
        raise RunError(
            f"cannot read checkpoint {path}: prescribed in its description names supports that are not there"
        )
    there["contacts"] = [{"drag": 0.0, **contact} for contact in there["contacts"]]  # older files have none
    there["members"] = there.get("members") or []  # likewise
    return there


# --- shapes of entries -----------------------------------------------------------------------------------------------


def _has_shape(value: Any, shape: Any) -> bool:
    """Whether a value of JSON has a shape.

    Args:
        value: a value as `json.loads` returns it.
        shape: a type; a set of what the value may be; a function that checks it; a list with the shape of all items; a tuple with
            the shapes of a list of fixed length; a table with the shape of each key; or several of these, `AnyOf`.
    """
    if isinstance(shape, AnyOf):
        return any(_has_shape(value, one) for one in shape)
    if isinstance(shape, dict):
        return (
            isinstance(value, dict)
            and set(value) == set(shape)
            and all(_has_shape(one, shape[key]) for key, one in value.items())
        )
    if isinstance(shape, list):
        return isinstance(value, list) and all(_has_shape(one, shape[0]) for one in value)
    if isinstance(shape, tuple):
        return isinstance(value, list) and len(value) == len(shape) and all(map(_has_shape, value, shape))
    if isinstance(shape, set):
        return isinstance(value, (str, int, float)) and value in shape
    return isinstance(value, shape) if isinstance(shape, type) else bool(shape(value))


class AnyOf(tuple[Any, ...]):
    """Shapes of which a value has one."""


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value)
    )


def _is_positive(value: Any) -> bool:
    """Whether it is a number from 0 on."""
    return _is_number(value) and value >= 0


def _is_above_zero(value: Any) -> bool:
    return _is_number(value) and value > 0


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**62


def _is_tag(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**31


def _is_surface(value: Any) -> bool:
    """Whether it is a surface of a known kind; its numbers are checked when it is made."""
    if not isinstance(value, dict) or not _has_shape(value.get("kind"), set(KINDS)):
        return False
    by_fingerprint = isinstance(value.get("fingerprint"), str) and _is_count(value.get("triangles"))
    return value["kind"] != "Triangles" or by_fingerprint


def _is_border(value: Any) -> bool:
    """Whether it is the state of a far field, with a row for each node of its border."""
    older = {"marks": [_is_number], "held": [_VECTOR], "displacement": [_VECTOR]}
    if not _has_shape(value, AnyOf([{**older, "gravity": _VECTOR}, older])):
        return False
    n = value["marks"][0] if len(value["marks"]) == 3 else -1
    return len(value["held"]) == n and len(value["displacement"]) == n


def _is_table_of_sums(value: Any) -> bool:
    return isinstance(value, dict) and all(one is None or _is_number(one) for one in value.values())


_PAIR = (_is_number, _is_number)
_VECTOR = AnyOf([_PAIR, (_is_number, _is_number, _is_number)])
_NONE = type(None)
_FREE = AnyOf([_NONE, _is_number])
"""A component of a support along which there is none, or its value"""
_SUPPORT = AnyOf([
    (_is_tag, lambda v: v is True, AnyOf([(), (_FREE, _FREE), (_FREE, _FREE, _FREE)])), (_is_tag, bool, AnyOf([(), *_VECTOR])),
])  # fmt: skip
_SIDES = {
    "sides": [(_is_tag, _FREE, _FREE, _FREE, _is_tag)], "nodes": [(_VECTOR, [list])], "incoming": AnyOf([_NONE, list]),
    "free_fields": [dict]
}  # fmt: skip
_HISTORY = ([_is_number], [[_is_number]])
_FIELD = {
    "name": str, "unit": str, "meaning": str, "components": lambda v: _is_count(v) and 0 < v < 1000, "initial": _is_number
}  # fmt: skip
_BODY = {
    "start": _is_number, "mass": _is_number, "speed": _is_number, "velocity": _HISTORY, "spin": _HISTORY, "force": _HISTORY,
    "centre": [_is_number], "inertia": [_is_number], "drive": [{0, 1, 2}], "rotates": bool,
}  # fmt: skip
_PARTS = {"parts": _is_count, "largest": _is_positive}
_STRENGTH = AnyOf([_is_positive, {"fingerprint": str, **_PARTS}, {"values": [_is_positive], **_PARTS}])
_OLD_CONTACT = {
    "surface": _is_surface, "friction": _STRENGTH, "adhesion": _STRENGTH, "penalty": _is_number, "bonded": bool, "body": _BODY
}  # fmt: skip
_CONTACT = AnyOf([{**_OLD_CONTACT, "drag": _STRENGTH}, _OLD_CONTACT])


def _is_contact(value: Any) -> bool:
    """Whether it is a contact with a rigid surface, of a line with a strength for each of its segments, if by segment."""
    if not _has_shape(value, _CONTACT):
        return False
    points, closed = value["surface"].get("points"), value["surface"].get("closed")
    segments = len(points) - (not closed) if isinstance(points, list) else 0
    return all(len(one["values"]) == segments for one in value.values() if isinstance(one, dict) and "values" in one)


_FIELD_CONTACT = {
    "first": _is_count, "second": _is_count, "friction": _is_number, "adhesion": _is_number, "interface": _is_surface
}  # fmt: skip
_MEMBER = {"name": str, "member": dict, "positions": [_VECTOR], "state": dict}
_WATER = {
    "density": _is_number, "modulus": str, "suction_limit": str,  # texts, as they may be infinite
    "kozeny_carman": bool, "drained_surface": bool, "standing": [_PAIR], "rain": [_PAIR], "retention": [[[_is_number]]],
    "anisotropy": [((_is_number,) * 3,) * 3],
    "conditions": [(_is_tag, [_PAIR], bool, bool, bool)],
}  # fmt: skip
_OLD_WATER = {
    **{name: shape for name, shape in _WATER.items() if name != "density"},
    "unit_weight": _is_number, "conditions": [(_is_tag, [_PAIR], _is_number, bool, bool)],
}  # fmt: skip
_CONTROL = {"longest": _is_above_zero, "length": _is_above_zero, "iterations": _is_positive, "cuts": _is_positive}

_ENTRIES: dict[str, tuple[Any, str]] = {
    "ranks": (lambda v: _is_count(v) and v > 0, "a whole number from 1 on"),
    "time": (_is_number, "a number [s]"),
    "steps": (_is_count, "a whole number from 0 on"),
    "dimension": ({2, 3}, "2 or 3"),
    "mesh": (str, "a text"),
    "materials": ([str], "a list of texts"),
    "gravity": (_VECTOR, "2 or 3 numbers [m/s2]"),
    "gravity_ramp": (_is_positive, "a number from 0 on [s]"),
    "outflow_tags": ([_is_tag], "a list of tags"),
    "supports": ([_SUPPORT], "a list of [tag, whole, vector]"),
    "prescribed": (dict, "a table"),
    "next_id": (_is_count, "a whole number from 0 on"),
    "added_fields": ([_FIELD], "a list of {name, unit, meaning, components, initial}"),
    "contacts": ([_is_contact], "a list of contacts with rigid surfaces"),
    "field_contacts": ([_FIELD_CONTACT], "a list of contacts between velocity fields"),
    "members": (AnyOf([_NONE, [_MEMBER]]), "a list of structural members"),  # null in older files
    "far_field": (AnyOf([_NONE, _is_border]), "null, or forces and displacements of its border"),
    "water": (AnyOf([_NONE, _WATER, _OLD_WATER]), "null, or the properties of the pore water"),
    "geometry": (set(Geometry.__members__), f"one of {', '.join(Geometry.__members__)}"),
    "velocity_fields": ([_is_count], "a list of whole numbers from 0 on"),
    "collisions": (
        [{"ball": _is_count, "other": _is_count, "friction": _is_positive, "restitution": _is_positive}],
        "a list of collisions",
    ),
    "absorbing": (
        AnyOf(
            [_NONE, _SIDES, {**_SIDES, "free_damping": AnyOf([_NONE, (_FREE, _FREE, _FREE)])}]
        ),  # older files have none
        "null, or the sides that absorb waves",
    ),
    "cuts": (_is_count, "a whole number from 0 on"),
    "left_imbalance": (_is_number, "a number"),
    "integration": (
        AnyOf([_NONE, set(Integration.__members__)]),
        f"null, or one of {', '.join(Integration.__members__)}",
    ),
    "last_integration": (
        AnyOf([_NONE, set(Integration.__members__)]),  # null in older files
        f"null, or one of {', '.join(Integration.__members__)}",
    ),
    "implicit": (AnyOf([_NONE, _CONTROL]), "null, or the state of an implicit run"),
    "notes": (dict, "a table"),
    "sums": (_is_table_of_sums, "a table of numbers"),
}
