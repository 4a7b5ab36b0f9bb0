"""Supports of a site by boundary, as its file names them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.compat import facet_nodes
from fenics_bridge.fem.supports import tagged_facets

from .checks import say

LEAST_LEVEL = 0.05
"""Part of the area of a base, seen from above, below which it stands upright"""
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
    return [support_of(name, kind, f"{path}: supports.{name}", domain, facet_tags) for name, kind in given.items()]


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
