"""Length of steps that are shortened when they fail and grow again when they converge easily: implicit steps, load steps of finite
elements, and steps of their consolidation."""

from __future__ import annotations

from dataclasses import dataclass

MAX_CUTS = 10
"""A step is not made shorter than the longest one / 2^MAX_CUTS."""


@dataclass
class StepControl:
    """What a run carries from one step to the next; checkpoints of implicit runs hold it.

    Lengths are in s for steps in time, and in units of what is raised for load steps.
    """

    longest: float
    """that a step may be long"""
    length: float
    """of the next step, unless a report comes before"""
    iterations: int = 0
    """since the last report"""
    cuts: int = 0
    """since the last report"""

    def cut(self, tried: float) -> None:
        """After a step of the length ``tried`` failed: half of it is tried next."""
        self.cuts += 1
        self.length = tried / 2

    def grow(self, factor: float = 2.0) -> None:
        """After an easy step."""
        self.length = min(self.longest, factor * self.length)

    @property
    def is_too_short(self) -> bool:
        """Whether a run is to give up."""
        return self.length < self.longest / 2**MAX_CUTS
