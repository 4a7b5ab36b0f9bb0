"""The keys of site files, which all studies share: each study takes what it needs, and a key that no study knows is a mistake."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from inspect import signature
from pathlib import Path
from typing import Any

import mpm_core as mpm
from fenics_bridge import water

from ..parameters import unknown_key
from .k0 import KEY as K0
from .laws import OVERCONSOLIDATION, give_way, is_number, law_keys, leave_out_idle, located
from .tables import MOST_FILES, merged, parsed

DAY = 86400.0
MM_PER_DAY = 1e-3 / DAY
KEYS = {
    "extends": "the file of another site, of which this one changes or adds keys",
    "mesh": "a .geo or .msh file beside the site's",
    "cell_size": "a size of cells [m]",
    "constants": "values of other constants of the .geo file",
    "axisymmetric": "true for a half section about the axis x = 0",
    "dimension": "3 for a body of tetrahedra, whose z axis points up; 2, by default, for a section",
    "air": "names of groups of the mesh that hold no soil",
    "soils": "tables [soils.NAME] for the physical groups of the mesh",
    "laws": "tables [laws.NAME] that stages name",
    "classes": "the number of steps of a parameter that grows with depth",
    "supports": "fixed or roller by boundary",
    "boundaries": "tables [boundaries.NAME] of what the water does there",
    "pressures": "loads by boundary [Pa]",
    "points": "places [x, y] whose settlements are followed",
    "members": "tables [members.NAME] of bars, struts and beams that stages install",
    "stages": "tables [[stages]] of what is placed and dug away",
}
"""What stands at the top of a site's file, and what it is"""
INTERFACE = "interface_strength"
"""Key of a beam: the strength of friction and adhesion between it and the soil, over the strength of the soil"""
CURVES = {"van_genuchten": water.VanGenuchten, "gardner": water.Gardner, "free_surface": water.FreeSurface,
          "tabulated": water.Tabulated}  # fmt: skip
FLOW = ("conductivity", "dip", "porosity", "compressibility", *CURVES)
"""Keys of a soil that describe the flow of its water"""
UNDRAINED = ("undrained", "water_modulus", "porosity")
"""Keys of a law whose water does not drain; where a study computes the water, laws are of effective stresses"""
CONDITIONS: dict[str, tuple[Callable, float]] = {
    "head": (water.Head, 1.0),
    "reservoir": (water.Reservoir, 1.0),
    "flux": (water.Flux, 1.0),
    "rain": (water.Rain, MM_PER_DAY),
}
"""Boundary condition by its key, and what one of its units is in SI"""
WATER = (*CONDITIONS, "seepage_face")
"""Keys of a boundary"""
MEMBERS: dict[str, Callable] = {"bar": mpm.bar, "strut": mpm.strut, "beam": mpm.beam}
"""Function that makes a structural member of each kind"""
STAGE_KEYS = (
    "name", "day", "duration", "fill", "excavate", "boundaries", "law", "unit_weight", "pressure", "support", "release",
    "water_level", "steady_flow", "reset_displacement", "install", "remove", "deconfinement",
)  # fmt: skip
CHANGES = ("excavate", "law", "unit_weight", "pressure", "support", "release", "install", "remove", "deconfinement")
"""What a stage may change beside soils that it places"""
STAGE_WATER = ("water_level", "steady_flow")
"""Keys of a stage that give it pore pressures"""
SYMBOLS = {
    "gsi": "geological_strength_index",
    **dict.fromkeys(("m_i", "mi"), "intact_constant"),
    **dict.fromkeys(("sigma_ci", "sigma_c", "ucs"), "intact_strength"),
    "d": "disturbance_factor",
    **dict.fromkeys(("relaxation", "relaxation_factor"), "deconfinement"),
}
"""Keys by the symbols and other words of the literature, which messages of unknown keys know"""


def read_site_table(path: Path, needed: Sequence[str] = ()) -> dict[str, Any]:
    """The file of a site as a table, all of whose keys are known.

    Args:
        path: of the TOML file.
        needed: keys that it must have besides mesh and soils.

    Raises:
        InputError: it cannot be read, is not TOML, has a key that no study knows or lacks one that is needed.
    """
    files: list[dict[str, Any]] = []
    table = _extended(path, files)
    for key in ("soils", "laws"):
        for name, law in table.get(key, {}).items():
            leave_out_idle(law, [file.get(key, {}).get(name, {}) for file in files])
    for key in ("mesh", "soils", *needed):
        if key not in table:
            raise mpm.InputError(f"{path} has no {key!r}, which this study needs: {KEYS[key]}")
    size = table.get("cell_size", 1.0)
    if not (is_number(size) and size > 0):
        raise mpm.InputError(f"{path}: cell_size is {size!r}, expected a number above 0 [m]")
    for name, given in _table_at(table, "members", str(path)).items():
        _require_member(given, f"{path}: members.{name}")
    stages = table.get("stages", [])
    if isinstance(stages, dict):  # a single one
        stages = table["stages"] = [stages]
    if not isinstance(stages, list):
        raise mpm.InputError(f"{path}: stages is {stages!r}, expected tables [[stages]]")
    for k, stage in enumerate(stages):
        _require_known(stage, STAGE_KEYS, f"{path}: stages[{k}]")
        for name, given in _table_at(stage, "boundaries", f"{path}: stages[{k}]").items():
            _require_known(given, WATER, f"{path}: stages[{k}].boundaries.{name}")
    return table


def _extended(path: Path, files: list[dict[str, Any]]) -> dict[str, Any]:
    """The file of a site as a table, over those that it extends; files: tables of those that extend it, to which its own is added."""
    table = parsed(path)
    files.append(table)
    _require_known(table, KEYS, str(path))
    for key, known in (
        ("soils", (*FLOW, "unit_weight", K0, OVERCONSOLIDATION, *law_keys())),
        ("laws", (OVERCONSOLIDATION, *law_keys())),
        ("boundaries", WATER),
    ):
        for name, given in _table_at(table, key, str(path)).items():
            _require_known(given, known, f"{path}: {key}.{name}")
    if "extends" not in table:
        return table
    base = table.pop("extends")
    if not isinstance(base, str):
        raise mpm.InputError(f"{path}: extends is {base!r}, expected the file of a site")
    if len(files) == MOST_FILES:
        raise mpm.InputError(
            f"{path}: extends is {base!r}, expected at most {MOST_FILES} files that extend one another"
        )
    below, folder = _extended(path.parent / base, files), (path.parent / base).parent
    if "mesh" in below:
        below["mesh"] = str(folder.resolve() / str(below["mesh"]))
    for key in ("soils", "laws"):
        below[key] = {name: located(law, folder.resolve()) for name, law in below.get(key, {}).items()}
        for name in below[key]:
            give_way(below[key][name], table.get(key, {}).get(name, {}))
    return merged(below, table)


def _table_at(table: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    found = table.get(key, {})
    if not isinstance(found, dict):
        raise mpm.InputError(f"{where}: {key} is {found!r}, expected tables by name")
    return found


def _require_known(given: Any, known: Collection[str], where: str) -> None:
    """Require that all keys of a table are known; dashes in them become underscores."""
    if not isinstance(given, dict):
        raise mpm.InputError(f"{where} is {given!r}, expected a table of keys and values")
    for key in list(given):
        given[key.replace("-", "_")] = given.pop(key)
    for key in given:
        if key not in known:
            meant = SYMBOLS.get(key.lower())
            problem = f"unknown key '{key}'; did you mean {meant}?" if meant in known else unknown_key(key, known)
            raise mpm.InputError(f"{where}: {problem}")


def _require_member(given: Any, where: str) -> None:
    """Require that the keys of a structural member are those of its kind."""
    kind = given.get("kind") if isinstance(given, dict) else None
    if not isinstance(kind, str) or kind not in MEMBERS:
        raise mpm.InputError(f"{where}: kind is {kind!r}, expected one of {', '.join(map(repr, MEMBERS))}")
    arguments = {
        name: one for name, one in signature(MEMBERS[kind]).parameters.items() if name not in ("start", "end", "points")
    }
    _require_known(given, ("kind", "points", *arguments, *([INTERFACE] if kind == "beam" else [])), where)
    missing = [name for name, one in arguments.items() if one.default is one.empty and name not in given]
    if missing:
        raise mpm.InputError(f"{where} has no {' and no '.join(missing)}, expected the {kind}'s own (docs/members.md)")


def member_of(given: Mapping[str, Any], where: str) -> mpm.Member:
    """The structural member that the table of a site describes; where: it stands, for messages.

    Raises:
        InputError: a value is missing or out of range.
    """
    arguments = {key: value for key, value in given.items() if key not in ("kind", INTERFACE)}
    if "points" not in arguments:
        raise mpm.InputError(f"{where} has no points, expected those of its line, such as [[0, 0], [0, -5]]")
    try:
        if given["kind"] != "strut":
            return MEMBERS[given["kind"]](**arguments)
        ends = arguments.pop("points")
        if not isinstance(ends, list) or len(ends) != 2:
            raise mpm.InputError(f"points is {ends!r}, expected the two ends of a strut")
        return mpm.strut(*ends, **arguments)
    except mpm.InputError as error:
        raise mpm.InputError(f"{where}: {error}") from None


def require_push(pressure: float, where: str) -> None:
    """Raise InputError for a pressure on the ground [Pa] below 0; where: it stands, for the message."""
    if pressure < 0:
        raise mpm.InputError(
            f"{where} is {pressure:g} Pa, expected at least 0: a pressure pushes on the ground, and one below 0 would pull at it; "
            "to unload the ground, let a pressure fall with time, or let a stage dig soil away"
        )


def part_of(table: Mapping[str, Any], keys: Collection[str]) -> dict[str, Any]:
    """The entries of a table that have one of some keys."""
    return {key: value for key, value in table.items() if key in keys}


def changes_of(stages: Iterable[Mapping[str, Any]], keys: Sequence[str]) -> str:
    """The changes by some keys that stages make, in words: "excavate of 'cut', release of 'cut'"; empty without any."""
    named = [(stage.get("name", f"stage {k}"), stage) for k, stage in enumerate(stages, 1)]
    given = [(key, name) for name, stage in named for key in keys if stage.get(key) not in (None, "", [], {})]
    return ", ".join(f"{key} of {name!r}" for key, name in given)
