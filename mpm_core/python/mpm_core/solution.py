"""Result of the solution of an implicit step."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class Solution:
    """The course of the iteration over one step; the same on all ranks."""

    residuals: list[float] = field(default_factory=list)
    """|r| relative to the largest of |f_ext|, |f_int| and inertia: at the start and after each iteration"""
    iterations: int = 0
    converged: bool = False
    easy: bool = False
    """Whether a step twice as long may be tried"""
    reason: str = ""
    """Reason why it did not converge"""
    linear_iterations: list[int] = field(default_factory=list)
    """Krylov iterations of each Newton iteration"""


def relative(report: dict) -> float:
    """Residual of a trial by the scale of its forces; 0 where there are none."""
    return report["residual"] / report["scale"] if report["scale"] > 0 else 0.0
