"""The space that the soil fills, and the parts that the body consists of: losses that no other result shows."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .model import Model

LEAST_FILLED = 0.85
"""Filled volume over that of the particles below which a run warns"""

ALIKE = 0.05
"""Difference of that fraction up to which it counts as the one at the start"""

LEAST_PART = 0.01
"""Fraction of the mass above which a piece of the body counts as a part"""


SWOLLEN = 2.0
"""Volume of a particle over that of its cell above which it counts as swollen"""

STEPS_BETWEEN = 256
"""Steps after which a run checks its space and parts again"""


class Space(NamedTuple):
    """Volumes, in plane strain areas times one metre, in axial symmetry of one radian [m3].

    particles: sum of the particles' volumes
    filled: volume that they fill: in each cell the smaller of their volume and its own
    """

    particles: float
    filled: float


def space(model: Model) -> Space:
    """Volume of the particles, and the volume of the mesh that they fill. Where particles crowd, the latter is smaller.

    Collective.
    """
    p, mesh = model.particles, model.mesh
    held = np.bincount(p.cell, p.volume, minlength=mesh.owned_cells)
    filled = np.minimum(held[: mesh.owned_cells], model.cell_volumes[: mesh.owned_cells])
    sums = model.comm.allreduce(np.array([p.volume.sum(), filled.sum()]))
    return Space(float(sums[0]), float(sums[1]))


def swollen(model: Model) -> str:
    """Text on the particle that is largest relative to its cell, where that is more than twice the cell's volume, else none.

    Where a surface cuts off a corner of a cell, a node beyond it has hardly any mass, and the few particles there, at the apex of
    their strength, expand without resistance. Pressed together again they resist with the volume that they have reached, which
    generates energy. Collective.
    """
    p = model.particles
    largest = float(np.max(p.volume / model.cell_volumes[p.cell], initial=0.0))
    largest = max(model.comm.allgather(largest))
    if largest <= SWOLLEN:
        return ""
    return (
        f"a particle has {largest:.3g} times the volume of its cell: soil in a corner of a cell has expanded without resistance, and "
        "resists with that volume when it is pressed together. Take a stiffer contact (penalty=1 of add_contact), or let rigid "
        "surfaces follow the sides of cells (docs/howto/limits.md)"
    )


def parts(model: Model) -> NDArray[np.float64]:
    """Masses [kg] of the pieces that the body consists of, the heaviest first, on all ranks.

    Particles belong together when their cells share a node, for then they act on each other. A body in tension whose
    particles have moved apart by more than a cell is in pieces (numerical fracture), whatever its law says.

    Note:
        Collective; gathers the filled cells on one rank.
    """
    p, mesh = model.particles, model.mesh
    mass = np.bincount(p.cell, p.mass, minlength=mesh.owned_cells)[: mesh.owned_cells]
    cells = np.flatnonzero(mass)
    gathered = model.comm.gather((mesh.global_nodes[mesh.cells[cells]], mass[cells]))
    found = None
    if gathered is not None:
        nodes, masses = (np.concatenate(each) for each in zip(*gathered, strict=True))
        found = _piece_masses(nodes, masses)
    return model.comm.bcast(found)


def count_parts(model: Model) -> int:
    """Number of the pieces of the body that have more than `LEAST_PART` of its mass. Collective."""
    masses = parts(model)
    return int(np.sum(masses >= LEAST_PART * masses.sum()))


def _piece_masses(cells: NDArray, masses: NDArray) -> NDArray[np.float64]:
    """Masses of the sets of cells that nodes connect."""
    _, nodes = np.unique(cells, return_inverse=True)
    nodes = nodes.reshape(cells.shape)
    by_node = np.argsort(nodes, axis=None, kind="stable")
    cell_at_node = by_node // cells.shape[1]
    first_at_node = np.flatnonzero(np.diff(nodes.ravel()[by_node], prepend=-1))
    label = np.arange(len(first_at_node))
    while True:
        before = label
        # A node takes the least label of the cells around it, and then that of the node which bears this number, so
        # that pieces grow by leaps.
        label = np.minimum.reduceat(label[nodes].min(axis=1)[cell_at_node], first_at_node)
        label = label[label]
        if np.array_equal(label, before):
            break
    weights = np.bincount(label[nodes[:, 0]], masses)
    return np.sort(weights[weights > 0])[::-1]


class SpaceWatch:
    """Compares space and parts of a body with those at the start of the model's first run.

    A check costs as much as some ten steps, so it is made after every `STEPS_BETWEEN` steps only.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._parts = count_parts(model)
        self._steps = model.steps
        at_start = space(model)
        self._at_start = at_start.filled / at_start.particles if at_start.particles > 0 else 1.0

    def look(self) -> None:
        """Warn if the body has come apart, or takes up too little space. Collective."""
        if self._model.steps - self._steps < STEPS_BETWEEN:
            return
        self._steps = self._model.steps
        now, volumes = count_parts(self._model), space(self._model)
        if self._model.comm.rank != 0:
            return
        if now > self._parts:
            before, self._parts = self._parts, now
            warnings.warn(
                f"the body is in {now} parts at t = {self._model.time:.6g} s, and was in {before}: particles moved apart "
                "by more than a cell, so that no force acts between them. Unless the soil is meant to break, use more particles "
                "per cell or larger cells",
                RuntimeWarning,
                stacklevel=5,
            )
        if volumes.filled < LEAST_FILLED * volumes.particles:
            filled = volumes.filled / volumes.particles
            warnings.warn(
                f"the particles fill {100 * filled:.0f} % of their volume at t = "
                f"{self._model.time:.6g} s: {crowding(filled, self._at_start)}",
                RuntimeWarning,
                stacklevel=5,
            )


def crowding(filled: float, at_start: float) -> str:
    """Why particles fill too little space, by the fraction of their volume that they fill now and at the start of the run."""
    gathers = (
        "they accumulate in some cells, so that the body takes up too little space; this is less with integration=MIXED than with "
        "PARTICLES"
    )
    if at_start >= LEAST_FILLED:
        return gathers
    alike = filled > at_start - ALIKE
    placed = (
        f"they {'did so' if alike else f'filled {100 * at_start:.0f} %'} at the start, as on a regular grid of points, some of which "
        "lie on the sides of cells, or where soil was placed twice; Model.seed fills cells evenly"
    )
    return placed if alike else f"{placed}. Since then {gathers}"
