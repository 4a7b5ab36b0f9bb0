"""Warnings of input that is probably missing, of the wrong magnitude, or not what the motion of the soil asks for."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from .boundary_warnings import doubts_of_boundaries
from .drainage_warnings import undrained_border
from .input_warnings import UNIT_WEIGHTS
from .law_warnings import doubts_of_laws
from .member_warnings import members_in_air
from .water_checks import undrained_friction

if TYPE_CHECKING:
    from .model import Model

ON_EARTH = 10.0
"""Gravity [m/s2] by which soils have these unit weights; that of a centrifuge may be any number of times as large"""

TILTED = 1e-6
"""Fraction of gravity across the last axis above which it is more than round-off"""


def warn_of_setup(model: Model, nmd: bool, damping: float = 0.0, until: float = np.inf) -> None:
    """Warn of probable mistakes in the input, and of what does not suit the model: local damping, water that has no time to flow.

    Collective.
    """
    of_loads = _nothing_acts(model), _nothing_holds(model), _upwards(model), _weight(model) or _softness(model)
    of_laws, of_boundaries = doubts_of_laws(model, nmd), doubts_of_boundaries(model, damping)
    of_water = _tilted_water(model), undrained_friction(model, until), undrained_border(model)
    of_members = members_in_air(model)
    found = [text for text in (*of_loads, *of_laws, *of_boundaries, *of_water, of_members) if text]
    if model.comm.rank == 0:
        for text in found:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def _nothing_acts(model: Model) -> str:
    p = model.particles
    acts = bool(np.any(model.gravity)) or bool(model._prescribed) or bool(model._water_conditions)
    acts = acts or model._incoming is not None
    acts = acts or any(bool(np.any(values)) for values in (p.traction, p.velocity, p.stress))
    bodies = [entry["body"] for entry in model._contacts]
    acts = acts or any(np.any(body[name][1]) for body in bodies for name in ("velocity", "spin", "force"))
    if model.comm.allreduce(int(acts)):
        return ""
    return (
        "nothing acts on the particles: gravity is zero, and so are tractions, velocities of supports and of rigid surfaces, and "
        "the particles' own velocities and stresses; gravity is given by model.set_gravity"
    )


def _nothing_holds(model: Model) -> str:
    held = model._conditions or model._contacts or model._absorbing or model._border is not None
    held = held or any(member.fixed_end for member in model.members.values())
    if held or not np.any(model.gravity):
        return ""
    return "nothing holds the particles, which fall freely: there is gravity and no boundary condition (model.fix, model.roller)"


def _weight(model: Model) -> str:
    p, gravity = model.particles, min(float(np.linalg.norm(model.gravity)), ON_EARTH)
    densities = p.mass / p.volume
    low = model.comm.allreduce(float(densities.min(initial=np.inf)), MPI.MIN) * gravity
    high = model.comm.allreduce(float(densities.max(initial=0.0)), MPI.MAX) * gravity
    odd = low if low < UNIT_WEIGHTS[0] else high
    if gravity == 0 or (low >= UNIT_WEIGHTS[0] and high <= UNIT_WEIGHTS[1]):
        return ""
    return (
        f"the unit weight of particles is {odd:.4g} N/m3, density times {gravity:g} m/s2, expected from {UNIT_WEIGHTS[0]:g} to "
        f"{UNIT_WEIGHTS[1]:g} N/m3 for a soil: densities are in kg/m3, 2000 for most soils"
    )


def _upwards(model: Model) -> str:
    up = float(model.gravity[-1])
    if up <= 0:
        return ""
    return f"gravity acts upwards, {up:g} m/s2 along the last axis, expected a component below zero there, such as -9.81 m/s2"


def _tilted_water(model: Model) -> str:
    """Of levels of water under gravity that is not along the last axis."""
    water, across = model._core.water, float(np.linalg.norm(model.gravity[:-1]))
    levels = any(is_level for _, _, is_level, *_ in model._water_conditions) or (
        water is not None and bool(water.standing)
    )
    if not levels or across <= TILTED * float(np.linalg.norm(model.gravity)):
        return ""
    return (
        f"gravity has a component of {across:g} m/s2 across the last axis, under which a surface of water at rest is inclined; levels "
        "of water (hold_pore_pressure, stand_water) count along the last axis, with the gravity along it alone: turn the mesh, not "
        "gravity, or give pressures"
    )


def _softness(model: Model) -> str:
    """Soil that its own weight would compress to nothing, because its moduli are not in Pa."""
    p, gravity = model.particles, np.asarray(model.gravity)
    size = float(np.linalg.norm(gravity))
    if size == 0:
        return ""
    along = p.position @ (gravity / size)
    top, base = (model.comm.allreduce(float(x), op) for x, op in (
        (along.min(initial=np.inf), MPI.MIN), (along.max(initial=-np.inf), MPI.MAX),
    ))  # fmt: skip
    mass, volume = (model.comm.allreduce(float(column.sum())) for column in (p.mass, p.volume))
    stress, modulus = mass / volume * size * (base - top), max(law.p_wave_modulus for law in model.laws)
    if modulus >= stress:
        return ""
    return (
        f"the soil is so soft that its own weight would compress it to nothing: its oedometric modulus is {modulus:.4g} Pa at most, "
        f"and the weight above its base {stress:.4g} Pa; moduli are in Pa"
    )
