"""A background mesh that moves with the particles, so that none crosses into another cell; it shows the error of crossings."""

from collections.abc import Callable

import numpy as np

import mpm_core as mpm


def in_order(model: mpm.Model, name: str) -> np.ndarray:
    """A field of the particles in the order of their numbers."""
    return getattr(model.particles, name)[np.argsort(model.particles.id)]


def set_in_order(model: mpm.Model, name: str, values: np.ndarray) -> None:
    """Set a field of the particles, given in that order."""
    model.particles.set(name, values[np.argsort(np.argsort(model.particles.id))])


def on_moved_mesh(model: mpm.Model, nodes: np.ndarray, build: Callable[[np.ndarray], mpm.Model]) -> mpm.Model:
    """The particles of a model with their masses, volumes and stresses in a new one, whose mesh has its nodes elsewhere.

    nodes: (n, 2) [m]; build: makes the empty model on them, of one rank
    """
    moved = build(nodes)
    moved.seed_points(in_order(model, "position"), in_order(model, "volume"), density=1.0)
    for name in ("mass", "stress"):
        set_in_order(moved, name, in_order(model, name))
    return moved
