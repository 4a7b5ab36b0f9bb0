"""The laws that studies can choose from on the command line, and the options of those beyond Mohr-Coulomb."""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import mpm_core as mpm

from .checks import check_effect, say
from .options import add_choice, add_code, add_number, add_switch
from .parameters import did_you_mean
from .site.law_doubts import DOUBTS

MATERIALS = (
    "mohr-coulomb",
    "viscoplastic",
    "softening",
    "tresca",
    "von-mises",
    "drucker-prager",
    "hardening-soil",
    "cam-clay",
    "nor-sand",
    "sanisand",
    "hoek-brown",
    "elastic",
)
TOYOURA = {
    "rigidity": 125.0, "poisson": 0.05, "critical_slope": 1.25, "extension_ratio": 0.712, "critical_void_ratio": 0.934,
    "critical_compression": 0.019, "critical_exponent": 0.7, "hardening": 7.05, "hardening_void_ratio": 0.968,
    "bounding_exponent": 1.1, "dilatancy": 0.704, "dilatancy_exponent": 3.5, "fabric_limit": 4.0, "fabric_rate": 600.0,
    "void_ratio": 0.8, "largest_pressure": 200e3, "attraction": 1e3,
}  # fmt: skip
"""SANISAND of Toyoura sand (Dafalias & Manzari 2004, table 1), and where it begins unless said otherwise"""


FRICTIONAL = ("mohr-coulomb", "viscoplastic", "softening", "drucker-prager", "hardening-soil")
ONLY_WITH = {
    ("--viscosity",): ("viscoplastic",),
    ("--residual-cohesion", "--residual-friction-angle", "--softening-strain", "--reference-length"): ("softening",),
    ("--compression-slope", "--swelling-slope", "--preconsolidation", "--creep", "--reference-time"): ("cam-clay",),
    ("--critical-slope", "--void-ratio", "--attraction"): ("cam-clay", "nor-sand"),
    ("--critical-void-ratio", "--critical-compression", "--dilatancy", "--hardening", "--rigidity", "--image-pressure",
     "--coupling"): ("nor-sand",),
    ("--sanisand",): ("sanisand",),
    ("--secant-modulus", "--oedometer-modulus", "--unloading-modulus", "--unloading-poisson", "--stiffness-exponent",
     "--normal-k0", "--failure-ratio", "--vertical-preconsolidation", "--reference-pressure", "--small-strain-modulus",
     "--threshold-strain"): ("hardening-soil",),
    ("--intact-strength", "--geological-strength-index", "--intact-constant", "--disturbance-factor",
     "--dilation-ratio"): ("hoek-brown",),
    ("--friction-angle", "--dilation-angle"): FRICTIONAL,
    ("--tension-cutoff",): (*FRICTIONAL, "hoek-brown"),
    ("--cohesion",): (*FRICTIONAL, "tresca", "von-mises"),
    ("--young",): tuple(name for name in MATERIALS if name not in ("cam-clay", "nor-sand", "sanisand", "hardening-soil")),
    ("--poisson",): tuple(name for name in MATERIALS if name not in ("sanisand", "hardening-soil")),
}  # fmt: skip
"""Options that only some laws have"""


def add_law_options(
    parser: argparse.ArgumentParser,
    material: str | None = MATERIALS[0],
    about: str = "",
    viscosity: float | None = 1e3,
    viscosity_about: str = "",
) -> None:
    """The law of the soil and what the laws need beyond elasticity, cohesion, friction and dilation.

    Args:
        material, viscosity [Pa s]: by default; None where they depend on other options, and ``about`` and ``viscosity_about``
            say how.
    """
    p = parser.add_argument_group("law of the soil")
    add_choice(p, "--material", material, MATERIALS,
               "law of the soil; Tresca and von Mises: the cohesion is the shear strength" + about)  # fmt: skip
    add_parameter(p, mpm.MohrCoulomb, "tension_cutoff", None)
    add_parameter(p, mpm.ViscoplasticMohrCoulomb, "viscosity", viscosity, f"viscoplastic{viscosity_about}: ")
    for name, default in [("residual_cohesion", 200.0), ("residual_friction_angle", 15.0), ("softening_strain", 0.3),
                          ("reference_length", 0.1)]:  # fmt: skip
        add_parameter(p, mpm.SofteningMohrCoulomb, name, default, "softening: ")
    for name, default, option in [("compression", 0.1, "--compression-slope"), ("swelling", 0.02, "--swelling-slope"),
                                  ("critical_slope", 1.0, None), ("void_ratio", 1.0, None),
                                  ("preconsolidation", 20e3, None), ("attraction", 1e3, None), ("creep", 0.0, None),
                                  ("reference_time", 86400.0, None)]:  # fmt: skip
        shared = name in ("critical_slope", "void_ratio", "attraction")
        add_parameter(p, mpm.CamClay, name, default, "Cam-Clay and NorSand: " if shared else "Cam-Clay: ", option)
    for name, default in [("critical_void_ratio", 1.0), ("critical_compression", 0.03), ("dilatancy", 4.0), ("hardening", 100.0),
                          ("rigidity", 200.0), ("image_pressure", 20e3), ("coupling", 0.2)]:  # fmt: skip
        add_parameter(p, mpm.NorSand, name, default, "NorSand: ")
    for name, default, option in [("secant_modulus", 30e6, None), ("oedometer_modulus", 30e6, None), ("unloading_modulus", 90e6, None),
                                  ("poisson", 0.2, "--unloading-poisson"), ("exponent", 0.5, "--stiffness-exponent"),
                                  ("normal_k0", 0.0, None), ("failure_ratio", 0.9, None), ("vertical_preconsolidation", 0.0, None),
                                  ("reference_pressure", 100e3, None), ("small_strain_modulus", 0.0, None),
                                  ("threshold_strain", 2e-4, None)]:  # fmt: skip
        add_parameter(p, mpm.HardeningSoil, name, default, "Hardening Soil: ", option)
    for name, default in [("intact_strength", 20e6), ("geological_strength_index", 40.0), ("intact_constant", 8.0),
                          ("disturbance_factor", 0.0), ("dilation_ratio", 0.0)]:  # fmt: skip
        add_parameter(p, mpm.HoekBrown, name, default, "Hoek-Brown: ")
    p.add_argument("--sanisand", nargs="*", default=[], metavar="NAME=VALUE",
                   help="SANISAND: parameters that differ from those of Toyoura sand, such as void_ratio=0.75 dilatancy=0.5; "
                        "docs/api/law_parameters.md has all of them with their units")  # fmt: skip
    add_switch(
        p, "--undrained", False, "undrained soil: a law of effective stresses, and pore water that does not drain"
    )
    for name, default in [("water_modulus", 2e7), ("porosity", 0.4)]:
        add_parameter(p, mpm.Undrained, name, default, "undrained: ")
    add_code(
        p, "--python-law", "FILE:CLASS", "law written in Python, constructed without arguments, instead of --material"
    )
    add_code(p, "--umat", "LIBRARY", "shared library with an Abaqus UMAT, instead of --material")
    p.add_argument("--properties", type=float, nargs="*", default=[], metavar="X", help="PROPS of the UMAT")
    p.add_argument("--strength-properties", nargs="*", default=[], metavar="NUMBER:KIND",
                   help="PROPS of the UMAT that are its strength, for strength reduction: number from 1 and kind (strength, "
                        "friction, dilation) of each, such as 3:strength 4:friction 5:dilation; angles in degrees")  # fmt: skip
    p.add_argument("--variables", type=int, default=0, metavar="N", help="NSTATV of the UMAT (default: 0)")
    add_switch(p, "--finite-strain", False, "Kirchhoff stress in logarithmic strain (Hencky)")


def add_parameter(
    parser: argparse.ArgumentParser,
    law: Any,
    name: str,
    default: float | None,
    about: str = "",
    option: str | None = None,
) -> None:
    """An option for a parameter of a law, with the unit, the meaning and the range that the law declares.

    Args:
        default: None for an option that need not be given.
        about: put before the meaning.
        option: by default the parameter's name.
    """
    declared = next(p for p in law.parameters if p.name == name)
    bounds = {
        "at_least" if declared.lower_included else "above": declared.lower,
        "at_most" if declared.upper_included else "below": declared.upper,
    }
    bounds = {kind: bound for kind, bound in bounds.items() if bound is not None}
    add_number(
        parser, option or "--" + name.replace("_", "-"), default, declared.unit, about + declared.meaning, **bounds
    )


def check_law_options(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """End with an error where the command line names options that the law does not have."""
    own = "--python-law" if options.python_law else "--umat" if options.umat else ""
    if own:
        check_effect(parser, options, False, ("--material", "--viscosity"), f"no {own}")
    for names, materials in () if own else ONLY_WITH.items():
        check_effect(parser, options, options.material in materials, names, f"--material {' or '.join(materials)}")
    umat = ("--properties", "--strength-properties", "--variables")
    check_effect(parser, options, options.umat is not None, umat, "--umat")
    check_effect(
        parser, options, own or options.small_strain_modulus > 0, ("--threshold-strain",), "--small-strain-modulus"
    )
    check_effect(parser, options, own or options.creep > 0, ("--reference-time",), "--creep")
    if options.material in ("hardening-soil", "cam-clay", "hoek-brown") and not own:
        with suppress(mpm.InputError):  # said where the law is made
            for doubt in DOUBTS:
                say(doubt(law_of(options), f"--material {options.material}"))


def given_law(a: argparse.Namespace) -> str:
    """The option that says which law the clay has, and its value."""
    option = next((name for name in ("python_law", "umat") if getattr(a, name)), "material")
    return f"--{option.replace('_', '-')} is {getattr(a, option)}"


def law_of(args: argparse.Namespace) -> Any:
    """The law that the options describe.

    Raises:
        InputError: options that do not fit together, by the law's own parameter names; a law that is not there.
    """
    law = _skeleton(args)
    if args.finite_strain:
        law = mpm.Hencky(law)
    if args.undrained:
        law = mpm.Undrained(law, water_modulus=args.water_modulus, porosity=args.porosity)
    return law


def _python_law(text: str) -> Any:
    """The law of a class in a file, "FILE:CLASS"."""
    file, _, name = text.rpartition(":")
    if not file:
        raise mpm.InputError(f"--python-law is '{text}', expected a file, a colon and a class in it")
    if not Path(file).is_file():
        raise mpm.InputError(f"--python-law is '{text}', but the file {file} does not exist")
    sys.path.insert(0, str(Path(file).parent))  # for what it imports beside it
    spec = importlib.util.spec_from_file_location("law_of_the_user", file)
    if spec is None or spec.loader is None:
        raise mpm.InputError(f"--python-law is '{text}', expected a file of Python, whose name ends in .py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not hasattr(module, name):
        raise mpm.InputError(f"--python-law names the class '{name}', which {file} does not have")
    return mpm.PythonLaw(getattr(module, name)())


KINDS = {"strength": "strength", "friction": "friction angle", "dilation": "dilation angle"}
"""Meanings of a property of a UMAT, and their names in the law"""


def _strength_properties(words: Sequence[str]) -> dict[int, str]:
    """Kinds of properties by their numbers, "3:strength"."""
    named = {}
    for word in words:
        number, _, kind = word.partition(":")
        if not number.isdecimal() or kind not in KINDS:
            raise mpm.InputError(
                f"--strength-properties names '{word}', expected NUMBER:KIND with one of {', '.join(KINDS)}"
            )
        named[int(number)] = KINDS[kind]
    return named


def sanisand_of(words: Sequence[str]) -> mpm.Sanisand:
    """Toyoura sand with the parameters that differ, "void_ratio=0.75".

    Raises:
        InputError: a word that is no name, equals sign and number, a name that the law does not have, or a value out of its range.
    """
    parameters, known = dict(TOYOURA), [p.name for p in mpm.Sanisand.parameters]
    for word in words:
        name, equals, value = word.partition("=")
        try:
            number = float(value)
        except ValueError:
            equals = ""
        if not equals:
            raise mpm.InputError(f"--sanisand has '{word}', expected NAME=VALUE such as void_ratio=0.75")
        if name not in known:
            near = did_you_mean(name, known) or f", expected one of {', '.join(known)}"
            raise mpm.InputError(f"--sanisand has '{name}', which is no parameter of the law{near}")
        parameters[name] = number
    return mpm.Sanisand(**parameters)


def _skeleton(a: argparse.Namespace) -> Any:
    elastic = {"young": a.young, "poisson": a.poisson}
    if a.umat:
        if not Path(a.umat).is_file():
            raise mpm.InputError(f"--umat is '{a.umat}', but the file does not exist")
        modulus = mpm.LinearElastic(**elastic).p_wave_modulus
        return mpm.Umat(
            a.umat,
            properties=a.properties,
            n_variables=a.variables,
            p_wave_modulus=modulus,
            strength_parameters=_strength_properties(a.strength_properties),
        )
    if a.python_law:
        return _python_law(a.python_law)
    strength = {"cohesion": a.cohesion, "friction_angle": a.friction_angle, "dilation_angle": a.dilation_angle}
    strength["tension_cutoff"] = a.tension_cutoff
    match a.material:
        case "elastic":
            return mpm.LinearElastic(**elastic)
        case "tresca":
            return mpm.tresca(**elastic, shear_strength=a.cohesion)
        case "von-mises":
            return mpm.von_mises(**elastic, yield_stress=a.cohesion * 3**0.5)
        case "drucker-prager":
            return mpm.matched_drucker_prager(**elastic, **strength, match=mpm.ConeMatch.PLANE_STRAIN)
        case "cam-clay":
            return mpm.CamClay(
                compression=a.compression_slope, swelling=a.swelling_slope, critical_slope=a.critical_slope, poisson=a.poisson,
                preconsolidation=a.preconsolidation, void_ratio=a.void_ratio, attraction=a.attraction, creep=a.creep,
                reference_time=a.reference_time,
            )  # fmt: skip
        case "nor-sand":
            return mpm.NorSand(
                critical_void_ratio=a.critical_void_ratio, critical_compression=a.critical_compression,
                critical_slope=a.critical_slope, dilatancy=a.dilatancy, hardening=a.hardening, rigidity=a.rigidity,
                poisson=a.poisson, image_pressure=a.image_pressure, void_ratio=a.void_ratio, coupling=a.coupling,
                attraction=a.attraction,
            )  # fmt: skip
        case "hardening-soil":
            return mpm.HardeningSoil(
                **strength, secant_modulus=a.secant_modulus, oedometer_modulus=a.oedometer_modulus,
                unloading_modulus=a.unloading_modulus, poisson=a.unloading_poisson, exponent=a.stiffness_exponent,
                normal_k0=a.normal_k0, failure_ratio=a.failure_ratio,
                vertical_preconsolidation=a.vertical_preconsolidation, reference_pressure=a.reference_pressure,
                small_strain_modulus=a.small_strain_modulus, threshold_strain=a.threshold_strain,
            )  # fmt: skip
        case "hoek-brown":
            return mpm.HoekBrown(
                **elastic, intact_strength=a.intact_strength, geological_strength_index=a.geological_strength_index,
                intact_constant=a.intact_constant, disturbance_factor=a.disturbance_factor,
                dilation_ratio=a.dilation_ratio, tension_cutoff=a.tension_cutoff,
            )  # fmt: skip
        case "sanisand":
            return sanisand_of(a.sanisand)
        case "viscoplastic":
            return mpm.ViscoplasticMohrCoulomb(**elastic, **strength, viscosity=a.viscosity)
        case "softening":
            return mpm.SofteningMohrCoulomb(
                mpm.MohrCoulomb(**elastic, **strength),
                residual_cohesion=a.residual_cohesion,
                residual_friction_angle=min(a.residual_friction_angle, a.friction_angle),
                softening_strain=a.softening_strain,
                reference_length=a.reference_length,
            )
    return mpm.MohrCoulomb(**elastic, **strength)
