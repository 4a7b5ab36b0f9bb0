"""Retention curves as the core takes them: points that it joins by monotone cubics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import real_numbers

SUCTIONS = np.concatenate([[0.0], np.geomspace(1.0, 1e9, 541)])
"""Points of the curves [Pa]: 60 in each decade"""

CURVES = ("saturation", "effective", "relative_permeability")
"""Functions that a retention curve has"""

Points = tuple[NDArray[np.float64], list[NDArray[np.float64]], list[NDArray[np.float64]]]


def curves_of_laws(retention: Any, laws: Sequence[Any]) -> list[list[NDArray[np.float64]]]:
    """Values of the retention curves at `SUCTIONS`.

    Args:
        retention: a curve, or one for each law; None stands for soil that stays saturated.
        laws: the laws.

    Returns:
        For each law, one array for each of `CURVES`; nothing where all soil stays saturated.

    Raises:
        InputError: not one for each law, or a curve that does not fall from 1 or lets no water through.
    """
    given = list(retention) if isinstance(retention, (list, tuple)) else [retention] * len(laws)
    if len(given) != len(laws):
        raise InputError(f"retention has {len(given)} curves, expected one, or one for each of the {len(laws)} laws")
    return [curve_values(curve) for curve in given] if any(curve is not None for curve in given) else []


def joined(values: Sequence[ArrayLike]) -> Points:
    """Suctions, values and slopes of the curves of a law."""
    arrays = [np.asarray(one, dtype=np.float64) for one in values]
    return SUCTIONS, arrays, [_slopes(one) for one in arrays]


def curve_values(curve: Any) -> list[NDArray[np.float64]]:
    """Values of a retention curve at `SUCTIONS`, one array for each of `CURVES`; None stands for soil that stays saturated.

    Raises:
        InputError: a curve that does not fall from 1 or lets no water through.
    """
    if curve is None:
        return [np.ones_like(SUCTIONS) for _ in CURVES]
    missing = [name for name in CURVES if not callable(getattr(curve, name, None))]
    if missing:
        raise InputError(f"retention is {curve!r}, which has no {missing[0]}(), expected a retention curve")
    values = [
        np.broadcast_to(real_numbers(f"in retention, {name}", getattr(curve, name)(SUCTIONS)), len(SUCTIONS))
        for name in CURVES
    ]
    for name, found in zip(CURVES, values, strict=True):
        rises = np.flatnonzero(~(np.diff(found) <= 1e-12))
        if len(rises):
            k = rises[0]
            raise InputError(f"in retention, {name} goes from {found[k]:g} to {found[k + 1]:g} from a suction of "
                             f"{SUCTIONS[k]:g} to {SUCTIONS[k + 1]:g} Pa, expected values that fall")  # fmt: skip
        least = "more than" if name == CURVES[2] else "no less than"
        if abs(found[0] - 1) > 1e-9 or found[-1] < 0 or (name == CURVES[2] and found[-1] == 0):
            raise InputError(
                f"in retention, {name} goes from {found[0]:g} to {found[-1]:g}, expected from 1 to {least} 0"
            )
    return values


def _slopes(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slopes that keep cubics between the points monotone (Fritsch and Butland 1984); at the ends those of the chords."""
    lengths = np.diff(SUCTIONS)
    chords = np.diff(values) / lengths
    before, after = chords[:-1], chords[1:]
    w1, w2 = 2 * lengths[1:] + lengths[:-1], lengths[1:] + 2 * lengths[:-1]
    falls = (before < -1e-99) & (after < -1e-99)
    slopes = np.zeros_like(values)
    slopes[1:-1][falls] = ((w1 + w2)[falls]) / (w1[falls] / before[falls] + w2[falls] / after[falls])
    slopes[0] = chords[0]
    return slopes
