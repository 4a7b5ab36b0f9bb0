"""Pore pressures of stages from steady flow through the soils that are there, around walls that hold the water back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from dolfinx.mesh import exterior_facet_indices, meshtags
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.mesh.tagged import tag_values
from fenics_bridge.water.soils import WATER_WEIGHT

from ..checks import say
from ..site.doubts import warn_of_heads, warn_of_reservoirs
from ..site.flow import boundaries_of_stage, boundary_of, wet_soils
from ..site.flow_doubts import warn_of_kept_flow, warn_of_low_reservoirs, warn_of_sealed_ground
from ..water.discharge import exit_gradients, exit_gradients_by_boundary, extent_of, in_words, inflows


@dataclass
class StageFlow:
    """Steady flow of a stage.

    pressure: function of positions that returns the pore pressures; reservoirs: each with its ground, (condition, x, y) [m]
    cell_tags: soils through which it flows
    """

    flow: water.Seepage
    pressure: Any
    reservoirs: list[tuple]
    cell_tags: Any = None

    def __call__(self, points: np.ndarray) -> Any:
        """Pore pressures (n,) [Pa] at positions (n, D) [m]; in front of walls those of the reservoirs there. Collective."""
        return self.pressure(points)


def flow_row(pressure: Any) -> dict[str, float]:
    """Results of a stage of steady flow: what enters at each boundary, and the gradients with which it leaves. Collective.

    Args:
        pressure: pore pressures of the stage; there are results where they are a StageFlow.
    """
    if not isinstance(pressure, StageFlow):
        return {}
    flow = pressure.flow
    tags = boundaries_of(flow)
    return inflows(flow, tags) | exit_gradients(flow)


def boundaries_of(flow: water.Seepage) -> list[str]:
    """Names of the boundaries with a condition."""
    return list(dict.fromkeys(one.facet_tag for one in flow.boundary))


def flow_lines(stage: str, pressure: Any) -> list[str]:
    """What enters at each boundary in the steady flow of a stage, in words; none without one. Collective."""
    if not isinstance(pressure, StageFlow):
        return []
    flow, names = pressure.flow, boundaries_of(pressure.flow)
    found = in_words(inflows(flow, names), extent_of(flow)).values()
    return [f"inflow in the steady flow of {stage!r}, {name}: {value}" for name, value in zip(names, found)]


def upward_exits(pressure: Any, unit_weight: Mapping[Any, float]) -> dict[str, tuple[float, float]]:
    """Largest gradient with which water leaves upwards at each boundary, and the least unit weight [N/m3] of the soil there. Collective.

    Args:
        pressure: pore pressures of the stage; there are boundaries where they are a StageFlow.
        unit_weight: by the tags of the soils that are there [N/m3].
    """
    if not isinstance(pressure, StageFlow):
        return {}
    flow, tags = pressure.flow, tag_values(pressure.flow.domain, pressure.cell_tags, pressure.flow.domain.topology.dim)
    found = {}
    for name, gradient in exit_gradients_by_boundary(flow, upward=True).items():
        beside = cells_beside(flow.domain, tagged_facets(flow.domain.comm, flow.facet_tags, name, "boundary"))
        least = min((unit_weight[tag] for tag in np.unique(tags[beside])), default=np.inf)
        found[name] = gradient, flow.domain.comm.allreduce(float(least), MPI.MIN)
    return found


def cells_beside(domain: Any, facets: np.ndarray) -> np.ndarray:
    """Cells of this rank that have some of its facets."""
    dim = domain.topology.dim
    domain.topology.create_connectivity(dim - 1, dim)
    links = domain.topology.connectivity(dim - 1, dim)
    return np.unique(np.concatenate([np.empty(0, np.int32), *(links.links(facet) for facet in facets)])).astype(int)


def warn_of_heave(stage: str, exits: Mapping[str, tuple[float, float]]) -> None:
    """Warn where water leaves upwards with a gradient that lifts soil without cohesion.

    Args:
        stage: its name.
        exits: of `upward_exits`.
    """
    for name, (gradient, weight) in exits.items():
        critical = weight / WATER_WEIGHT - 1
        if gradient > max(critical, 0.0):  # where no water leaves upwards, soil that is lighter than water is there too
            say(f"stage {stage!r}: water leaves the ground upwards with a gradient of {gradient:.2f} at {name!r}, above the critical one of "
                f"{critical:.2f} of soil of {weight / 1e3:.3g} kN/m3: it lifts soil without cohesion (hydraulic heave)")  # fmt: skip


def with_steady_flow(
    mesh: tuple[Any, Any, Any],
    stages: Sequence[bridge.Stage],
    table: Mapping[str, Any],
    path: Path,
    geometry: mpm.Geometry | None = None,
) -> list[bridge.Stage]:
    """Stages of a site, with pore pressures of steady flow in those that ask for it by ``steady_flow = true``. Collective.

    Water flows through the soils that are there and have a conductivity, under the conditions of `[boundaries]` and of the stages so
    far, where these boundaries are at the surface of the soil. It does not flow through members that are impervious.

    Args:
        mesh: domain, cell tags and facet tags of the site.
        stages: the stages, of which the last ones are those of the file.
        table, path: of the file.
        geometry: of the site; None for a plane section.

    Raises:
        InputError: a stage asks for it beside a water level, or without boundaries or soils for it, or in three dimensions.
    """
    rows = table.get("stages", [])
    if not any("steady_flow" in row for row in rows):
        return list(stages)
    pores, boundary = wet_soils(dict(table), path), boundary_of(dict(table), path)
    there: list[str] = []
    members: dict[str, mpm.Member] = {}
    result = list(stages[: len(stages) - len(rows)])
    flowing = False
    for stage in result:
        there += stage.fill
    for k, (row, stage) in enumerate(zip(rows, stages[len(result) :])):
        where = f"{path}: stages[{k}]"
        there = [soil for soil in (*there, *stage.fill) if soil not in stage.excavate]
        before = members
        members = {name: one for name, one in members.items() if name not in stage.remove} | stage.install
        boundary |= boundaries_of_stage(row, where)
        if _asks(row, where):
            if mesh[0].topology.dim == 3:
                raise mpm.InputError(
                    f"{where}: steady_flow is true, but dimension is 3, expected a water_level: flow is computed in sections"
                )
            soils = {soil: pores[soil] for soil in there if pores[soil] is not None}
            walls = {name: member for name, member in members.items() if member.impervious}
            if not boundary or not soils:
                lacks = "no soil with a conductivity is there" if boundary else "the file has no [boundaries.NAME]"
                raise mpm.InputError(f"{where}: steady_flow is true, but {lacks}")
            try:
                pressure = _flow(mesh, soils, list(boundary.values()), walls, path, where, geometry)
                stage, flowing = replace(stage, pore_pressure=pressure), True
                ground = bridge.soil_mesh(*mesh, tag=there)[0]
                lines = [np.array(wall.points) for wall in walls.values()]
                warn_of_sealed_ground(pressure.flow, ground, lines, f"{where}: steady_flow")
            except (mpm.InputError, RuntimeError) as error:
                raise mpm.InputError(f"{where}: steady_flow: {error}") from None
        elif "water_level" in row:
            flowing = False
        elif flowing:
            warn_of_kept_flow(where, row, stage, before, [soil for soil in pores if pores[soil] is not None])
        result.append(stage)
    return result


def _asks(row: Mapping[str, Any], where: str) -> bool:
    given = row.get("steady_flow", False)
    if not isinstance(given, bool):
        raise mpm.InputError(f"{where}: steady_flow is {given!r}, expected true or false")
    if given and "water_level" in row:
        raise mpm.InputError(f"{where} has steady_flow and water_level, expected one of them")
    return given


def _flow(
    mesh: tuple[Any, Any, Any],
    soils: dict[str, water.PorousSoil],
    boundary: list[Any],
    walls: dict[str, Any],
    path: Path,
    where: str,
    geometry: mpm.Geometry | None,
) -> StageFlow:
    """Steady flow through soils by name, by quadratic elements where no soil dries, and its pore pressures. Collective."""
    body, cells, facets = bridge.soil_mesh(*mesh, tag=list(soils), walls=walls)
    facets = _at_surface(body, facets)
    acting = [one for one in boundary if _is_there(body.comm, facets, one.facet_tag)]
    if not acting:
        raise mpm.InputError("no boundary with a condition is at the surface of the soils that are there")
    warn_of_reservoirs(body, acting, path)
    warn_of_low_reservoirs(body, facets, acting, where)
    warn_of_heads(body, facets, acting, where)
    dries = any(not isinstance(soil.retention, water.AlwaysSaturated) for soil in soils.values())
    flow = water.Seepage(body, soils, facets, acting, cell_tags=cells, degree=1 if dries else 2, geometry=geometry)
    try:
        flow.solve()
    except mpm.InputError as error:
        apart = ", ".join(repr(one.facet_tag) for one in boundary if one not in acting)
        hint = f"; not at the surface of the soils that are there and have a conductivity: {apart}" if apart else ""
        raise mpm.InputError(f"{error}{hint}") from None
    reservoirs = [(one, *line) for one in acting if isinstance(one, water.Reservoir)
                  for line in water.ground_lines(body, facets, one.facet_tag)]  # fmt: skip
    outside = water.reservoir_pressure(body, facets, acting) if reservoirs else None
    return StageFlow(flow, flow.pore_pressure(outside=outside), reservoirs, cells)


def _at_surface(body: Any, facets: Any) -> Any:
    """The tags of those facets that are at the surface of a body, with their names. Collective."""
    there = np.isin(facets.indices, exterior_facet_indices(body.topology))
    tags = meshtags(body, facets.dim, facets.indices[there], facets.values[there])
    return bridge.name_tags(tags, bridge.names_of(facets))


def _is_there(comm: MPI.Comm, facets: Any, name: str) -> bool:
    """Whether the facets of a name, or of any other that the mesh does not know, which is named later, are there. Collective."""
    known = bridge.names_of(facets)
    return name not in known or comm.allreduce(int(np.isin(facets.values, known[name]).sum())) > 0
