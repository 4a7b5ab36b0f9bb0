"""Back-analysis: the value of a parameter for which a result of a study has a given value."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from scipy import optimize

from mpm_core import InputError

from .plan import number_of

MOST_RUNS = 20
"""Runs after which the search ends"""
NEAR = 1e-3
"""Error of the value over the width of the interval, and of the result over the difference of those at its ends, at which the search
ends"""
JUMP = 0.05
"""Distance of the result from the target, over the difference of those at the ends of the interval, from which it jumps past the target"""


@dataclass(frozen=True)
class Wanted:
    """What is looked for: a parameter between two values, and the value of a result."""

    name: str
    low: float
    high: float
    result: str
    target: float


@dataclass(frozen=True)
class Found:
    """What a search has found.

    value: of the parameter, nearest to the target; result: there; reason: why the search ended early, or empty
    """

    value: float
    result: float
    reason: str = ""


def wanted_of(parameter: str, target: str) -> Wanted:
    """What the words NAME=LOW:HIGH and RESULT=VALUE look for.

    Raises:
        InputError: they are not of this form.
    """
    name, _, interval = parameter.partition("=")
    result, _, text = target.partition("=")
    ends, value = [number_of(end) for end in interval.split(":")], number_of(text)
    if not name or len(ends) != 2 or ends[0] is None or ends[1] is None or ends[0] >= ends[1]:
        raise InputError(
            f"--find is {parameter!r}, expected NAME=LOW:HIGH with rising numbers, such as friction-angle=15:35"
        )
    if not result or value is None:
        raise InputError(f"--target is {target!r}, expected RESULT=VALUE, such as factor_of_safety=1")
    return Wanted(name.removeprefix("--"), ends[0], ends[1], result, value)


def find(wanted: Wanted, results_at: Callable[[list[float]], list[float]]) -> Found:
    """Search for the value of a parameter by Brent's method.

    Args:
        wanted: what is looked for.
        results_at: function of values of the parameter that gives the result at each of them, NaN where there is none.
    """
    ends = [wanted.low, wanted.high]
    known = dict(zip(ends, results_at(ends)))
    near = NEAR * abs(known[wanted.high] - known[wanted.low])

    def difference(value: float) -> float:
        """Result less target, 0 where both are near enough."""
        if value not in known:
            known[value] = results_at([value])[0]
        if not math.isfinite(known[value]):
            raise _Unknown(value)
        return 0.0 if abs(known[value] - wanted.target) <= near else known[value] - wanted.target

    reason = ""
    try:
        if difference(wanted.low) * difference(wanted.high) > 0:
            low, high = (known[end] for end in ends)
            reason = f"{wanted.result} is {low:.4g} and {high:.4g} at the ends of the interval, expected {wanted.target:g} between them"
        else:
            width, most = NEAR * (wanted.high - wanted.low), MOST_RUNS - 2
            end = optimize.brentq(difference, *ends, xtol=width, maxiter=most, full_output=True, disp=False)[1]
            reason = "" if end.converged else f"{MOST_RUNS} runs did not bring {wanted.result} to {wanted.target:g}"
    except _Unknown as unknown:
        reason = f"{wanted.result} is not known where {wanted.name} is {unknown.value:g}"
    there = {value: result for value, result in known.items() if math.isfinite(result)}
    best = min(reversed(there), key=lambda value: abs(there[value] - wanted.target), default=math.nan)
    if not reason and abs(there[best] - wanted.target) > JUMP / NEAR * near:
        reason = f"{wanted.result} jumps past {wanted.target:g} where {wanted.name} is {best:.4g}"
    return Found(best, there.get(best, math.nan), reason)


class _Unknown(Exception):
    """A run has no result."""

    def __init__(self, value: float) -> None:
        self.value = value
