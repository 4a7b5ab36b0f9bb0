"""What a hand-over from finite elements to particles needs, and what it warns of: loads, weights, water and laws that differ."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.equilibrium import beyond_equilibrium
from mpm_core.law_text import parameter_texts
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.fem.deconfinement import refuse_held
from fenics_bridge.fem.elastic import ElasticSolution
from fenics_bridge.fem.geometry import require_same_geometry
from fenics_bridge.fem.loads import Load
from fenics_bridge.fem.pseudo_static import forces_per_volume
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.mesh.names import known_tags, tag_numbers
from fenics_bridge.transfer.pore_pressures import (
    prescribed_mistake,
    skeleton_of,
    stands_on_surface,
    takes_pore_pressure,
)
from fenics_bridge.water.consolidation import Consolidation

SAME_WEIGHT = 0.01
"""Relative difference of unit weights up to which they count as the same"""

_OF_LOADS = 'Model.traction, load_surface, particles.set("traction", ...) or fix'
_REMEDIES = {
    "body force across gravity": "set_gravity, with the inertia of an earthquake as a part along its axis",
    "pore pressure": "pore water (Model.add_water), laws that are Undrained, or as traction the bridge.seepage_forces",
    "the pressure of water that stands on the surface": "Model.stand_water with pore water, else as traction the bridge.boundary_forces",
}
"""How particles are given a load of finite elements"""


def require_usable(
    model: mpm.Model, fem: Any, move: bool, equilibrate: bool, integration: mpm.Integration | None
) -> None:
    """Raise InputError, on all ranks, unless particles can take over an equilibrium; see `initialise` for the arguments. Collective."""
    solved = not isinstance(fem, QuasiStatic) or fem.converged
    agree(model.comm, None if solved else "fem has not been solved, or its last solution did not converge")
    if isinstance(fem, QuasiStatic):
        refuse_held(model.comm, fem)
    require_same_geometry(model, fem)
    agree(
        model.comm,
        None
        if model.comm.allreduce(len(model.particles))
        else "model has no particles, expected some: seed them before",
    )
    agree(model.comm, _water_mistake(model, fem) or prescribed_mistake(model, fem))
    agree(model.comm, _not_equilibrated(model, fem, integration) if equilibrate else None)
    agree(model.comm, _members_mistake(model, fem))
    agree(model.comm, _rising_gravity(model))
    known = not move or hasattr(model.mesh, "domain")
    agree(model.comm, None if known else "model: to move particles its mesh must come from `background_mesh`")


def _water_mistake(model: mpm.Model, fem: Any) -> str | None:
    """Why pore water of particles and finite elements do not fit together, in words; None if they do."""
    name, wet, coupled = type(fem).__name__, model._core.water is not None, isinstance(fem, Consolidation)
    if wet and not coupled and not takes_pore_pressure(model, fem):
        return (
            f"fem is a {name} without pore pressures, expected a QuasiStatic with them (reconfigure) or a water.Consolidation, since "
            "particles have pore water (Model.add_water)"
        )
    return None if wet or not coupled else f"fem is a {name}, expected particles with pore water (Model.add_water)"


def _not_equilibrated(model: mpm.Model, fem: Any, integration: mpm.Integration | None) -> str | None:
    """Why `Model.equilibrate` would refuse a model, in words; None if it would not."""
    beyond = beyond_equilibrium(model, integration) or ("structural members" if getattr(fem, "members", None) else "")
    words = f"equilibrate is True, expected False with {beyond}, which Model.equilibrate does not support"
    return words if beyond else None


def _members_mistake(model: mpm.Model, fem: Any) -> str | None:
    """A structural member that both have, in words; None without."""
    both = next((name for name in getattr(fem, "members", ()) if name in model.members), None)
    return (
        None if both is None else f"model has the member {both!r}, expected it in fem only, from where it is taken over"
    )


def _rising_gravity(model: mpm.Model) -> str | None:
    """How much of its gravity a model has, in words, while this rises; None afterwards."""
    ramp, gravity = model._core.gravity_ramp, model.gravity
    if model.time >= ramp or not gravity.any():
        return None
    return (
        f"gravity is {model.time / ramp:.0%} of {gravity.tolist()} m/s2 at t = {model.time:g} s, and rises until {ramp:g} s (ramp "
        "of set_gravity), expected all of it at the hand-over"
    )


def warn_of_other_weight(model: mpm.Model, fem: Any) -> None:
    """Warn, on the first rank, of particles whose unit weight is none of those that the finite elements carry. Collective."""
    if not isinstance(fem, QuasiStatic):
        return
    towards = _direction_of_gravity(model)
    carried = [float(force @ towards) for force in forces_per_volume(_named_weights(fem), model.mesh.dim)] or [0.0]
    p, gravity = model.particles, float(np.linalg.norm(model.gravity))
    own = gravity * p.mass / p.volume
    low = model.comm.allreduce(float(own.min(initial=np.inf)), MPI.MIN)
    high = model.comm.allreduce(float(own.max(initial=0.0)), MPI.MAX)
    too_low, too_high = low < (1 - SAME_WEIGHT) * min(carried), high > (1 + SAME_WEIGHT) * max(carried)
    if (too_low or too_high) and model.comm.rank == 0:
        bounds = sorted({min(carried), max(carried)})
        warnings.warn(
            f"the unit weight of particles is {low if too_low else high:.5g} N/m3, density times gravity, that of the finite "
            f"elements {' to '.join(f'{x:.5g}' for x in bounds)} N/m3: the stresses do not balance the weight of the particles",
            RuntimeWarning,
            stacklevel=3,
        )


def _named_weights(fem: QuasiStatic) -> Load:
    """The load without the unit weight of all other soils where there are none: after stages it is zero. Collective."""
    weights = fem.load.unit_weight
    there = set(known_tags(fem.domain.comm, fem.cell_tags)) - set(fem.off)
    if not isinstance(weights, dict) or not there or there.difference(weights):
        return fem.load
    return replace(fem.load, unit_weight={tag: weight for tag, weight in weights.items() if tag in there})


def _direction_of_gravity(model: mpm.Model) -> NDArray[np.float64]:
    """Unit vector (D,), down where there is no gravity."""
    length = float(np.linalg.norm(model.gravity))
    return np.asarray(model.gravity) / length if length > 0 else -np.eye(model.mesh.dim)[-1]


def _acts_across_gravity(model: mpm.Model, load: Load) -> bool:
    """Whether weight and body force of a load together act along another direction than gravity does."""
    towards = _direction_of_gravity(model)
    forces = np.array(forces_per_volume(load, model.mesh.dim)).reshape(-1, model.mesh.dim)
    size = SAME_WEIGHT * np.linalg.norm(forces, axis=1).max(initial=0.0)
    across = np.linalg.norm(forces - np.outer(forces @ towards, towards), axis=1)
    return bool(load.body_force) and bool((across > size).any())


def warn_of_other_water(model: mpm.Model, fem: Any) -> None:
    """Warn, on the first rank, of water in the pores of particles that weighs more or less than that of the finite elements."""
    if not isinstance(fem, Consolidation) or model.comm.rank != 0:
        return
    own, carried = model._core.water.density * float(np.linalg.norm(model.gravity)), fem.water.unit_weight
    if abs(own - carried) > SAME_WEIGHT * carried:
        warnings.warn(
            f"the unit weight of the particles' water is {own:.5g} N/m3, density times gravity, that of the finite elements "
            f"{carried:.5g} N/m3 (gravity, unit_weight): their equilibrium is another one",
            RuntimeWarning,
            stacklevel=3,
        )


def warn_of_missing_loads(model: mpm.Model, fem: Any) -> None:
    """Warn, on the first rank, of loads of the finite elements where particles carry no forces. Collective."""
    if isinstance(fem, ElasticSolution):
        return
    load, comm = fem.load if isinstance(fem, QuasiStatic) else fem.load_at(fem.time), model.comm
    missing = ["body force across gravity"] if _acts_across_gravity(model, load) else []
    names = ("pressure", "traction") if isinstance(fem, QuasiStatic) else ()
    missing += [name for name in names if any(np.any(value) for value in getattr(load, name).values())]
    if isinstance(fem, QuasiStatic) and fem.largest_pore_pressure() > 0:
        if not takes_pore_pressure(model, fem):
            missing.append("pore pressure")
        elif stands_on_surface(fem) and not (model._core.water is not None and model._core.water.standing):
            missing.append("the pressure of water that stands on the surface")
    if comm.allreduce(float(np.abs(model.particles.traction).max(initial=0.0)), MPI.MAX) > 0 or model._contacts:
        missing = []
    held = {condition[0] for condition in model._conditions}
    for support in fem.supports if isinstance(fem, QuasiStatic) and load.displacement else ():
        if any(support.displacement or ()) and held.isdisjoint(
            tag_numbers(fem.domain.comm, fem.facet_tags, support.facet_tag, "supports")
        ):
            missing.append(f"prescribed displacement at {support.facet_tag!r}")
    if missing and comm.rank == 0:
        remedies = dict.fromkeys(_REMEDIES.get(name, _OF_LOADS) for name in missing)
        warnings.warn(
            f"the finite elements carry {', '.join(missing)}, which the particles do not, so that the stresses do not "
            f"balance their loads: give it to them first, by {'; '.join(remedies)}",
            RuntimeWarning,
            stacklevel=3,
        )


def require_same_laws(model: mpm.Model, fem: Any, number: Any) -> None:
    """Raise InputError, on all ranks, unless particles have the laws that the finite elements have there.

    Args:
        model: the particles.
        fem: the finite elements.
        number: number of the law that the finite elements have at each particle, shape (n,).
    """
    laws, own = fem.laws, model.laws
    if takes_pore_pressure(model, fem):
        own = [skeleton_of(law) for law in own]
    pairs = np.unique(np.column_stack([model.particles.material, number]), axis=0)
    mistakes = (_law_mistake(material, own[material], laws[there]) for material, there in pairs)
    agree(model.comm, next((mistake for mistake in mistakes if mistake), None))


def _law_mistake(material: Any, law: Any, there: Any) -> str | None:
    """Difference between the law of a material and that of the finite elements, in words; None for none."""
    if type(law) is not type(there):
        return f"the law of fem is {type(there).__name__}, that of material {material} is {type(law).__name__}"
    own, of_fem = parameter_texts(law), parameter_texts(there)
    for name, text in own.items():
        if text != of_fem[name]:
            return f"the law of fem has {name}={of_fem[name]}, that of material {material} has {name}={text}"
    return None
