"""Warnings of input that is probably missing, of the wrong magnitude, or not what the motion of the soil asks for."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from . import _core
from .mesh import cell_sizes
from .water_checks import undrained_friction

if TYPE_CHECKING:
    from .model import Model

UNIT_WEIGHTS = (1e3, 150e3)
"""Bounds of the unit weight of a soil [N/m3]: peat has 10 kN/m3, published slopes have up to 80, and 16 kN/m3 taken for a density
gives 157"""

SPUN_UNIT_WEIGHTS = (300e3, 6e6)
"""Bounds of the unit weight of a soil in a centrifuge [N/m3], from some 15 to 250 g; 16 to 25 kN/m3 taken for a density lie below"""

ON_EARTH = 10.0
"""Gravity [m/s2] by which soils have these unit weights; that of a centrifuge may be any number of times as large"""

RADIANS = (0.1, 1.57)
"""Friction angles, and those of slopes, [degrees] that are more probably angles in radians, of soils from 6 to 90 degrees"""

STEEPEST_FRICTION = 2.0
"""Coefficient of friction, of an angle of 63 degrees, above which it is more probably an angle"""

ODD_WATER = (0.1, 200.0, 5000.0)
"""Densities [kg/m3] between the first two and above the last are probably those of water in other units, or under another gravity"""

HEAVIEST_RAIN = 1e-3
"""Rate [m/s] above which rain is more probably in other units: the heaviest minute on record, 38 mm, had 6.3e-4 m/s"""

RETURNED = 0.01
"""Fraction of a stress by which an update without strain changes it, above which it is probably beyond the yield surface by mistake"""

CUT_MOTION = 0.05
"""Fraction of the largest velocity of a motion at its ends above which it is probably cut off"""

STIFFER = 2.0
"""Stiffness of an external law over the modulus that it states, above which the time step is far from the critical one"""

TILTED = 1e-6
"""Fraction of gravity across the last axis above which it is more than round-off"""

NEARLY_INCOMPRESSIBLE = 0.45
"""Poisson's ratio above which linear cells lock"""


def warn_of_setup(model: Model, nmd: bool, damping: float = 0.0, until: float = np.inf) -> None:
    """Warn of probable mistakes in the input, and of what does not suit the model: local damping, water that has no time to flow.

    Collective.
    """
    locks = "" if nmd else locking(model.laws)
    of_loads = _nothing_acts(model), _nothing_holds(model), _upwards(model), _weight(model) or _softness(model)
    of_laws = (
        angles_in_radians(model.laws),
        *_stiffer_than_said(model),
        *(_outside_of_surface(model, kind) for kind in SURFACES),
        locks,
    )
    of_sides = (
        *_held_sides(model),
        _held_border(model),
        _uncarried_weight(model),
        *_cut_motion(model),
        *_reversed_interfaces(model),
        _damped_waves(model, damping),
        _tilted_water(model),
        undrained_friction(model, until),
    )
    found = [text for text in (*of_loads, *of_laws, *of_sides) if text]
    if model.comm.rank == 0:
        for text in found:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def _held_sides(model: Model) -> Iterator[str]:
    """Of sides that absorb, let a wave in or move with a free field, those whose own boundary conditions prevent it."""
    names = {tag: name for name, tags in model.mesh.names["facet"].items() for tag in tags}
    wave = np.array(model._incoming[2]) if model._incoming else None
    for tag, *_, beside in model._absorbing:
        held = [_held_directions(condition) for condition in model._conditions if condition[0] == tag]
        rank = _rank([np.zeros((1, model.mesh.dim)), *held])
        if beside < 0 and wave is not None and _rank([wave, *held]) == rank:
            yield (
                f"the wave does not enter through the side {names.get(tag, tag)!r}: boundary conditions of the same facets hold it along "
                f"{wave}, the direction of the wave; release them (model.release)"
            )
        elif (
            beside >= 0
            and wave is not None
            and any(np.abs(directions @ wave).max(initial=0.0) > 1e-9 for directions in held)
        ):
            yield (
                f"the side {names.get(tag, tag)!r} does not move with the free field beside it: boundary conditions of the same facets "
                f"hold it against {wave}, the direction of the wave; release them (model.release)"
            )
        elif rank == model.mesh.dim:
            yield (
                f"the side {names.get(tag, tag)!r} absorbs nothing: boundary conditions of the same facets hold it; release them "
                "(model.release)"
            )


def _held_border(model: Model) -> str:
    """Of a far field most of whose nodes cannot move."""
    border, mesh = model._border, model.mesh
    if border is None:
        return ""
    directions: dict[int, list[NDArray[np.float64]]] = {}
    for condition in model._conditions:
        directions.setdefault(condition[0], []).append(_held_directions(condition))
    fixed = [tag for tag, held in directions.items() if _rank([np.zeros((1, mesh.dim)), *held]) == mesh.dim]
    cell, vertex = np.nonzero(np.isin(mesh._core.facet_tags, fixed))
    nodes = [np.delete(mesh.cells[c], k) for c, k in zip(cell, vertex)]
    own = mesh.global_nodes[np.unique(np.concatenate(nodes))] if nodes else []
    count = int(np.count_nonzero(model.comm.allreduce(np.isin(border.nodes, own).astype(int))))
    if 2 * count <= len(border.nodes):
        return ""
    return (
        f"boundary conditions hold {count} of the {len(border.nodes)} nodes of the far field, whose ground then has no effect on them; "
        "release the border (model.release)"
    )


def _uncarried_weight(model: Model) -> str:
    """Of soil that nothing but sides without springs could carry, which did not hold its weight when they began to absorb."""
    gravity = np.asarray(model.gravity)
    size = float(np.linalg.norm(gravity))
    others = (
        model._contacts
        or model._border is not None
        or any(thickness < np.inf for _, _, _, thickness, _ in model._absorbing)
    )
    is_rigid = any(np.isinf(normal) for _, normal, *_ in model._absorbing)
    if size == 0 or not model._absorbing or others or is_rigid:
        return ""
    along = [np.abs(_held_directions(condition) @ gravity).max(initial=0.0) for condition in model._conditions]
    if max(along, default=0.0) > 1e-9 * size:
        return ""
    weight = size * model.comm.allreduce(float(model.particles.mass.sum()))
    held = [entry[2] for entries in model._nodes_of_sides().values() for entry in entries]
    carried = max(0.0, -float(np.sum(held @ gravity)) / size)
    if carried >= 0.5 * weight:
        return ""
    return (
        f"nothing carries the soil: the sides that absorb held {carried:.3g} N of its weight of {weight:.3g} N when absorb was "
        "called, and go on to hold that: find the equilibrium under gravity on supports, then release these and call absorb"
    )


def _held_directions(condition: tuple[int, bool, list[float | None]]) -> NDArray[np.float64]:
    """Directions along which a boundary condition holds its nodes, one per row."""
    _, whole, vector = condition
    if whole:
        return np.eye(len(vector))[[value is not None for value in vector]]
    return np.array([vector], dtype=float) / np.linalg.norm(np.array(vector, dtype=float))


def _rank(directions: Sequence[NDArray[np.float64]]) -> int:
    """Number of independent directions among unit vectors."""
    return int(np.linalg.matrix_rank(np.vstack(directions), tol=1e-9))


def _cut_motion(model: Model) -> Iterator[str]:
    """Of an incoming motion that is cut off at speed."""
    if not model._incoming:
        return
    velocity = np.array(model._incoming[1])
    largest = np.abs(velocity).max()
    for what, end in (("begins", velocity[0]), ("ends", velocity[-1])):
        if abs(end) > CUT_MOTION * largest:
            yield (
                f"the motion that enters {what} at {abs(end) / largest:.0%} of its largest velocity, and is zero beyond, which is a "
                "blow: bring its velocity to zero at its ends, as by a baseline correction and a taper"
            )


def _damped_waves(model: Model, damping: float) -> str:
    """Of local damping in a model that waves enter."""
    if not (damping and model._incoming):
        return ""
    return (
        f"damping is {damping:g} where a motion enters (model.shake, model.drive): local damping weakens its waves at all "
        "frequencies; give rayleigh=mpm.Rayleigh.of_ratio(0.02, frequencies=(1.0, 5.0)), for instance, in its place"
    )


def _reversed_interfaces(model: Model) -> list[str]:
    """Of interfaces along planes, those that point from the second body to the first where these meet."""
    planes = [entry for entry in model._field_contacts if entry["interface"]["kind"] == "Plane"]
    if not planes:
        return []
    p, mesh, found = model.particles, model.mesh, []
    field_of = np.array(model._velocity_fields)[p.material]
    for entry in planes:
        bodies = [field_of == entry[name] for name in ("first", "second")]
        nodes = np.intersect1d(*(mesh.cells[p.cell[body]] for body in bodies))
        near = np.isin(mesh.cells[p.cell], nodes).any(axis=1)
        along = p.position @ np.array(entry["interface"]["normal"])
        sums = [(along[body & near].sum(), np.count_nonzero(body & near)) for body in bodies]
        (first, n), (second, m) = np.array(model.comm.allgather(sums)).sum(axis=0)
        if n and m and second / m < first / n:
            found.append(
                f"where velocity fields {entry['first']} and {entry['second']} meet, the soil of the second lies behind that of the "
                f"first along the interface {entry['interface']['normal']}, which points from the first to the second: turn it round, "
                "or exchange first and second"
            )
    return found


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


def is_unit_weight(weight: float) -> bool:
    """Whether a soil may have a unit weight [N/m3], on earth or in a centrifuge."""
    return any(low <= weight <= high for low, high in (UNIT_WEIGHTS, SPUN_UNIT_WEIGHTS))


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


SURFACES = {
    _core.CamClay: (
        "lie beyond their preconsolidation pressure; the first step reduces them to it. Set it by "
        'model.set_state("log_preconsolidation", mpm.log_preconsolidation(law, stress, overconsolidation))'
    ),
    _core.NorSand: (
        "lie outside of the yield surface of their image pressure; the first step returns them to it. Set it, and the void ratio, by "
        "model.set_state(name, values) for name, values in mpm.nor_sand_state(law, stress, state_parameter).items()"
    ),
}
"""What a warning says of stresses outside of the yield surface that a law has at the start, and how to set it"""


def _outside_of_surface(model: Model, kind: Any) -> str:
    """Of soil that has never been loaded as the stresses say that it is, before the first step, which would change them."""
    if model.steps > 0:
        return ""
    p, outside, total = model.particles, 0, 0
    for number, law in enumerate(model.laws):
        rows = p.material == number
        if not (rows.any() and any(isinstance(each, kind) for each in with_inner_laws(law))):
            continue
        stress = p.stress[rows]
        returned = stress.copy()
        law.update(np.zeros_like(stress), returned, np.ascontiguousarray(p.state[rows, : law.n_state]))
        change = np.linalg.norm(returned - stress, axis=1)
        outside += int(np.count_nonzero(change > RETURNED * np.linalg.norm(stress, axis=1)))
        total += len(stress)
    outside, total = model.comm.allreduce(np.array([outside, total]))
    if not outside:
        return ""
    return f"stresses of {outside / total:.1%} of the particles of {kind.__name__} {SURFACES[kind]}"


def _stiffer_than_said(model: Model) -> Iterator[str]:
    """Of laws in Python and UMATs whose modulus for the critical time step is too small, before the first step."""
    for number, law in enumerate(model.laws):
        if model.steps > 0 or not isinstance(list(with_inner_laws(law))[-1], (_core.PythonLaw, _core.Umat)):
            continue
        rows = np.flatnonzero(model.particles.material == number)[:100]
        modulus = model.comm.allreduce(_compression_modulus(model, law, rows) if len(rows) else 0.0, MPI.MAX)
        if modulus > STIFFER * law.p_wave_modulus:
            yield (
                f"the modulus of compression of {law.name} is {modulus:.3g} Pa in some particles, above its p_wave_modulus of "
                f"{law.p_wave_modulus:.3g} Pa, which limits the time step: explicit steps may be unstable"
            )


def _compression_modulus(model: Model, law: Any, rows: NDArray[np.intp]) -> float:
    """Largest modulus [Pa] of particles of a law that are compressed a little along the first axis, as they are now."""
    p, strain, dim = model.particles, 1e-7, model.mesh.dim
    size = cell_sizes(model.cell_volumes, dim)[p.cell[rows]]
    stresses = []
    for compression in (0.0, strain):  # without strain, stresses beyond the yield surface return to it
        increment, deformation = np.zeros_like(p.stress[rows]), np.tile(np.eye(dim), (len(rows), 1, 1))
        increment[:, 0] -= compression
        deformation[:, 0, 0] -= compression
        stress, state = p.stress[rows], np.ascontiguousarray(p.state[rows, : law.n_state])
        law.update(increment, stress, state, time=model.time, cell_size=size, deformation=deformation)
        stresses.append(stress[:, 0])
    return float(((stresses[0] - stresses[1]) / strain).max())


def angles_in_radians(laws: Iterable[Any]) -> str:
    """What a warning says of a friction angle that is probably in radians; empty where there is none."""
    angles = {getattr(law, "friction_angle", 0.0) for each in laws for law in with_inner_laws(each)}
    numbers = sorted(angle for angle in angles if isinstance(angle, (int, float)))
    found = (in_radians("the friction angle", angle) for angle in numbers)
    return next((text for text in found if text), "")


def in_radians(name: str, angle: float) -> str:
    """What a warning says of an angle that is probably in radians; empty for others."""
    if not RADIANS[0] <= angle <= RADIANS[1]:
        return ""
    return f"{name} is {angle:g} degrees; angles are in degrees, and {angle:g} rad are {np.degrees(angle):.1f} degrees"


def warn_of_radians(**angles: float) -> None:
    """Warn of angles [degrees], by the names of their arguments, that are probably in radians. Not collective."""
    for name, angle in angles.items():
        text = in_radians(name, angle)
        if text:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def warn_of_rain(comm: MPI.Comm, rate: float, stacklevel: int = 3) -> None:
    """Warn of a rate of rain [m/s] that is probably in other units. Not collective."""
    if comm.rank == 0 and rate > HEAVIEST_RAIN:
        warnings.warn(
            f"the rate of the rain is {rate:g} m/s, more than has ever fallen; rates are in m/s, and {rate:g} mm/h are "
            f"{rate / 3.6e6:.3g} m/s",
            RuntimeWarning,
            stacklevel=stacklevel,
        )


def warn_of_friction(comm: MPI.Comm, friction: float) -> None:
    """Warn of a coefficient of friction that is probably an angle. Not collective."""
    if comm.rank == 0 and friction > STEEPEST_FRICTION:
        warnings.warn(
            f"friction is {friction:g}, a coefficient of Coulomb friction, which is the tangent of the angle of friction: for an angle "
            f"of {friction:g} degrees give {np.tan(np.radians(friction)):.4g}",
            RuntimeWarning,
            stacklevel=4,
        )


def warn_of_water_weight(comm: MPI.Comm, unit_weight: float) -> None:
    """Warn of a unit weight of water that is probably in kN/m3; one of nearly zero is fine. Not collective."""
    if comm.rank == 0 and 1.0 <= unit_weight <= 100.0:
        warnings.warn(
            f"the unit weight of water is {unit_weight:g} N/m3; unit weights are in N/m3, 9810 for water",
            RuntimeWarning,
            stacklevel=3,
        )


def warn_of_water_density(comm: MPI.Comm, density: float, stacklevel: int = 3) -> None:
    """Warn of a density of water in other units, or found by another gravity; one of nearly zero is fine. Not collective."""
    if comm.rank == 0 and not (density < ODD_WATER[0] or ODD_WATER[1] < density < ODD_WATER[2]):
        warnings.warn(
            f"the density of water is {density:g} kg/m3, expected some 1000; densities are in kg/m3, unit weights in N/m3 under the "
            "gravity of the model",
            RuntimeWarning,
            stacklevel=stacklevel,
        )


def with_inner_laws(law: Any) -> Iterator[Any]:
    """A law and the laws that it is made of."""
    yield law
    for inner in ("skeleton", "law", "peak"):
        if isinstance(getattr(law, inner, None), tuple(_core.law_types)):
            yield from with_inner_laws(getattr(law, inner))


def keeps_volume(laws: Iterable[Any]) -> bool:
    """Whether a law hardly lets its soil change its volume, so that linear cells lock without averaged strains."""
    return bool(locking(laws))


def locking(laws: Iterable[Any]) -> str:
    """What a warning says of linear cells or elements without averaged strains; empty where no law keeps the volume of its soil."""
    reasons = sorted({reason for law in laws for reason in _reasons_to_lock(law)})
    if not reasons:
        return ""
    return (
        f"linear cells lock in soil whose volume hardly changes ({', '.join(reasons)}): it is too stiff and too strong, the more the "
        "coarser the mesh; use nmd=True, which averages volumetric strains (docs/locking.md)"
    )


def locks_at_failure(laws: Iterable[Any]) -> bool:
    """Whether a law keeps the volume of its soil only as it fails: its dilation angle is below its friction angle."""
    laws = list(laws)
    return not keeps_volume(laws) and any(_core.associated_fraction(law) < 1 for law in laws)


def dilates(laws: Iterable[Any]) -> bool:
    """Whether soil of a law with friction dilates as it fails."""
    yields = [law for law in laws if not isinstance(law, _core.LinearElastic) and not keeps_volume([law])]
    return any(_core.associated_fraction(law) > 0 for law in yields)


def _reasons_to_lock(law: Any) -> Iterator[str]:
    """Reasons for which a law, or the law within it, keeps the volume of the soil."""
    for each in with_inner_laws(law):
        if hasattr(each, "water_modulus"):
            yield "undrained"
        poisson, friction = getattr(each, "poisson", None), getattr(each, "friction_angle", None)
        if isinstance(poisson, (int, float)) and poisson > NEARLY_INCOMPRESSIBLE:
            yield f"Poisson's ratio {poisson:g}"
        if isinstance(friction, (int, float)) and friction == 0:
            yield "friction angle 0"
