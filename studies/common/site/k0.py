"""How the soils of a site are there from the beginning: K0, the ratio of horizontal to vertical effective stress, and overconsolidation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.k0 import LARGEST_K0
from fenics_bridge.fem.overconsolidation import LARGEST

from ..checks import say
from .laws import OVERCONSOLIDATION, RATIO, is_number, without_effect

if TYPE_CHECKING:
    from .file import Site

KEY = "k0"
"""Key of a soil for its K0; `OVERCONSOLIDATION` has no effect on most laws, and so belongs to `site_laws`"""


def k0_of(soils: Mapping[str, Mapping[str, Any]], path: Path) -> dict[str, float]:
    """K0 [-] by soil, of those that have one.

    Raises:
        InputError: one is no number above 0, or so large that it is in percent.
    """
    found = {soil: given[KEY] for soil, given in soils.items() if KEY in given}
    for soil, value in found.items():
        if not (is_number(value) and 0 < value <= LARGEST_K0):
            raise mpm.InputError(
                f"{path}: soils.{soil}: {KEY} is {value!r}, expected a number above 0 and up to {LARGEST_K0:g}, such as 0.5"
            )
    return found


def overconsolidation_of(soils: Mapping[str, Mapping[str, Any]], path: Path) -> dict[str, float]:
    """Overconsolidation ratio [-] by soil, of those that have one and whose law has a memory of it.

    Raises:
        InputError: one is no number from 1 on, or so large that it is no ratio.
    """
    found = {soil: given[OVERCONSOLIDATION] for soil, given in soils.items() if OVERCONSOLIDATION in given}
    for soil, value in found.items():
        if not (is_number(value) and 1 <= value <= LARGEST):
            raise mpm.InputError(
                f"{path}: soils.{soil}: {OVERCONSOLIDATION} is {value!r}, expected a ratio from 1 to {LARGEST:g}, such as 2"
            )
    without_ratio = {soil: {key: value for key, value in soils[soil].items() if key != RATIO} for soil in found}
    return {
        soil: value for soil, value in found.items() if OVERCONSOLIDATION not in without_effect(without_ratio[soil])
    }


def from_the_beginning(
    stages: Sequence[bridge.Stage], site: Site, has_beginning: bool, path: Path
) -> list[bridge.Stage]:
    """The stages of a site, the first of which places its soils with their K0 and overconsolidation.

    Args:
        stages: of the site.
        site: with K0 and overconsolidation by soil.
        has_beginning: whether the first stage is the beginning, in which soils come at rest.
        path: of the site's file, for messages.

    Raises:
        InputError: a soil with one of them comes later.
    """
    for key, given in ((KEY, site.k0), (OVERCONSOLIDATION, site.overconsolidation)):
        for number, stage in enumerate(stages):
            late = next((soil for soil in stage.fill if soil in given), None)
            if late is not None and (number > 0 or not has_beginning):
                raise mpm.InputError(
                    f"{path}: soils.{late}: {key} is {given[late]!r}, but the stage {stage.name!r} places this soil, expected none: only soil that "
                    "is there from the beginning has it"
                )
    say(_forgetting(site, path))
    if not (stages and has_beginning):
        return list(stages)
    k0, ratios = (of_soils(stages[0].fill, given) for given in (site.k0, site.overconsolidation))
    return [replace(stages[0], k0=k0, overconsolidation=ratios), *stages[1:]]


def of_soils(soils: Sequence[str], given: Mapping[str, float]) -> dict[int | str, float]:
    """What is given by soil, of some soils."""
    return {soil: given[soil] for soil in soils if soil in given}


def _forgetting(site: Site, path: Path) -> str:
    """A warning of stages that give overconsolidated soil another law; empty for others."""
    laws = (soil for row in site.stage_rows for soil in row.get("law", {}))
    soils = [soil for soil in dict.fromkeys(laws) if soil in site.overconsolidation]
    if not soils:
        return ""
    return (
        f"{path}: a stage gives {', '.join(map(repr, soils))} another law, which does not know of its {OVERCONSOLIDATION}: the soil is then normally "
        "consolidated, unless the law has a vertical_preconsolidation"
    )


def begin_at_rest(site: Site, fem: bridge.QuasiStatic) -> None:
    """Bring elements to equilibrium with all soils of a site at once, those with K0 at rest, and overconsolidated ones so. Collective.

    Args:
        site: with K0 or overconsolidation; its members are there where it has no stages.
        fem: its elements, new.

    Raises:
        StageError: there is no equilibrium.
    """
    bridge.FemSite(fem).carry_out(all_at_rest(site))


def all_at_rest(site: Site) -> bridge.Stage:
    """A stage that brings all soils of a site at once, those with K0 at rest; its members are there where it has no stages."""
    members = {} if site.stages else site.members
    return bridge.Stage("all at once", site.soils, unit_weight=site.unit_weight, k0=site.k0, install=members,
                        overconsolidation=site.overconsolidation, strength_ratio=site.strength_ratio)  # fmt: skip


def say_left_out(k0: Mapping[str, Any], overconsolidation: Mapping[str, Any], where: str) -> None:
    """Warn of K0 and overconsolidation of some soils in what begins without stresses; nothing without any.

    Args:
        k0: by soil.
        overconsolidation: by soil.
        where: what it is, for the message.
    """
    given = ((KEY, k0), (OVERCONSOLIDATION, overconsolidation))
    named = [f"{key} of {', '.join(map(repr, soils))}" for key, soils in given if soils]
    if named:
        say(f"{where}: {' and '.join(named)} {'is' if len(named) == 1 else 'are'} left out, since stresses begin at zero here; the load or the "
            "strength at failure hardly depends on it")  # fmt: skip
