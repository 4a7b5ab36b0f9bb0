"""The cell that sets the critical time step of a model."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ._core import InputError

if TYPE_CHECKING:
    from .mesh import Mesh
    from .model import Model


class CriticalCell(NamedTuple):
    """The cell with the smallest h_min / c_d (16), with the particle in it that has the fastest wave."""

    number: int
    """Number of the cell over all ranks, as in `Mesh.global_cells`"""
    centre: tuple[float, ...]
    """Of the cell [m]"""
    altitude: float
    """Smallest altitude h_min of the cell [m]"""
    wave_speed: float
    """Speed c_d of the compression wave (17) [m/s]"""
    material: int
    """Number of the law"""
    time_step: float
    """h_min / c_d [s], what `Model.critical_time_step` returns"""


def critical_cell(model: Model) -> CriticalCell:
    """Find the cell that sets the critical time step, so that it can be made larger, or its soil softer.

    Raises:
        InputError: the model has no particles.

    Note:
        Collective; the answer is the same on all ranks.
    """
    p, mesh, comm = model.particles, model.mesh, model.comm
    found = None
    if len(p):
        modulus = np.array([law.p_wave_modulus for law in model.laws])[p.material]
        speed = np.sqrt(modulus * p.volume / p.mass)
        cells, where = np.unique(p.cell, return_inverse=True)
        altitude = _altitudes(mesh, cells)[where]
        k = int(np.argmin(altitude / speed))
        found = CriticalCell(
            int(mesh.global_cells[p.cell[k]]), tuple(map(float, mesh.points[mesh.cells[p.cell[k]]].mean(axis=0))),
            float(altitude[k]), float(speed[k]), int(p.material[k]), float(altitude[k] / speed[k]),
        )  # fmt: skip
    of_ranks = [cell for cell in comm.allgather(found) if cell is not None]
    if not of_ranks:
        raise InputError(
            "the model has no particles, expected some before asking for the cell of the critical time step"
        )
    return min(of_ranks, key=lambda cell: (cell.time_step, cell.number))


def _altitudes(mesh: Mesh, cells: NDArray[np.int32]) -> NDArray[np.float64]:
    """Smallest altitude of some cells [m]: one over the largest gradient of their shape functions."""
    corners = mesh.points[mesh.cells[cells]]
    gradients = np.linalg.inv(corners[:, 1:] - corners[:, :1])  # a column for each node but the first
    first = -gradients.sum(axis=2, keepdims=True)
    return 1 / np.linalg.norm(np.concatenate([first, gradients], axis=2), axis=1).max(axis=1)
