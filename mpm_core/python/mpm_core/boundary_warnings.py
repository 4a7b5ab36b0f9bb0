"""Warnings of boundaries that prevent what they are for: sides that absorb, incoming waves, far fields, interfaces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .model import Model

CUT_MOTION = 0.05
"""Fraction of the largest velocity of a motion at its ends above which it is probably cut off"""


def doubts_of_boundaries(model: Model, damping: float) -> Iterator[str]:
    """What is probably wrong with sides that absorb or let waves in, far fields and interfaces of a model. Collective."""
    yield from _held_sides(model)
    yield _held_border(model)
    yield _uncarried_weight(model)
    yield from _cut_motion(model)
    yield from _reversed_interfaces(model)
    yield _damped_waves(model, damping)


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
