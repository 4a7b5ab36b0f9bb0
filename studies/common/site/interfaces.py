"""Soil that slides along the walls of a site: cells beside them whose strength is a fraction of that of their soil."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mpm_core.law_warnings import with_inner_laws

import fenics_bridge as bridge
import mpm_core as mpm

from .keys import INTERFACE
from .laws import is_number

WITHOUT_MEMORY = (mpm.LinearElastic, mpm.MohrCoulomb, mpm.ViscoplasticMohrCoulomb, mpm.DruckerPrager, mpm.HoekBrown)
"""Laws that may change in a stage without losing what the soil has gone through"""


@dataclass
class Interfaces:
    """Cells beside walls.

    fractions: strength of each wall's interface over that of the soil; walls: the walls beside the cells of each tag
    """

    fractions: dict[str, float] = field(default_factory=dict)
    walls: dict[int, tuple[str, ...]] = field(default_factory=dict)

    def law(self, tag: int, law: Any, there: Any) -> Any:
        """The law of a tag's cells beside those of its walls that are there, which has the strength of the weakest interface.

        Elastic soil has no strength, and stays as it is.

        Raises:
            InputError: the strength of the law is not known.
        """
        fractions = {wall: self.fractions[wall] for wall in self.walls.get(tag, ()) if wall in there}
        weakest = min(fractions, key=fractions.__getitem__, default=None)
        if weakest is None or fractions[weakest] == 1 or isinstance(law, mpm.LinearElastic):
            return law
        try:
            return bridge.reduced_strength(law, 1 / fractions[weakest])
        except mpm.InputError as error:
            raise mpm.InputError(f"members.{weakest}: {INTERFACE}: {error}") from None


def fractions_of(tables: Mapping[str, Any], path: Path) -> dict[str, float]:
    """The interface strengths of a site's members by name; of those that name one.

    Raises:
        InputError: a fraction that is not above 0 and at most 1.
    """
    found = {}
    for name, table in tables.items():
        if INTERFACE not in table:
            continue
        where, value = f"{path}: members.{name}", table[INTERFACE]
        if not is_number(value) or not 0 < value <= 1:
            raise mpm.InputError(f"{where}: {INTERFACE} is {value!r}, expected a number above 0 and at most 1")
        found[name] = float(value)
    return found


def split_beside(
    domain: Any, cell_tags: Any, laws: dict[int, Any], members: Mapping[str, mpm.Member], fractions: dict[str, float]
) -> tuple[Any, Interfaces]:
    """Give the cells beside walls tags of their own, which have the laws of their soils until the walls are there. Collective.

    Args:
        domain: the mesh; cell_tags: its tags.
        laws: by cell tag; those of the new tags are added, and those of tags without cells taken out.
        members: by name; fractions: interface strengths of walls among them.

    Returns:
        The new cell tags, and what is beside walls.

    Raises:
        InputError: the mesh does not follow one of these walls. Raised on all ranks alike.
    """
    beside = Interfaces(fractions)
    for wall in fractions:
        try:
            cell_tags, before = bridge.tags_beside(domain, cell_tags, members[wall])
        except mpm.InputError as error:  # on all ranks
            raise mpm.InputError(f"members.{wall}: {INTERFACE}: {error}") from None
        for new, old in before.items():
            if old in laws:
                laws[new] = laws[old]
                beside.walls[new] = (*beside.walls.get(old, ()), wall)
        left = {tag for tags in bridge.names_of(cell_tags).values() for tag in tags}
        for old in set(before.values()) - left:  # all of its cells are beside this wall
            laws.pop(old, None)
            beside.walls.pop(old, None)
    return cell_tags, beside


def in_stages(
    stages: list[bridge.Stage], laws: dict[int, Any], beside: Interfaces, tags_of: Any
) -> tuple[list[bridge.Stage], list[Any]]:
    """Let interfaces have their strength from the stage on that installs their wall, and lose it when it is taken away.

    Soils whose laws remember what they have gone through have that of the interface from the beginning, as `weakened` gives it.

    Args:
        stages: of the site.
        laws: by cell tag, those of tags beside walls without memory as the soils have them.
        beside: cells beside walls.
        tags_of: function of the name of a soil that gives its tags.

    Returns:
        The stages, and the laws that come in by them.
    """
    there: set[str] = set()
    full, acting = dict(laws), dict(laws)
    changed, further = [], []
    for stage in stages:
        there = there.difference(stage.remove).union(stage.install)
        given = {tag: law for soil, law in stage.law.items() for tag in tags_of(soil)}
        full |= given
        for tag in beside.walls:
            memory = not isinstance(full[tag], WITHOUT_MEMORY)
            law = beside.law(tag, full[tag], beside.fractions if memory else there)
            if tag in given or (law != acting[tag] and not memory):
                given[tag] = law
                further.append(law)
        acting |= given
        changed.append(replace(stage, law=given) if given else stage)
    return changed, further


def weakened(laws: dict[int, Any], beside: Interfaces, all_laws: bool) -> dict[int, Any]:
    """The laws with the strength of all interfaces.

    Args:
        laws: by cell tag.
        beside: cells beside walls.
        all_laws: whether laws without memory are among those that are weakened, as where all walls are there from the beginning.
    """
    chosen = [tag for tag in beside.walls if all_laws or not isinstance(laws[tag], WITHOUT_MEMORY)]
    return laws | {tag: beside.law(tag, laws[tag], beside.fractions) for tag in chosen}


def with_ratios_beside(
    stages: list[bridge.Stage], laws: Mapping[int, Any], beside: Interfaces, tags_of: Any
) -> list[bridge.Stage]:
    """Divide strength ratios of softening soil beside walls as its laws are; ratios are then those of cell tags.

    The strength that a ratio gives replaces the peak of such a law, which has the strength of the interface from the beginning. Other
    laws divide the strengths of all points themselves.

    Args:
        stages: of the site, after `in_stages`.
        laws: by cell tag, of the beginning.
        beside: cells beside walls.
        tags_of: function of the name of a soil that gives its tags.
    """
    acting, changed = dict(laws), []
    for stage in stages:
        acting |= {
            tag: law for key, law in stage.law.items() for tag in ([key] if isinstance(key, int) else tags_of(key))
        }
        ratios: dict[int | str, bridge.StrengthRatio] = {}
        for soil, ratio in stage.strength_ratio.items():
            for tag in tags_of(soil):
                weakest = min((beside.fractions[wall] for wall in beside.walls.get(tag, ())), default=1.0)
                softens = any(isinstance(one, mpm.SofteningMohrCoulomb) for one in with_inner_laws(acting[tag]))
                ratios[tag] = replace(ratio, ratio=weakest * ratio.ratio) if softens else ratio
        changed.append(replace(stage, strength_ratio=ratios))
    return changed
