"""The cell that sets the critical time step of a model."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from ._core import InputError

if TYPE_CHECKING:
    from .model import Model


class CriticalCell(NamedTuple):
    """The cell with the smallest h_min / c_d (16), with the particle in it that has the fastest wave."""

    number: int
    """Number of the cell over all ranks, as in `Mesh.global_cells`"""
    centre: tuple[float, ...]
    """Centre of the cell [m]"""
    altitude: float
    """Smallest altitude h_min of the cell [m]"""
    wave_speed: float
    """Speed c_d of the compression wave (17) [m/s]; of the fast wave where water has its own velocity"""
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
    k, altitude, time_step = model._core.critical_particle()
    found, p, mesh = None, model.particles, model.mesh
    if k >= 0:
        cell = p.cell[k]
        centre = tuple(map(float, model.node_positions[mesh.cells[cell]].mean(axis=0)))
        number, material = int(mesh.global_cells[cell]), int(p.material[k])
        found = CriticalCell(number, centre, altitude, altitude / time_step, material, time_step)
    of_ranks = [cell for cell in model.comm.allgather(found) if cell is not None]
    if not of_ranks:
        raise InputError(
            "the model has no particles, expected some before asking for the cell of the critical time step"
        )
    return min(of_ranks, key=lambda cell: (cell.time_step, cell.number))
