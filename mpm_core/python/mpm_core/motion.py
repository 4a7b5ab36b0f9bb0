"""Motions of the ground over time, from records of acceleration."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import real_numbers

STANDARD_GRAVITY = 9.80665
"""The unit g [m/s2]"""

UNITS = {"m/s2": 1.0, "cm/s2": 0.01, "g": STANDARD_GRAVITY}
"""Units of accelerations [m/s2]"""


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


def read_accelerogram(path: str | os.PathLike[str], *, unit: str | None = None, baseline: int | None = 1) -> Motion:
    """The motion of a file of `read_acceleration`.

    Args:
        path: of the file; all ranks read it.
        unit: as for `read_acceleration`.
        baseline: as for `motion_of_acceleration`.

    Raises:
        InputError: as `read_acceleration` and `motion_of_acceleration`.
    """
    return motion_of_acceleration(*read_acceleration(path, unit=unit), baseline=baseline)


def read_acceleration(
    path: str | os.PathLike[str], *, unit: str | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times [s] and accelerations [m/s2], (n,) each, of a file of two columns, or of the PEER ground motion database (.AT2).

    Columns are divided by blanks, commas or semicolons (between which a comma is a decimal one); ``#`` begins a comment. A file of
    PEER has its number of values and time step in its header, as NPTS and DT, and then nothing but values.

    Args:
        path: of the file; all ranks read it.
        unit: of the acceleration in the file, ``"m/s2"``, ``"cm/s2"`` or ``"g"``; a file of PEER says it by itself.

    Raises:
        InputError: an unknown unit, none for two columns, or another one than a file of PEER says; a file that cannot be read, has not
            two columns of numbers, or not as many values as its header says; times that do not rise.
    """
    if unit is not None and unit not in UNITS:
        raise InputError(f"unit is {unit!r}, expected one of {', '.join(map(repr, UNITS))}")
    try:
        with open(path, encoding="utf-8", errors="replace") as file:  # names of places in headers are in any encoding
            lines = file.read().splitlines()
    except OSError as error:
        raise InputError(f"accelerogram {os.fspath(path)} cannot be read: {error}") from error
    if (header := _peer_header(lines)) is not None:
        time, values, unit = _peer_record(os.fspath(path), lines, header, unit)
    else:
        if unit is None:
            raise InputError(
                f"unit is None, expected that of accelerogram {os.fspath(path)}: {', '.join(map(repr, UNITS))}"
            )
        time, values = _two_columns(os.fspath(path), lines)
    time, acceleration = _column("time", time), UNITS[unit] * _column("acceleration", values)
    _require_series(time, "acceleration", acceleration)
    return time, acceleration


def _two_columns(path: str, lines: list[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times and values of a file with one of each in a line."""
    texts = [line.split("#")[0] for line in lines]
    texts = [text.replace(",", ".").replace(";", " ") if ";" in text else text.replace(",", " ") for text in texts]
    try:
        columns = np.loadtxt(texts, ndmin=2)
    except ValueError as error:
        raise InputError(
            f"accelerogram {path} cannot be read: {error}; expected lines of a time and an acceleration, divided by "
            "blanks or a comma, and # before those of a header, or a file of the PEER ground motion database"
        ) from error
    if columns.ndim != 2 or columns.shape[1] != 2:
        raise InputError(f"accelerogram {path} has {columns.shape[-1]} columns, expected time and acceleration")
    return columns[:, 0], columns[:, 1]


_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_HEADERS = (
    re.compile(rf"NPTS\s*=\s*(\d+)\D.*?DT\s*=\s*({_NUMBER})", re.IGNORECASE),
    re.compile(rf"(\d+)\s+({_NUMBER})\s+NPTS\s*,\s*DT", re.IGNORECASE),
)
"""The last line of the header of a PEER file: NPTS=  5000, DT=   .0100 SEC; older files have 5000  0.0100  NPTS, DT"""
_HEADER_LINES = 10
_IN_UNIT = {
    "g": re.compile(r"UNITS OF G\b|\(G'?S?\)|\bIN G\b", re.IGNORECASE),
    "cm/s2": re.compile(r"\bCM/S(EC)?(/S(EC)?|\^?2|\*\*2)", re.IGNORECASE),
}


def _unit_in(header: list[str]) -> str | None:
    """The unit of accelerations that a header names, if any."""
    said = " ".join(header)
    return next((unit for unit, pattern in _IN_UNIT.items() if pattern.search(said)), None)


def says_its_unit(path: str | os.PathLike[str]) -> bool:
    """Whether an accelerogram is a PEER file whose header has the unit of the accelerations; False where it cannot be read."""
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            lines = [line for line, _ in zip(file, range(_HEADER_LINES))]
    except OSError:
        return False
    header = _peer_header(lines)
    return header is not None and _unit_in(lines[: header[0]]) is not None


def _peer_header(lines: list[str]) -> tuple[int, int, float] | None:
    """Number of the last line of the header of a PEER file, its number of values, and its time step [s]; None for other files."""
    for number, line in enumerate(lines[:_HEADER_LINES]):
        for pattern in _HEADERS:
            if found := pattern.search(line):
                return number, int(found[1]), float(found[2])
    return None


def _peer_record(
    path: str, lines: list[str], header: tuple[int, int, float], unit: str | None
) -> tuple[NDArray[np.float64], NDArray[np.float64], str]:
    """Times, values and unit of a PEER file."""
    last, count, step = header
    said = " ".join(lines[:last]).upper()
    if "VELOCITY" in said or "DISPLACEMENT" in said:
        raise InputError(
            f"accelerogram {path} has velocities or displacements by its header, expected accelerations (.AT2)"
        )
    own = _unit_in(lines[:last]) or unit
    if own is None:
        raise InputError(f"unit is None, expected that of accelerogram {path}, whose header does not name it")
    if unit not in (None, own):
        raise InputError(f"unit is {unit!r}, expected {own!r} as the header of accelerogram {path} says")
    try:
        values = np.array(" ".join(lines[last + 1 :]).split(), dtype=float)
    except ValueError as error:
        raise InputError(f"accelerogram {path} cannot be read: {error}") from None
    if len(values) != count:
        raise InputError(f"accelerogram {path} has {len(values)} values, expected {count} as its header says")
    return step * np.arange(count), values, own


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
