"""Warnings of laws: friction angles in radians, and linear elements that lock in soil that keeps its volume."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from mpm_core.law_warnings import angles_in_radians, keeps_volume, locking, locks_at_failure

from fenics_bridge import compat
from fenics_bridge.mesh.tagged import cell_volumes
from mpm_core.mesh import cell_sizes

if TYPE_CHECKING:
    from dolfinx import fem

    from fenics_bridge.fem.quasi_static import QuasiStatic
    from fenics_bridge.water.consolidation import Consolidation

FEWEST = 3
"""Cells over the height of a mechanism below which factors of linear elements with averages are up to a tenth too low: 1.6 of them in
the bank of docs/fem.md with cells of a third of its height; with 4.2, cells of a sixth, they are right to 4 %"""


def warn_of_laws(model: QuasiStatic | Consolidation, instead: str = "elements of degree=2 or 4 hardly lock") -> None:
    """Warn where the laws of a new model have angles in radians, or keep the volume of the soil whatever happens. Collective."""
    laws = model.laws  # on all ranks, since it is collective
    locks = locking(laws) if _is_plain(model) else ""
    for text in (angles_in_radians(laws), f"{locks}; {instead}" if locks else ""):
        if text and model.domain.comm.rank == 0:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def warn_of_locking_at_failure(model: Any) -> None:
    """Warn where the soil keeps its volume as it fails, before a collapse load or a factor of safety is found. Collective."""
    laws = model.laws  # on all ranks, since it is collective
    texts = []
    if _is_plain(model) and locks_at_failure(laws):
        texts.append(
            "linear elements without averaged strains are too strong for soil whose dilation angle is below its friction angle, "
            "since it keeps its volume as it fails: take nmd=True, or elements of degree=2 or 4 (docs/locking.md)"
        )
    if _is_quadratic_of_revolution(model) and (locks_at_failure(laws) or keeps_volume(laws)):
        texts.append(
            "quadratic elements of a body of revolution are up to a tenth too strong for soil that keeps its volume as it fails, the more "
            "the coarser the mesh: take degree=4, or compare with smaller cells (docs/fem.md)"
        )
    for text in texts:
        if model.domain.comm.rank == 0:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def warn_of_few_cells(model: Any, mechanism: fem.Function) -> None:
    """Warn where linear elements with averaged strains resolve a mechanism by so few cells that averages reach over all of it.

    Args:
        model: the finite elements.
        mechanism: its displacement, with a largest one of 1; soil with more than half of it counts as moving.

    Note:
        Collective.
    """
    if getattr(model, "degree", 2) != 1 or not model._nmd:
        return
    domain, space, dim = model.domain, mechanism.function_space, model.domain.geometry.dim
    moves = np.linalg.norm(mechanism.x.array.reshape(-1, dim), axis=1) > 0.5
    heights = space.tabulate_dof_coordinates()[moves, dim - 1]
    volumes = cell_volumes(domain)
    sizes = cell_sizes(volumes, dim)[moves[compat.cell_dofs(space)[: len(volumes)]].any(axis=1)]
    here = heights.min(initial=np.inf), heights.max(initial=-np.inf), sizes.sum(), len(sizes)
    low, high, total, count = np.transpose(domain.comm.allgather(here))
    if count.sum() == 0:
        return
    cells = (high.max() - low.min()) * count.sum() / total.sum()
    if cells < FEWEST and domain.comm.rank == 0:
        high_as = f"{cells:.2g} cells high" if cells >= 1 else "less than one cell high"
        warnings.warn(
            f"the soil that moves in the mechanism is {high_as}, so that averages of linear elements reach over all of it: "
            f"the load or factor may be up to a tenth too low. Take cells that make it {FEWEST} high at least, or degree=2 (docs/fem.md)",
            RuntimeWarning,
            stacklevel=3,
        )


def _is_quadratic_of_revolution(model: Any) -> bool:
    return getattr(model, "degree", None) == 2 and getattr(model, "radius", None) is not None


def _is_plain(model: Any) -> bool:
    return getattr(model, "degree", 2) == 1 and not model._nmd
