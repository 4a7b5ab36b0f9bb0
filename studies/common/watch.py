"""What studies of a sliding slope look at over time."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from .movie import particle_frame
from .slope_case import SlopeCase


class Watch:
    """The particle at the crest, the farthest particle, and frames of all particles for the pictures."""

    def __init__(self, case: SlopeCase) -> None:
        self.model = case.model
        start = self.model.particles.initial_position
        self.crest_id = case.crest_particle()
        self.first_toe = self.model.comm.allreduce(start[:, 0].max(initial=-np.inf), MPI.MAX)
        self.frames: list[dict[str, np.ndarray]] = []

    def crest_displacement(self) -> float:
        """Length of the displacement of the particle that started at the crest [m]. Collective."""
        p = self.model.particles
        found = p.find([self.crest_id])
        return self.model.comm.allreduce(float(np.linalg.norm(p[found[found >= 0]].displacement)))

    def runout(self) -> float:
        """Advance of the farthest particle past where the farthest one started [m]. Collective."""
        return (
            self.model.comm.allreduce(self.model.particles.position[:, 0].max(initial=-np.inf), MPI.MAX)
            - self.first_toe
        )

    def keep(self, time: float) -> None:
        """Store a frame for the pictures, on the first rank. Collective."""
        frame = particle_frame(self.model, time)
        if frame is not None:
            self.frames.append(frame)
