"""The description in a checkpoint, whose entries are all checked before they are used."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from typing import Any

from ._core import Geometry, RunError
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
    for name, (is_right, expected) in _EXPECTED.items():
        if name not in there and name in _OPTIONAL:
            continue
        if not is_right(there.get(name)):
            raise RunError(
                f"cannot read checkpoint {path}: {name} in its description is {json.dumps(there.get(name))[:80]}, "
                f"expected {expected}"
            )
    last = len(there["supports"])
    if not all(name.lstrip("-").isdigit() and _is_count(k) and k < last for name, k in there["prescribed"].items()):
        raise RunError(
            f"cannot read checkpoint {path}: prescribed in its description names supports that are not there"
        )
    return there


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300 and math.isfinite(value)
    )


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 2**62


def _is_tag(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**31


def _are(kind: Callable[[Any], bool], value: Any) -> bool:
    return isinstance(value, list) and all(map(kind, value))


def _is_support(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 3
        and _is_tag(value[0])
        and isinstance(value[1], bool)
        and (_are(lambda one: value[1] and one is None or _is_number(one), value[2]) and len(value[2]) in (0, 2, 3))
    )


def _is_field(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and set(value) == {"name", "unit", "meaning", "components", "initial"}
        and all(isinstance(value[key], str) for key in ("name", "unit", "meaning"))
        and _is_count(value["components"])
        and 0 < value["components"] < 1000
        and _is_number(value["initial"])
    )


def _is_known_by_fingerprint(surface: Any) -> bool:
    return isinstance(surface.get("fingerprint"), str) and _is_count(surface.get("triangles"))


def _is_surface(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and value.get("kind") in KINDS
        and (value["kind"] != "Triangles" or _is_known_by_fingerprint(value))
    )


def _is_contact(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and set(value) | {"bonded"} == {"surface", "friction", "adhesion", "penalty", "bonded", "body"}
        and isinstance(value.get("bonded", False), bool)
        and _is_surface(value["surface"])
        and all(_is_number(value[key]) for key in ("friction", "adhesion", "penalty"))
        and _is_body(value["body"])
    )


def _is_field_contact(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and set(value) == {"first", "second", "friction", "adhesion", "interface"}
        and _is_surface(value["interface"])
        and all(_is_count(value[key]) for key in ("first", "second"))
        and all(_is_number(value[key]) for key in ("friction", "adhesion"))
    )


_BODY_NUMBERS, _BODY_HISTORIES = ("start", "mass", "speed"), ("velocity", "spin", "force")


def _is_body(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and set(value) == {*_BODY_NUMBERS, *_BODY_HISTORIES, "centre", "inertia", "drive", "rotates"}
        and all(_is_number(value[key]) for key in _BODY_NUMBERS)
        and all(_is_history(value[key]) for key in _BODY_HISTORIES)
        and all(_are(_is_number, value[key]) for key in ("centre", "inertia"))
        and _are(lambda one: one in (0, 1, 2), value["drive"])
        and isinstance(value["rotates"], bool)
    )


def _is_history(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 2
        and _are(_is_number, value[0])
        and _are(lambda row: _are(_is_number, row), value[1])
    )


def _is_water(value: Any) -> bool:
    if value is None:
        return True
    texts = {"modulus", "suction_limit"}  # as they may be infinite
    newer = {"suction_limit", "standing", "rain", "retention"}  # which older files lack
    return (
        isinstance(value, dict)
        and set(value) | newer == texts | newer | {"unit_weight", "kozeny_carman", "drained_surface", "conditions"}
        and _is_number(value["unit_weight"])
        and all(isinstance(value[key], str) for key in texts & set(value))
        and all(isinstance(value[key], bool) for key in ("kozeny_carman", "drained_surface"))
        and _are(_is_water_condition, value["conditions"])
        and all(_are(_is_pair, value.get(key, [])) for key in ("standing", "rain"))
        and _are(lambda curves: _are(lambda one: _are(_is_number, one), curves), value.get("retention", []))
    )


def _is_pair(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 2 and _are(_is_number, value)


def _is_water_condition(value: Any) -> bool:
    return (
        isinstance(value, list)
        and len(value) == 5
        and _is_tag(value[0])
        and (_is_number(value[1]) or _are(_is_pair, value[1]))
        and _is_number(value[2])
        and all(isinstance(one, bool) for one in value[3:])
    )


def _is_border(value: Any) -> bool:
    if value is None:
        return True
    if not (
        isinstance(value, dict) and set(value) == {"marks", "held", "displacement"} and _are(_is_number, value["marks"])
    ):
        return False
    n = value["marks"][0] if len(value["marks"]) == 3 else -1
    return all(
        isinstance(rows, list) and len(rows) == n and all(_are(_is_number, row) and len(row) in (2, 3) for row in rows)
        for rows in (value["held"], value["displacement"])
    )


def _is_control(value: Any) -> bool:
    if value is None:
        return True
    return (
        isinstance(value, dict)
        and {"longest", "length"} <= set(value) <= {"longest", "length", "iterations", "cuts"}
        and all(_is_number(one) and one >= 0 for one in value.values())
    )


_OPTIONAL = (
    "added_fields",
    "contacts",
    "far_field",
    "field_contacts",
    "water",
    "geometry",
    "velocity_fields",
    "cuts",
    "left_imbalance",
    "implicit",
    "notes",
)
_EXPECTED: dict[str, tuple[Callable[[Any], bool], str]] = {
    "ranks": (lambda v: _is_count(v) and v > 0, "a whole number from 1 on"),
    "time": (_is_number, "a number [s]"),
    "steps": (_is_count, "a whole number from 0 on"),
    "dimension": (lambda v: v in (2, 3), "2 or 3"),
    "mesh": (lambda v: isinstance(v, str), "a text"),
    "materials": (lambda v: _are(lambda one: isinstance(one, str), v), "a list of texts"),
    "gravity": (lambda v: _are(_is_number, v) and len(v) in (2, 3), "2 or 3 numbers [m/s2]"),
    "gravity_ramp": (lambda v: _is_number(v) and v >= 0, "a number from 0 on [s]"),
    "outflow_tags": (lambda v: _are(_is_tag, v), "a list of tags"),
    "supports": (lambda v: _are(_is_support, v), "a list of [tag, whole, vector]"),
    "prescribed": (lambda v: isinstance(v, dict), "a table"),
    "next_id": (_is_count, "a whole number from 0 on"),
    "added_fields": (lambda v: _are(_is_field, v), "a list of {name, unit, meaning, components, initial}"),
    "contacts": (lambda v: _are(_is_contact, v), "a list of contacts with rigid surfaces"),
    "field_contacts": (lambda v: _are(_is_field_contact, v), "a list of contacts between velocity fields"),
    "far_field": (_is_border, "null, or forces and displacements of its border"),
    "water": (_is_water, "null, or the properties of the pore water"),
    "geometry": (lambda v: v in Geometry.__members__, f"one of {', '.join(Geometry.__members__)}"),
    "velocity_fields": (lambda v: _are(_is_count, v), "a list of whole numbers from 0 on"),
    "cuts": (_is_count, "a whole number from 0 on"),
    "left_imbalance": (_is_number, "a number"),
    "implicit": (_is_control, "null, or the state of an implicit run"),
    "notes": (lambda v: isinstance(v, dict), "a table"),
}
