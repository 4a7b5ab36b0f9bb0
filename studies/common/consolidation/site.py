"""A site of consolidation as a TOML file: mesh, soils with law and conductivity, supports, water, and pressures in time.

`meshes/fill.toml` is an example. Its keys are those of the sites of seepage, and besides them

    [soils.clay]                       # a physical group: conductivity and porosity (without them it holds no water), and
    unit_weight = 17e3                 # N/m3, saturated
    material = "mohr-coulomb"          # of effective stresses, and the parameters of the law, named as options of the study slope

    [supports]                         # as for sites of stages
    [pressures]                        # Pa on a boundary, beside that of reservoirs: a number, or rows [days, Pa]; the first one holds before it
    [points]                           # name = [x, y]: places whose settlements are followed

    [[stages]]                         # soil and members that come and go while the ground consolidates
    day = 30.0
    duration = 10.0                    # days in which its weight comes or goes; 0 by default: at once
    fill = ["layer 1"]                 # soils of the mesh that are there from now on, and excavate = [...] that are not
    boundaries.ground.reservoir = 0.0  # what the water does from now on, where that changes
    install = ["wall"]                 # tables [members.NAME], and remove = [...]
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import with_inner_laws

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.fem.active_cells import cells_there
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.loads import warn_of_weight
from fenics_bridge.mesh.names import known_tags, tag_numbers
from fenics_bridge.water.boundary import value_at

from ..checks import say
from ..site.doubts import warn_of_heads, warn_of_reservoirs
from ..site.file import Site, site_of
from ..site.flow import boundary_of, wet_soils
from ..site.flow_doubts import warn_of_sealed_ground
from ..site.k0 import of_soils
from ..site.keys import CHANGES, DAY, changes_of, read_site_table
from ..site.mesh import part_of_mesh, require_plane
from ..site.strength import refuse_strength_ratio
from ..slope.case import GRAVITY
from ..water.site import (
    by_law,
    corners_of,
    directions_of,
    effective_laws,
    times_of,
    vertical_conductivity,
)
from .stages import GroundStage, Table, pressure_table, stages_of

BALANCED = 1e-9
"""Out-of-balance ratio of particles at the beginning"""
POROUS = ("conductivity", "dip", "porosity")


@dataclass
class ConsolidationSite:
    """A site of consolidation as its file describes it, on its mesh.

    site: laws, weights and supports; mesh: domain, cell tags and facet tags of its soils; soils: by name, None without water
    pressures: tables in s; stages: the first is the beginning
    """

    site: Site
    mesh: tuple
    soils: dict[str, water.PorousSoil | None]
    pressures: dict[str, Table]
    points: dict[str, np.ndarray]
    stages: list[GroundStage]

    @property
    def boundary(self) -> list:
        """Conditions of the water at the beginning."""
        return list(self.stages[0].boundary.values())

    def corners(self, apart: float) -> list[float]:
        """Times [s] at which loads, levels or soils change their rate; those that follow within `apart` [s] make a jump.

        Stages begin in any case.
        """
        starts = {stage.start for stage in self.stages}
        ends = {stage.start + stage.duration for stage in self.stages}
        rows = {time for table in self.pressures.values() for time, _ in table}
        water_rows = times_of(one for stage in self.stages for one in stage.boundary.values())
        return corners_of(starts | ends | rows | water_rows, apart, always=starts)

    @property
    def creeps(self) -> bool:
        """Whether a soil creeps."""
        return any(getattr(each, "creep", 0.0) > 0 for law in self.site.laws.values() for each in with_inner_laws(law))

    def changes_until(self, end: float) -> bool:
        """Whether soil, a pressure or what the water does changes after the beginning, at which all is in equilibrium, before `end` [s].

        Soil that creeps changes in any case.
        """
        if self.creeps:
            return True
        conditions = [one for stage in self.stages for one in stage.boundary.values()]
        given = [getattr(one, key, None) for one in conditions for key in ("level", "rate")]
        tables = [*self.pressures.values(), *(one for one in given if isinstance(one, tuple))]
        times = [time for table in tables for time, _ in table if time < end] + [end]
        changed = any(value_at(table, time) != value_at(table, 0.0) for table in tables for time in times if time > 0)
        return changed or any(0 < stage.start < end for stage in self.stages)

    def dilating_little(self) -> list[str]:
        """Soils whose dilation angle is below their friction angle, so that Newton's method may find no equilibrium where they yield."""
        names = {tag: name for name, tags in bridge.names_of(self.site.cell_tags).items() for tag in tags}
        angles = {
            names.get(tag, str(tag)): (getattr(each, "dilation_angle", None), getattr(each, "friction_angle", None))
            for tag, law in self.site.laws.items()
            for each in with_inner_laws(law)
        }
        return [name for name, (psi, phi) in angles.items() if psi is not None and phi is not None and psi < phi]

    def stage_at(self, time: float) -> GroundStage | None:
        """The stage that begins at a time [s], after the beginning; None where none does."""
        return next((one for one in self.stages[1:] if np.isclose(one.start, time, rtol=1e-9, atol=0.0)), None)

    def load(self, time: float) -> bridge.Load:
        """Weights and pressures at a time [s]."""
        return bridge.Load(self.site.unit_weight, {tag: value_at(given, time) for tag, given in self.pressures.items()})

    def at_rest(self, element: water.Element, nmd: bool = False) -> water.Consolidation:
        """The ground at the beginning: in equilibrium under its weight, the pressures at time 0 and the steady flow. Collective.

        Members of the beginning are there as weight and pressures come.

        Above the water table its water has the suction of the steady flow, which saturated soil bears.

        Args:
            element: elements of displacement and pressure.
            nmd: average volumetric strains of linear elements over nodes.

        Raises:
            RunError: it cannot carry them.
        """
        domain, cell_tags, facet_tags = self.mesh
        off = self.stages[0].off
        wet = {soil: porous for soil, porous in self.soils.items() if porous is not None and soil not in off}
        if not wet:
            raise mpm.InputError(
                "soils: no soil that is there at the beginning has a conductivity, expected at least one"
            )
        body = part_of_mesh(self.mesh, wet)
        here = known_tags(domain.comm, body[2])
        absent = {name for name, tags in bridge.names_of(facet_tags).items() if not set(tags) & set(here)}
        boundary = [
            condition for condition in self.boundary if condition.facet_tag not in absent
        ]  # not of soil to come
        flow = water.Seepage(body[0], wet, body[2], boundary, cell_tags=body[1], geometry=self.site.geometry)
        flow.solve()
        there = [soil for soil in self.soils if soil not in off]
        warn_of_heads(body[0], body[2], boundary, "boundaries, at the beginning")
        warn_of_sealed_ground(flow, part_of_mesh(self.mesh, there)[0], (), "boundaries, at the beginning")
        fem = bridge.QuasiStatic(
            domain,
            self.site.laws,
            facet_tags,
            self.site.supports,
            element.value,
            nmd,
            as_particles=nmd,
            cell_tags=cell_tags,
            options_prefix="rest_",
            geometry=self.site.geometry,
        )
        pressure = flow.pore_pressure(suction=True)
        self._require_members(fem)
        self._carry_weight(fem, pressure)
        model = water.Consolidation(domain, self.site.laws, self.soils, facet_tags, self.site.supports, self.boundary,
                                    load=self.load, element=element, nmd=nmd, cell_tags=cell_tags,
                                    geometry=self.site.geometry)  # fmt: skip
        model.reconfigure(off=off)
        model.initialise(fem, pressure)
        return model

    def _carry_weight(self, fem: bridge.QuasiStatic, pressure: Any) -> None:
        """Bring new elements to the equilibrium of the beginning; pressure: of the water, a function of positions [Pa]. Collective."""
        there, load = [soil for soil in self.soils if soil not in self.stages[0].off], self.load(0.0)
        k0, ratios = (of_soils(there, given) for given in (self.site.k0, self.site.overconsolidation))
        stage = bridge.Stage("beginning", there, unit_weight=self.site.unit_weight, pressure=load.pressure, k0=k0,
                             overconsolidation=ratios, pore_pressure=pressure, install=dict(self.stages[0].members))  # fmt: skip
        # Ground at rest may have no equilibrium under a weight in kN/m3, and its error does not say why.
        warn_of_weight(fem.domain.comm, bridge.Load(unit_weight=self.site.unit_weight), fem.cell_tags)
        try:
            bridge.FemSite(fem).carry_out(stage)
        except bridge.StageError as error:
            raise mpm.RunError(
                f"the ground has no equilibrium under its weight and the initial pressures: {error}"
            ) from error

    def _require_members(self, fem: bridge.QuasiStatic) -> None:
        """Require that the members of all stages are in soil that is there then. Collective.

        Raises:
            InputError: one is not.
        """
        domain, cell_tags, _ = self.mesh
        for stage in self.stages:
            off = tag_numbers(domain.comm, cell_tags, stage.off, "off", "cell") if stage.off else ()
            fem.require_members(
                dict(stage.members), cells_there(domain, cell_tags, off) if off else None, f"stage {stage.name!r}: "
            )

    def particles(self, fem: water.Consolidation, per_cell: int, nmd: bool = False) -> mpm.Model:
        """Implicit particles with pore water in the place of finite elements at rest, in equilibrium. Collective.

        Steps in small displacements make forces of stresses as the elements do; where quadratic elements leave something out of
        balance, it is brought to rest, and pore pressures stay.

        Soil without conductivity has pore water too, without pressure (`water.waterless_facets`).

        Raises:
            InputError: the water has a boundary condition other than reservoirs, there are structural members, or a stage places
                soil with conductivity, or digs soil away in the course of time.
        """
        self._require_stages_of_particles()
        dry = [soil for soil, porous in self.soils.items() if porous is None]
        facet_tags = water.waterless_facets(*self.mesh, dry) if dry else self.mesh[2]
        mesh, laws = bridge.background_mesh(*self.mesh[:2], facet_tags), list(self.site.laws.values())
        model = mpm.Model(mesh, laws, geometry=self.site.geometry)
        there = [soil for soil in self.soils if soil not in self.stages[0].off]
        for soil in there:
            self.seed(model, soil, per_cell)
        bridge.apply_supports(model, self.site.supports)
        model.set_gravity((0.0, -GRAVITY))
        pores = {soil: self.pores(soil) for soil in there}
        model.add_water(
            porosity={soil: porosity for soil, (porosity, _) in pores.items()},
            conductivity={soil: conductivity for soil, (_, conductivity) in pores.items()},
            anisotropy=directions_of(by_law(self.soils, self.site)),
        )
        if dry:
            model.hold_pore_pressure(water.WATERLESS, 0.0)
        self.load_particles(model, fem.time, self.stages[0])
        bridge.initialise(model, fem, equilibrate=False)
        model.equilibrate(nmd=nmd, small_displacements=True, tolerance=BALANCED)
        return model

    def seed(self, model: mpm.Model, soil: str, per_cell: int) -> None:
        """Place the particles of a soil. Collective."""
        density, laws = self.site.unit_weight[soil] / GRAVITY, list(self.site.laws)
        for tag in model.mesh.tags_of("cell", soil):
            model.seed(density=density, per_cell=per_cell, cell_tag=tag, material=laws.index(tag))

    def pores(self, soil: str) -> tuple[float, float]:
        """Porosity [-] and vertical conductivity [m/s] of particles; those of another soil where it has none."""
        porous = self.soils[soil] or next(one for one in self.soils.values() if one is not None)
        return porous.porosity, vertical_conductivity(porous)

    def _require_stages_of_particles(self) -> None:
        if member := next((name for stage in self.stages for name in stage.members), None):
            raise mpm.InputError(
                f"particles: there is the member {member!r}, expected none: implicit particles have no members"
            )
        for before, stage in zip(self.stages, self.stages[1:]):
            wet = [soil for soil in before.off if soil not in stage.off and self.soils[soil] is not None]
            if wet:
                raise mpm.InputError(f"particles: stage {stage.name!r} places {wet[0]!r}, which has a conductivity; expected soil "
                                     "that holds no water, or the pressure of a fill in [pressures]")  # fmt: skip
            if stage.duration > 0 and any(soil not in before.off for soil in stage.off):
                raise mpm.InputError(f"particles: stage {stage.name!r} digs soil away in {stage.duration / DAY:g} days, expected "
                                     "a duration of 0")  # fmt: skip

    def load_particles(self, model: mpm.Model, time: float, stage: GroundStage) -> None:
        """Give particles the reservoirs of a stage and the pressures, at a time [s]. Collective."""
        water.apply_reservoirs(model, stage.boundary.values(), time)
        for tag, given in self.pressures.items():
            model.press_surface(tag, value_at(given, time))


def read_consolidation_site(
    path: Path, comm: MPI.Comm, cell_size: float | None = None, pressures: dict[str, Table] | None = None
) -> ConsolidationSite:
    """Read a site of consolidation and make its mesh. Collective.

    Args:
        path: of the TOML file.
        cell_size: [m], instead of the one in the file; for meshes with that constant.
        pressures: by boundary, besides those in the file or instead of them.

    Raises:
        InputError: on all ranks, with the file, the key and what was expected.
    """
    table = read_site_table(path, needed=("boundaries", "points"))
    require_plane(table, path)
    soils, rows = wet_soils(table, path, POROUS), table.get("stages", [])
    changes = changes_of(rows, [key for key in CHANGES if key not in ("excavate", "install", "remove")])
    if changes:
        say(f"{path}: this study leaves out {changes}")
    site = site_of(effective_laws(table), path, comm, cell_size, interfaces=True)
    site.require_no_fields(path)
    refuse_strength_ratio(site, path)
    mesh = part_of_mesh((site.domain, site.cell_tags, site.facet_tags), soils)
    for name in pressures or {}:
        if name not in mesh[2].names:
            raise mpm.InputError(f"--pressures names '{name}', expected some of {', '.join(mesh[2].names)}")
    stages = stages_of(rows, list(soils), boundary_of(table, path), f"{path}: stages", site.members)
    conditions = {id(one): one for stage in stages for one in stage.boundary.values()}  # each once
    warn_of_reservoirs(mesh[0], conditions.values(), path)
    given = {name: pressure_table(one, f"{path}: pressures.{name}") for name, one in table.get("pressures", {}).items()}
    placed = {soil: weight for soil, weight in site.unit_weight.items() if soil in stages[0].off}
    warn_of_weight(comm, bridge.Load(unit_weight=placed))  # that of the beginning is doubted with its equilibrium
    points = {name: _point(given, f"{path}: points.{name}") for name, given in table["points"].items()}
    search = PointSearch(mesh[0], np.array(list(points.values())).reshape(-1, 2))
    for name, found in zip(points, search.found):
        if not found:
            raise mpm.InputError(
                f"{path}: points.{name} is {points[name].tolist()}, expected a place in the mesh of soils [m]"
            )
    return ConsolidationSite(site, mesh, soils, given | (pressures or {}), points, stages)


def _point(given: Any, where: str) -> np.ndarray:
    point = np.array(given, dtype=float) if isinstance(given, list) and len(given) == 2 else np.empty(0)
    if point.shape != (2,):
        raise mpm.InputError(f"{where} is {given!r}, expected [x, y] in m")
    return point
