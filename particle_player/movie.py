"""Particles over time, and how they are packed small for a page."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from particle_player.scene import Quantity, Scene, axis_labels, disc_diameter

LEVELS = 65534
ABSENT = 65535
MOST_BYTES = 60e6
"""Largest size of a movie before it is packed; frames of a longer one are left out."""
MOST_PARTICLES = 200_000
"""Largest number of particles in a movie; of more particles every second, third ... is drawn, larger."""
PICTURE_AXES = ["across the picture [m]", "up the picture [m]"]

Frame = Mapping[str, NDArray]


@dataclass(frozen=True)
class Movie:
    """Particles over time, for one panel of the player.

    Args:
        title: stands above the panel.
        scene: mesh behind the particles.
        frames: at least one, each with ``time`` [s] (or what else the slider shows), ``position`` (n, 2) [m], ``volume``
            (n,) [m^3 per metre], of a half section the area too, quantities by their keys (n,) in SI units, and ``id`` (n,)
            when rows change their order or number from frame to frame; ``bodies`` (k, 2, 2) are segments of rigid surfaces [m],
            as many in each frame. With a view, positions and segments have three coordinates, ``volume`` is the area that a particle
            covers in the picture (n,) [m^2], and ``light`` (n,) its brightness from 0 to 1, if it is given.
        quantities: those of the frames that can be chosen, by key.
        view: of a body in three dimensions, rows of unit vectors to the right and upwards in the picture, and to the eye (3, 3);
            the scene is then that of the picture.
    """

    title: str
    scene: Scene
    frames: Sequence[Frame]
    quantities: Mapping[str, Quantity]
    view: NDArray[np.float64] | None = None

    def in_picture(self, points: NDArray[np.floating]) -> NDArray[np.floating]:
        """Points (..., 2) of the plane as they are; those of a body (..., 3) [m] to the right and upwards in its picture (..., 2) [m]."""
        return points if self.view is None else points @ self.view[:2].T


def packed(movie: Movie) -> dict[str, Any]:
    """A movie as JSON: each field (frames, particles), rows by rising id.

    Raises:
        ValueError: a movie without frames.
    """
    if not movie.frames:
        raise ValueError("frames is empty, expected at least one")
    frames, ids, every = _chosen(movie)
    view = movie.view
    places = [_columns(frame, ids) for frame in frames]

    def over_time(values: Sequence[NDArray]) -> dict[str, Any]:
        table = np.full((len(frames), len(ids)), np.nan, np.float32)
        for row, (rows, columns), value in zip(table, places, values):
            row[columns] = value[rows]
        return quantised(table)

    across, up = zip(*(movie.in_picture(frame["position"]).T for frame in frames))
    fields = {
        "x": over_time(across),
        "y": over_time(up),
        "radius": over_time([0.5 * np.sqrt(every) * disc_diameter(frame["volume"]) for frame in frames]),
    }
    if view is not None:
        fields["depth"] = over_time([frame["position"] @ view[2] for frame in frames])
    if "light" in frames[0]:
        fields["light"] = over_time([frame["light"] for frame in frames])
    for key, quantity in movie.quantities.items():
        fields[key] = over_time([quantity.scale * frame[key] for frame in frames])
    return {
        "title": movie.title + (f" (one particle in {every})" if every > 1 else ""),
        "times": [float(frame["time"]) for frame in frames],
        "count": len(ids),
        "ids": ids.tolist() if (ids != np.arange(len(ids))).any() else None,
        "fields": fields,
        "bodies": [
            np.round(movie.in_picture(frame["bodies"]).reshape(-1), 5).tolist() if "bodies" in frame else []
            for frame in frames
        ],
        "scene": _scene(movie.scene),
        "axes": PICTURE_AXES
        if view is not None
        else [label.replace("$", "") for label in axis_labels(movie.scene.half_section)],
        "view": None if view is None else view.tolist(),
    }


def _ids(frame: Frame) -> NDArray[np.int64]:
    return np.asarray(frame.get("id", np.arange(len(frame["position"])))).astype(np.int64)


def _chosen(movie: Movie) -> tuple[list[Frame], NDArray[np.int64], int]:
    """Frames and particles' numbers that are drawn, and of how many particles one is."""
    ids = np.unique(np.concatenate([_ids(frame) for frame in movie.frames]))
    every = -(-len(ids) // MOST_PARTICLES)
    ids = ids[::every]
    size = 2 * len(ids) * (3 + 2 * (movie.view is not None) + len(movie.quantities))
    skip = max(1, int(np.ceil(len(movie.frames) * size / MOST_BYTES)))
    return list(movie.frames)[::-1][::skip][::-1], ids, every  # counted backwards: the last frame always stays


def _columns(frame: Frame, ids: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows of a frame that are drawn, and their columns among ``ids``."""
    numbers = _ids(frame)
    columns = np.minimum(np.searchsorted(ids, numbers), len(ids) - 1)
    rows = np.flatnonzero(ids[columns] == numbers)
    return rows, columns[rows]


def quantised(table: NDArray[np.floating]) -> dict[str, Any]:
    """A field (frames, particles) in 16 bits, packed for ``readField`` in ``data.js``; NaN where a particle is absent.

    Successive frames hardly differ, nor do the high bytes: differences and bytes set apart pack well.
    """
    present = np.isfinite(table)
    low = float(np.min(table, where=present, initial=np.inf))
    high = float(np.max(table, where=present, initial=-np.inf))
    if not low <= high:
        low = high = 0.0
    span = high - low if high > low else 1.0
    levels = np.where(present, np.rint((np.where(present, table, low) - low) / span * LEVELS), ABSENT).astype(np.uint16)
    differences = np.concatenate([levels[:1], levels[1:] - levels[:-1]]).ravel()
    apart = np.concatenate([(differences & 255).astype(np.uint8), (differences >> 8).astype(np.uint8)])
    data = base64.b64encode(zlib.compress(apart.tobytes(), 6)).decode("ascii")
    return {"low": low, "high": low + span, "data": data}


def _scene(scene: Scene) -> dict[str, list[float]]:
    """Lines behind the particles, each as x0 y0 x1 y1 [m]."""
    cells = scene.cells
    edges = np.unique(np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1), axis=0)
    lines = {"boundary": scene.boundary, "outline": scene.initial_outline, "mesh": scene.points[edges]}
    return {name: np.round(segments.reshape(-1), 5).tolist() for name, segments in lines.items()}
