"""Length of steps that are shortened when they fail and grow again when they converge easily.

Implicit steps use it, load steps of finite elements, and steps of their consolidation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from .laws import small_strain_columns

MAX_CUTS = 10
"""A step is not made shorter than the longest one / 2^MAX_CUTS."""

SMALL_PART = 0.05
"""First part of a load that soil with a small-strain stiffness bears. Its stiffness falls to a fourth within the first strains, while it begins to
yield: a step across both makes a settlement in first loading too large, by a fifth where the whole load comes at once."""


def first_part(laws: Iterable[Any], usual: float) -> float:
    """The first part of a load [-]: the usual one, or `SMALL_PART` where soil has a small-strain stiffness.

    Args:
        laws: of the soils.
        usual: part of other laws [-].
    """
    return min(usual, SMALL_PART) if any(map(small_strain_columns, laws)) else usual


@dataclass
class StepControl:
    """State of the step control from one step to the next; checkpoints of implicit runs contain it.

    Lengths are in s for steps in time, and in units of the load for load steps.
    """

    longest: float
    """Largest length of a step"""
    length: float
    """Length of the next step, unless a report comes before"""
    iterations: int = 0
    """Iterations since the last report"""
    cuts: int = 0
    """Cutbacks since the last report"""

    def cut(self, tried: float) -> None:
        """Halve the next step after one of the length ``tried`` failed."""
        self.cuts += 1
        self.length = tried / 2

    def grow(self, factor: float = 2.0) -> None:
        """Lengthen the next step after one that converged easily."""
        self.length = min(self.longest, factor * self.length)

    @property
    def is_too_short(self) -> bool:
        """Whether the run must end."""
        return self.length < self.longest / 2**MAX_CUTS
