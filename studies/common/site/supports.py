"""Supports of a site by boundary, as its file names them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx.mesh import exterior_facet_indices
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.compat import facet_nodes
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.mesh.names import known_tags

from ..checks import say
from .doubts import ends_of_mesh

LEAST_LEVEL = 0.05
"""Part of the area of a base, seen from above, below which it stands upright"""
ON_AXIS = 1e-9
"""Part of the largest radius up to which a boundary counts as on the axis"""
DEFAULT_SUPPORTS = {
    "base": "fixed",
    **dict.fromkeys(("left", "right", "front", "back", "sides", "axis", "far"), "roller"),
}
"""Supports of boundaries by their names, where a file has none"""


def supports_of(table: dict, path: Path, domain: Any, facet_tags: Any) -> list[bridge.Support]:
    """The supports that a site names; by default those of boundaries with the names of `DEFAULT_SUPPORTS`. Collective."""
    names = bridge.names_of(facet_tags)
    given = table.get("supports") or {name: kind for name, kind in DEFAULT_SUPPORTS.items() if name in names}
    if not given:
        raise mpm.InputError(
            f"{path} has no [supports], and the mesh has no boundary named {', '.join(DEFAULT_SUPPORTS)}; it has {list(names)}"
        )
    _warn_of_upright_base(path, domain, facet_tags)
    _warn_of_sides_without_name(path, domain, facet_tags, bool(table.get("axisymmetric")))
    if not table.get("supports"):
        _warn_of_free_sides(path, domain, facet_tags, given)
    return [support_of(name, kind, f"{path}: supports.{name}", domain, facet_tags) for name, kind in given.items()]


def supports_of_soil(supports: Sequence[bridge.Support], domain: Any, facet_tags: Any) -> list[bridge.Support]:
    """Those supports whose boundaries are at a body of soil; others hold what slides there only. Collective."""
    names, there = bridge.names_of(facet_tags), set(known_tags(domain.comm, facet_tags))
    return [one for one in supports if there.intersection(names.get(str(one.facet_tag), ()))]


def warn_of_rigid_core(path: Path, domain: Any, facet_tags: Any, supports: Mapping[str, str] | None) -> None:
    """Warn of boundaries of an axisymmetric site that are held as an axis is, but are not on it: they hold the soil as a rigid core does. Collective.

    Args:
        path: of the file.
        domain, facet_tags: of the mesh.
        supports: kinds by boundary as in the file; None where it has none, so that those of `DEFAULT_SUPPORTS` are held.
    """
    names = bridge.names_of(facet_tags)
    held = [
        name
        for name in (("axis", "left") if supports is None else ("axis",))
        if name in names and name in (supports or names)
    ]
    for name in held:
        x = domain.geometry.x[facet_nodes(domain, tagged_facets(domain.comm, facet_tags, name, "supports"))][:, :, 0]
        ends = domain.comm.allgather((float(x.min(initial=np.inf)), float(x.max(initial=-np.inf))))
        low, high = min(low for low, _ in ends), max(high for _, high in ends)
        size = max(domain.comm.allgather(float(domain.geometry.x[:, 0].max(initial=0.0))))
        if low > ON_AXIS * size:
            where = f"x = {low:.4g} m" if high - low <= ON_AXIS * size else f"x = {low:.4g} to {high:.4g} m"
            say(f"{path}: the boundary {name!r} is at {where}, but the axis of an axisymmetric site is at x = 0: a support there holds the soil as a rigid "
                "core of that radius does. Let the mesh begin at x = 0, or give [supports] without it where it is the side of a hole")  # fmt: skip


def support_of(name: str, kind: str, where: str, domain: Any, facet_tags: Any) -> bridge.Support:
    """The support of a boundary, of a kind that a file names; where: it stands, for messages. Collective."""
    if kind == "fixed":
        return bridge.fixed(name)
    if kind != "roller":
        raise mpm.InputError(f"{where} is {kind!r}, expected 'fixed' or 'roller'")
    normal = bridge.flat_normal(domain, facet_tags, name)
    if normal is None:
        raise mpm.InputError(
            f"{where}: a roller needs a boundary at right angles to an axis, expected 'fixed' for this one"
        )
    return bridge.roller(name, normal)


def _warn_of_free_sides(path: Path, domain: Any, facet_tags: Any, held: Mapping[str, str]) -> None:
    """Warn of boundaries at the sides of a mesh that have no support, since their names are none of the default ones. Collective.

    Args:
        path: of the file, which names no supports.
        domain: the mesh.
        facet_tags: tags of its boundaries.
        held: supports by boundary.
    """
    comm, x = domain.comm, domain.geometry.x
    low, high = ends_of_mesh(domain)
    free = []
    for name in bridge.names_of(facet_tags):
        normal = None if name in held else bridge.flat_normal(domain, facet_tags, name)
        if normal is None or normal[-1]:
            continue
        axis = normal.index(1.0)
        places = x[facet_nodes(domain, tagged_facets(comm, facet_tags, name, "supports"))][:, :, axis].ravel()
        place = np.mean([one for one in comm.allgather(places.mean() if len(places) else None) if one is not None])
        if min(abs(place - low[axis]), abs(place - high[axis])) < 1e-6 * (high[axis] - low[axis]):
            free.append(name)
    if free:
        several = len(free) > 1
        say(f"{path}: the boundar{'ies' if several else 'y'} {' and '.join(map(repr, free))} at the side{'s' if several else ''} of the mesh "
            f"{'are' if several else 'is'} free, since without [supports] only {', '.join(DEFAULT_SUPPORTS)} are held: name {'them' if several else 'it'} "
            "in [supports], or give [supports] without it where it is a free surface")  # fmt: skip


def _warn_of_sides_without_name(path: Path, domain: Any, facet_tags: Any, axisymmetric: bool) -> None:
    """Warn where boundaries without a name, which no support holds, are at the lower end or at a side of a mesh; path: of the file. Collective.

    The axis of an axisymmetric mesh needs no support.
    """
    dim, (low, high) = domain.geometry.dim, ends_of_mesh(domain)
    nameless = np.setdiff1d(exterior_facet_indices(domain.topology), facet_tags.indices)
    corners = domain.geometry.x[facet_nodes(domain, nameless)]
    near = 1e-6 * (high - low).max()
    ends = [(axis, end) for axis in range(dim - 1) for end in (low, high)] + [(dim - 1, low)]
    found = []
    for axis, end in ends[1:] if axisymmetric else ends:
        there = (np.abs(corners[:, :, axis] - end[axis]) < near).all(axis=1)
        if domain.comm.allreduce(bool(there.any()), MPI.LOR):
            found.append(f"{'xyz'[axis]} = {end[axis]:g} m")
    if found:
        say(f"{path}: the mesh has boundaries without a name at {' and '.join(found)}, which no support holds: name them in the mesh, as physical groups "
            "of gmsh, also where they are free surfaces")  # fmt: skip


def _warn_of_upright_base(path: Path, domain: Any, facet_tags: Any) -> None:
    """Warn where the boundary named base stands upright, as in a mesh whose vertical axis is another one; path: of the file. Collective."""
    if "base" not in bridge.names_of(facet_tags):
        return
    dim = domain.geometry.dim
    corners = domain.geometry.x[facet_nodes(domain, tagged_facets(domain.comm, facet_tags, "base", "supports"))]
    edges = corners[:, 1:] - corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1] if dim == 3 else [0.0, 0.0, 1.0])
    here = np.abs(normals[:, dim - 1]).sum(), np.linalg.norm(normals, axis=1).sum()
    level, area = np.sum(domain.comm.allgather(here), axis=0)
    if level < LEAST_LEVEL * area:
        up = "xyz"[dim - 1]
        say(f"{path}: the boundary 'base' stands upright, but {up} points up and the weight acts against it: turn the mesh so that its height "
            f"is along {up}")  # fmt: skip
