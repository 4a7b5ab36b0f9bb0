"""What particles with pore water need before a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ._core import InputError

if TYPE_CHECKING:
    from .pore_water import PoreWater

STANDARD_GRAVITY = 9.81
"""Gravity by which the unit weight of water is divided to get its density [m/s2]"""

OTHER_GRAVITY = 5e-3
"""Part by which gravity may differ from it where water stands up to a level: on Earth it does by 0.003, and 9.8 and 9.82 are common"""


def require_pores(porosity: NDArray, conductivity: NDArray) -> None:
    """Raises InputError for a porosity or conductivity out of its range."""
    bad = ~((porosity > 0) & (porosity < 1))
    if bad.any():
        raise InputError(f"porosity is {porosity[bad][0]}, expected more than 0 and less than 1 in all particles")
    bad = ~((conductivity > 0) & np.isfinite(conductivity))
    if bad.any():
        raise InputError(f"conductivity is {conductivity[bad][0]} m/s, expected positive numbers in all particles")


def require_soil(model: PoreWater) -> None:
    """Raises InputError for particles of this rank without pores, or lighter than the water in them."""
    p, water = model.particles, model._core.water
    require_pores(p.porosity, p.conductivity)
    if model._core.has_two_phases:
        return
    of_water = p.porosity * water.unit_weight / STANDARD_GRAVITY * (p.saturation if water.may_dry else 1.0)
    density = p.mass / p.volume
    light = density <= of_water
    if light.any():
        raise InputError(
            f"density of a particle is {density[light][0]:g} kg/m3, expected more than that of the water in its pores, "
            f"{of_water[light][0]:g} kg/m3 of soil; densities are of the saturated soil"
        )


def require_standard_gravity(model: PoreWater) -> None:
    """Raises InputError, on all ranks, where levels of water and gravity ask for two unit weights of water."""
    water, gravity = model._core.water, float(np.linalg.norm(model.gravity))
    levels = bool(water.standing) or any(slope != 0 for _, _, slope, _, _ in model._water_conditions)
    if not levels or abs(gravity / STANDARD_GRAVITY - 1) <= OTHER_GRAVITY:
        return
    weight = water.unit_weight
    density = weight / STANDARD_GRAVITY
    raise InputError(
        f"gravity is {gravity:g} m/s2, expected {STANDARD_GRAVITY:g} where water stands up to a level (hold_pore_pressure(level=...), "
        f"stand_water): the pressure below a level is that of unit_weight, {weight:g} N/m3, and the density of the pore water is "
        f"unit_weight / {STANDARD_GRAVITY:g} = {density:g} kg/m3, which weighs {density * gravity:g} N/m3 under this gravity; set gravity "
        f"to {STANDARD_GRAVITY:g} m/s2, or give pressures in the place of levels, of water that weighs {density * gravity:g} N/m3"
    )
