"""Where the front of a slide is."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

comm = MPI.COMM_WORLD
FRONT = 0.01
"""Part of the soil that lies beyond its front: the foremost particle may have been thrown there by itself"""


def front(x: np.ndarray, volume: np.ndarray) -> float:
    """Position of the front of the soil [m]: beyond it lies `FRONT` of the volume of all particles. Collective.

    Args:
        x: positions along the slope (n,) of this rank's particles [m].
        volume: their volumes (n,) [m2].
    """
    x, volume = (np.concatenate(comm.allgather(values)) for values in (x, volume))
    order = np.argsort(x)
    filled = np.cumsum(volume[order])
    return float(np.interp((1 - FRONT) * filled[-1], filled, x[order]))
