"""Warnings of members that are probably in other units, and of beams that bend otherwise than the user expects."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.member_warnings import odd_units, rigid_beam
from numpy.typing import NDArray

from fenics_bridge.structures.installed import Members

ALONG = 0.7
"""Component of a beam's direction along a coordinate, at least, by which a roller in this direction cuts it"""

ON_LINE = 0.05
"""Distance of an end from the line of a beam that it is meant to be on, over the distance of the body's nodes there, at most"""

COARSE = 1.5
"""Distance of a beam's nodes over that of the body's beside them, above which the soil's nodes between them move on their own"""

HELD = 0.99
"""Part of an end's motion by nodes that a support holds, at least, so that it counts as held"""


def warn_of_members(members: Members, held: NDArray[np.integer], before: set[str], comm: MPI.Comm) -> None:
    """Warn of members just installed in odd units, and of beams that cannot bend, or that a roller cuts at a free end. Collective.

    Args:
        members: the members of a body.
        held: this rank's own dofs that supports hold.
        before: names of members that were there before.
        comm: the ranks.
    """
    is_held = members.of_all_ranks(held)
    for name, one in members.installed():
        if name in before:
            continue
        of_beam = (rigid_beam(name, _rigid(one), "linear elements"), _hinge(name, one, is_held))
        found = _loose(members, name, one), _coarse(members, name, one), _beside(name, one)
        for text in (*found, *odd_units(name, one.member), *(of_beam if one.member.bending_stiffness else ())):
            if text and comm.rank == 0:
                warnings.warn(text, RuntimeWarning, stacklevel=5)


def _coarse(members: Members, name: str, one: Any) -> str:
    """What a warning says of a beam whose spacing leaves nodes of the soil beside it free; empty without. Collective."""
    if not one.member.bending_stiffness or one.member.spacing is None:
        return ""
    longest = float(np.linalg.norm(np.diff(one.nodes, axis=0), axis=1).max())
    beside = members.node_distance(np.array(one.member.points))
    if longest <= COARSE * beside:
        return ""
    return (
        f"the beam {name!r} has nodes {longest:.3g} m apart, and the soil beside it has them every {beside:.3g} m: the soil moves between its "
        "nodes, and fails there: give it a smaller spacing, or none"
    )


def _beside(name: str, one: Any) -> str:
    """What a warning says of a beam whose nodes are near those of the mesh, but others; empty without."""
    if not one.beside:
        return ""
    return (
        f"the beam {name!r} goes along edges of the mesh, but its corners are not nodes of the mesh: its axial and shear forces jump from segment "
        "to segment, around the right ones; give its line the nodes of the mesh, as by a transfinite curve of gmsh with as many parts"
    )


def _rigid(one: Any) -> float:
    """Fraction of a beam's nodes at which it cannot bend, as all three nodes beside are in one linear element [-]."""
    strains, longest = one.strains, np.linalg.norm(np.diff(one.nodes, axis=0), axis=1).max()
    curvature = abs(one.strain[strains.segments : strains.segments + len(strains.bends_at)])
    if curvature.shape[0] == 0:
        return 0.0
    largest = np.asarray(curvature.max(axis=1).todense()).ravel()
    return float(np.mean(largest < 1e-6 / longest**2))


def _hinge(name: str, one: Any, is_held: NDArray[np.float64]) -> str:
    """What a warning says of a free end on a boundary that holds it along the beam and lets it move across; empty without."""
    member = one.member
    if member.closed:
        return ""
    ends = ((0, 1, "clamped_start", member.clamped_start), (-1, -2, "clamped_end", member.clamped_end))
    rest = one.movement @ (1 - is_held)  # parts of the ends' motions by nodes that are free
    free = np.abs(rest.reshape(one.nodes.shape)) > 1 - HELD
    for end, beside, argument, clamped in ends:
        along = one.nodes[end] - one.nodes[beside]
        axis = int(np.argmax(np.abs(along)))
        cuts = abs(along[axis]) > ALONG * float(np.linalg.norm(along)) and not free[end, axis] and free[end, 1 - axis]
        if cuts and not clamped:
            where = ", ".join(f"{x:.6g}" for x in one.nodes[end])
            return (
                f"the beam {name!r} ends at ({where}) m on a boundary that holds it along its line, where it is free to turn: a hinge. "
                f"If the boundary is an axis of symmetry, or cuts the beam, give it {argument}=True"
            )
    return ""


def _loose(members: Members, name: str, one: Any) -> str:
    """What a warning says of an end on a beam that is far from the beam's nodes, so that it pulls at the soil; empty without. Collective."""
    if one.member.bending_stiffness:
        return ""
    for beam, other in members.installed():
        if not other.member.bending_stiffness:
            continue
        for end in one.nodes[[0]] if one.member.fixed_end else one.nodes[[0, -1]]:
            start, edges = other.nodes[:-1], np.diff(other.nodes, axis=0)
            along = np.clip(np.sum((end - start) * edges, axis=1) / np.sum(edges**2, axis=1), 0, 1)
            off = np.linalg.norm(start + along[:, None] * edges - end, axis=1)
            size = members.node_distance(np.array([end, end + 1e-3 * edges[int(np.argmin(off))]]))
            apart = float(np.linalg.norm(other.nodes - end, axis=1).min())
            if off.min() < ON_LINE * size and apart > 1.01 * size:
                where = ", ".join(f"{x:.6g}" for x in end)
                return (
                    f"the member {name!r} ends at ({where}) m on the beam {beam!r}, {apart:.3g} m from the next node of this, so that it acts on "
                    "the soil rather than on the beam: make the point one of the beam's line, or its spacing smaller"
                )
    return ""
