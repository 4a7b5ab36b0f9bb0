"""A site of slopes under water that rises, falls or rains on them: mesh, soils with law and conductivity, supports, and water.

`meshes/drawdown.toml` and `meshes/rain.toml` are examples. The file has the keys of a site of stages and those of a site of
seepage: each soil has a law of effective stresses, a unit weight, conductivity and a retention curve. All soils are there at once.
Cells of the mesh that no soil names are air, or water, into which the soil may slide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.water.boundary import value_at
from fenics_bridge.water.soils import WATER_WEIGHT

from ..checks import say
from ..site.doubts import warn_of_flooded_ground, warn_of_heads, warn_of_members, warn_of_pressures, warn_of_reservoirs
from ..site.file import Site, site_of
from ..site.flow import boundary_of, wet_soils
from ..site.flow_doubts import warn_of_rigid_soil
from ..site.k0 import k0_of, overconsolidation_of, say_left_out
from ..site.keys import CHANGES, changes_of
from ..site.strength import refuse_strength_ratio
from ..site.supports import supports_of_soil
from ..water.site import corners_of, effective_laws, read_water_table, standing_load, times_of


@dataclass
class SlopeSite:
    """A slope and its water as a file describes them.

    site: mesh, laws, weights and supports; porous: {soil: PorousSoil}; boundary: of `fenics_bridge.water`
    body: domain, cell tags and facet tags of the soil alone
    """

    site: Site
    porous: dict[str, water.PorousSoil]
    boundary: list
    body: tuple

    def seepage(self, boundary: list | None = None) -> water.Seepage:
        """The flow in linear elements, at rest; its reservoirs load the soil as well. Collective."""
        domain, cell_tags, facet_tags = self.body
        boundary = self.boundary if boundary is None else boundary
        return water.Seepage(domain, self.porous, facet_tags, boundary, cell_tags=cell_tags, loading=self.standing())

    def standing(self) -> Callable | None:
        """Pressure of the water on the ground by positions and time, as of `standing_water`; None without a reservoir.

        Collective.
        """
        domain, _, facet_tags = self.body
        return standing_load(domain, facet_tags, self.boundary)

    def ground(self) -> list[tuple]:
        """Reservoirs, each with a line of the ground below it, of which it may have several: (condition, x, y). Collective."""
        domain, _, facet_tags = self.body
        return [
            (c, *line)
            for c in self.boundary
            if isinstance(c, water.Reservoir)
            for line in water.ground_lines(domain, facet_tags, c.facet_tag)
        ]

    def free_water(self, time: float) -> Callable:
        """Pressure [Pa] of the reservoirs at a time [s] at positions outside of the soil; zero above them. Collective."""
        reservoirs = [(value_at(condition.level, time), x[0], x[-1]) for condition, x, _ in self.ground()]

        def pressure(points: np.ndarray) -> np.ndarray:
            depth = np.zeros(len(points))
            for level, left, right in reservoirs:
                beside = (points[:, 0] >= left - 1e-6) & (points[:, 0] <= right + 1e-6)
                depth = np.maximum(depth, np.where(beside, level - points[:, 1], 0.0))
            return WATER_WEIGHT * depth

        return pressure

    def elements(
        self, degree: int, pore_pressure: Callable, laws: dict | None = None, **options: Any
    ) -> bridge.QuasiStatic:
        """Elements of the soil, unloaded, under given pore pressures. Collective."""
        domain, cell_tags, facet_tags = self.body
        site = self.site
        supports = supports_of_soil(site.supports, domain, facet_tags)
        fem = bridge.QuasiStatic(
            domain, laws or site.laws, facet_tags, supports, degree, cell_tags=cell_tags, **options
        )
        site.vary(fem, laws or site.laws)
        fem.reconfigure(pore_pressure=pore_pressure)
        return fem

    def times(self, end: float) -> list[float]:
        """Times [s] up to an end at which a table of the boundary conditions has a corner."""
        return [time for time in corners_of(times_of(self.boundary)) if time <= end]

    def boundary_at(self, time: float) -> list:
        """The boundary conditions with the values that they have at a time [s], for good."""
        return [_held(condition, time) for condition in self.boundary]


def _held(condition: Any, time: float) -> Any:
    names = [name for name in ("level", "rate") if hasattr(condition, name)]
    return replace(condition, **{name: value_at(getattr(condition, name), time) for name in names})


def read_slope_site(path: Path, comm: MPI.Comm, cell_size: float | None = None, slower: float = 1.0) -> SlopeSite:
    """Read a site of slopes and make its mesh. Collective.

    Args:
        path: of the TOML file.
        cell_size: [m], instead of the one in the file.
        slower: factor on the times of all tables.

    Raises:
        InputError: on all ranks, with the file, the key and what was expected.
    """
    table = read_water_table(path, needed=("boundaries",))
    porous = {}
    for name, soil in wet_soils(table, path).items():
        if soil is None:
            raise mpm.InputError(
                f"{path}: soils.{name} has no conductivity [m/s], which this study needs for the flow of water"
            )
        porous[name] = soil
    changes = changes_of(table.get("stages", []), (*CHANGES, "boundaries"))
    if changes:
        say(f"{path}: all soils are there at once, and this study leaves out {changes}")
    warn_of_pressures(table, path)
    warn_of_members(table, path)
    say_left_out(k0_of(table["soils"], path), overconsolidation_of(table["soils"], path), str(path))
    boundary = [_slower(one, slower) for one in boundary_of(table, path).values()]
    site = site_of(effective_laws(table), path, comm, cell_size, interfaces=False)
    refuse_strength_ratio(site, path)
    body = site.body()
    warn_of_reservoirs(body[0], boundary, path)
    warn_of_flooded_ground(body[0], body[2], boundary, path)
    warn_of_heads(body[0], body[2], boundary, path)
    warn_of_rigid_soil(porous, boundary, path)
    return SlopeSite(site, porous, boundary, body)


def _slower(condition: Any, factor: float) -> Any:
    tables = {
        name: getattr(condition, name)
        for name in ("level", "rate")
        if isinstance(getattr(condition, name, None), tuple)
    }
    rows = {name: tuple((factor * time, value) for time, value in table) for name, table in tables.items()}
    return replace(condition, **rows)
