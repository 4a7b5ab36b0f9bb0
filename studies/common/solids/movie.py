"""Particles of a body over time for the page of a run, in the view of the pictures of bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

import mpm_core as mpm
from particle_player import Movie, Scene

from ..plots import DISPLACEMENT, SHEAR_STRAIN, SPEED
from .film import lit_surface
from .members import square_size
from .particles import body_of
from .plots import outline_of
from .site import Solid
from .view import picture_axes

QUANTITIES = {"displacement": DISPLACEMENT, "shear_strain": SHEAR_STRAIN, "speed": SPEED}
FINER = 2
"""Squares over the width of a particle, in which the surface of a body is found"""


def ground_of(model: mpm.Model, soil_tags: Sequence[int]) -> Solid | None:
    """The soil of a model in three dimensions at the start, on the first rank; None on the others. Collective."""
    mesh = model.mesh
    own = np.flatnonzero(np.isin(mesh.cell_tags[: mesh.owned_cells], soil_tags))
    parts = model.comm.gather(mesh.points[mesh.cells[own]])
    if parts is None:
        return None
    points, cells = np.unique(np.concatenate(parts).reshape(-1, 3), axis=0, return_inverse=True)
    return Solid(points, cells.reshape(-1, 4), 0 * points, np.zeros(len(cells) // 4))


def solid_movie(title: str, ground: Solid | None, frames: Sequence[Mapping[str, np.ndarray]]) -> Movie | None:
    """Frames of a body for one panel of the player; None where there are none.

    Args:
        title: stands above the panel.
        ground: the soil at the start.
        frames: as `solid_frame` gives them.
    """
    frames = [frame for frame in frames if len(frame["position"])]
    if ground is None or not frames:
        return None
    side = body_of(frames[-1]).side_to_see()
    view = picture_axes(side)
    outline = outline_of(ground, side) @ view[:2].T
    scene = Scene(ground.points @ view[:2].T, np.empty((0, 3), dtype=np.int64), outline=outline)
    return Movie(title, scene, [_lit(frame, view) for frame in frames], QUANTITIES, view)


def _lit(frame: Mapping[str, np.ndarray], view: np.ndarray) -> dict[str, Any]:
    """A frame with the area that each particle covers, and its brightness as a part of the surface that is seen."""
    at = frame["position"] @ view.T
    square = square_size(at[:, :2], float(np.median(np.cbrt(frame["volume"]))) / FINER)
    places = (at[:, :2] - at[:, :2].min(axis=0)) / square
    columns, rows = np.floor(places).astype(int).T
    nearest = np.full((rows.max() + 1, columns.max() + 1), -np.inf)
    # Rows of a picture run downwards.
    np.maximum.at(nearest, (rows.max() - rows, columns), at[:, 2] / square)
    covered = np.isfinite(nearest)
    light = lit_surface(np.where(covered, nearest, 0.0), covered, float(FINER), view)
    found = map_coordinates(light, [rows.max() - places[:, 1] + 0.5, places[:, 0] - 0.5], order=1, mode="nearest")
    return {**frame, "volume": np.cbrt(frame["volume"]) ** 2, "light": found.astype(np.float32)}
