"""A warning about pressures on facets that the soil leaves."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .model import Model


class LoadWatch:
    """Warns once where the cells behind facets whose pressure loads the soil have become empty, so that the load is lost there.

    Args:
        model: the model. Collective.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._speaks = any(presses for *_, presses in model._water_conditions)
        if self._speaks:
            self._begin()

    def _begin(self) -> None:
        """Take the loaded facets, and the cells that are filled now."""
        model, mesh, owned = self._model, self._model.mesh, self._model.mesh.owned_cells
        tags = np.asarray(mesh._core.facet_tags)[:owned]  # of the facet that is opposite to each node of a cell
        self._loaded = []
        for tag, history, is_level, _, presses in model._water_conditions:
            if not presses:
                continue
            cells, opposite = np.nonzero(tags == tag)
            of_cell = mesh.points[mesh.cells[cells], -1]
            height = (of_cell.sum(axis=1) - of_cell[np.arange(len(cells)), opposite]) / mesh.dim
            self._loaded.append((tag, history, is_level, cells, height))
        self._mesh, self._before = mesh, self._filled()

    def _filled(self) -> NDArray[np.bool_]:
        """Which cells of this rank have particles."""
        filled = np.zeros(len(self._model.mesh.cells), dtype=bool)
        filled[self._model.particles.cell] = True
        return filled

    def look(self) -> None:
        """Warn if soil has left loaded facets since the beginning of the run. Collective."""
        if not self._speaks:
            return
        model, lost = self._model, {}
        if model.mesh is not self._mesh:  # cells have moved to other ranks
            self._begin()
            return
        left = self._before & ~self._filled()
        for tag, history, is_level, cells, height in self._loaded:
            value = np.interp(model.time, *np.transpose(history))
            pressed = height < value if is_level else value != 0
            lost[tag] = model.comm.allreduce(int(np.count_nonzero(left[cells] & pressed)))
        tags = [tag for tag, count in lost.items() if count]
        if not tags:
            return
        self._speaks = False
        if model.comm.rank == 0:
            names = {tag: name for name, of_name in model.mesh.names["facet"].items() for tag in of_name}
            warnings.warn(
                f"the soil has left facets with tag {names.get(tags[0], tags[0])!r}, on which a pressure acts (press_surface, "
                "hold_pore_pressure), so that this load is lost there: it acts on the soil behind facets only. Loads that move with "
                "the soil are those of its particles (load_surface, traction) and of water above its surface (stand_water)",
                RuntimeWarning,
                stacklevel=5,
            )
