"""What the tests of output write."""

import numpy as np
from mpi4py import MPI

COMM = MPI.COMM_WORLD
TRIANGLES = np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)
SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])


def particle_fields(n, dimension, seed=0):
    rng = np.random.default_rng(seed)
    return {
        "position": rng.random((n, dimension)),
        "velocity": rng.random((n, dimension)),
        "stress": rng.random((n, 4 if dimension == 2 else 6)),
        "volume": rng.random(n),
        "gradient": rng.random((n, 9)),
        "id": rng.permutation(n).astype(np.int64),
        "material": np.ones(n, dtype=np.int32),
    }
