"""The small-strain memory of Hardening Soil, which natural ground has lost."""

from __future__ import annotations

import numpy as np
from mpm_core.laws import small_strain_columns
from numpy.typing import NDArray

from fenics_bridge.types import Law


def without_memory(law: Law, state: NDArray[np.float64]) -> NDArray[np.float64]:
    """The states of points that are as stiff in all directions as after a long rest.

    The strains by which ground comes to equilibrium in its first stage are those of its deposition. Ages have passed since then, and its
    stiffness at small strains has come back.

    Args:
        law: law of the points.
        state: state variables, shape (n, n_state).

    Returns:
        State variables, shape (n, n_state): those of the memory are zero, others as they were.
    """
    rested = state.copy()
    rested[:, small_strain_columns(law)] = 0.0
    return rested
