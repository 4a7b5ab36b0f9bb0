"""Ghost penalty: stabilisation of the implicit scheme at nodes with hardly any mass."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _core
from ._core import InputError


@dataclass(frozen=True)
class GhostPenalty:
    """Penalty on the jump of gradients between partly filled cells and their neighbours.

    Where the boundary of the body cuts a cell, the outer nodes of the cell depend on a few particles only, which makes the
    tangent nearly singular. The penalty couples the gradient in such a cell to that of its neighbour (Burman 2010; in implicit
    MPM Coombs 2023). The penalty vanishes for affine motion, and where all cells of the body are filled.

    Raises:
        InputError: a number below zero, or ``filled`` above one.
    """

    stiffness: float = 0.1
    """gamma_K, relative to the shear modulus [-]; acts on the displacement of the step,
    with inertia on the part that comes from changes of velocity"""
    mass: float = 0.1
    """gamma_M, relative to the density [-]; acts on the acceleration"""
    filled: float = 0.5
    """Cells filled to less than this fraction of their volume are stabilised; 0 for none"""

    def __post_init__(self) -> None:
        for name in ("stiffness", "mass", "filled"):
            value = getattr(self, name)
            most = 1.0 if name == "filled" else np.inf
            if not (np.isfinite(value) and 0 <= value <= most):
                raise InputError(f"{name} is {value}, expected a number from 0 to {most}")

    def options(self) -> Any:
        """The penalty as the core takes it, a ``_core.GhostOptions`` with the same three numbers."""
        options = _core.GhostOptions()
        options.stiffness, options.mass, options.filled = self.stiffness, self.mass, self.filled
        return options
