"""Supports of a site by boundary, as its file names them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import fenics_bridge as bridge
import mpm_core as mpm

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
