"""Seepage in time, in steps that end at the corners of its tables and are as long as Newton's method takes well."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fenics_bridge import water

from .site import DAY, corners_of, times_of

FEW_ITERATIONS, SHORTEST = 7, 1e-6
"""Newton's iterations up to which the next step is longer, and the shortest step over the whole time"""
FIRST = 0.25
"""Longest first step after a corner of a table, over the shorter one of the times to the corners before and after it"""


class FlowSteps:
    """Steps of a flow up to an end [s], which begin with a two-hundredth of it, or less, and end at the corners of tables."""

    def __init__(self, flow: water.Seepage, end: float) -> None:
        self._flow, self._end, self._dt = flow, end, end / 200
        self._close = 1e-9 * end
        corners = np.array([0.0, *(time for time in corners_of(times_of(flow.boundary)) if time < end), end])
        spans = np.diff(corners)
        self._first = dict(zip(corners[:-1], FIRST * np.minimum(spans, [spans[0], *spans[:-1]])))

    def until(self, time: float, after: Callable[[], None] = lambda: None) -> str | None:
        """Follow the flow up to a time [s]; returns why it ended early, if it did. Collective.

        Args:
            after: called after each step.
        """
        ends = [corner for corner in self._first if corner < time - self._close]
        for target in (*ends, time):
            stopped = self._towards(target, after)
            if stopped:
                return stopped
        return None

    def _towards(self, target: float, after: Callable[[], None]) -> str | None:
        flow = self._flow
        while flow.time < target - self._close:
            begins = (first for corner, first in self._first.items() if abs(flow.time - corner) <= self._close)
            self._dt = min(self._dt, next(begins, np.inf))
            step = min(self._dt, target - flow.time)
            if not flow.advance(step):
                self._dt = 0.4 * step
                if self._dt < SHORTEST * self._end:
                    return f"steps of {step:.3g} s do not converge at {flow.time / DAY:.3g} days: {flow.reason}"
                continue
            after()
            if flow.iterations <= FEW_ITERATIONS:
                self._dt = min(1.5 * max(self._dt, step), self._end / 50)
        return None
