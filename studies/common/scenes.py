"""The background mesh of a model for pictures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import mpm_core as mpm
from particle_player import Scene


def scene_of(model: mpm.Model, soil_tags: Sequence[int]) -> Scene | None:
    """The whole background mesh, with the cells of some tags as soil, on the first rank; None on the others, and of a body. Collective."""
    comm, mesh = model.comm, model.mesh
    if mesh.dim == 3:
        return None
    n = mesh.owned_cells
    parts = comm.gather((mesh.points[mesh.cells[:n]], mesh.cell_tags[:n]))
    if parts is None:
        return None
    corners, tags = (np.concatenate(arrays) for arrays in zip(*parts))
    points, cells = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    return Scene(points, cells.reshape(-1, 3), np.isin(tags, soil_tags), model.geometry == mpm.Geometry.AXISYMMETRIC)
