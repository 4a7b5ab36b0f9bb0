"""The pore water of a model in the description of a checkpoint."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from .water_checks import LABORATORY_GRAVITY

if TYPE_CHECKING:
    from .model import Model

_WATER = ("density", "modulus", "suction_limit", "kozeny_carman", "drained_surface")

_MAY_BE_INFINITE = ("modulus", "suction_limit")

_OF_SURFACE = ("standing", "rain")


def water_entry(model: Model) -> dict[str, Any] | None:
    """Properties and boundary conditions of the pore water; None without water."""
    water = model._core.water
    if water is None:
        return None
    values = {name: getattr(water, name) for name in _WATER}
    texts = {name: repr(getattr(water, name)) for name in _MAY_BE_INFINITE}
    surface = {name: [list(pair) for pair in getattr(water, name)] for name in _OF_SURFACE}
    curves = [[values.tolist() for values in of_law] for of_law in model._retention]
    return {
        **values,
        **texts,
        **surface,
        "conditions": [list(one) for one in model._water_conditions],
        "retention": curves,
        "anisotropy": [[list(row) for row in tensor] for tensor in water.anisotropy],
    }


def take_water(model: Model, entry: dict[str, Any] | None) -> None:
    """Give a model the pore water of an entry, or none."""
    model._core.water, model._water_conditions, model._retention = None, [], []
    if entry is None:
        return
    entry = _present_entry(entry)
    water = _core.PoreWater()
    for name in _WATER:
        setattr(water, name, float(entry[name]) if name in _MAY_BE_INFINITE else entry[name])
    for name in _OF_SURFACE:
        setattr(water, name, [(time, value) for time, value in entry[name]])
    water.anisotropy = entry["anisotropy"]
    model._set_retention(water, [[np.asarray(values) for values in of_law] for of_law in entry["retention"]])
    model._core.water = water
    model._set_water_conditions(
        [
            (tag, [(time, number) for time, number in value], is_level, held, loads)
            for tag, value, is_level, held, loads in entry["conditions"]
        ]
    )


def _present_entry(entry: dict[str, Any]) -> dict[str, Any]:
    """An entry as it is written now; before, it had the unit weight under 9.81 m/s2, and levels as pressures that fall with height."""
    if "density" in entry:
        return entry
    return {
        **entry,
        "density": entry["unit_weight"] / LABORATORY_GRAVITY,
        "conditions": [
            [tag, [[time, number / -slope if slope else number] for time, number in value], slope != 0, held, loads]
            for tag, value, slope, held, loads in entry["conditions"]
        ],
    }
