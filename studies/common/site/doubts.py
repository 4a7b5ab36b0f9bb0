"""Warnings of values of a site that are possible but probably mistakes: water far above the ground, conductivities in other units."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx.mesh import exterior_facet_indices
from mpm_core.input_warnings import HEAVIEST_RAIN, LARGEST_CONDUCTIVITY, fast_flow

import fenics_bridge as bridge
from fenics_bridge import water
from fenics_bridge.compat import cell_dofs, cell_nodes, facet_nodes
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.water.soils import WATER_WEIGHT

from ..checks import say
from .keys import DAY, STAGE_WATER, changes_of

DEEPEST = 3.0
"""Depth of water over the top of a mesh, over the height of the mesh, above which a level is probably a mistake"""

DRIEST = 0.1
"""Suction [m] over the height of a mesh above which soil that remains saturated is probably a mistake"""

FLOODED = 0.01
"""Head above the ground, over the height of the mesh, above which it is probably that of water that stands there"""

LEAST_RAIN = 1e-3
"""Rain [mm/day] below which it is probably in m/s: 1 m a day is 1.2e-5 m/s"""

SAMPLES = 400
"""Places along a level of water at which it is compared with the ground"""

LIGHTEST = 1e3
"""Unit weight [N/m3] below which one is left out on purpose, or in kN/m3, which is said elsewhere"""

STANDING, STEEPEST = 0.02, 0.01
"""Depth of water over the height of a mesh from which on it stands on the ground, and slope of a level that may be rounded"""

COARSEST = 0.1
"""Conductivity [m/s] above which it is of rock fill or clean coarse gravel, or in m/day, in which fine sand has 0.1 to 1"""

LOOSEST = 1e-5
"""Compressibility [1/Pa] above which it is probably in other units, or a modulus"""


def ends_of_mesh(domain: Any) -> tuple[np.ndarray, np.ndarray]:
    """The least and the largest coordinates of a mesh, (3,) each [m]. Collective."""
    x, comm = domain.geometry.x, domain.comm
    ends = np.max(comm.allgather([-x.min(axis=0, initial=np.inf), x.max(axis=0, initial=-np.inf)]), axis=0)
    return -ends[0], ends[1]


def ends_of_height(domain: Any) -> tuple[float, float]:
    """Height of the lowest and of the highest point of a mesh [m]. Collective."""
    low, high = (float(end[domain.geometry.dim - 1]) for end in ends_of_mesh(domain))
    return low, high


def warn_of_depth(domain: Any, levels: Iterable[float], where: str) -> None:
    """Warn of the highest of some levels of water [m] if it is far above a mesh; where: it stands in the file. Collective."""
    (low, high), level = ends_of_height(domain), max(levels)
    if level - high > DEEPEST * (high - low):
        say(f"{where} is {level:g} m, {level - high:.3g} m above the top of the mesh, which is {high - low:.3g} m high: levels are elevations "
            "in m, not depths or pressures")  # fmt: skip


def warn_of_dry_level(domain: Any, levels: Iterable[float], where: str) -> None:
    """Warn of levels of water [m] that are all below a mesh, as a depth below the ground would be; where: they stand in the file. Collective."""
    (low, high), level = ends_of_height(domain), max(levels)
    if level < low - 1e-9 * (high - low):
        say(f"{where} is {level:g} m, below the base of the mesh at {low:g} m, so that all of the ground is dry: levels are elevations in m, not depths "
            "below the ground")  # fmt: skip


def warn_of_buoyant_weight(unit_weight: Mapping[str, float], stages: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Warn of soils lighter than water in a site whose stages have water, where unit weights are those of the saturated soil.

    Args:
        unit_weight: by soil [N/m3].
        stages: rows of the file at a path.
        path: of the file.
    """
    wet = any("water_level" in row or row.get("steady_flow", False) for row in stages)
    light = [soil for soil, weight in unit_weight.items() if LIGHTEST < weight < WATER_WEIGHT]
    if wet and light:
        say(f"{path}: {' and '.join(map(repr, light))} {'is' if len(light) == 1 else 'are'} lighter than water, {unit_weight[light[0]]:g} N/m3: "
            "unit_weight is that of the saturated soil, such as 18e3, not the one under buoyancy, and below the water table the soil floats")  # fmt: skip


def warn_of_slanting_water(domain: Any, cell_tags: Any, soils: Sequence[str], level: np.ndarray, where: str) -> None:
    """Warn of a level of water that slopes above the ground of a section, where water stands and its surface is level. Collective.

    Args:
        domain, cell_tags: of the section.
        soils: their names; the ground is the top of all of them.
        level: points (k, 2) of the level [m].
        where: it stands in the file.
    """
    low, high = ends_of_height(domain)
    names = bridge.names_of(cell_tags)
    own = bridge.background_arrays(domain, cell_tags)
    soil = np.isin(own["cell_tags"], [tag for name in soils for tag in names.get(name, (name,))])
    corners = own["points"][own["cells"][soil]]
    x = np.linspace(*level[[0, -1], 0], SAMPLES)
    ground = domain.comm.allreduce(top_of(corners, x), np.maximum)
    above = np.interp(x, *level.T) - ground
    inside = np.isfinite(ground)
    standing = inside[1:] & inside[:-1] & (np.minimum(above[1:], above[:-1]) > STANDING * (high - low))
    slope = np.abs(np.diff(np.interp(x, *level.T)) / np.diff(x))
    wrong = np.flatnonzero(standing & (slope > STEEPEST))
    if len(wrong):
        worst = wrong[np.argmax(above[wrong])]
        say(f"{where} slopes by 1:{1 / slope[worst]:.2g} near x = {x[worst]:.4g} m, where it is {above[worst]:.2g} m above the ground: water that "
            "stands there is level, and presses on the ground as deep as the level says; let the level follow the ground, or lie below it")  # fmt: skip


def top_of(corners: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Height of the top of triangles (m, 3, 2) [m] at abscissas x (n,) [m]; minus infinity where there is none."""
    ends = corners[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2, 2)
    ends = np.take_along_axis(ends, np.argsort(ends[:, :, :1], axis=1), axis=1)
    found = np.full(len(x), -np.inf)
    for (x0, y0), (x1, y1) in ends[ends[:, 1, 0] > ends[:, 0, 0]]:
        a, b = np.searchsorted(x, (x0, x1))
        found[a:b] = np.maximum(found[a:b], y0 + (y1 - y0) * (x[a:b] - x0) / (x1 - x0))
    return found


def warn_of_reservoirs(domain: Any, boundary: Iterable[Any], path: Any) -> None:
    """Warn of reservoirs of the file at a path that are far above a mesh. Collective."""
    for condition in boundary:
        if isinstance(condition, water.Reservoir):
            warn_of_depth(domain, levels_of(condition), f"{path}: the reservoir of {condition.facet_tag!r}")


def levels_of(reservoir: water.Reservoir | water.Head) -> list[float]:
    """Its levels over time [m]."""
    given = np.asarray(reservoir.level, dtype=float)
    levels: list[float] = (given[:, 1] if given.ndim else given[None]).tolist()
    return levels


def warn_of_flooded_ground(domain: Any, facet_tags: Any, boundary: Iterable[Any], path: Any) -> None:
    """Warn of ground beside a reservoir that is lower than its level, but dry: a crest that is overtopped, or a floor that is left out.

    Collective.

    Args:
        domain, facet_tags: of a plane section.
        boundary: boundary conditions of the water.
        path: of the file.
    """
    reservoirs = [condition for condition in boundary if isinstance(condition, water.Reservoir)]
    if not reservoirs:
        return
    wet = [tagged_facets(domain.comm, facet_tags, condition.facet_tag, "boundary") for condition in reservoirs]
    sealed = [
        tagged_facets(domain.comm, facet_tags, condition.facet_tag, "boundary")
        for condition in boundary
        if isinstance(condition, water.Flux)  # of a structure, if it is zero
    ]
    dry = upward_facets(domain, np.setdiff1d(exterior_facet_indices(domain.topology), np.concatenate([*wet, *sealed])))
    dry = np.concatenate(domain.comm.allgather(dry))
    for condition, facets in zip(reservoirs, wet, strict=True):
        level = max(levels_of(condition))
        ends = np.concatenate(domain.comm.allgather(domain.geometry.x[facet_nodes(domain, facets)].reshape(-1, 3)))
        beside = np.isin(dry @ (1, 1j), ends[:, :2] @ (1, 1j)).any(
            axis=1
        )  # nodes by their coordinates, as complex numbers
        low = beside & (dry[:, :, 1].max(axis=1, initial=-np.inf) < level)
        if low.any():
            x, y = dry[low][0].mean(axis=0)
            say(f"{path}: the reservoir of {condition.facet_tag!r} rises to {level:g} m, above the ground beside it at x = {x:.4g} m, y = {y:.4g} m, "
                "which is not part of a reservoir: no water stands on it or enters there; lower the level, or give that boundary a reservoir, or "
                "flux = 0.0 where a structure seals it")  # fmt: skip


def warn_of_heads(domain: Any, facet_tags: Any, boundary: Iterable[Any], path: Any) -> None:
    """Warn of a head above ground that looks upwards, where soil is computed too: its water does not press on the ground. Collective.

    Args:
        domain, facet_tags: of a section.
        boundary: boundary conditions of the water.
        path: of the file.
    """
    low, high = ends_of_height(domain)
    for condition in boundary:
        if not isinstance(condition, water.Head):
            continue
        ground = upward_facets(domain, tagged_facets(domain.comm, facet_tags, condition.facet_tag, "boundary"))
        tops = [part for part in domain.comm.allgather(ground[:, :, 1].ravel()) if len(part)]
        over = max(levels_of(condition)) - float(min(map(np.min, tops), default=np.inf))
        if over > FLOODED * (high - low):
            say(f"{path}: the head of {condition.facet_tag!r} is up to {over:.3g} m above this ground, but its water does not press on the ground: "
                "where water stands there, take reservoir in the place of head")  # fmt: skip


def upward_facets(domain: Any, facets: np.ndarray) -> np.ndarray:
    """Ends of those of some facets at the border of a plane section that soil is below of [m], shape (k, 2, 2)."""
    topology = domain.topology
    topology.create_connectivity(1, 2)
    cells = [topology.connectivity(1, 2).links(facet)[0] for facet in facets.astype(np.int32)]
    ends = domain.geometry.x[facet_nodes(domain, facets.astype(np.int32))][:, :, :2].reshape(-1, 2, 2)
    soil = domain.geometry.x[cell_nodes(domain)[cells]][:, :, :2].reshape(-1, 3, 2).mean(axis=1)
    along, inwards = ends[:, 1] - ends[:, 0], soil - ends[:, 0]
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    normal *= -np.sign((normal * inwards).sum(axis=1))[:, None]
    upward: np.ndarray = ends[normal[:, 1] > 1e-6 * np.linalg.norm(along, axis=1)]
    return upward


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
        verbs = ("is", "has") if len(dry) == 1 else ("are", "have")
        say(f"{path}: {' and '.join(map(repr, dry))} {verbs[0]} up to {max(map(found.get, dry)):.3g} m above the water table and {verbs[1]} no retention "
            "curve: such soil remains saturated there, conducts as much water as below and releases none when the water falls. Give it "
            "free_surface = {} or van_genuchten = {...} (docs/water.md), unless capillarity keeps it saturated")  # fmt: skip
    return bool(dry)


def warn_of_flow(soil: water.PorousSoil, where: str) -> None:
    """Warn of a conductivity or compressibility that is probably in other units; where: the soil stands in the file."""
    largest = np.linalg.eigvalsh(soil.tensor(soil.conductivity, 2)).max()
    say(fast_flow(f"{where}: conductivity", float(largest)))
    if COARSEST < largest <= LARGEST_CONDUCTIVITY:
        say(f"{where}: conductivity is {largest:g} m/s, that of rock fill or clean coarse gravel; conductivities are in m/s, and {largest:g} m/day are "
            f"{largest / DAY:.3g} m/s")  # fmt: skip
    if soil.compressibility > LOOSEST:
        say(f"{where}: compressibility is {soil.compressibility:g} 1/Pa, of an oedometric modulus of {1 / soil.compressibility:.3g} Pa, which "
            "hardly any soil has: compressibilities are in 1/Pa, such as 1e-7 for a modulus of 10 MPa")  # fmt: skip


def warn_of_rate(key: str, largest: float, where: str) -> None:
    """Warn of a rate at a boundary that is probably in other units.

    Args:
        key: of the boundary, with the unit of the file: rain [mm/day] or flux [m/s].
        largest: its largest value in that unit.
        where: it stands in the file.
    """
    if key == "rain" and 0 < largest < LEAST_RAIN:
        say(f"{where}: rain is {largest:g} mm/day at most, next to nothing: rain is in mm/day, and {largest:g} m/s are "
            f"{largest * 1e3 * DAY:.3g} mm/day")  # fmt: skip
    if key == "flux" and largest > HEAVIEST_RAIN:
        say(f"{where}: flux is {largest:g} m/s, more than has ever fallen as rain: a flux is in m/s, and {largest:g} mm/day are "
            f"{largest * 1e-3 / DAY:.3g} m/s")  # fmt: skip


def warn_of_water(table: dict[str, Any], path: Path) -> None:
    """Warn of the water of a file for a study that has only that of stages."""
    if "boundaries" in table and not changes_of(table.get("stages", []), STAGE_WATER):
        say(f"{path}: the water of [boundaries] is left out here, and the soils are without pore pressure; the studies drawdown, "
            "rain and consolidation have it, or a stage with water_level or steady_flow = true")  # fmt: skip


def warn_of_pressures(table: dict[str, Any], path: Path) -> None:
    """Warn of the loads of a file for a study that has none that change in time."""
    if table.get("pressures"):
        say(f"{path}: the loads of [pressures] are left out here; the study consolidation has them, and the studies of stages "
            "the pressure of a stage")  # fmt: skip


def warn_of_members(table: dict[str, Any], path: Path) -> None:
    """Warn of the structural members of a file for a study that has none."""
    if table.get("members"):
        names = ", ".join(map(repr, table["members"]))
        say(f"{path}: the structural members {names} are left out here; the studies safety, collapse, slope, excavation, embankment "
            "and consolidation have them")  # fmt: skip
