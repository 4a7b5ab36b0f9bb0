"""Common parts of the cases: checks and what a case hands back."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

STUDIES = Path(__file__).parents[1]
if str(STUDIES) not in sys.path:
    sys.path.insert(0, str(STUDIES))  # a case imports what studies share, and other studies


class Kind(Enum):
    """How a computed number is compared with the expected one."""

    EQUAL = "="
    AT_LEAST = "≥"
    AT_MOST = "≤"


@dataclass(frozen=True)
class Check:
    """A computed number and its expected value.

    Args:
        quantity: what it is, for instance "settlement of the top, 3D".
        expected: the number it should be, in ``unit``.
        source: where that comes from: a formula, a paper and equation, an identity.
        computed: the number that came out.
        tolerance: largest error that passes, as a fraction of ``scale``.
        unit: as shown; "-" for none.
        kind: AT_LEAST and AT_MOST count only what is missing to the expected number as error.
        scale: what errors are divided by, in ``unit``; by default the expected number's size.
        over: name of the scale, which the table adds to the source; required with a scale.
        limit: the reason, where the method is known not to reach the expected number. Such a check is shown with its
            error and counts as no failure.
        method: where several methods find the same quantity, the one of this check; they stand in one row of the table.
    """

    quantity: str
    expected: float
    source: str
    computed: float
    tolerance: float
    unit: str = "-"
    kind: Kind = Kind.EQUAL
    scale: float | None = None
    over: str = ""
    limit: str = ""
    method: str = ""

    def __post_init__(self) -> None:
        if (self.scale is None) != (self.over == ""):
            raise ValueError(
                f"over is {self.over!r} with scale={self.scale}, expected the name of the scale, where there is one"
            )

    @property
    def error(self) -> float:
        """Difference to the expected number as a fraction of the scale [-]; not a number when nothing was computed."""
        difference = self.computed - self.expected
        if self.kind is not Kind.EQUAL and self.computed == self.computed:
            difference = max(0.0, -difference if self.kind is Kind.AT_LEAST else difference)
        return abs(difference) / (abs(self.expected) if self.scale is None else self.scale)

    @property
    def passed(self) -> bool:
        return self.error <= self.tolerance


@dataclass
class Result:
    """Result of a case: its checks, and pictures in its folder with their captions."""

    checks: list[Check]
    figures: dict[str, str] = field(default_factory=dict)


def line(check: Check) -> str:
    """A check as it is printed."""
    verdict = "pass" if check.passed else "known limit" if check.limit else "FAIL"
    unit = "" if check.unit == "-" else f" {check.unit}"
    return (
        f"  {verdict:5} {check.quantity}{', ' * bool(check.method)}{check.method}: {check.computed:.5g}{unit}, "
        f"expected {check.kind.value} {check.expected:.5g}{unit}, error {check.error:.2%}, tolerance {check.tolerance:.2%}"
    )
