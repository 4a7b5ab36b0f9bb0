"""What particles with pore water need before a run."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from . import _core
from ._core import InputError
from .checks import positive
from .contact_strength import largest
from .mesh import cell_sizes

if TYPE_CHECKING:
    from .model import Model
    from .pore_water import PoreWater

LABORATORY_GRAVITY: float = _core.laboratory_gravity
"""Gravity under which conductivities are measured [m/s2]"""


def density_of_water(density: float, unit_weight: float | None) -> float:
    """The density [kg/m3], or that of water of a unit weight [N/m3], which was the argument before.

    Raises:
        InputError: a number that is not positive.
    """
    if unit_weight is None:
        return positive("density", density, "kg/m3")
    warnings.warn(
        "unit_weight of add_water is now density, in kg/m3: unit_weight / 9.81; the old name will be removed in the next version",
        DeprecationWarning,
        stacklevel=5,
    )
    return positive("unit_weight", unit_weight, "N/m3") / LABORATORY_GRAVITY


def require_pores(porosity: NDArray, conductivity: NDArray) -> None:
    """Raises InputError for a porosity or conductivity out of its range."""
    bad = ~((porosity > 0) & (porosity < 1))
    if bad.any():
        raise InputError(f"porosity is {porosity[bad][0]}, expected more than 0 and less than 1 in all particles")
    bad = ~((conductivity > 0) & np.isfinite(conductivity))
    if bad.any():
        raise InputError(f"conductivity is {conductivity[bad][0]} m/s, expected positive numbers in all particles")


def require_saturation(saturation: NDArray, suction_limit: float, retention: Any) -> None:
    """Raises InputError for particles of this rank whose pores cannot have such a saturation."""
    bad = ~((saturation > 0) & (saturation <= 1))
    if bad.any():
        raise InputError(f"saturation is {saturation[bad][0]}, expected more than 0 and at most 1 in all particles")
    moist = saturation < 1
    if moist.any() and retention is not None:
        raise InputError(
            f"saturation is {saturation[moist][0]} beside a retention curve, which gives it; expected one of the two"
        )
    if moist.any() and suction_limit == np.inf:
        raise InputError(
            f"saturation is {saturation[moist][0]} without a suction_limit, expected one: the suction of pores that are not full [Pa]"
        )


def filled_fraction(particles: Any) -> NDArray | float:
    """Fraction of the pores that water fills while it moves with the soil [-], (n); 1 where all are full."""
    return particles.saturation if len(particles.saturation) else 1.0


def require_soil(model: PoreWater) -> None:
    """Raises InputError for particles of this rank without pores, or lighter than the water in them."""
    p, water = model.particles, model._core.water
    require_pores(p.porosity, p.conductivity)
    if model._core.has_two_phases:
        return
    of_water = p.porosity * water.density * filled_fraction(p)
    density = p.mass / p.volume
    light = density <= of_water
    if light.any():
        raise InputError(
            f"density of a particle is {density[light][0]:g} kg/m3, expected more than that of the water in its pores, "
            f"{of_water[light][0]:g} kg/m3 of soil; densities are those with the water"
        )


def undrained_friction(model: Model, until: float) -> str:
    """What a warning says of friction where the pore pressure has no time to follow the load; empty for others. Collective."""
    water = model._core.water
    if water is None or not any(largest(contact["friction"]) > 0 for contact in model._contacts):
        return ""
    of_cells = (
        cell_sizes(model.mesh.cell_volumes, model.mesh.dim)[model.particles.cell] ** 2 / model.particles.conductivity
    )
    modulus = max(law.p_wave_modulus for law in model.laws)
    fastest = model.comm.allreduce(of_cells.min(initial=np.inf), MPI.MIN)
    drains = fastest * water.density * LABORATORY_GRAVITY / modulus
    if not until < drains:
        return ""
    return (
        f"the pore water needs {drains:.3g} s to flow through a cell and the run ends at {until:.3g} s: the friction of soil that does not "
        "drain is uncertain by half where rigid surfaces cut cells; let the mesh follow them, or use adhesion, which does not depend on "
        "the pore pressure (docs/contact.md)"
    )
