"""Warnings of values of a site that are possible but probably mistakes: water far above the ground, conductivities in other units."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from mpm_core.input_warnings import fast_flow

from fenics_bridge import water

from .checks import say

DEEPEST = 3.0
"""Depth of water over the top of a mesh, over the height of the mesh, above which a level is probably a mistake"""

LOOSEST = 1e-5
"""Compressibility [1/Pa] above which it is probably in other units, or a modulus"""


def ends_of_height(domain: Any) -> tuple[float, float]:
    """Height of the lowest and of the highest point of a mesh [m]. Collective."""
    height = domain.geometry.x[:, domain.geometry.dim - 1]
    low, high = zip(*domain.comm.allgather((height.min(initial=np.inf), height.max(initial=-np.inf))))
    return float(min(low)), float(max(high))


def warn_of_depth(domain: Any, levels: Iterable[float], where: str) -> None:
    """Warn of the highest of some levels of water [m] if it is far above a mesh; where: it stands in the file. Collective."""
    (low, high), level = ends_of_height(domain), max(levels)
    if level - high > DEEPEST * (high - low):
        say(f"{where} is {level:g} m, {level - high:.3g} m above the top of the mesh, which is {high - low:.3g} m high: levels are elevations "
            "in m, not depths or pressures")  # fmt: skip


def warn_of_reservoirs(domain: Any, boundary: Iterable[Any], path: Any) -> None:
    """Warn of reservoirs of the file at a path that are far above a mesh. Collective."""
    for condition in boundary:
        if isinstance(condition, water.Reservoir):
            given = np.asarray(condition.level, dtype=float)
            levels = given[:, 1] if given.ndim else given[None]
            warn_of_depth(domain, levels.tolist(), f"{path}: the reservoir of {condition.facet_tag!r}")


def warn_of_flow(soil: water.PorousSoil, where: str) -> None:
    """Warn of a conductivity or compressibility that is probably in other units; where: the soil stands in the file."""
    largest = np.linalg.eigvalsh(soil.tensor(soil.conductivity, 2)).max()
    say(fast_flow(f"{where}: conductivity", float(largest)))
    if soil.compressibility > LOOSEST:
        say(f"{where}: compressibility is {soil.compressibility:g} 1/Pa, of an oedometric modulus of {1 / soil.compressibility:.3g} Pa, which "
            "hardly any soil has: compressibilities are in 1/Pa, such as 1e-7 for a modulus of 10 MPa")  # fmt: skip
