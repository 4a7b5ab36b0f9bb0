"""From finite elements to particles: stress, state and displacement of an equilibrium."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.checks import flag, member, of_kind, renamed
from mpm_core.collective import collectively
from mpm_core.equilibrium import beyond_equilibrium
from mpm_core.law_text import parameter_texts
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.fem.deconfinement import refuse_held
from fenics_bridge.fem.elastic import ElasticSolution
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.geometry import Geometry, require_same_geometry
from fenics_bridge.fem.loads import Load
from fenics_bridge.fem.pseudo_static import forces_per_volume
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.mesh.names import known_tags, tag_numbers
from fenics_bridge.transfer.dried import balance_dried_soil
from fenics_bridge.transfer.moved import fitted_volumes, held_volumes, volume_change
from fenics_bridge.transfer.pore_pressures import (
    add_to_stress,
    prescribed_mistake,
    set_pore_pressure,
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
_BALANCED, _MOST_STEPS = 5e-4, 60
"""Out-of-balance ratio to reach, and largest number of steps: near collapse each one leaves a fraction of it."""


@dataclass(frozen=True, repr=False)
class Handover:
    """Result of a hand-over; sums are over all ranks."""

    unbalanced_ratio: float
    """Out-of-balance over external force of the particles as they were given their stress [-]"""
    equilibrated_ratio: float | None
    """Out-of-balance ratio after the equilibration [-]; None without equilibration, as with resting cells"""
    returned_fraction: float
    """Fraction of the particles whose stress had to be returned to the yield surface [-]"""
    yielded_fraction: float
    """Fraction of the particles that yielded in the equilibration where the finite elements did not [-]"""

    def __repr__(self) -> str:
        after = "" if self.equilibrated_ratio is None else f", {self.equilibrated_ratio:.2g} after the equilibration"
        return (
            f"<Handover: out-of-balance ratio {self.unbalanced_ratio:.2g}{after}; {self.returned_fraction:.2%} of the particles "
            f"returned to the yield surface, {self.yielded_fraction:.2%} newly yielded>"
        )

    settled_ratio = renamed("settled_ratio", "equilibrated_ratio")
    returned_share = renamed("returned_share", "returned_fraction")
    yielded_share = renamed("yielded_share", "yielded_fraction")


def initialise(
    model: mpm.Model,
    fem: QuasiStatic | ElasticSolution | Consolidation,
    *,
    count_displacement: bool = True,
    move: bool = False,
    smooth: bool = False,
    equilibrate: bool = True,
    resting: bool = False,
    nmd: bool | None = None,
    integration: mpm.Integration | None = None,
) -> Handover:
    """Start particles from an equilibrium found by finite elements (a consistent transfer: it keeps values). Collective.

    Each particle takes the stress, the state and the accumulated strain of the finite elements where it is, is returned
    to the yield surface should it be outside, and loses its velocity. The model's gravity must be that of the
    equilibrium, its loads and supports too, and its geometry that of the finite elements.

    On the same cells, particles are in equilibrium at once (out of balance by rounding) with linear elements, and in
    plane strain and 3D with quadratic ones, whose cell means linear test functions cannot distinguish from their stresses.
    In axisymmetric bodies two things differ: the hoop stress acts with the particles at the centre of a cell, which leaves
    some 1e-3 of quadratic elements out of balance; and the weights of nodes are exact for particles at Gauss points of
    degree 2 (`per_cell` of 3, 12, 48), and with others good to the square of the cell size. The suction of soil that has dried and
    the weight of its water are no polynomials: particles then take total stresses and moments of the weight from each cell of the
    elements (`dried.balance_dried_soil`), of which a particle alone in its cell has the sum only. Averaged forces of dried soil
    leave some 1e-4, since these averages leave out the suction.

    Args:
        model: model with particles.
        fem: finite elements, solved and converged; the meshes and their partitions may differ. Particles with pore water
            (`Model.add_water`) take their pore pressures too, from a `water.Consolidation` or from a `QuasiStatic` with prescribed
            ones, without suction where they have retention curves, and `equilibrate` keeps these. Particles of `Undrained` laws,
            whose skeletons are the laws of a `QuasiStatic` with prescribed pore pressures, take total stresses, and the pressures
            as their `excess_pore_pressure`; particles of other laws may lie beside them where there are no pore pressures.
            Its structural members are installed in the model with their forces; `equilibrate` must be False then.
        count_displacement: let displacements of particles include those of the finite elements; otherwise they start from zero.
        move: move particles with the body, by its displacement; otherwise they stay where they are, with their volume.
            Volumes of particles that move change with the body's, and are then fitted to what each cell of their mesh holds
            of the moved body (`moved.fitted_volumes`). A body that has moved is only near equilibrium: that of small
            strains is one of the undeformed body, and now its surface cuts cells.
        smooth: take the smooth stress instead of the cell's mean. With the same cells in both meshes the mean is in
            equilibrium as it is; with other cells the smooth stress is far nearer to it.
        equilibrate: bring the particles to equilibrium (`Model.equilibrate`) under the model's present loads, to an
            out-of-balance ratio of 5e-4.
        resting: let all cells rest (`Model.rest`) as the finite elements that they were; only what fails turns into particles.
            They are not moved, and not equilibrated: with the cells of the finite elements they are in equilibrium as they are.
        nmd: whether the run that follows averages strains, in explicit steps: equilibrium is then one of forces of averaged mean
            stresses. By default as in the finite elements. False for implicit steps that move particles: these average strains.
        integration: how the run that follows makes forces of stresses; by default as in `mpm_core.Model.explicit`.

    Returns:
        How far the particles are from equilibrium, and how many of them yield.

    Raises:
        InputError: a particle is outside the finite elements' mesh or, moved, outside the background mesh, laws or geometries do
            not match, the finite elements did not converge, gravity still rises, or `equilibrate` is True where the model has
            something that `Model.equilibrate` does not support. The particles are unchanged. Raised on all ranks alike.
    """
    particles = of_kind("model", model, mpm.Model).particles
    of_kind("fem", fem, QuasiStatic, ElasticSolution, Consolidation)
    options = {
        "count_displacement": count_displacement,
        "move": move,
        "smooth": smooth,
        "equilibrate": equilibrate,
        "resting": resting,
    }
    chosen = () if nmd is None else (("nmd", nmd),)
    collectively(model.comm, lambda: [flag(name, value) for name, value in (*options.items(), *chosen)])
    if integration is not None:
        collectively(model.comm, lambda: member("integration", integration, mpm.Integration))
    _require_usable(model, fem, move, equilibrate and not resting, integration)
    _warn_of_other_weight(model, fem)
    _warn_of_other_water(model, fem)
    _warn_of_missing_loads(model, fem)
    if resting:
        agree(model.comm, "move is True, expected False with resting: resting cells are not moved" if move else None)
        model.rest()
    search = PointSearch(fem.displacement.function_space.mesh, particles.position)
    search.require_all("particles")
    if isinstance(fem, (QuasiStatic, Consolidation)):
        number = np.rint(search.values(fem.material_function())[:, 0]).astype(int)
        outside = int(np.sum(number < 0))
        agree(
            model.comm,
            f"{outside} particles lie where the finite elements have no soil" if outside else None,
        )
        _require_same_laws(model, fem, number)
    returned = _take_stress_and_state(model, fem, search, smooth)
    _displace(model, fem.displacement, search, move, count_displacement)
    _take_members(model, fem, move)
    averaged = getattr(fem, "_nmd", False) if nmd is None else nmd
    before = model.out_of_balance(nmd=averaged, integration=integration)
    had_yielded = int(np.sum(particles.plastic_strain > 0))
    after = None
    if equilibrate and not resting:
        settled = model.equilibrate(nmd=averaged, integration=integration, tolerance=_BALANCED, max_steps=_MOST_STEPS)
        after = settled.unbalanced_ratio
    yielded = int(np.sum(particles.plastic_strain > 0)) - had_yielded  # what has yielded stays so
    count, returned, yielded = (model.comm.allreduce(n) for n in (len(particles), returned, yielded))
    return Handover(before, after, returned / count, yielded / count)


def _take_stress_and_state(model: mpm.Model, fem: Any, search: PointSearch, smooth: bool) -> int:
    """Give the particles stress and state of the finite elements at their positions; returns the number of returned stresses."""
    particles = model.particles
    stress, state = search.values(fem.stress_function(smooth)), particles.state.copy()
    if isinstance(fem, (QuasiStatic, Consolidation)):
        values = search.values(fem.state_function())
        state[:, : values.shape[1]] = values
    if takes_pore_pressure(model, fem):
        if model._core.water is not None:
            set_pore_pressure(model, fem._water.pressure, search)
        else:
            add_to_stress(model, fem, search, smooth, stress, state)
    if isinstance(fem, Consolidation):
        set_pore_pressure(model, fem.pressure, search)
        stress = balance_dried_soil(model, fem, search, stress)
    returned = _returned(model.laws, particles.material, stress, state)
    particles.set("stress", stress)
    particles.set("state", state)
    particles.set("deviatoric_strain", search.values(fem.deviatoric_strain_function())[:, 0])
    for name in ("velocity", "velocity_gradient") if model.resting_cells.any() else ("velocity",):
        particles.set(name, np.zeros_like(getattr(particles, name)))
    return returned


def _displace(model: Any, displacement: Any, search: PointSearch, move: bool, count: bool) -> None:
    """Move the particles, count the displacement as theirs, both or neither; rows may have another order afterwards."""
    particles, start = model.particles, model.particles.position
    moved = search.values(displacement)
    if count:
        particles.set("initial_position", start if move else start - moved)
    elif move:
        particles.set("initial_position", start + moved)
    if move:
        held = held_volumes(model.mesh.domain, displacement, model.geometry)
        change = search.values(volume_change(displacement))[:, 0]
        if model.geometry == Geometry.AXISYMMETRIC:
            change *= 1 + moved[:, 0] / start[:, 0]
        particles.set("volume", particles.volume * change)
        model.place(start + moved)
        particles.set("volume", fitted_volumes(particles.volume, particles.cell, held))


def _returned(
    laws: Sequence[Any], material: NDArray[np.integer], stress: NDArray[np.float64], state: NDArray[np.float64]
) -> int:
    """Return stresses to the yield surface, in place; returns the number of those that were outside."""
    outside = 0
    for number, law in enumerate(laws):
        rows = np.flatnonzero(material == number)
        inside, unused = stress[rows], np.ascontiguousarray(state[rows, : law.n_state])
        law.update(np.zeros_like(inside), inside, unused, None)
        moved = np.abs(inside - stress[rows]).max(axis=1, initial=0.0)
        outside += int(np.sum(moved > 1e-9 * np.abs(stress).max(initial=0.0)))
        stress[rows] = inside  # the state stays that of the finite elements
    return outside


def _require_usable(
    model: mpm.Model, fem: Any, move: bool, equilibrate: bool, integration: mpm.Integration | None
) -> None:
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


def _take_members(model: mpm.Model, fem: Any, move: bool) -> None:
    """Install the structural members of the finite elements, with their forces, where the soil around them goes. Collective."""
    members, forces = getattr(fem, "members", {}), {}
    for name in members:
        given = fem.member_forces(name)
        moved = fem.moved_member(name)
        forces[name] = replace(given, displacement=moved if move else np.zeros_like(moved))
    model.install(members, forces)


def _rising_gravity(model: mpm.Model) -> str | None:
    """How much of its gravity a model has, in words, while this rises; None afterwards."""
    ramp, gravity = model._core.gravity_ramp, model.gravity
    if model.time >= ramp or not gravity.any():
        return None
    return (
        f"gravity is {model.time / ramp:.0%} of {gravity.tolist()} m/s2 at t = {model.time:g} s, and rises until {ramp:g} s (ramp "
        "of set_gravity), expected all of it at the hand-over"
    )


def _warn_of_other_weight(model: mpm.Model, fem: Any) -> None:
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


def _warn_of_other_water(model: mpm.Model, fem: Any) -> None:
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


def _warn_of_missing_loads(model: mpm.Model, fem: Any) -> None:
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


def _require_same_laws(model: mpm.Model, fem: Any, number: Any) -> None:
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
