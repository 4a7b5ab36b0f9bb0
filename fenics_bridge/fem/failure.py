"""Messages about a step without equilibrium: its load, place and soil, and possible remedies; and about one that cannot be meant."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from fenics_bridge.fem.active_cells import free_motions
from fenics_bridge.mesh.names import group_label


def explained(fem: Any, reason: str, load: Any) -> str:
    """The reason why a QuasiStatic found no equilibrium under a load, with load, place, soil, law and advice. Collective."""
    where, soil, law, tension = most_moved(fem)
    place = ", ".join(f"{round(float(x), 6):.3g}" for x in where)  # without what round-off leaves of zero
    name = "" if soil is None else f"the soil {group_label(fem.cell_tags, soil)} "
    return (
        f"{reason}; under {_in_words(fem, load)}; most moved {name}near ({place}) m, which follows the law {law.name}. "
        f"{advice(reason, free_motions(fem), law, tension)}"
    )


def warn_of_motion(fem: Any) -> None:
    """Warn of an equilibrium of a body that nothing holds, or whose displacements are larger than it is. Collective."""
    if not fem.converged:
        return
    domain, dim, free = fem.domain, fem.domain.geometry.dim, free_motions(fem)
    x, u = domain.geometry.x[:, :dim], np.linalg.norm(fem.displacement.x.array.reshape(-1, dim), axis=1)
    high = domain.comm.allreduce(x.max(axis=0, initial=-np.inf), np.maximum)
    low = domain.comm.allreduce(x.min(axis=0, initial=np.inf), np.minimum)
    size, largest = float(np.max(high - low)), max(domain.comm.allgather(float(u.max(initial=0.0))))
    text = ""
    if free:
        text = (
            f"nothing holds the body against moving {' and '.join(free)}, so that its displacement is not determined: give it "
            "supports"
        )
    elif largest > size:
        text = (
            f"the largest displacement is {largest:.3g} m, more than the size of the body, {size:.3g} m; displacements are taken to "
            "be small. Moduli are in Pa"
        )
    if text and domain.comm.rank == 0:
        warnings.warn(text, RuntimeWarning, stacklevel=4)


def advice(reason: str, free: list[str], law: Any, tension: bool) -> str:
    """Possible remedies.

    Args:
        reason: why there is no equilibrium.
        free: unsupported motions, in words.
        law: law where the body moves most.
        tension: whether there is tension there.
    """
    if free:
        return f"Nothing holds the soil that is there against moving {' and '.join(free)}: give it supports"
    if "linear solver" in reason:
        return (
            "Either the ground fails there: take a smaller change, more strength or more support; or a part of the soil is not "
            "held, because it touches the others in points only"
        )
    if getattr(law, "cohesion", 1.0) == 0 and getattr(law, "friction_angle", 1.0) == 0:
        return "The soil has no strength there: give it cohesion or a friction angle"
    if getattr(law, "cohesion", 1.0) == 0:
        return "The soil has no cohesion, and next to a free surface it carries hardly anything: give it some, or less load"
    if tension and "mechanism" in reason:
        return (
            "The ground fails and comes under tension there: take less load, or away what pulls, or give it more strength, a "
            "larger tension_cutoff or support"
        )
    if tension or "law" in reason:
        return (
            "The soil comes under tension there: take away what pulls, or give it cohesion or a larger tension_cutoff"
        )
    if "mechanism" in reason:
        return "The ground fails there: take less load, more strength or more support"
    return (
        "Newton's method and relaxation gave up: try smaller steps, more steps of relaxation (max_steps of Solver), a tolerance "
        "as in practice (PRACTICE), or more dilation"
    )


def most_moved(fem: Any) -> Any:
    """Place of the largest displacement in the last increment, also of a step that failed. Collective.

    Returns the place (D,) [m], and of the soil nearest to it: its tag, its law, and whether it was under tension.
    """
    comm, dim = fem.domain.comm, fem.domain.geometry.dim
    space, points = fem.displacement.function_space, fem.points
    size = np.linalg.norm(fem.increment.x.array.reshape(-1, dim), axis=1)
    size = np.where(np.isfinite(size), size, np.inf)[: space.dofmap.index_map.size_local]
    node = int(np.argmax(size)) if len(size) else None
    found = (float(size[node]), space.tabulate_dof_coordinates()[node, :dim].tolist()) if len(size) else (-1.0, None)
    where = max(comm.allgather(found), key=lambda one: one[0])[1]
    distance = np.where(
        np.repeat(points.material, points.per_cell) >= 0, np.linalg.norm(points.coordinates() - where, axis=1), np.inf
    )
    candidate = (np.inf, -1, False)
    if points.n:
        nearest = int(np.argmin(distance))
        stress = points.trial_stress
        tension = bool(stress[nearest, :3].sum() >= -1e-9 * np.abs(stress).max())  # a cut-off leaves none
        candidate = (float(distance[nearest]), int(points.material[nearest // points.per_cell]), tension)
    _, number, tension = min(comm.allgather(candidate))
    return where, fem.soils[number], fem.laws[number], tension


def _in_words(fem: Any, load: Any) -> str:
    """A load as text, without the components that are not given."""
    weight = load.unit_weight.items() if isinstance(load.unit_weight, dict) else [(None, load.unit_weight)]
    parts = [f"unit weight {w:.5g} N/m3{_of(fem.cell_tags, tag)}" for tag, w in weight if w]
    forces = load.body_force.items()
    parts += [f"body force {_vector(b)} N/m3{_of(fem.cell_tags, tag)}" for tag, b in forces if np.any(b)]
    parts += [f"pressure {p:.5g} Pa{_of(fem.facet_tags, tag)}" for tag, p in load.pressure.items() if p]
    parts += [f"traction {_vector(t)} Pa{_of(fem.facet_tags, tag)}" for tag, t in load.traction.items()]
    parts += [f"{load.displacement:.3g} of the prescribed displacements"] if load.displacement else []
    parts += [f"{load.held:.3g} of the forces still held"] if load.held else []
    return ", ".join(dict.fromkeys(parts)) or "no load"  # once for all classes of a soil


def _vector(components: Any) -> str:
    return f"({', '.join(f'{float(x):.5g}' for x in components)})"


def _of(tags: Any, tag: Any) -> Any:
    return "" if tag is None else f" of {group_label(tags, tag)}"
