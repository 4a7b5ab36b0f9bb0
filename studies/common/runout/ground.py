"""Strength of the ground under a run-out: friction, adhesion, pore pressure and turbulent resistance, also by maps."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path

import numpy as np
from mpm_core.input_warnings import in_radians

import mpm_core as mpm
from fenics_bridge.terrain import Raster, read_raster
from fenics_bridge.terrain.raster import TIFF
from fenics_bridge.terrain.slide import require_cover

from ..checks import check_effect, check_file, say
from ..options import add_number
from ..slope.case import GRAVITY


def add_ground_options(parser: ArgumentParser) -> None:
    """Friction, adhesion, pore pressure and turbulent resistance between the slide and the ground."""
    p = parser.add_argument_group("ground under the slide")
    add_number(
        p, "--ground-friction-angle", 15.0, "degrees", "friction angle between slide and ground", at_least=0, below=90
    )
    p.add_argument("--friction-map", type=Path, default=None, metavar="FILE",
                   help="raster of friction angles between slide and ground [degrees], in place of --ground-friction-angle")  # fmt: skip
    add_number(
        p, "--ground-adhesion", 0.0, "Pa", "shear strength between slide and ground without pressure", at_least=0
    )
    add_number(p, "--pore-pressure-ratio", 0.0, "-", "pore pressure over total normal stress between slide and ground, which reduces "
               "its friction", at_least=0, below=1)  # fmt: skip
    add_number(p, "--turbulence", None, "m/s2", "coefficient of Voellmy's turbulent resistance of the ground, some 100 to 2000, the smaller "
               "the stronger (default: no such resistance)", above=0)  # fmt: skip
    p.add_argument("--turbulence-map", type=Path, default=None, metavar="FILE",
                   help="raster of these coefficients [m/s2], in place of --turbulence")  # fmt: skip


def check_ground(p: ArgumentParser, a: Namespace) -> None:
    """End with an error where options of the ground do not fit together."""
    check_file(p, a.friction_map, "--friction-map")
    check_file(p, a.turbulence_map, "--turbulence-map")
    check_effect(p, a, a.friction_map is None, ("--ground-friction-angle",), "no --friction-map")
    check_effect(p, a, a.turbulence_map is None, ("--turbulence",), "no --turbulence-map")
    say(in_radians("--ground-friction-angle", a.ground_friction_angle))


def ground_strength(a: Namespace, ground: Raster) -> dict[str, float | Raster]:
    """Friction [-], adhesion [Pa] and drag [-] of the ground, see `fenics_bridge.terrain.seed_slide`.

    Pore pressures of the ratio r_u leave the friction (1 - r_u) tan(phi), and the drag is g / xi.

    Raises:
        InputError: a map that cannot be read, or whose values are out of range.
    """
    friction: float | Raster = (1 - a.pore_pressure_ratio) * float(np.tan(np.radians(a.ground_friction_angle)))
    drag: float | Raster = 0.0 if a.turbulence is None else GRAVITY / a.turbulence
    if a.friction_map is not None:
        angles = read_map("--friction-map", a.friction_map, ground)
        low, high = angles.values.min(), angles.values.max()
        if low < 0 or high >= 90:
            raise mpm.InputError(
                f"--friction-map has values of {low:g} to {high:g}, expected angles from 0 to below 90 degrees"
            )
        say(f"--friction-map has values up to {high:g} only, which are angles in degrees" if 0 < high <= 1.5 else "")
        friction = _mapped(angles, (1 - a.pore_pressure_ratio) * np.tan(np.radians(angles.values)))
    if a.turbulence_map is not None:
        turbulence = read_map("--turbulence-map", a.turbulence_map, ground)
        if turbulence.values.min() <= 0:
            raise mpm.InputError(
                f"--turbulence-map has values from {turbulence.values.min():g} on, expected some above 0 m/s2"
            )
        drag = _mapped(turbulence, GRAVITY / turbulence.values)
        doubt_turbulence("--turbulence-map has values from", float(turbulence.values.min()))
    elif a.turbulence is not None:
        doubt_turbulence("--turbulence is", a.turbulence)
    return {"friction": friction, "adhesion": a.ground_adhesion, "drag": drag}


def doubt_turbulence(given: str, turbulence: float) -> None:
    """Warn of a coefficient of turbulent resistance [m/s2] that is probably g / xi."""
    say(f"{given} {turbulence:g} m/s2, expected Voellmy's coefficient xi, some 100 to 2000 m/s2: the slide hardly moves"
        if turbulence < GRAVITY else "")  # fmt: skip


def read_map(name: str, path: Path, ground: Raster) -> Raster:
    """A raster in the coordinate reference of the ground, which it takes where the file names none.

    Args:
        name: of its option.

    Raises:
        InputError: it cannot be read, or does not cover the ground.
    """
    names_its_own = path.with_suffix(".prj").is_file() or path.suffix.lower() in TIFF
    try:
        raster = read_raster(path, crs=None if names_its_own else ground.crs)
        require_cover(str(path), raster, ground)
        return raster
    except mpm.InputError as error:
        raise mpm.InputError(f"{name}: {error}") from None


def _mapped(raster: Raster, values: np.ndarray) -> Raster:
    return Raster(raster.x, raster.y, values, raster.crs)
