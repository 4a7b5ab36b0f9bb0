"""A site of seepage as a TOML file: mesh, hydraulic soils by name, and what the water does at the boundaries.

Example of a file:

    mesh = "dam.geo"                   # beside this file; or a .msh
    cell_size = 0.6                    # and other constants of the .geo file under [constants]

    [soils.core]                       # a physical group of the mesh
    conductivity = 1e-8                # m/s; or [along x, along y], or along and across strata with dip = 20.0 [degrees]
    porosity = 0.42
    compressibility = 2e-7             # 1/Pa
    van_genuchten = {alpha = 6e-5, n = 1.4, residual = 0.15, air_entry = 200.0}   # or gardner, free_surface, tabulated

    [boundaries.upstream]              # one of head, reservoir [m], flux [m/s], rain [mm/day] or seepage_face = true
    reservoir = [[0.0, 10.0], [15.0, 3.0]]      # a number, or a table of (days, value)
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

from ..checks import say
from ..site.doubts import warn_of_flooded_ground, warn_of_reservoirs
from ..site.file import Site
from ..site.flow import boundary_of, wet_soils
from ..site.keys import DAY, UNDRAINED, changes_of, member_of, read_site_table
from ..site.mesh import check_soils, geometry_of, part_of_mesh, require_plane, site_mesh


@dataclass
class WaterSite:
    """A site of seepage as its file describes it, on its mesh.

    soils: {name: PorousSoil}; boundary: of `fenics_bridge.water`; varies: whether any value changes in time
    ground: mesh of all soils, also of those that hold no water, without walls
    walls: lines (n, 2) of the members that hold water back [m]; geometry: plane section or axial symmetry
    """

    domain: Any
    cell_tags: Any
    facet_tags: Any
    soils: dict[str, water.PorousSoil]
    boundary: list
    varies: bool
    ground: Any
    walls: list[np.ndarray]
    geometry: mpm.Geometry | None = None

    def seepage(self, degree: int) -> water.Seepage:
        """The flow, at rest, in elements of a degree; reservoirs that change load the soil as well. Collective."""
        loading = standing_load(self.domain, self.facet_tags, self.boundary) if self.varies else None
        return water.Seepage(
            self.domain,
            self.soils,
            self.facet_tags,
            self.boundary,
            cell_tags=self.cell_tags,
            degree=degree,
            loading=loading,
            geometry=self.geometry,
        )


def standing_load(domain: Any, facet_tags: Any, boundary: Sequence[Any]) -> Callable | None:
    """Pressure of the water on the ground by positions and time, as of `standing_water`; None without a reservoir. Collective."""
    any_there = any(isinstance(condition, water.Reservoir) for condition in boundary)
    return water.standing_water(domain, facet_tags, boundary) if any_there else None


def times_of(boundary: Iterable[Any]) -> set[float]:
    """Times [s] of the rows of all tables of boundary conditions."""
    values = (getattr(one, key, None) for one in boundary for key in ("level", "rate"))
    return {time for table in values if isinstance(table, tuple) for time, _ in table}


def corners_of(times: Iterable[float], apart: float = 0.0, always: Container[float] = ()) -> list[float]:
    """Times [s] after 0 at which a rate changes, where steps should end.

    Args:
        times: of the rows of tables, in any order.
        apart: times that follow another within this [s] are left out: both rows are a jump, which belongs to the step after it.
        always: times that are kept in any case.
    """
    kept = [0.0]
    for time in sorted(time for time in times if time > 0):
        if time in always or time - kept[-1] > apart:
            kept.append(time)
    return kept[1:]


def time_in_words(time: float) -> str:
    """A time [s] in words: "1 day", "2.5 days", "1200 days"; below 0.01 days "7.2 min" or "4.9 s"."""
    days = time / DAY
    if 0 < days < 0.01:
        return f"{time / 60:.3g} min" if time >= 60 else f"{time:.3g} s"
    number = f"{days:.0f}" if days >= 100 else f"{days:.3g}"
    return f"{number} day" if number == "1" else f"{number} days"


def read_water_site(path: Path, comm: MPI.Comm, cell_size: float | None = None) -> WaterSite:
    """Read a site of seepage and make its mesh. Collective.

    Args:
        path: of the TOML file.
        cell_size: [m], instead of the one in the file.

    Raises:
        InputError: on all ranks, with the file, the key and what was expected.
    """
    table = read_site_table(path, needed=("boundaries",))
    require_plane(table, path)
    geometry, soils = geometry_of(table, path), wet_soils(table, path)
    dry = [name for name, soil in soils.items() if soil is None]
    if len(dry) == len(soils):
        raise mpm.InputError(f"{path} has no soil with a conductivity [m/s], which the flow of water needs")
    if dry:
        say(f"{path}: the flow leaves out {', '.join(map(repr, dry))}, which has no conductivity")
    changes = changes_of(table.get("stages", []), ("excavate", "boundaries"))
    if changes:
        say(f"{path}: all soils are there at once, and this study leaves out {changes}")
    mesh = site_mesh(table, path, comm, cell_size)
    check_soils(table, path, mesh[1])
    wet = {name: soil for name, soil in soils.items() if soil is not None}
    members = [member_of(given, f"{path}: members.{name}") for name, given in table.get("members", {}).items()]
    walls = [np.array(member.points) for member in members if member.impervious]
    body = bridge.soil_mesh(*mesh, tag=list(wet), walls=walls) if walls else part_of_mesh(mesh, wet)
    ground = part_of_mesh(mesh, soils)[0] if dry or walls else body[0]
    boundary = list(boundary_of(table, path).values())
    warn_of_reservoirs(body[0], boundary, path)
    warn_of_flooded_ground(body[0], body[2], boundary, path)
    return WaterSite(*body, wet, boundary, bool(times_of(boundary)), ground, walls, geometry)


def read_water_table(path: Path, needed: Sequence[str]) -> dict[str, Any]:
    """The file of a site, for a study that computes its water in plane sections; needed: keys besides mesh and soils."""
    table = read_site_table(path, needed)
    require_plane(table, path)
    if table.get("axisymmetric", False) is not False:
        raise mpm.InputError(
            f"{path}: axisymmetric is {table['axisymmetric']!r}, expected false: this study has plane sections"
        )
    return table


def effective_laws(table: dict[str, Any]) -> dict[str, Any]:
    """The file of a site with laws of effective stresses only, for a study that computes the water of the soils."""
    soils = {name: {k: v for k, v in given.items() if k not in UNDRAINED} for name, given in table["soils"].items()}
    return table | {"soils": soils}


def vertical_conductivity(soil: water.PorousSoil) -> float:
    """Conductivity of a soil along the last axis [m/s], which particles have as a number."""
    return float(np.ravel(soil.conductivity)[-1])


def by_law(soils: dict[str, Any], site: Site) -> list[Any]:
    """What is given by the name of a soil, for each law of a site, whose parameters may grow with depth."""
    tags = bridge.names_of(site.cell_tags)
    by_tag = {tag: one for name, one in soils.items() for tag in tags.get(name, (name,))}
    return [by_tag[tag] for tag in site.laws]


def directions_of(soils: Iterable[water.PorousSoil | None]) -> list | None:
    """Conductivities of particles over the vertical one, for `Model.add_water(anisotropy=)`: of each soil; None without any."""
    factors = [
        soil.conductivity / np.float64(vertical_conductivity(soil))
        if soil is not None and np.ndim(soil.conductivity)
        else None
        for soil in soils
    ]
    return factors if any(factor is not None for factor in factors) else None
