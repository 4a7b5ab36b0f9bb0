"""Maps of a slide in plan: thickness of the deposit, largest thickness and speed, and where it has been."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

import mpm_core as mpm
from fenics_bridge.terrain.raster import Raster


class SlideMaps:
    """Thickness and speed of a slide on a grid, whose greatest values are kept over time. Collective.

    Args:
        model: model of a slide in three dimensions.
        ground: raster whose points are the centres of the map's cells.
        least: thickness below which a cell counts as untouched [m].
    """

    def __init__(self, model: mpm.Model, ground: Raster, least: float = 0.01) -> None:
        self.model, self.ground, self.least = model, ground, least
        self._most = np.zeros(ground.values.shape)
        self._fastest = np.zeros(ground.values.shape)
        self.record()

    def _around(self) -> Iterator[Any]:
        """The four points around each particle: (rows, columns) and the fraction of the particle that each of them has."""
        row, column, s, t = self.ground.place(self.model.particles.position)
        for up, across, part in ((0, 0, (1 - s) * (1 - t)), (0, 1, s * (1 - t)), (1, 0, (1 - s) * t), (1, 1, s * t)):
            yield (row + up, column + across), part

    def _per_area(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sums of the particles' values over area, shape (ny, nx): each gives its own to the four points around it. Collective."""
        found = np.zeros(self.ground.values.shape)
        for places, part in self._around():
            np.add.at(found, places, part * values / self.ground.spacing**2)
        self.model.comm.Allreduce(MPI.IN_PLACE, found)
        return found

    def thickness(self) -> NDArray[np.float64]:
        """Volume of the particles over area [m], shape (ny, nx). Collective."""
        return self._per_area(self.model.particles.volume)

    def at(self, places: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Thickness of the slide and its mean speed at places now. Collective.

        Args:
            places: [m], shape (n, 2).

        Returns:
            Thickness [m], measured vertically, and speed [m/s], the mean over the thickness, each of shape (n,); both are 0 where
            the slide is thinner than ``least``.
        """
        p = self.model.particles
        fields = (p.volume, p.volume * np.linalg.norm(p.velocity, axis=1))
        volume, flux = (
            Raster(self.ground.x, self.ground.y, self._per_area(field), self.ground.crs).at(places) for field in fields
        )
        there = volume >= self.least
        return np.where(there, volume, 0.0), np.where(there, flux / np.where(there, volume, 1.0), 0.0)

    def record(self) -> None:
        """Include the present state in the greatest values. Collective."""
        speed = np.linalg.norm(self.model.particles.velocity, axis=1)
        fastest = np.zeros(self.ground.values.shape)
        for places, part in self._around():
            np.maximum.at(fastest, places, np.where(part > 0, speed, 0.0))
        self.model.comm.Allreduce(MPI.IN_PLACE, fastest, MPI.MAX)
        self._fastest = np.maximum(self._fastest, fastest)
        self._most = np.maximum(self._most, self.thickness())

    def maps(self) -> dict[str, Raster]:
        """The maps by name. Collective.

        Returns:
            `deposit` (thickness now) [m], `most` (largest thickness) [m] and `speed` (largest) [m/s], with gaps where the slide
            has not been, and `reached`: 1 where it has been, else 0.
        """
        deposit, reached = self.thickness(), self._most >= self.least
        values = {
            "deposit": np.where(deposit >= self.least, deposit, np.nan), "most": np.where(reached, self._most, np.nan),
            "speed": np.where(reached, self._fastest, np.nan), "reached": reached.astype(float),
        }  # fmt: skip
        return {name: Raster(self.ground.x, self.ground.y, value, self.ground.crs) for name, value in values.items()}
