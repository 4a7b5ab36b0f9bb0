"""Warnings of values of a site that are possible but probably mistakes: water far above the ground, conductivities in other units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from mpm_core.input_warnings import fast_flow

import fenics_bridge as bridge
from fenics_bridge import water
from fenics_bridge.compat import cell_dofs

from .checks import say

DEEPEST = 3.0
"""Depth of water over the top of a mesh, over the height of the mesh, above which a level is probably a mistake"""

DRIEST = 0.1
"""Suction [m] over the height of a mesh above which soil that remains saturated is probably a mistake"""

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


def warn_of_suction(flow: water.Seepage, soils: Mapping[str, water.PorousSoil], cell_tags: Any, path: Any) -> bool:
    """Warn of soil high above the water table, in a flow as it is now, that remains saturated for want of a retention curve. Collective.

    Args:
        flow: the flow of a site; soils: by name, and cell_tags: of its mesh.
        path: of the file.

    Returns:
        Whether there is such soil.
    """
    head, comm = flow.pressure_head, flow.domain.comm
    cells, (low, high) = cell_dofs(head.function_space), ends_of_height(flow.domain)
    least = head.x.array[cells[cell_tags.indices[cell_tags.indices < len(cells)]]].min(axis=1)
    tags, found = cell_tags.values[cell_tags.indices < len(cells)], {}
    for name, soil in soils.items():
        here = least[np.isin(tags, bridge.names_of(cell_tags).get(name, ()))].min(initial=np.inf)
        found[name] = -min(comm.allgather(float(here))) if isinstance(soil.retention, water.AlwaysSaturated) else 0.0
    dry = [name for name, suction in found.items() if suction > DRIEST * (high - low)]
    if dry:
        say(f"{path}: {' and '.join(map(repr, dry))} is up to {max(map(found.get, dry)):.3g} m above the water table and has no retention "
            "curve: it remains saturated there, conducts as much water as below and releases none when the water falls. Give it "
            "free_surface = {} or van_genuchten = {...} (docs/water.md), unless capillarity keeps it saturated")  # fmt: skip
    return bool(dry)


def warn_of_flow(soil: water.PorousSoil, where: str) -> None:
    """Warn of a conductivity or compressibility that is probably in other units; where: the soil stands in the file."""
    largest = np.linalg.eigvalsh(soil.tensor(soil.conductivity, 2)).max()
    say(fast_flow(f"{where}: conductivity", float(largest)))
    if soil.compressibility > LOOSEST:
        say(f"{where}: compressibility is {soil.compressibility:g} 1/Pa, of an oedometric modulus of {1 / soil.compressibility:.3g} Pa, which "
            "hardly any soil has: compressibilities are in 1/Pa, such as 1e-7 for a modulus of 10 MPa")  # fmt: skip
