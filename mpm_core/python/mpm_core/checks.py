"""Checks of numbers that a caller gives; errors name the argument and what was expected."""

import numpy as np

from ._core import InputError


def positive(name: str, value: float, unit: str, *, zero: bool = False) -> float:
    """A finite number above zero, or at least zero."""
    if not (np.isfinite(value) and (value >= 0 if zero else value > 0)):
        raise InputError(
            f"{name} is {value} {unit}, expected a {'number not below zero' if zero else 'positive number'}"
        )
    return float(value)


def within(name: str, value: float, low: float, high: float, *, open_above: bool = False) -> float:
    """A number between two others, these included; without the upper one where open above."""
    if not (low <= value < high or (value == high and not open_above)):
        raise InputError(f"{name} is {value}, expected {low} <= {name} {'<' if open_above else '<='} {high}")
    return float(value)
