"""Soil and water with a velocity each: what an explicit run of a model with pore water needs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from ._core import InputError, Integration, StressUpdate
from .rayleigh import Rayleigh
from .water_checks import LABORATORY_GRAVITY

if TYPE_CHECKING:
    from .body import Body
    from .model import Model


def begin_two_phases(model: Model, integration: Any, stress_update: Any, rayleigh: Rayleigh) -> None:
    """Give the water of a model its own mass and velocity, unless it has them. Collective."""
    if model._core.water is None:
        return
    _require_two_phases(model, integration, stress_update)
    model._check_water()
    _require_dissipation(model, rayleigh)
    if not model._core.has_two_phases:
        model._core.split_phases()
    set_impervious(model)


def set_impervious(body: Body) -> None:
    """Let no water pass the facets that hold the soil, but for those with a prescribed pore pressure. Collective."""
    if body._core.water is not None:
        pervious = {tag for tag, _, _, held, _ in body._water_conditions if held}
        closed = {tag for tag, _, _ in body._conditions} | {side[0] for side in body._absorbing}
        body._core.set_impervious(sorted(closed - pervious), sorted(pervious))


def _require_two_phases(model: Model, integration: Any, stress_update: Any) -> None:
    refused = {
        "several velocity fields": max(model._velocity_fields) > 0,
        "retention curves": model._core.water.may_dry,
        "DUAL_DOMAIN integration": integration == Integration.DUAL_DOMAIN,
        f"stress_update {stress_update}": stress_update != StressUpdate.MODIFIED_LAST,
    }
    for what, there in refused.items():
        if there:
            raise InputError(f"the model has pore water, expected an explicit run without {what}")


def _require_dissipation(model: Model, rayleigh: Rayleigh) -> None:
    """Raise InputError for mass damping that may do more work than the drag of the water takes out. Collective.

    Forces alpha m v of the soil's velocity v on soil and water take out energy in all motions as long as alpha <=
    4 g rho / (k rho_w); see ``add_rayleigh_forces`` in mpm_core/model/rayleigh.h.
    """
    if rayleigh.mass == 0:
        return
    p, water = model.particles, model._core.water
    mass = p.mass + p.water_mass if model._core.has_two_phases else p.mass
    factors = np.array([np.linalg.eigvalsh(tensor)[-1] for tensor in water.anisotropy] or np.ones(len(model.laws)))
    conductivity = p.conductivity * factors[p.material]
    limits = 4 * LABORATORY_GRAVITY * mass / (p.volume * water.density * conductivity)
    limit = model.comm.allreduce(limits.min(initial=np.inf), MPI.MIN)
    if rayleigh.mass > limit:
        raise InputError(
            f"rayleigh.mass is {rayleigh.mass:g} 1/s, expected at most {limit:g} 1/s, beyond which it could give energy to the "
            "pore water of soil that conducts so well"
        )


def of_suction(model: Model) -> str:
    """Text on suction as a cause of generated energy, to follow others; none where the pores bear no suction, or any."""
    water = model._core.water
    if water is None or not 0 < water.suction_limit < np.inf:
        return ""
    return (
        f"; another cause is water that its suction_limit of {water.suction_limit:g} Pa draws in at the surface of soil that conducts well: "
        "take suction_limit=0 there (docs/water_particles.md)"
    )


def refuse_two_phases(model: Model, scheme: str) -> None:
    """Raises InputError for moist soil, or after an explicit run, in which the water has a velocity of its own. Collective."""
    water = model._core.water
    moist = water is not None and not water.may_dry and bool((model.particles.saturation < 1).any())
    if model.comm.allreduce(moist, MPI.LOR):
        raise InputError(
            f"saturation is less than 1 in parts of the soil, which {scheme} does not support; expected a retention curve in its place"
        )
    if model._core.has_two_phases:
        raise InputError(f"the pore water has a velocity of its own since explicit(), which {scheme} does not support")
