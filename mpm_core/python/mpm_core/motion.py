"""Motions of the ground over time, from records of acceleration."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import real_numbers

STANDARD_GRAVITY = 9.80665
"""The unit g [m/s2]"""


@dataclass(frozen=True, eq=False)
class Motion:
    """The velocity of a motion over time, interpolated linearly; zero outside the time range.

    Args:
        time: rising times [s], shape (n,), n at least 2.
        velocity: at these times [m/s], shape (n,).

    Raises:
        InputError: times that do not rise, other lengths, values that are not finite.
    """

    time: NDArray[np.float64]
    velocity: NDArray[np.float64]

    def __post_init__(self) -> None:
        for name in ("time", "velocity"):
            object.__setattr__(self, name, _column(name, getattr(self, name)))
        _require_series(self.time, "velocity", self.velocity)


def motion_of_acceleration(time: ArrayLike, acceleration: ArrayLike, *, baseline: int | None = 1) -> Motion:
    """The motion that begins at rest and has an acceleration that is linear between its samples.

    A record's zero is never exact, and its error grows in the velocity with time, in the displacement with its square. The
    baseline correction takes from the velocity the polynomial without constant that fits it best by least squares (Boore &
    Bommer 2005, section 3), and its derivative from the acceleration.

    Args:
        time: rising times [s], shape (n,).
        acceleration: at these times [m/s2], shape (n,).
        baseline: degree of the polynomial that is taken from the velocity; ``None`` leaves the record as it is.

    Raises:
        InputError: as `Motion`; a degree that is not from 1 to 5.
    """
    times, accelerations = _column("time", time), _column("acceleration", acceleration)
    _require_series(times, "acceleration", accelerations)
    steps = np.diff(times)
    velocity = np.append(0.0, np.cumsum(0.5 * steps * (accelerations[1:] + accelerations[:-1])))
    if baseline is not None:
        if baseline not in range(1, 6):
            raise InputError(f"baseline is {baseline!r}, expected a degree from 1 to 5 or None")
        part = (times - times[0]) / (times[-1] - times[0])
        powers = part[:, None] ** np.arange(1, baseline + 1)
        velocity -= powers @ np.linalg.lstsq(powers, velocity, rcond=None)[0]
    return Motion(times, velocity)


def read_accelerogram(path: str | os.PathLike[str], *, unit: str, baseline: int | None = 1) -> Motion:
    """The motion of a file of `read_acceleration`.

    Args:
        path: of the file; all ranks read it.
        unit: of the acceleration, ``"m/s2"``, ``"cm/s2"`` or ``"g"``.
        baseline: as for `motion_of_acceleration`.

    Raises:
        InputError: as `read_acceleration` and `motion_of_acceleration`.
    """
    return motion_of_acceleration(*read_acceleration(path, unit=unit), baseline=baseline)


def read_acceleration(path: str | os.PathLike[str], *, unit: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times [s] and accelerations [m/s2], (n,) each, of a file with these two columns, divided by blanks or commas.

    Args:
        path: of the file; all ranks read it. ``#`` begins a comment.
        unit: of the acceleration in the file, ``"m/s2"``, ``"cm/s2"`` or ``"g"``.

    Raises:
        InputError: an unknown unit, a file that cannot be read or has not two columns of numbers, times that do not rise.
    """
    factors = {"m/s2": 1.0, "cm/s2": 0.01, "g": STANDARD_GRAVITY}
    if unit not in factors:
        raise InputError(f"unit is {unit!r}, expected one of {', '.join(map(repr, factors))}")
    try:
        with open(path, encoding="utf-8") as file:
            lines = [line.split("#")[0].replace(",", " ") for line in file]
        columns = np.loadtxt(lines, ndmin=2)
    except OSError as error:
        raise InputError(f"accelerogram {os.fspath(path)} cannot be read: {error}") from error
    except ValueError as error:
        raise InputError(
            f"accelerogram {os.fspath(path)} cannot be read: {error}; expected lines of a time and an acceleration, divided by "
            "blanks or a comma, and # before those of a header"
        ) from error
    if columns.ndim != 2 or columns.shape[1] != 2:
        raise InputError(
            f"accelerogram {os.fspath(path)} has {columns.shape[-1]} columns, expected time and acceleration"
        )
    time, acceleration = _column("time", columns[:, 0]), factors[unit] * _column("acceleration", columns[:, 1])
    _require_series(time, "acceleration", acceleration)
    return time, acceleration


def _column(name: str, values: ArrayLike) -> NDArray[np.float64]:
    column = real_numbers(name, values)
    if column.ndim != 1 or not np.isfinite(column).all():
        raise InputError(f"{name} has shape {column.shape}, expected (n,) of finite numbers")
    return column


def _require_series(time: NDArray[np.float64], name: str, values: NDArray[np.float64]) -> None:
    if len(time) < 2 or len(values) != len(time):
        raise InputError(f"{name} has {len(values)} entries for {len(time)} times, expected one for each of at least 2")
    if not (np.diff(time) > 0).all():
        raise InputError(
            f"time goes from {time[0]} s to {time[-1]} s but does not rise at each step, expected rising times"
        )
