"""Warnings of structural members of a site that work otherwise than meant."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from mpm_core.members import Member

import fenics_bridge as bridge
from fenics_bridge.fem.active_cells import cells_there
from fenics_bridge.fem.evaluate import PointSearch

from ..checks import say

if TYPE_CHECKING:
    from .file import Site


def warn_of_pulling_struts(site: Site) -> None:
    """Warn of struts in the open, as between the walls of a pit, that are installed with a tension. Collective.

    Struts are jacked against walls. Anchors and ties have soil around them, and a cable has no strength in compression.
    """
    there: list[str] = []
    for stage in site.stages:
        there = [soil for soil in (*there, *stage.fill) if soil not in stage.excavate]
        pulling = {name: one for name, one in stage.install.items() if _is_strut(one) and one.prestress > 0}
        for name, is_open in zip(pulling, _in_the_open(site, there, list(pulling.values()))):
            if is_open:
                say(f"{site.path}: members.{name}: prestress is {pulling[name].prestress:g} N/m, a tension, by which the strut pulls at what it is "
                    "meant to hold apart; that of a strut which is jacked against walls is a compression, below 0")  # fmt: skip


def _is_strut(member: Member) -> bool:
    return not member.bonded and not member.bending_stiffness and member.compressive_strength > 0


def _in_the_open(site: Site, soils: Sequence[str], members: Sequence[Member]) -> list[bool]:
    """Whether the middles of members are in none of some soils. Collective."""
    if not members:
        return []
    off = [tag for name, tags in bridge.names_of(site.cell_tags).items() if name not in soils for tag in tags]
    middles = np.array([np.mean([one.points[0], one.points[-1]], axis=0) for one in members])
    inside = PointSearch(site.domain, middles).values(cells_there(site.domain, site.cell_tags, off))[:, 0]
    found: list[bool] = (np.nan_to_num(inside) < 0.5).tolist()
    return found
