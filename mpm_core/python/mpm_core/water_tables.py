"""Pressures, levels and rain of pore water over time, as a number or a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ._core import InputError
from .checks import real_numbers

History: TypeAlias = list[tuple[float, float]]
"""Pairs of time [s] and value, of rising times, joined by straight lines; one pair for a value that stays"""

Value: TypeAlias = float | Sequence[tuple[float, float]]
"""A number, or a table ((time [s], value), ...) of rising times, before and after which the end values hold"""


def history_of(name: str, value: Value, least: float = -np.inf) -> History:
    """A number or a table over time as pairs.

    Raises:
        InputError: numbers that are not finite or below the least, or times that do not rise.
    """
    numbers = real_numbers(name, value)
    pairs = np.array([[0.0, numbers]]) if numbers.ndim == 0 else numbers
    good = pairs.ndim == 2 and pairs.shape[1:] == (2,) and len(pairs) > 0 and bool(np.isfinite(pairs).all())
    if not good or np.any(np.diff(pairs[:, 0]) <= 0):
        raise InputError(
            f"{name} is {value!r}, expected a finite number or a table ((time, value), ...) of rising times"
        )
    if np.any(pairs[:, 1] < least):
        raise InputError(f"{name} is {value!r}, expected {least:g} or more")
    return [(float(time), float(number)) for time, number in pairs]
