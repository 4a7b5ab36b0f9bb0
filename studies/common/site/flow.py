"""Pores of soils, and what the water does at boundaries, as tables of a site's file describe them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import mpm_core as mpm
from fenics_bridge import water

from .doubts import warn_of_flow, warn_of_rate
from .keys import CONDITIONS, CURVES, DAY, FLOW, UNDRAINED, part_of
from .laws import is_number


def wet_soils(table: dict[str, Any], path: Path, keys: Collection[str] = FLOW) -> dict[str, water.PorousSoil | None]:
    """The pores of each soil of a file by some keys; None for a soil without any, which holds no water."""
    found = {}
    for name, given in table["soils"].items():
        porous = part_of(given, keys)
        undrained = set(porous) <= set(UNDRAINED) and given.get("undrained", False)  # its porosity is that of the law
        found[name] = porous_soil(porous, f"{path}: soils.{name}") if porous and not undrained else None
    return found


def boundary_of(table: dict[str, Any], path: Path) -> dict[str, Any]:
    """The conditions of the water in a file, by boundary."""
    return _conditions(table.get("boundaries", {}), f"{path}: boundaries")


def boundaries_of_stage(row: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The conditions of the water that a stage changes, by boundary; where: it stands, for messages."""
    return _conditions(row.get("boundaries", {}), f"{where}.boundaries")


def _conditions(given: Mapping[str, Any], where: str) -> dict[str, Any]:
    return {name: condition(name, one, f"{where}.{name}") for name, one in given.items()}


def porous_soil(given: dict, where: str) -> water.PorousSoil:
    """The soil that a table of `FLOW` describes; where: it stands, for messages."""
    for key in given:
        if key in CURVES and not isinstance(given[key], dict):
            raise mpm.InputError(f"{where}: {key} is {given[key]!r}, expected a table such as {key} = {{name = value}}")
        if not _has_numbers(given[key]):
            raise mpm.InputError(f"{where}: {key} is {given[key]!r}, expected numbers")
    curves = [key for key in given if key in CURVES]
    if len(curves) > 1 or "conductivity" not in given:
        raise mpm.InputError(
            f"{where} has {', '.join(given) or 'nothing'}, expected conductivity and one retention curve at most"
        )
    try:
        parameters = {key: value for key, value in given.items() if key not in CURVES}
        if "dip" in parameters:
            parameters["conductivity"] = _of_strata(given["conductivity"], parameters.pop("dip"))
        if curves:
            parameters["retention"] = CURVES[curves[0]](**given[curves[0]])
        soil = water.PorousSoil(**parameters)
    except (TypeError, mpm.InputError) as error:
        raise mpm.InputError(f"{where}: {error}") from None
    warn_of_flow(soil, where)
    return soil


def _has_numbers(value: Any) -> bool:
    """Whether a value of a site file, or whatever is in its lists and tables, is a finite number."""
    if isinstance(value, (list, dict)):
        return all(_has_numbers(part) for part in (value.values() if isinstance(value, dict) else value))
    return is_number(value)


def _of_strata(conductivity: Any, dip: float) -> Any:
    """Tensor of the conductivities along and across strata that dip [degrees] along x."""
    if not isinstance(conductivity, list) or len(conductivity) != 2:
        raise mpm.InputError(f"dip: conductivity is {conductivity!r} m/s, expected [along, across] the strata")
    return water.dipping(*conductivity, dip)


def condition(name: str, given: dict, where: str) -> Any:
    """The boundary condition that the table of a boundary describes."""
    if given == {"seepage_face": True}:
        return water.SeepageFace(name)
    if len(given) != 1 or next(iter(given)) not in CONDITIONS:
        raise mpm.InputError(f"{where} has {given}, expected one of {', '.join(CONDITIONS)} or seepage_face = true")
    key, value = next(iter(given.items()))
    make, unit = CONDITIONS[key]
    if isinstance(value, list):
        if not value or any(not isinstance(row, list) or len(row) != 2 or not _has_numbers(row) for row in value):
            raise mpm.InputError(f"{where}: {key} is {value!r}, expected a number or rows [days, value]")
        for (day, _), (later, _) in zip(value, value[1:]):
            if later <= day:
                raise mpm.InputError(
                    f"{where}: {key} has day {later:g} after day {day:g}, expected rows of rising days"
                )
        _require_rain(where, key, [number for _, number in value])
        warn_of_rate(key, max(number for _, number in value), where)
        return make(name, tuple((DAY * float(day), unit * float(number)) for day, number in value))
    if not is_number(value):
        raise mpm.InputError(f"{where}: {key} is {value!r}, expected a number or rows [days, value]")
    _require_rain(where, key, [value])
    warn_of_rate(key, value, where)
    return make(name, unit * float(value))


def _require_rain(where: str, key: str, values: list[float]) -> None:
    """Raises InputError, in the units of the file, for rain that would leave the soil."""
    if key == "rain" and min(values) < 0:
        raise mpm.InputError(
            f"{where}: rain is {min(values):g} mm/day, expected 0 or more: rain does not leave the soil"
        )
