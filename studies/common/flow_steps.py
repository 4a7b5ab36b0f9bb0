"""Seepage in time, in steps as long as Newton's method takes well."""

from __future__ import annotations

from collections.abc import Callable

from fenics_bridge import water

from .water_site import DAY

FEW_ITERATIONS, SHORTEST = 7, 1e-6
"""Newton's iterations up to which the next step is longer, and the shortest step over the whole time"""


class FlowSteps:
    """Steps of a flow up to an end [s], which begin with a two-hundredth of it."""

    def __init__(self, flow: water.Seepage, end: float) -> None:
        self._flow, self._end, self._dt = flow, end, end / 200

    def until(self, time: float, after: Callable[[], None] = lambda: None) -> str | None:
        """Follow the flow up to a time [s]; returns why it ended early, if it did. Collective.

        Args:
            after: called after each step.
        """
        flow = self._flow
        while flow.time < time * (1 - 1e-12):
            step = min(self._dt, time - flow.time)
            if not flow.advance(step):
                self._dt = 0.4 * step
                if self._dt < SHORTEST * self._end:
                    return f"steps of {step:.3g} s do not converge at {flow.time / DAY:.3g} days: {flow.reason}"
                continue
            after()
            if flow.iterations <= FEW_ITERATIONS:
                self._dt = min(1.5 * max(self._dt, step), self._end / 50)
        return None
