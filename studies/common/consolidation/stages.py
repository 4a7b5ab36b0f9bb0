"""What changes while ground consolidates: pressures over time, and soil and members that come and go in stages."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

import mpm_core as mpm

from ..checks import low_pressure, say
from ..site.flow import boundaries_of_stage
from ..site.keys import DAY, require_push

Table = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class GroundStage:
    """A stage of construction.

    start, duration: from when, and for how long, the weight of what is placed or dug away comes or goes [s]
    off: soils that are not there from then on; boundary: conditions of the water from then on, by boundary
    members: structural members that are there from then on, by name; renewed: those that are taken out and installed anew
    """

    name: str
    start: float
    duration: float
    off: tuple[str, ...]
    boundary: Mapping[str, Any]
    members: Mapping[str, mpm.Member] = field(default_factory=dict)
    renewed: tuple[str, ...] = ()


def pressure_table(given: Any, where: str) -> Table:
    """A pressure over time, in s and Pa, from a number [Pa] or rows [days, Pa] that are joined by straight lines.

    The pressure of the first row holds before it, and that of the last row after it.

    Args:
        given: number or rows.
        where: it stands, for messages.

    Raises:
        InputError: another form, values that are not finite or below 0, or days that do not rise.
    """
    rows = given if isinstance(given, list) else [[0.0, given]]
    try:
        table = np.array(rows, dtype=float)
    except (TypeError, ValueError):
        table = np.empty(0)
    if table.ndim != 2 or table.shape[1] != 2:
        raise mpm.InputError(f"{where} is {given!r}, expected a number or rows [days, Pa]")
    if not np.all(np.isfinite(table)):
        raise mpm.InputError(f"{where} is {given!r}, expected finite numbers")
    require_push(float(table[:, 1].min()), where)
    say(low_pressure(where, float(table[:, 1].max())))
    late = np.flatnonzero(np.diff(table[:, 0]) <= 0)
    if len(late):
        first, second = table[late[0] : late[0] + 2, 0]
        raise mpm.InputError(
            f"{where}: day {second:g} comes after day {first:g}, expected rows [days, Pa] of rising days"
        )
    first, pressure = table[0]
    if isinstance(given, list) and first > 0 and pressure > 0:
        say(f"{where} begins on day {first:g} with {pressure:g} Pa, which act before it as well, also in the equilibrium at the beginning: for another pressure "
            "until then begin with a row of day 0, such as [0.0, 0.0]")  # fmt: skip
    return tuple((DAY * float(day), float(value)) for day, value in table)


def pressures_of(words: Iterable[str]) -> dict[str, Table]:
    """Pressures as the command line has them: NAME=PA, or NAME=DAYS:PA,DAYS:PA,...

    Raises:
        InputError: as `pressure_table`, or a text of another form.
    """
    found = {}
    for word in words:
        name, equals, text = word.partition("=")
        try:
            rows = [[float(number) for number in pair.split(":")] for pair in text.split(",")]
        except ValueError:
            rows = []
        one = len(rows) == 1 and len(rows[0]) == 1
        if not name or not equals or not rows or (not one and any(len(row) != 2 for row in rows)):
            raise mpm.InputError(f"--pressures is {word!r}, expected NAME=PA or NAME=DAYS:PA,DAYS:PA,...")
        found[name] = pressure_table(rows[0][0] if one else rows, f"--pressures {name}")
    return found


def stages_of(
    given: Sequence[dict],
    soils: Sequence[str],
    boundary: Mapping[str, Any],
    where: str,
    members: Mapping[str, mpm.Member] | None = None,
) -> list[GroundStage]:
    """Stages of construction, the first of which is the beginning.

    A first stage without a day says which soils and members are there then; otherwise those soils are that no later stage
    places, and no members. Without any stages all members are there.

    Args:
        given: rows of the file.
        soils: names of all soils.
        boundary: conditions of the water at the beginning, by boundary.
        where: they stand, for messages.
        members: all structural members, by name.

    Raises:
        InputError: an unknown key or soil, days that do not rise, or soil or a member that comes twice or goes where there is none.
    """
    members = members or {}
    names = [_names(row, "fill", f"{where}[{k}]") for k, row in enumerate(given)]
    begins = bool(given) and "day" not in given[0]
    later = {soil for fill in names[begins:] for soil in fill}
    off = tuple(soil for soil in soils if (soil not in names[0] if begins else soil in later))
    changed = boundaries_of_stage(given[0], f"{where}[0]") if begins else {}
    there = dict(members) if not given else {}
    stages = [GroundStage("beginning", 0.0, 0.0, off, {**boundary, **changed}, there)]
    if begins:
        stages[0] = replace(stages[0], members=_members_after(given[0], stages[0], members, f"{where}[0]")[0])
    for k, row in list(enumerate(given))[begins:]:
        stages.append(_stage(row, stages[-1], soils, members, f"{where}[{k}]", first=len(stages) == 1))
    return stages


def _stage(
    row: dict, before: GroundStage, soils: Sequence[str], members: Mapping[str, mpm.Member], where: str, first: bool
) -> GroundStage:
    day, duration = _days(row, "day", where), _days(row, "duration", where, 0.0)
    if day < before.start / DAY or (day == before.start / DAY and not first):
        raise mpm.InputError(
            f"{where}: day {day:g} comes after day {before.start / DAY:g}, expected stages of rising days"
        )
    fill, gone = _names(row, "fill", where), _names(row, "excavate", where)
    if not set(row) - {"name", "day", "duration"}:
        raise mpm.InputError(
            f"{where} has neither fill nor excavate, expected soils to place or to dig away, or members to install or to remove"
        )
    for soil in (*fill, *gone):
        if soil not in soils:
            raise mpm.InputError(f"{where}: soil {soil!r} is not among the soils {', '.join(soils)}")
        if (soil in fill) != (soil in before.off):
            raise mpm.InputError(f"{where}: {soil!r} is {'not ' if soil in before.off else ''}there before this stage")
    off = tuple(soil for soil in soils if (soil in before.off or soil in gone) and soil not in fill)
    there, renewed = _members_after(row, before, members, where)
    names = (*fill, *gone, *(_names(row, "install", where)), *(_names(row, "remove", where)))
    name = str(row.get("name", ", ".join(names)))
    boundary = {**before.boundary, **boundaries_of_stage(row, where)}
    return GroundStage(name, DAY * day, DAY * duration, off, boundary, there, renewed)


def _members_after(
    row: Mapping[str, Any], before: GroundStage, members: Mapping[str, mpm.Member], where: str
) -> tuple[dict[str, mpm.Member], tuple[str, ...]]:
    """Members that are there after a stage, and those of them that it takes out and installs anew."""
    install, remove = (_names(row, key, where) for key in ("install", "remove"))
    for name in remove:
        if name not in before.members:
            raise mpm.InputError(f"{where}: remove names the member {name!r}, which is not there before this stage")
    for name in install:
        if name in before.members and name not in remove:
            raise mpm.InputError(f"{where}: install names the member {name!r}, which is there before this stage")
    there = {name: one for name, one in before.members.items() if name not in remove}
    return {**there, **{name: members[name] for name in install}}, tuple(name for name in install if name in remove)


def _names(row: Mapping[str, Any], key: str, where: str) -> list[str]:
    names = row.get(key, [])
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise mpm.InputError(
            f"{where}: {key} is {names!r}, expected names of {'members' if key in ('install', 'remove') else 'soils'}"
        )
    return names


def _days(row: dict, key: str, where: str, default: float | None = None) -> float:
    value = row.get(key, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value) or value < 0:
        when = ", when the stage begins" if key == "day" else ""
        raise mpm.InputError(f"{where}: {key} is {value!r}, expected a number of days from 0 on{when}")
    return float(value)
