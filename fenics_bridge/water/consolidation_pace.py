"""Steps of a consolidation that are short enough: how far backward Euler lags behind, from the rates of two steps."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

SHRINK = 0.7
"""Part of a step that the one after it has at least"""


class Pace:
    """How much longer steps of backward Euler may become.

    Backward Euler takes the rate at the end of a step for all of it. Of a motion u(t) with the acceleration a, a step dt misses a dt^2 / 2, and the T / dt
    steps since the load last changed miss a dt T / 2 together; what is missed of a process that slows down, as consolidation and creep do, is made up for
    later, and the whole is then no more than half of the last step's motion. By creep, u = c ln(t), both are c dt / (2 t): the motion lags by half of a step.

    Args:
        first_step: shortest length of a step [s], that of the first one after a change.
        accuracy: largest error of the displacements, over the largest displacement [-].
    """

    def __init__(self, first_step: float, accuracy: float) -> None:
        self.first_step, self.accuracy = first_step, accuracy
        self.recent = first_step
        """Length of the longer one of the last two steps [s]; the last one may have been cut to end at a time"""
        self._length = first_step
        self._elapsed = 0.0
        self._velocity: NDArray[np.float64] | None = None

    def next_length(
        self, step: float, planned: float, moved: NDArray[np.float64], total: NDArray[np.float64], comm: Any
    ) -> float:
        """Length [s] of the next step, after one that was made. Collective.

        Args:
            step: length of the step that was made [s].
            planned: length of the next one by other rules [s].
            moved: displacements in the step [m], shape (n,).
            total: displacements after it [m], shape (n,).
            comm: the ranks.
        """
        velocity, before, length_before = moved / step, self._velocity, self._length
        self._velocity, self._length, self._elapsed = velocity, step, self._elapsed + step
        if before is None:
            return min(planned, self.first_step)
        self.recent = max(length_before, step)
        acceleration = 2 * (velocity - before) / (step + length_before)
        sizes = np.array([np.abs(each).max(initial=0.0) for each in (acceleration, velocity, total)])
        comm.Allreduce(MPI.IN_PLACE, sizes, MPI.MAX)
        missed = 0.5 * min(sizes[0] * self._elapsed, sizes[1])  # in a unit of time [m/s]
        longest = self.accuracy * sizes[2] / missed if missed > 0 else np.inf
        return min(planned, max(longest, SHRINK * step, self.first_step))
