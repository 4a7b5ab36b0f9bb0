"""Particles over time for the page of a run: frames are gathered while a study runs."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
from mpi4py import MPI

import mpm_core as mpm
import particle_player
from particle_player import Quantity, Scene

from .plots import DISPLACEMENT, PORE_PRESSURE, POROSITY, SHEAR_STRAIN, SPEED, VERTICAL_STRESS, WATER_PRESSURE

QUANTITIES = {
    "shear_strain": SHEAR_STRAIN, "displacement": DISPLACEMENT, "vertical_stress": VERTICAL_STRESS, "speed": SPEED
}  # fmt: skip
WET_QUANTITIES = {"pore_pressure": WATER_PRESSURE, "porosity": POROSITY}
"""Frames of models with pore water have them too"""
PORE = "excess_pore_pressure"
"""The state variable; frames of models that have it have it too"""
ALIKE = ("time", "bodies")
"""Entries of a frame that all ranks have alike"""


def particle_movie(
    title: str,
    scene: Scene | None,
    frames: Sequence[Mapping[str, np.ndarray] | None],
    quantities: Mapping[str, Quantity] = QUANTITIES,
) -> particle_player.Movie | None:
    """Frames of a model for one panel of the player, with the excess pore pressure where there is one.

    Args:
        title: stands above the panel.
        scene: mesh behind the particles.
        frames: as `particle_frame` gives them.
        quantities: those of the frames that can be chosen, by key.

    Returns:
        The movie; None where there are no frames, and on ranks other than the first, where scene and frames are None.
    """
    here = [frame for frame in frames if frame is not None]
    if scene is None or not here:
        return None
    pore = {PORE: PORE_PRESSURE} if PORE in here[0] else {}
    return particle_player.Movie(title, scene, here, {**quantities, **pore})


def __getattr__(name: str) -> object:
    if name == "Movie":
        text = "common.movie.Movie is now common.movie.particle_movie; the old name will go with the next version"
        warnings.warn(text, DeprecationWarning, stacklevel=2)
        return particle_movie
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def own_frame(model: mpm.Model, time: float, averaged: bool = False) -> dict[str, np.ndarray]:
    """The particles of a plane model on this rank as they are, and all rigid surfaces. Collective.

    Args:
        averaged: whether pore pressures are averaged over nodes, as those that act where a run averages volumetric strains.
    """
    acting = partial(averaged_where_known, model) if averaged else np.asarray
    # Plastic strain, because elastic oscillations during a long creep add up in the total.
    p = model.particles.single("volume", "id", "displacement", "velocity", "stress", "plastic_strain")
    pore = {PORE: acting(model.state(PORE)).astype(np.float32)} if has_pore_pressure(model) else {}
    if model.has_water:
        pore |= model.particles.single(*WET_QUANTITIES)
        pore["pore_pressure"] = acting(model.particles.pore_pressure).astype(np.float32)
        del pore["position"]
    area = areas(model, p["volume"], p["position"])
    return {
        "time": np.float64(time), "position": p["position"], "volume": area, "id": p["id"],
        "displacement": np.hypot(*p["displacement"].T), "shear_strain": p["plastic_strain"],
        "vertical_stress": p["stress"][:, 1].copy(), "speed": np.hypot(*p["velocity"].T), **pore, **bodies_of(model),
    }  # fmt: skip


def areas(model: mpm.Model, volume: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Volumes of particles (n,) as pictures have them: in the section [m2], also where they are those of one radian."""
    return volume / position[:, 0] if model.geometry == mpm.Geometry.AXISYMMETRIC else volume


def averaged_where_known(model: mpm.Model, values: np.ndarray) -> np.ndarray:
    """Values of the particles averaged over nodes; NaN, of soils that have none, stays and counts as zero. Collective."""
    return np.where(np.isnan(values), np.nan, model.average_over_nodes(np.nan_to_num(values)))


def bodies_of(model: mpm.Model) -> dict[str, np.ndarray]:
    """Rigid surfaces and structural members as segments, where there are any. Collective."""
    outlines = [contact.outline() for contact in model.contacts]
    segments = [points[cells] for points, cells in outlines]
    for name in model.members:
        nodes = model.member_forces(name).places
        segments.append(np.stack([nodes[:-1], nodes[1:]], axis=1))
    return {"bodies": np.concatenate(segments)} if segments else {}


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
