"""Checks of what a caller gives: numbers, whose errors name the argument and what was expected, and old names."""

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._core import InputError


def positive(name: str, value: float, unit: str, *, zero: bool = False) -> float:
    """A finite number above zero, or at least zero."""
    expected = "number not below zero" if zero else "positive number"
    try:
        number = float(0.0 + value)  # float() alone would read a text
    except (TypeError, ValueError):
        raise InputError(f"{name} is {value!r}, expected a {expected}") from None
    if not (np.isfinite(number) and (number >= 0 if zero else number > 0)):
        raise InputError(f"{name} is {value} {unit}, expected a {expected}")
    return number


def within(name: str, value: float, low: float, high: float, *, open_above: bool = False) -> float:
    """A number between two others, these included; without the upper one where open above."""
    if isinstance(value, bool) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise InputError(f"{name} is {value!r}, expected a number")
    if not (low <= value < high or (value == high and not open_above)):
        raise InputError(f"{name} is {value}, expected {low} <= {name} {'<' if open_above else '<='} {high}")
    return float(value)


def count(name: str, value: int) -> int:
    """A whole number from one on."""
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise InputError(f"{name} is {value!r}, expected a whole number from 1 on")
    return int(value)


def real_numbers(name: str, values: Any) -> NDArray[np.float64]:
    """Real numbers of any shape, infinite ones too; text, which NumPy would read, and complex numbers are refused."""
    try:
        array = np.asarray(values)
        is_real = array.dtype.kind in "iuf"
    except ValueError:  # rows of different lengths
        is_real = False
    if not is_real:
        raise InputError(f"{name} is {shown(values)}, expected real numbers")
    return array.astype(np.float64, order="C")


def at_points(name: str, values: Any, count: int) -> NDArray[np.float64]:
    """Real numbers of points, shape (count,): one for all of them, or one for each."""
    array = real_numbers(name, values)
    if array.shape not in ((), (1,), (count,)):
        raise InputError(f"{name} has shape {array.shape}, expected a number or shape ({count},)")
    return np.array(np.broadcast_to(array, count))


def shown(value: Any) -> str:
    """A value as errors show it, cut off where it is long."""
    text = repr(value)
    return text if len(text) <= 100 else f"{text[:97]}..."


def member(name: str, value: Any, kind: Any) -> Any:
    """A member of an enumeration, such as Integration.MIXED."""
    if not isinstance(value, kind):
        expected = ", ".join(f"{kind.__name__}.{each}" for each in kind.__members__)
        raise InputError(f"{name} is {value!r}, expected one of {expected}")
    return value


def of_kind(name: str, value: Any, *kinds: type) -> Any:
    """An object of one of the kinds, such as Newton; the error names them."""
    if not isinstance(value, kinds):
        raise InputError(f"{name} is {value!r}, expected a {' or a '.join(kind.__name__ for kind in kinds)}")
    return value


def watcher(watch: Any) -> Any:
    """A function that watches a run, or None."""
    if not (watch is None or callable(watch)):
        raise InputError(f"watch is {watch!r}, expected a function without arguments, or None")
    return watch


def flag(name: str, value: Any) -> bool:
    """True or False; text, of which any that is not empty would count as True, is refused."""
    if not isinstance(value, (bool, np.bool_)) and not (isinstance(value, (int, np.integer)) and value in (0, 1)):
        raise InputError(f"{name} is {value!r}, expected True or False")
    return bool(value)


def renamed(old: str, new: str) -> Any:
    """A property under the old name of an attribute, which warns and returns the new one; kept for one version."""

    def value(self: Any) -> Any:
        warnings.warn(
            f"{type(self).__name__}.{old} is now called {new}; the old name will be removed in the next version",
            DeprecationWarning,
            stacklevel=2,
        )
        return getattr(self, new)

    return property(value, doc=f"Old name of `{new}`.")
