"""Undrained strengths of the soils of a site that follow the vertical effective stress: `strength_ratio` of a soil, or of a law of a stage.

Example of a file:

    [soils.tailings]                   # as they have consolidated
    friction_angle = 33.0
    cohesion = 0.0

    [laws.liquefied]
    material = "tresca"
    strength_ratio = 0.06              # undrained strength over vertical effective stress; with overconsolidation = 2 and
                                       # strength_exponent = 0.8 times 2^0.8, or with a vertical_preconsolidation [Pa] over it
    shear_strength = 500.0             # Pa, the least strength

    [[stages]]
    name = "liquefaction"
    law = {tailings = "liquefied"}     # by the stresses at the beginning of this stage
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.strength_ratio import STRENGTH

from .fields import SoilField, varying
from .laws import EXPONENT, HISTORY, OVERCONSOLIDATION, RATIO, has_ratio, is_profile, law_at

if TYPE_CHECKING:
    from .file import Site


def ratio_of(table: Mapping[str, Any], where: str) -> bridge.StrengthRatio | None:
    """The strength ratio in the table of a law; None where it has none.

    Args:
        table: of a soil or law.
        where: it stands in the file.

    Raises:
        InputError: a number out of its range.
    """
    if not has_ratio(table):
        return None
    given = {name: table[key] for name, key in (("ratio", RATIO), ("exponent", EXPONENT)) if key in table}
    if HISTORY in table:
        given[HISTORY] = _history(table[HISTORY], where)
    try:
        return bridge.StrengthRatio(overconsolidation=table.get(OVERCONSOLIDATION, 1.0), **given)
    except mpm.InputError as error:
        key = "" if str(error).startswith((OVERCONSOLIDATION, HISTORY)) else "strength_"
        raise mpm.InputError(f"{where}: {key}{error}") from None


def _history(value: Any, where: str) -> Any:
    """A vertical preconsolidation stress as a `StrengthRatio` takes it: a number, or a function of positions where it grows with depth."""
    if not isinstance(value, dict):
        return value
    if not is_profile(value):
        raise mpm.InputError(f"{where}: {HISTORY} is {value}, expected a number or {{value = , per_metre = , top = }}")
    return lambda x: value["value"] + value["per_metre"] * np.maximum(value["top"] - x[:, -1], 0.0)


def without_history(table: dict[str, Any]) -> dict[str, Any]:
    """The table of a law without the vertical preconsolidation stress that belongs to its strength ratio; as it is without a ratio."""
    return {key: value for key, value in table.items() if key != HISTORY} if has_ratio(table) else table


def law_of_table(table: dict[str, Any], height: float | None, where: str, fields: Sequence[SoilField] = ()) -> Any:
    """The law that a table describes, as `law_at` has it, with the parameters that vary from point to point.

    Raises:
        InputError: the strength is a random field and follows the vertical effective stress.
    """
    table, names = without_history(table), [field.parameter for field in fields]
    if has_ratio(table) and STRENGTH in names:
        raise mpm.InputError(f"{where} has {RATIO}, and its strength is a random field, expected one of them")
    return varying(law_at(table, height, where), [*names, *([STRENGTH] if has_ratio(table) else [])])


def with_strength_ratios(
    stages: Sequence[bridge.Stage], site: Site, laws: Mapping[str, Mapping[str, Any]], path: Path
) -> list[bridge.Stage]:
    """The stages of a site with the strength ratios of its soils and of the laws that stages name.

    Args:
        stages: of the site.
        site: with strength ratios and K0 by soil, and its stages as in the file.
        laws: tables of the laws that stages name.
        path: of the site's file, for messages.

    Raises:
        InputError: a soil with a strength ratio is not there with K0 from the beginning.
    """
    bare = next((soil for soil in site.strength_ratio if soil not in site.k0), None)
    if bare is not None:
        raise mpm.InputError(
            f"{path}: soils.{bare} has {RATIO} but no k0, expected both, since its strength follows the stress that it begins with; or {RATIO} "
            "in a table [laws.NAME], whose name a stage has in `law` after the soil is there"
        )
    begun = len(stages) - len(site.stage_rows)  # a stage before those of the file has what is there from the beginning
    found = []
    for number, stage in enumerate(stages):
        ratios: dict[int | str, bridge.StrengthRatio] = {}
        if number == 0:
            ratios |= {soil: ratio for soil, ratio in site.strength_ratio.items() if soil in stage.fill}
        if number >= begun:
            for soil, name in site.stage_rows[number - begun].get("law", {}).items():
                ratio = ratio_of(laws[name], f"{path}: laws.{name}")
                ratios |= {} if ratio is None else {soil: ratio}
        found.append(replace(stage, strength_ratio=ratios))
    return found


def refuse_strength_ratio(site: Site, path: Path) -> None:
    """Raise InputError for soils with a strength ratio in the file of a study that has none; path: of the file."""
    soil = next(iter(site.strength_ratio), None)
    if soil is not None:
        raise mpm.InputError(
            f"{path}: soils.{soil} has {RATIO}, expected none: the studies safety, excavation, embankment and slope have it"
        )
