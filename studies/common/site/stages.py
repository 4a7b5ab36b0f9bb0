"""The stages of a site from the rows of its file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import fenics_bridge as bridge
import mpm_core as mpm

from ..checks import say
from .doubts import warn_of_depth, warn_of_dry_level, warn_of_slanting_water
from .keys import require_push
from .laws import is_number
from .names import names_at, require_soils
from .supports import support_of

if TYPE_CHECKING:
    from .file import Site


def stage_of(given: Mapping[str, Any], number: int, site: Site, laws: Mapping[str, Any], path: Path) -> bridge.Stage:
    """A stage from its row of a site's file. Collective.

    Args:
        given: the row.
        number: of the stage, from 0 on.
        site: with its soils, mesh, supports and members.
        laws: those that stages may name, by name.
        path: of the site's file, for messages.

    Raises:
        InputError: a value that is not possible, or a soil, law or member that the site does not have.
    """
    where = f"{path}: stages[{number}]"
    for key in ("law", "unit_weight"):
        if not isinstance(given.get(key, {}), dict):
            raise mpm.InputError(f"{where}: {key} is {given[key]!r}, expected a table such as {key} = {{name = value}}")
    for name, pressure in given.get("pressure", {}).items():
        if is_number(pressure):  # others are named with the stages
            require_push(pressure, f"{where}: pressure of {name!r}")
    reset = given.get("reset_displacement", False)
    if not isinstance(reset, bool):
        raise mpm.InputError(f"{where}: reset_displacement is {reset!r}, expected true or false")
    fill, excavate = (names_at(given, key, where, "soils") for key in ("fill", "excavate"))
    by_soil = {
        "fill": fill,
        "excavate": excavate,
        "law": given.get("law", {}),
        "unit_weight": given.get("unit_weight", {}),
    }
    for key, soils in by_soil.items():
        require_soils(soils, site.unit_weight, f"{where}: {key}")
    install, remove = (_member_names(given, key, site, where) for key in ("install", "remove"))
    for soil, law in given.get("law", {}).items():
        if law not in laws:
            raise mpm.InputError(
                f"{where}: law of {soil!r} is {law!r}, expected one of [laws]: {', '.join(laws) or 'there is none'}"
            )
    return bridge.Stage(
        str(given.get("name", f"stage {number + 1}")),
        fill=fill,
        excavate=excavate,
        law={soil: laws[law] for soil, law in given.get("law", {}).items()},
        unit_weight={**{soil: site.unit_weight[soil] for soil in fill}, **given.get("unit_weight", {})},
        pressure=given.get("pressure", {}),
        support=[support_of(name, kind, f"{where}.support.{name}", site.domain, site.facet_tags)
                 for name, kind in given.get("support", {}).items()],
        release=names_at(given, "release", where, "boundaries"),
        pore_pressure=_water(given["water_level"], where, site) if "water_level" in given else None,
        reset_displacement=reset,
        install={name: site.members[name] for name in install},
        remove=remove,
        deconfinement=given.get("deconfinement", 1.0),
    )  # fmt: skip


def warn_of_held(stages: Sequence[bridge.Stage], path: Path) -> None:
    """Warn of a last stage that does not release all of its out-of-balance forces; path: of the site's file."""
    last = stages[-1].deconfinement if stages else 1.0
    if is_number(last) and 0 < last < 1:
        say(f"{path}: the last stage, {stages[-1].name!r}, has deconfinement = {last:g}, so that forces which nothing built bears hold {1 - last:.0%} of "
            "what it changes to the end; a stage after it releases them, such as one that installs the lining")  # fmt: skip


def _member_names(given: Mapping[str, Any], key: str, site: Site, where: str) -> list[str]:
    """Names of structural members that a stage installs or removes."""
    names = names_at(given, key, where, "members")
    for name in names:
        if name not in site.members:
            known = ", ".join(site.members) or "there is none"
            raise mpm.InputError(f"{where}: {name!r} is not among the tables [members.NAME]: {known}")
    return names


def _water(level: Any, where: str, site: Site) -> Any:
    """Pore pressures below a water level: a number, or points (x, level) of its surface. Collective."""
    points = level if isinstance(level, list) else [[0.0, level]]
    good = points and all(
        isinstance(point, list) and len(point) == 2 and all(map(is_number, point)) for point in points
    )
    if not good or any(after[0] < before[0] for before, after in zip(points, points[1:])):
        raise mpm.InputError(
            f"{where}: water_level is {level!r}, expected a number [m] or points [x, level] with x rising"
        )
    where = f"{where}: water_level"
    heights = [height for _, height in points]
    warn_of_depth(site.domain, heights, where)
    warn_of_dry_level(site.domain, heights, where)
    if len(points) > 1 and site.dimension == 2:
        warn_of_slanting_water(site.domain, site.cell_tags, site.soils, np.array(points, dtype=float), where)
    return bridge.hydrostatic(np.array(level, dtype=float))
