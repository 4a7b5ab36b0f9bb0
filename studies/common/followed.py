"""Soil that a study follows, in particles or resting cells: its displacement, and the motion of nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from mpi4py import MPI
from mpm_core.resting import represented

import mpm_core as mpm


def cells_near(model: mpm.Model, place: np.ndarray, reach: float, tags: Sequence[int]) -> np.ndarray:
    """Numbers over all ranks of the cells of some tags whose centres are near a place. Collective."""
    mesh, n = model.mesh, model.mesh.owned_cells
    centres = mesh.points[mesh.cells[:n]].mean(axis=1)
    near = (np.linalg.norm(centres - place, axis=1) < reach) & np.isin(mesh.cell_tags[:n], tags)
    return np.concatenate(model.comm.allgather(mesh.global_cells[:n][near]))


def numbers_in(model: mpm.Model, cells: np.ndarray) -> np.ndarray:
    """Numbers of the particles that are in some cells, or for which these rest. Collective."""
    p = model.particles
    rows = np.isin(model.mesh.global_cells[p.cell], cells)
    mine = [first + np.arange(count) for first, count in zip(p.id[rows], represented(p)[rows].astype(int))]
    return np.concatenate([numbers for part in model.comm.allgather(mine) for numbers in part])


def mean_displacement(model: mpm.Model, numbers: np.ndarray) -> np.ndarray:
    """Mean displacement of the particles with some numbers, and of the cells that rest for them, (D) [m]. Collective."""
    p = model.particles
    rows = np.isin(p.id, numbers)
    sums = np.append((p.mass[:, None] * p.displacement)[rows].sum(axis=0), p.mass[rows].sum())
    sums = model.comm.allreduce(sums)
    return sums[:-1] / sums[-1]


class FollowedNodes:
    """The nodes nearest to places, and their velocities. Collective, as are its methods.

    Args:
        model: the model, whose partition stays.
        places: (k, D) [m].
    """

    def __init__(self, model: mpm.Model, places: np.ndarray) -> None:
        self._model = model
        apart = np.linalg.norm(model.mesh.points[:, None] - places, axis=2)
        self._nodes = apart.argmin(axis=0)
        nearest = [model.comm.allreduce((float(d), model.comm.rank), MPI.MINLOC) for d in apart.min(axis=0)]
        self._mine = np.array([rank == model.comm.rank for _, rank in nearest])

    def velocity(self) -> np.ndarray:
        """Velocities (k, D) [m/s]."""
        mine = np.where(self._mine[:, None], self._model.nodal("velocity")[self._nodes], 0.0)
        return self._model.comm.allreduce(mine)
