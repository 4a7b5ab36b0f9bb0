"""Particles over time for the page of a run: frames are gathered while a study runs, and packed small when it ends."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from mpi4py import MPI

import mpm_core as mpm

from .plots import (
    DISPLACEMENT,
    PORE_PRESSURE,
    POROSITY,
    SHEAR_STRAIN,
    SPEED,
    VERTICAL_STRESS,
    WATER_PRESSURE,
    Quantity,
    Scene,
    axis_labels,
    disc_diameter,
)

QUANTITIES = {
    "shear_strain": SHEAR_STRAIN, "displacement": DISPLACEMENT, "vertical_stress": VERTICAL_STRESS, "speed": SPEED
}  # fmt: skip
WET_QUANTITIES = {"pore_pressure": WATER_PRESSURE, "porosity": POROSITY}
"""Frames of models with pore water have them too"""
PORE = "excess_pore_pressure"
"""The state variable; frames of models that have it have it too"""
ALIKE = ("time", "bodies")
"""Entries of a frame that all ranks have alike"""
LEVELS = 65534
ABSENT = 65535
MOST_BYTES = 60e6
"""Of one movie before it is packed; of a longer one some frames are left out."""
MOST_PARTICLES = 200_000
"""In one movie; of more particles every second, third ... is drawn, larger."""


@dataclass(frozen=True)
class Movie:
    """Particles over time, for one panel of the player.

    Args:
        title: stands above the panel.
        scene: mesh behind the particles.
        frames: at least one, each with ``time`` [s] (or what else the slider shows), ``position`` (n, 2) [m], ``volume``
            (n,) [m^3 per metre], of a half section the area too, quantities by their keys (n,) in SI units, and ``id`` (n,)
            when rows change their order or number from frame to frame; ``bodies`` (k, 2, 2) are segments of rigid surfaces [m],
            as many in each frame. On ranks other than the first each is None.
        quantities: those of the frames that can be chosen, by key; the excess pore pressure is added where there is one.
    """

    title: str
    scene: Scene
    frames: Sequence[Mapping[str, np.ndarray] | None]
    quantities: Mapping[str, Quantity] = field(default_factory=lambda: QUANTITIES)

    def __post_init__(self) -> None:
        if self.frames and self.frames[0] is not None and PORE in self.frames[0]:
            object.__setattr__(self, "quantities", {**self.quantities, PORE: PORE_PRESSURE})


# --- frames ----------------------------------------------------------------------------------------------------------


def own_frame(model: mpm.Model, time: float) -> dict[str, np.ndarray]:
    """The particles of a plane model on this rank as they are, and all rigid surfaces. Collective where there are such."""
    # Plastic strain, because elastic oscillations during a long creep add up in the total.
    p = model.particles.single("volume", "id", "displacement", "velocity", "stress", "plastic_strain")
    pore = {PORE: model.state(PORE).astype(np.float32)} if has_pore_pressure(model) else {}
    if model.has_water:
        pore |= model.particles.single(*WET_QUANTITIES)
        del pore["position"]
    area = p["volume"]
    if model.geometry == mpm.Geometry.AXISYMMETRIC:
        area = area / p["position"][:, 0]
    return {
        "time": np.float64(time), "position": p["position"], "volume": area, "id": p["id"],
        "displacement": np.hypot(*p["displacement"].T), "shear_strain": p["plastic_strain"],
        "vertical_stress": p["stress"][:, 1].copy(), "speed": np.hypot(*p["velocity"].T), **pore, **_bodies(model),
    }  # fmt: skip


def _bodies(model: mpm.Model) -> dict[str, np.ndarray]:
    """The rigid surfaces that the particles touch, as segments, where there are any. Collective."""
    outlines = [contact.outline() for contact in model.contacts]
    return {"bodies": np.concatenate([points[cells] for points, cells in outlines])} if outlines else {}


def particle_frame(model: mpm.Model, time: float) -> dict[str, np.ndarray] | None:
    """All particles of a plane model as they are, on the first rank; None on the others. Collective."""
    return gathered(model.comm, own_frame(model, time))


def has_pore_pressure(model: mpm.Model) -> bool:
    """Whether the state of any of the laws has an excess pore pressure."""
    return any(PORE in law.state_names for law in model.laws)


def fem_frame(model: mpm.Model, fem: object, time: float, places: np.ndarray | None = None) -> dict | None:
    """What finite elements have at the particles' material points, on the first rank; None on the others. Collective.

    Args:
        fem: a solved ``QuasiStatic``.
        places: of the particles in the undeformed body (n, 2) [m]; where they started if not given.
    """
    p = model.particles
    places = p.initial_position if places is None else places
    found = fem.evaluate_at(places)
    plastic = (
        found["state"][:, fem.law.state_names.index("plastic_strain")] if fem.law.n_state else np.zeros(len(places))
    )
    pore = {PORE: found["state"][:, fem.law.state_names.index(PORE)]} if has_pore_pressure(model) else {}
    return frame_of(model, time, {
        "position": places + found["displacement"], "volume": p.volume, "id": p.id,
        "displacement": np.linalg.norm(found["displacement"], axis=1), "shear_strain": plastic,
        "vertical_stress": found["stress"][:, 1], "speed": np.zeros(len(places)),
        **pore,
    })  # fmt: skip


def frame_of(model: mpm.Model, time: float, fields: dict[str, np.ndarray]) -> dict[str, np.ndarray] | None:
    """Fields of all particles, on the first rank; None on the others. Collective."""
    single = {name: values if name == "id" else values.astype(np.float32) for name, values in fields.items()}
    return gathered(model.comm, {"time": np.float64(time), **single})


def gathered(comm: MPI.Comm, frame: dict[str, np.ndarray]) -> dict[str, np.ndarray] | None:
    """Frames of all ranks as one, on the first rank; None on the others. Collective."""
    if comm.size == 1:
        return frame
    parts = comm.gather(frame)
    if parts is None:
        return None
    return {name: frame[name] if name in ALIKE else np.concatenate([part[name] for part in parts]) for name in frame}


# --- packing ---------------------------------------------------------------------------------------------------------


def packed(movie: Movie) -> dict:
    """A movie as JSON: each field (frames, particles), rows by rising id.

    Raises:
        ValueError: a movie without frames.
    """
    if not movie.frames:
        raise ValueError("frames is empty, expected at least one")
    frames, ids, every = _chosen(movie)
    places = [_columns(frame, ids) for frame in frames]

    def over_time(values: Sequence[np.ndarray]) -> dict:
        table = np.full((len(frames), len(ids)), np.nan, np.float32)
        for row, (rows, columns), value in zip(table, places, values):
            row[columns] = value[rows]
        return quantised(table)

    fields = {
        "x": over_time([frame["position"][:, 0] for frame in frames]),
        "y": over_time([frame["position"][:, 1] for frame in frames]),
        "radius": over_time([0.5 * np.sqrt(every) * disc_diameter(frame["volume"]) for frame in frames]),
    }
    for key, quantity in movie.quantities.items():
        fields[key] = over_time([quantity.scale * frame[key] for frame in frames])
    return {
        "title": movie.title + (f" (one particle in {every})" if every > 1 else ""),
        "times": [float(frame["time"]) for frame in frames],
        "count": len(ids),
        "ids": ids.tolist() if (ids != np.arange(len(ids))).any() else None,
        "fields": fields,
        "bodies": [np.round(frame["bodies"].reshape(-1), 5).tolist() if "bodies" in frame else [] for frame in frames],
        "scene": _scene(movie.scene),
        "axes": [label.replace("$", "") for label in axis_labels(movie.scene.half_section)],
    }


def _ids(frame: Mapping[str, np.ndarray]) -> np.ndarray:
    return np.asarray(frame.get("id", np.arange(len(frame["position"])))).astype(np.int64)


def _chosen(movie: Movie) -> tuple[list[Mapping[str, np.ndarray]], np.ndarray, int]:
    """Frames and particles' numbers that are drawn, and of how many particles one is."""
    ids = np.unique(np.concatenate([_ids(frame) for frame in movie.frames]))
    every = -(-len(ids) // MOST_PARTICLES)
    ids = ids[::every]
    size = 2 * len(ids) * (3 + len(movie.quantities))
    skip = max(1, int(np.ceil(len(movie.frames) * size / MOST_BYTES)))
    return list(movie.frames)[::-1][::skip][::-1], ids, every  # counted backwards: the last frame always stays


def _columns(frame: Mapping[str, np.ndarray], ids: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of a frame that are drawn, and their columns among ``ids``."""
    numbers = _ids(frame)
    columns = np.minimum(np.searchsorted(ids, numbers), len(ids) - 1)
    rows = np.flatnonzero(ids[columns] == numbers)
    return rows, columns[rows]


def quantised(table: np.ndarray) -> dict:
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


def _scene(scene: Scene) -> dict:
    """Lines behind the particles, each as x0 y0 x1 y1 [m]."""
    cells = scene.cells
    edges = np.unique(np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1), axis=0)
    lines = {"boundary": scene.boundary, "outline": scene.initial_outline, "mesh": scene.points[edges]}
    return {name: np.round(segments.reshape(-1), 5).tolist() for name, segments in lines.items()}
