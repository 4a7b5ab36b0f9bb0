"""How far soil sinks into rigid surfaces whose springs are too soft for its stress."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

from .mesh import cell_sizes
from .surface_description import surface_of

if TYPE_CHECKING:
    from .model import Model

DEEPEST = 0.25
"""Mean penetration of the soil that touches a surface, over the size of its cells, above which a run warns"""


class PenetrationWatch:
    """Warns once for each rigid surface into which the soil sinks by a good part of a cell.

    Soil in the corner of a cell that a surface cuts off has a node of hardly any mass, and expands there without resistance; the
    deeper it lies, the more energy it generates when it is pressed together (docs/howto/limits.md).
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._warned: set[int] = set()

    def look(self) -> None:
        """Warn if the soil has sunk into a surface. Collective."""
        model = self._model
        entries = enumerate(zip(model.contacts, model._contacts, strict=True))
        open_ones = [
            (k, contact, entry) for k, (contact, entry) in entries if k not in self._warned and not entry["bonded"]
        ]
        if not open_ones:
            return
        size = _cell_size(model)
        if size == 0:  # all particles have left the mesh
            return
        for k, contact, entry in open_ones:
            state = contact._state()
            cells = state["penetration"] / size
            if cells <= DEEPEST:
                continue
            self._warned.add(k)
            if model.comm.rank == 0:
                stiffer = f"penalty=1 of add_contact in place of {entry['penalty']:g}" if entry["penalty"] < 1 else ""
                kind, stress = type(surface_of(model, entry["surface"])).__name__, state["normal"] / state["area"]
                warnings.warn(
                    f"soil lies {cells:.2g} cells deep in rigid surface {k} ({kind}) on average at t = {model.time:.6g} s, under "
                    f"{stress / 1e3:.3g} kPa: the contact is too soft for this stress, and soil in cells that the surface cuts "
                    f"may generate energy. Use {' or '.join(filter(None, [stiffer, 'a smaller courant']))} (docs/contact.md)",
                    RuntimeWarning,
                    stacklevel=5,
                )


def _cell_size(model: Model) -> float:
    """Mean size of the cells in which the particles are [m], 0 without particles. Collective."""
    mesh, comm = model.mesh, model.comm
    sizes = cell_sizes(mesh.cell_volumes, mesh.points.shape[1])[model.particles.cell]
    return float(comm.allreduce(float(sizes.sum())) / max(1, comm.allreduce(len(sizes))))
