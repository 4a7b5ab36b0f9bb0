"""Warnings of what is probably a mistake in a steady flow: ground that is sealed, and in stages pressures that are kept and low reservoirs."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from dolfinx.mesh import exterior_facet_indices

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.mesh.walls import distance_from

from ..checks import say
from .doubts import ends_of_height, levels_of, upward_facets
from .keys import DAY

SEALED = 0.01
"""Pressure head [m] at ground without a condition, over the height of the mesh, above which it is said"""


def warn_of_kept_flow(
    where: str, row: Mapping[str, Any], stage: bridge.Stage, before: Mapping[str, mpm.Member], wet: Collection[str]
) -> None:
    """Warn of a stage that changes what the water flows through or around, but keeps the pore pressures of the flow before it.

    Args:
        where: the stage stands in the file.
        row, stage: of the file, and what it means.
        before: members that are there before the stage, by name.
        wet: soils with a conductivity.
    """
    changed = [
        f"{verb} {soil!r}"
        for verb, soils in (("digs", stage.excavate), ("places", stage.fill))
        for soil in soils
        if soil in wet
    ]
    changed += [f"removes {name!r}" for name in stage.remove if name in before and before[name].impervious]
    changed += [f"changes the water at {name!r}" for name in row.get("boundaries", {})]
    if changed:
        say(f"{where} ({stage.name!r}) {', '.join(changed)}, but keeps the pore pressures of the steady flow before it, also where soil is gone, as "
            "of water that stands there: give it steady_flow = true or a water_level")  # fmt: skip


def warn_of_sealed_ground(flow: water.Seepage, ground: Any, walls: Iterable[np.ndarray], where: str) -> None:
    """Warn of ground that water presses against from below, where no boundary has a condition. Collective.

    Args:
        flow: the flow, solved.
        ground: mesh of all soils that are there, also of those that hold no water, without walls.
        walls: lines (n, 2) of the members that hold the water back [m].
        where: the flow is described, for the message.
    """
    domain, comm = flow.domain, flow.domain.comm
    taken = [flow.facet_tags.find(n) for one in flow.boundary for n in bridge.names_of(flow.facet_tags)[one.facet_tag]]
    closed = _middles(domain, np.setdiff1d(exterior_facet_indices(domain.topology), np.concatenate(taken)))
    open_air = np.concatenate(comm.allgather(_middles(ground, exterior_facet_indices(ground.topology))))
    low, high = ends_of_height(domain)
    close = 1e-6 * (high - low)
    free = np.isin(np.round(closed / close) @ (1, 1j), np.round(open_air / close) @ (1, 1j))
    for wall in walls:
        free &= distance_from(closed, wall) > close
    closed = closed[free]
    pressure = flow.pore_pressure()(closed - (0.0, close))
    found = [part for part in comm.allgather((pressure, closed)) if len(part[0])]
    if not found:
        return
    pressure, closed = (np.concatenate(parts) for parts in zip(*found))
    worst = int(np.argmax(pressure))
    if pressure[worst] > SEALED * (high - low) * flow.unit_weight:
        x, y = closed[worst]
        say(f"{where}: no boundary has a condition at the ground at x = {x:.4g} m, y = {y:.4g} m, where the water has a pressure of "
            f"{pressure[worst] / 1e3:.3g} kPa: no water leaves there, and as much presses on the ground as if water stood on it; give that boundary "
            "seepage_face = true or a reservoir, or flux = 0.0 where a structure or tight soil above seals it")  # fmt: skip


def warn_of_low_reservoirs(domain: Any, facets: Any, boundary: Iterable[Any], where: str) -> None:
    """Warn of reservoirs whose level is below their whole boundary. Collective; where: the stage stands in the file."""
    for one in boundary:
        if isinstance(one, water.Reservoir):
            lowest = min(
                (float(y.min()) for _, y in water.ground_lines(domain, facets, one.facet_tag)), default=-np.inf
            )
            level = max(levels_of(one))
            if level < lowest:
                say(f"{where}: steady_flow: the reservoir of {one.facet_tag!r} is at {level:g} m, below this boundary, which is at {lowest:g} m and "
                    "above: it is a seepage face, from which the water table does not fall any farther")  # fmt: skip


def warn_of_later_changes(
    days: float,
    boundary: Iterable[Any],
    path: Any,
    pressures: Mapping[str, Any] | None = None,
    starts: Mapping[str, float] | None = None,
) -> None:
    """Warn of what the file of a site describes for days after the end of a run.

    Args:
        days: duration of the run, the option --days.
        boundary: conditions of the water.
        path: of the file.
        pressures: tables of (s, Pa), by boundary.
        starts: times at which stages begin [s], by their names.
    """
    tables = {f"boundaries.{one.facet_tag}": getattr(one, key, None) for one in boundary for key in ("level", "rate")
              if isinstance(getattr(one, key, None), tuple)}  # fmt: skip
    tables |= {f"pressures.{name}": table for name, table in (pressures or {}).items()}
    end = DAY * days
    last = {
        name: max((b[0] for a, b in zip(table, table[1:]) if b[1] != a[1]), default=0.0)
        for name, table in tables.items()
    }
    said = [f"{name} (changes until day {time / DAY:.4g})" for name, time in last.items() if time > end]
    said += [f"stage {name!r} (day {time / DAY:.4g})" for name, time in (starts or {}).items() if time >= end]
    if said:
        say(f"{path}: the run ends after {days:g} days (--days), and leaves out what comes later: {', '.join(said)}")


def warn_of_degree(degree: int, varies: bool, soils: Mapping[str, water.PorousSoil]) -> None:
    """Warn of quadratic elements for a flow in time through soil that dries, which water hardly enters again.

    Args:
        degree: of the elements.
        varies: whether the flow changes with time.
        soils: of the flow, by name.
    """
    drying = [repr(name) for name, soil in soils.items() if not isinstance(soil.retention, water.AlwaysSaturated)]
    if degree == 2 and varies and drying:
        say(f"--elements is P2: water that infiltrates hardly enters dry soil in quadratic triangles, unless {' and '.join(drying)} dries over "
            "suctions of several cells (docs/water.md); take P1 for rain on dry soil and rising levels")  # fmt: skip


def warn_of_rigid_soil(soils: Mapping[str, water.PorousSoil], boundary: Iterable[Any], path: Any) -> None:
    """Warn of soil without a compressibility below a reservoir whose level changes: its pore water neither bears water that comes nor keeps its pressure.

    Args:
        soils: of the flow, by name.
        boundary: conditions of the water.
        path: of the file.
    """
    changes = any(isinstance(one, water.Reservoir) and len(set(levels_of(one))) > 1 for one in boundary)
    rigid = [repr(name) for name, soil in soils.items() if soil.compressibility == 0]
    if changes and rigid:
        say(f"{path}: the level of a reservoir changes, but {' and '.join(rigid)} {'has' if len(rigid) == 1 else 'have'} no compressibility: pore "
            "pressures follow the level at once, as in rigid soil, and factors of safety during a drawdown are too high. Give compressibility [1/Pa], "
            "the inverse of the oedometric modulus, of an elastic law (1 + nu) (1 - 2 nu) / (E (1 - nu))")  # fmt: skip


def _middles(domain: Any, facets: np.ndarray) -> np.ndarray:
    """Middles (k, 2) [m] of those of some facets at the border that soil is below of."""
    middles: np.ndarray = upward_facets(domain, facets).mean(axis=1)
    return middles
