"""The laws of the soils of a site: the table of a soil has the parameters of its law, named as the options of the study slope."""

from __future__ import annotations

import argparse
import math
import re
from collections.abc import Collection, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from mpm_core.input_warnings import soft_water

import mpm_core as mpm
from fenics_bridge.fem.strength_ratio import LARGEST_RATIO

from ..options import add_number, study_parser
from ..parameters import ParameterError, checked_values
from ..slope.case import add_soil_options
from ..soils import MATERIALS, ONLY_WITH, add_law_options, law_of

STRENGTHS = ("cohesion", "shear_strength")
"""Parameters of which a law has one; in a site that extends another, one of them takes the place of the other"""
KINDS = ("material", "python_law", "umat")
"""Keys that say which law it is; the last one that a table has does"""
OVERCONSOLIDATION = "overconsolidation"
"""Key of a soil whose law remembers the largest stress that it has carried"""
RATIO, EXPONENT = "strength_ratio", "strength_exponent"
"""Keys of a law without friction whose undrained strength follows the vertical effective stress"""
HISTORY = "vertical_preconsolidation"
"""Key of such a law, and of Hardening Soil, for the largest vertical effective stress before"""
COHESIVE = ("tresca", "mohr-coulomb", "viscoplastic", "softening")
"""Materials that may have a strength ratio"""
OF_UMAT = ("properties", "strength_properties", "variables")


@cache
def _parser() -> argparse.ArgumentParser:
    parser = study_parser(None)
    add_soil_options(parser, dilation_angle=0.0)
    add_law_options(parser)
    add_number(
        parser, "--shear-strength", None, "Pa", "undrained shear strength, for tresca: instead of cohesion", at_least=0
    )
    add_number(parser, "--strength-ratio", None, "-", "undrained strength ratio", above=0, at_most=LARGEST_RATIO)
    add_number(
        parser, "--strength-exponent", 0.8, "-", "exponent of the overconsolidation ratio", at_least=0, at_most=1
    )
    return parser


def law_keys() -> Sequence[str]:
    """Keys of all parameters of laws."""
    places = ("help", "output", "overwrite", "parameters_file", "allow_code")
    return [action.dest for action in _parser()._actions if action.dest not in places]


def law_units() -> dict[str, str]:
    """Units of the parameters of laws by key; "-" of those that have none."""
    return {key: getattr(action, "unit", "-") for action in _parser()._actions if (key := action.dest) in law_keys()}


def unit_weight_of(soil: dict, where: str) -> float:
    """Unit weight [N/m3] in the table of a soil; where: it stands, for messages."""
    if "unit_weight" not in soil:
        raise mpm.InputError(f"{where} has no unit_weight [N/m3]")
    if not is_number(soil["unit_weight"]) or soil["unit_weight"] < 0:
        raise mpm.InputError(f"{where}: unit_weight is {soil['unit_weight']!r}, expected a number from 0 on [N/m3]")
    return float(soil["unit_weight"])


def law_at(table: dict, height: float | None, where: str) -> Any:
    """The law that a table describes, where its parameters that grow with depth have their value at a height [m].

    Args:
        table: parameters of the law.
        height: None for a law without such parameters.
        where: the table stands, for messages.
    """
    if all(name in table for name in STRENGTHS):
        raise mpm.InputError(
            f"{where} has {' and '.join(STRENGTHS)}, expected one of them: the latter stands for the former"
        )
    values = vars(_parser().parse_args([]))
    place = "" if height is None else f", at a height of {height:.4g} m"
    try:
        here = {key: _at_height(key, value, height) for key, value in table.items()}
        values |= checked_values(where, here, _parser()._actions)
    except (ParameterError, ValueError) as error:
        raise mpm.InputError(f"{error}{place}" if isinstance(error, ParameterError) else f"{where}: {error}") from None
    if values["shear_strength"] is not None:
        values["cohesion"] = values["shear_strength"]
    if has_ratio(table):
        if table.get("friction_angle", 0) != 0:
            raise mpm.InputError(
                f"{where} has {RATIO} and friction_angle = {table['friction_angle']}, expected one of them"
            )
        values["friction_angle"] = values["dilation_angle"] = 0.0
    try:
        return law_of(argparse.Namespace(**values))
    except mpm.InputError as error:
        raise mpm.InputError(f"{where}: {_in_keys(str(error), table)}{place}") from None


def _in_keys(text: str, table: Mapping[str, Any]) -> str:
    """A message of the law in a table, with the keys of the table in the place of the law's parameters."""
    others = OPTION_OF if _kind_of(table) == "cam-clay" else {}
    return re.sub(r"\b(compression|swelling)\b", lambda found: others.get(found.group(), found.group()), text)


def _kind_of(table: Mapping[str, Any]) -> str:
    """A material, or the key of a law of one's own."""
    own = next((key for key in KINDS[:0:-1] if key in table), "")
    return own or table.get("material", MATERIALS[0])


def has_ratio(table: Mapping[str, Any]) -> bool:
    """Whether the undrained strength of the law in a table follows the vertical effective stress."""
    return RATIO in table and _kind_of(table) in COHESIVE


def without_effect(table: Mapping[str, Any]) -> list[str]:
    """Keys in the table of a law that have no effect on it."""
    kind = _kind_of(table)
    options = [option for options, materials in ONLY_WITH.items() if kind not in materials for option in options]
    idle = {option.strip("-").replace("-", "_") for option in options}
    idle |= set(STRENGTHS) if "cohesion" in idle else set()
    idle = idle - {"young", "poisson"} if kind == "umat" else idle | set(OF_UMAT)
    idle |= set(KINDS) - {kind} if kind in KINDS else set()
    idle |= set() if table.get("undrained", False) else {"water_modulus"}
    idle |= set() if table.get("small_strain_modulus") else {"threshold_strain"}
    idle = idle - {HISTORY} if has_ratio(table) else idle | {RATIO, EXPONENT}
    idle |= set() if kind in ("hardening-soil", "cam-clay") or has_ratio(table) else {OVERCONSOLIDATION}
    idle |= {"preconsolidation"} if OVERCONSOLIDATION in table else set()
    idle |= set() if table.get("creep") else {"reference_time"}
    return [key for key in table if key in idle]


def idle_doubt(table: Mapping[str, Any], where: str) -> str:
    """A warning of keys in the table of a law that have no effect on it; empty where there is none.

    Args:
        table: parameters of the law.
        where: it stands in the file.
    """
    keys = without_effect(table)
    if not keys:
        return ""
    drained = "" if table.get("undrained", False) else " that is not undrained" if "water_modulus" in keys else ""
    return f"{where}: {' and '.join(keys)} {'has' if len(keys) == 1 else 'have'} no effect with the law {_kind_of(table)}{drained}"


NEEDED_BY: Mapping[str, Sequence[Any]] = {
    "mohr-coulomb": (mpm.MohrCoulomb,),
    "drucker-prager": (mpm.MohrCoulomb,),
    "viscoplastic": (mpm.ViscoplasticMohrCoulomb,),
    "softening": (mpm.MohrCoulomb, mpm.SofteningMohrCoulomb),
    "hardening-soil": (mpm.HardeningSoil,),
    "cam-clay": (mpm.CamClay,),
    "nor-sand": (mpm.NorSand,),
    "hoek-brown": (mpm.HoekBrown,),
    "elastic": (mpm.LinearElastic,),
}
"""Laws whose parameters without a default a material needs; those of `tresca` and `von-mises` are stiffness and strength"""
OPTION_OF = {"compression": "compression_slope", "swelling": "swelling_slope"}
"""Keys of parameters of Cam-Clay that have another name in studies"""


def needed_keys(material: str) -> list[str]:
    """Keys of the parameters that a material needs: those without a default in its law; none for laws of one's own."""
    if material in ("tresca", "von-mises"):
        return ["young", "poisson", "cohesion"]
    declared = [parameter for law in NEEDED_BY.get(material, ()) for parameter in law.parameters]
    return [OPTION_OF.get(p.name, p.name) for p in declared if p.needed and p.unit is not None]


def left_out_doubt(table: Mapping[str, Any], where: str) -> str:
    """A warning of parameters that a law needs and its table does not have, with the values that are taken; empty where there is none.

    Args:
        table: parameters of the law.
        where: it stands in the file.
    """
    given = {"cohesion" if key in STRENGTHS else key for key in table}
    given |= {"friction_angle", "residual_friction_angle"} if has_ratio(table) else set()
    given |= {"preconsolidation"} if OVERCONSOLIDATION in table else set()
    missing = [key for key in needed_keys(_kind_of(table)) if key not in given]
    if not missing:
        return ""
    values, units = vars(_parser().parse_args([])), law_units()
    taken = [f"{key} = {values[key]:g}{'' if units[key] == '-' else ' ' + units[key]}" for key in missing]
    return f"{where} leaves out what its law {_kind_of(table)} needs: {', '.join(taken)} {'is' if len(missing) == 1 else 'are'} taken"


def give_way(below: dict, above: Mapping[str, Any]) -> None:
    """Take out of the table of a law what one that extends it replaces: the other strength, and the other kind of law.

    Args:
        below: table of the site that is extended; it is changed.
        above: table of the site that extends it.
    """
    for kinds in (STRENGTHS, KINDS):
        if any(key in above for key in kinds):
            for key in set(kinds) - set(above):
                below.pop(key, None)


def leave_out_idle(table: dict, files: Sequence[Mapping[str, Any]]) -> None:
    """Take out of the table of a law what has no effect on it, and comes from below the file that names the law.

    Args:
        table: of the law, of all files together; it is changed.
        files: the tables of the files that extend one another, the last one extended by all.
    """
    names_it = (number for number, given in enumerate(files, 1) if any(key in given for key in KINDS))
    own = {key for given in files[: next(names_it, len(files))] for key in given}
    for key in without_effect(table):
        if key not in own:
            del table[key]


def located(table: dict, folder: Path) -> dict:
    """The table of a law whose files are in the folder of the site's."""
    files = {key: str(folder / str(table[key])) for key in ("umat", "python_law") if key in table}
    return table | files


def _at_height(name: str, value: Any, height: float | None) -> Any:
    """A parameter as it is, or its value at a height: value + per_metre * (top - height)."""
    if not isinstance(value, dict):
        return value
    if height is None:
        raise ValueError(f"{name} is {value}, expected one value: only parameters of [soils] grow with depth")
    if not is_profile(value):
        raise ValueError(
            f"{name} is {value}, expected {{value = , per_metre = , top = }}: it grows with depth below top [m]"
        )
    return float(value["value"] + value["per_metre"] * max(value["top"] - height, 0.0))


def is_profile(value: dict) -> bool:
    """Whether a table says how a parameter grows with depth."""
    return set(value) == {"value", "per_metre", "top"} and all(map(is_number, value.values()))


MODULI = ("young", "secant_modulus", "oedometer_modulus", "unloading_modulus", "small_strain_modulus")
STRESSES = ("preconsolidation", HISTORY, "reference_pressure")
LEAST = dict.fromkeys(MODULI, 1e5) | dict.fromkeys(STRENGTHS, 50.0) | dict.fromkeys(STRESSES, 1e3)
"""Parameters [Pa] below which a soil of a site is probably given in kPa or MPa"""


def unit_doubt(parameters: Mapping[str, Any], where: str, heights: Collection[float] = ()) -> str:
    """A warning of stiffness, of soil or water, or strength in another unit than Pa; empty where there is no doubt, as for films that keep their volume.

    Args:
        parameters: of a law; where: they stand in the file.
        heights: of the soil [m], where a parameter grows with depth; its largest value counts.
    """
    for name, least in LEAST.items():
        value, most = parameters.get(name), ""
        if isinstance(value, dict) and heights:
            value, most = max(_at_height(name, value, height) for height in heights), " at most"
        fluid = name == "young" and is_number(parameters.get("poisson")) and parameters["poisson"] > 0.49
        if is_number(value) and 0 < value < least and not fluid:
            return f"{where}: {name} is {value:g} Pa{most}, which hardly any soil has: stresses and moduli are in Pa, such as 10e3 for 10 kPa"
    modulus = parameters.get("water_modulus")
    return soft_water(f"{where}: water_modulus", modulus) if is_number(modulus) and modulus > 0 else ""


def numbers_of(table: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    """The numbers of a table with some keys."""
    return {key: table[key] for key in keys if is_number(table.get(key))}


def is_number(value: Any) -> bool:
    """Whether a value of a site's file is a finite number."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
