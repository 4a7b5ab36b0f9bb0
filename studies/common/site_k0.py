"""K0 of the soils of a site, with which they are there from the beginning: the ratio of horizontal to vertical effective stress."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.k0 import LARGEST_K0

from .checks import say
from .site_laws import is_number

if TYPE_CHECKING:
    from .site_file import Site

KEY = "k0"
"""Key of a soil"""


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


def with_k0(
    stages: Sequence[bridge.Stage], k0: Mapping[str, float], has_beginning: bool, path: Path
) -> list[bridge.Stage]:
    """The stages of a site, the first of which places its soils with their K0.

    Args:
        stages: of the site.
        k0: by soil [-].
        has_beginning: whether the first stage is the beginning, in which soils come at rest.
        path: of the site's file, for messages.

    Raises:
        InputError: a soil with K0 comes later.
    """
    for number, stage in enumerate(stages):
        late = next((soil for soil in stage.fill if soil in k0), None)
        if late is not None and (number > 0 or not has_beginning):
            raise mpm.InputError(
                f"{path}: soils.{late}: {KEY} is {k0[late]!r}, but the stage {stage.name!r} places this soil, expected none: only soil that is "
                "there from the beginning has it"
            )
    if not (stages and has_beginning):
        return list(stages)
    return [replace(stages[0], k0={soil: k0[soil] for soil in stages[0].fill if soil in k0}), *stages[1:]]


def begin_at_rest(site: Site, fem: bridge.QuasiStatic) -> None:
    """Bring elements to equilibrium with all soils of a site at once, those with K0 at rest. Collective.

    Args:
        site: with K0; its members are there where it has no stages.
        fem: its elements, new.

    Raises:
        StageError: there is no equilibrium.
    """
    members = {} if site.stages else site.members
    stage = bridge.Stage("all at once", site.soils, unit_weight=site.unit_weight, k0=site.k0, install=members)
    bridge.FemSite(fem).carry_out(stage)


def say_left_out(soils: Mapping[str, Any], where: str) -> None:
    """Warn of the K0 of some soils in what begins without stresses; nothing without any.

    Args:
        soils: by name.
        where: what it is, for the message.
    """
    if soils:
        say(f"{where}: {KEY} of {', '.join(map(repr, soils))} is left out, since stresses begin at zero here; the load or the strength at failure "
            "hardly depends on it")  # fmt: skip
