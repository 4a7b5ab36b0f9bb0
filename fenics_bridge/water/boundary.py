"""Boundary conditions of the pore water, by facet tag; where none is given the boundary is impervious.

Values may be numbers or, for flows in time, functions of the time [s] or tables ((time, value), ...) that are joined by
straight lines; before the first and after the last time their end values hold. Over a step, water enters at the mean rate of a
table, and the level at the end of the step holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from mpm_core.checks import real_numbers
from numpy.typing import NDArray

from fenics_bridge.errors import InputError, agree, is_finite

Value = float | Callable | tuple | NDArray[np.float64]


@dataclass(frozen=True)
class Head:
    """Boundary condition of a prescribed total head, which is pressure head plus elevation."""

    facet_tag: int | str
    """Number or name of the tag"""
    level: Value
    """Total head [m]: the elevation to which water would rise"""


@dataclass(frozen=True)
class Reservoir:
    """Water stands against the boundary up to a level; above it the boundary is a seepage face."""

    facet_tag: int | str
    """Number or name of the tag"""
    level: Value
    """Elevation of the water's surface [m]"""


@dataclass(frozen=True)
class SeepageFace:
    """Water may leave, at atmospheric pressure, but not enter: p <= 0, outflow >= 0, and one of them is zero."""

    facet_tag: int | str
    """Number or name of the tag"""


@dataclass(frozen=True)
class Flux:
    """Water enters at a rate normal to the boundary."""

    facet_tag: int | str
    """Number or name of the tag"""
    rate: Value
    """Inflow [m/s]; negative where water leaves"""


@dataclass(frozen=True)
class Rain:
    """Rain infiltrates until water ponds; what the soil cannot take up runs off."""

    facet_tag: int | str
    """Number or name of the tag"""
    rate: Value
    """Rate of the rain on the horizontal [m/s]"""
    ponding: float = 0.0
    """Pressure head [m] above which water runs off"""


WaterBoundary = Head | Reservoir | SeepageFace | Flux | Rain


def value_at(value: Value, time: float) -> float:
    """A number, function or table of a boundary condition at a time [s]."""
    if callable(value):
        return float(value(time))
    numbers = np.asarray(value, dtype=float)
    return float(np.interp(time, *numbers.T)) if numbers.ndim else float(numbers)


def mean_over(value: Value, start: float, end: float) -> float:
    """Mean of a number or table of a boundary condition between two times [s]; of a function, its value at the end."""
    if callable(value) or np.ndim(value) == 0 or not end > start:
        return value_at(value, end)
    times, values = np.transpose(np.asarray(value, dtype=float))
    corners = np.array([start, *times[(times > start) & (times < end)], end])
    there = np.interp(corners, times, values)
    return float(np.sum(0.5 * (there[1:] + there[:-1]) * np.diff(corners)) / (end - start))


def mistake_at(condition: WaterBoundary, time: float) -> str | None:
    """Error in the values that functions of a boundary condition return for a time [s]; None without an error."""
    for name in ("level", "rate"):
        value = getattr(condition, name, None)
        if not callable(value):
            continue
        given = value(time)
        if not is_finite(given):
            return f"{name} is a function that returns {given!r} at t = {time:g} s, expected a finite number"
        if isinstance(condition, Rain) and given < 0:
            return f"rate is a function that returns {given!r} m/s at t = {time:g} s, expected 0 or more: rain does not leave the soil"
    return None


def listed(comm: MPI.Comm, boundary: Iterable[WaterBoundary]) -> list[WaterBoundary]:
    """The conditions that a caller gives, as a list. Collective.

    Raises:
        InputError: a condition stands alone. Raised on all ranks alike.
    """
    alone = hasattr(boundary, "facet_tag")
    agree(comm, f"boundary is {boundary!r}, expected a list of conditions" if alone else None)
    return list(boundary)


def mistake_in(condition: WaterBoundary) -> str | None:
    """Error in the values of a boundary condition; None without an error."""
    for name in ("level", "rate", "ponding"):
        value = getattr(condition, name, 0.0)
        if callable(value):
            continue
        try:
            numbers = real_numbers(name, value)
        except InputError:
            return f"{name} is {value!r}, expected a number, a function of time or a table ((time, value), ...)"
        if not np.all(np.isfinite(numbers)):
            return f"{name} is {value!r}, expected finite numbers"
        table = numbers.ndim > 0
        if table and (numbers.ndim != 2 or numbers.shape[1] != 2 or np.any(np.diff(numbers[:, 0]) <= 0)):
            return f"{name} is {value!r}, expected a number, a function of time or a table ((time, value), ...) of rising times"
        if name == "ponding" and value < 0:
            return f"ponding is {value!r} m, expected 0 or more"
        if isinstance(condition, Rain) and name == "rate" and np.any((numbers[:, 1] if table else numbers) < 0):
            return f"rate is {value!r} m/s, expected 0 or more: rain does not leave the soil"
    return None
