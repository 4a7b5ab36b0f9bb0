"""What the line of results of a run-out says of its end."""

from __future__ import annotations

import numpy as np

from ..history import History
from ..slope.case import GRAVITY

FASTER_THAN_FALL = 1.5
"""Speed of a particle over that of free fall through all of the height, from which on it is noise"""


def still_moving(history: History, mass: float) -> str:
    """The end of a line of results: the speed of a slide whose kinetic energy is not below a hundredth of its maximum, or nothing."""
    energy = history["kinetic_energy_J"]
    if not energy[-1] > 0.01 * energy.max():
        return ""
    return (
        f"; the slide still moves, by {np.sqrt(2 * energy[-1] / mass):.2g} m/s on average (root mean square): the maps are not those of a "
        "deposit at rest, raise --time"
    )


def left_the_mesh(fraction: float) -> str:
    """The end of a line of results: how much of the slide went beyond the rasters, where it is more than a hundredth."""
    return (
        f"; {fraction:.0%} of its mass left the mesh at its sides: use rasters beyond its reach"
        if fraction > 0.01
        else ""
    )


def too_fast(fastest: float, height: float) -> str:
    """The end of a line of results: that single particles are faster [m/s] than what falls freely through a height [m], or nothing."""
    fall = float(np.sqrt(2 * GRAVITY * height))
    return (
        f"; single particles are faster than free fall through all of the height, {fall:.3g} m/s: that is noise, as where a slide hits a "
        "structure, also in the map of the largest speed; a larger --pic damps it"
        if fastest > FASTER_THAN_FALL * fall
        else ""
    )
