"""Implicit particles with pore water in small displacements: how far their nodes have moved, and values at points."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

import mpm_core as mpm


class SmallMotion:
    """Quasi-static steps in which particles keep their places, while the displacement of the nodes is summed up.

    Args:
        model: particles with pore water.
        nmd: average volumetric strains over nodes.
    """

    def __init__(self, model: mpm.Model, nmd: bool = False) -> None:
        self.model, self._nmd = model, nmd
        self.moved = np.zeros(model.mesh.points.shape)
        """Displacement of the nodes [m], shape (n, D)"""

    def advance(self, until: float, dt: float) -> Iterator[mpm.ImplicitReport]:
        """Go to a time [s] with steps of dt [s] at most; yields a report of each. Collective.

        Raises:
            RunError: a step does not converge.
        """
        options = {"quasi_static": True, "small_displacements": True, "nmd": self._nmd}
        for report in self.model.implicit(until, dt=dt, every_steps=1, **options):
            self.moved += report.dt * self.model.nodal("velocity")
            yield report

    def of_particles(self) -> np.ndarray:
        """Displacement of the particles of this rank [m], shape (n, D)."""
        p = self.model.particles
        return self._interpolated(p.cell, p.position)

    def at(self, points: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
        """Displacement [m], shape (n, D), and pore pressure [Pa], shape (n,), at points with particles around. Collective.

        Pressures are those of the particles of the cell, continued by their gradients.
        """
        points, mesh, p = np.asarray(points, dtype=float), self.model.mesh, self.model.particles
        cells = np.asarray(mesh.cells_of(points))
        here = np.flatnonzero((cells >= 0) & (cells < mesh.owned_cells))
        values = np.zeros((len(points), 2 + mesh.dim))  # how many ranks have the point, pressure, displacement
        values[here, 0], values[here, 2:] = 1, self._interpolated(cells[here], points[here])
        for k in here:
            rows = p.cell == cells[k]
            steps = points[k] - p.position[rows]
            values[k, 1] = np.mean(p.pore_pressure[rows] + np.einsum("pa,pa->p", p.pressure_gradient[rows], steps))
        values = self.model.comm.allreduce(values)
        return values[:, 2:] / values[:, :1], values[:, 1] / values[:, 0]

    def _interpolated(self, cells: np.ndarray, points: np.ndarray) -> np.ndarray:
        corners = self.model.mesh.cells[cells]
        x = self.model.mesh.points[corners]
        inner = np.linalg.solve((x[:, 1:] - x[:, :1]).transpose(0, 2, 1), (points - x[:, 0])[..., None])[..., 0]
        weights = np.column_stack([1 - inner.sum(axis=1), inner])
        return np.einsum("pk,pka->pa", weights, self.moved[corners])
