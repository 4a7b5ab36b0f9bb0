"""Quantities that studies of a sliding slope record over time."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from .movie import gathered, own_frame
from .slope.case import SlopeCase


class Watch:
    """The particle at the crest, the farthest particle, and frames of all particles for the pictures."""

    def __init__(self, case: SlopeCase) -> None:
        self.model = case.model
        self.crest_id = case.crest_particle()
        self.first_toe = self._largest(self.model.particles.initial_position[:, 0].max(initial=-np.inf))
        self._kept: list[dict[str, np.ndarray]] = []

    def crest_displacement(self) -> float:
        """Length of the displacement of the particle that started at the crest [m]. Collective."""
        p = self.model.particles
        found = p.find([self.crest_id])
        return self._largest(np.linalg.norm(p[found[found >= 0]].displacement))

    def runout(self) -> float:
        """Advance of the farthest particle past where the farthest one started [m]. Collective."""
        return self._largest(self.model.particles.position[:, 0].max(initial=-np.inf)) - self.first_toe

    def _largest(self, mine: float) -> float:
        """Largest of all ranks' numbers."""
        largest = np.array(mine)
        self.model.comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        return float(largest)

    def keep(self, time: float) -> None:
        """Store a frame of this rank's particles for the pictures."""
        self._kept.append(own_frame(self.model, time))

    def frames(self) -> list[dict[str, np.ndarray]]:
        """The frames that were kept, of all particles, on the first rank; none on the others. Collective."""
        frames = [gathered(self.model.comm, frame) for frame in self._kept]
        return [frame for frame in frames if frame is not None]
