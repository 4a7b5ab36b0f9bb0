"""Warnings of linear elements without averaged strains in soil that keeps its volume."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from mpm_core.setup_warnings import locking, locks_at_failure

if TYPE_CHECKING:
    from fenics_bridge.fem.quasi_static import QuasiStatic
    from fenics_bridge.water.consolidation import Consolidation


def warn_of_locking(model: QuasiStatic | Consolidation, instead: str = "elements of degree=2 or 4 hardly lock") -> None:
    """Warn where the laws of a new model keep the volume of the soil whatever happens. Collective."""
    text = locking(model.laws) if _is_plain(model) else ""  # on all ranks, since `laws` is collective
    if text and model.domain.comm.rank == 0:
        warnings.warn(f"{text}; {instead}", RuntimeWarning, stacklevel=3)


def warn_of_locking_at_failure(model: Any) -> None:
    """Warn where the soil keeps its volume as it fails, before a collapse load or a factor of safety is found. Collective."""
    locks = _is_plain(model) and locks_at_failure(model.laws)  # on all ranks, since `laws` is collective
    if locks and model.domain.comm.rank == 0:
        warnings.warn(
            "linear elements without averaged strains are too strong for soil whose dilation angle is below its friction angle, "
            "since it keeps its volume as it fails: take nmd=True, or elements of degree=2 or 4 (docs/locking.md)",
            RuntimeWarning,
            stacklevel=3,
        )


def _is_plain(model: Any) -> bool:
    return getattr(model, "degree", 2) == 1 and not model._nmd
