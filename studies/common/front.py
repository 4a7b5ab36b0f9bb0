"""Where the front of a slide is."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

comm = MPI.COMM_WORLD
FRONT = 0.01
"""Part of the soil that lies beyond its front: the foremost particle may have been thrown there by itself"""


def front(x: np.ndarray, amount: np.ndarray, beyond: float = FRONT) -> float:
    """Position of the front of the soil [m]: beyond it lies a part of the soil of all particles. Collective.

    Args:
        x: positions along the slope (n,) of this rank's particles [m].
        amount: their masses, or the volumes of their grains (n,), which do not change.
        beyond: the part.
    """
    x, amount = (np.concatenate(comm.allgather(values)) for values in (x, amount))
    order = np.argsort(x)
    filled = np.cumsum(amount[order])
    return float(np.interp((1 - beyond) * filled[-1], filled, x[order]))
