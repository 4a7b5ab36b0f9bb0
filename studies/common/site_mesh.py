"""The mesh of a site, and the soils that it has."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

from .checks import say
from .site_keys import read_site_table

AIR = ("air", "water", "empty")
"""Groups of a mesh that hold no soil by their names"""


def geometry_of(table: dict[str, Any], path: Path) -> mpm.Geometry | None:
    """Axial symmetry where the table of a site says so, None for plane strain; path: of the file, for messages."""
    axisymmetric = table.get("axisymmetric", False)
    if not isinstance(axisymmetric, bool):
        raise mpm.InputError(f"{path}: axisymmetric is {axisymmetric!r}, expected true or false")
    return mpm.Geometry.AXISYMMETRIC if axisymmetric else None


def site_mesh(table: dict, path: Path, comm: MPI.Comm, cell_size: float | None) -> tuple[Any, Any, Any]:
    """The mesh that the table of a site's file names, cell tags and facet tags; `cell_size` [m] instead of the one there."""
    size = table.get("cell_size") if cell_size is None else cell_size
    constants = table.get("constants", {}) | ({} if size is None else {"cell_size": size})
    mesh = path.parent / str(table["mesh"])
    try:
        return bridge.read_mesh(mesh, comm, parameters=constants)
    except mpm.InputError as error:
        raise mpm.InputError(f"{path}: mesh: {error}") from None


def part_of_mesh(mesh: tuple[Any, Any, Any], soils: Collection[str]) -> tuple[Any, Any, Any]:
    """Domain, cell tags and facet tags of some soils; the mesh itself where it has no others. Collective."""
    return mesh if set(bridge.names_of(mesh[1])) == set(soils) else bridge.soil_mesh(*mesh, tag=list(soils))


def check_soils(table: dict, path: Path, cell_tags: Any) -> None:
    """Compare the soils of a site with the groups of its mesh: warns of groups without a soil, whose cells hold none.

    Raises:
        InputError: a soil that the mesh does not have.
    """
    names = list(bridge.names_of(cell_tags))
    for soil in table["soils"]:
        if soil not in names:
            raise mpm.InputError(
                f"{path}: soils.{soil}: no cell has the name {soil!r}; the mesh has {', '.join(map(repr, names))}"
            )
    declared = table.get("air", [])
    named = {*table["soils"], *AIR, *([declared] if isinstance(declared, str) else declared)}
    left = [name for name in bridge.names_of(cell_tags) if name not in named]
    if left:
        groups = ", ".join(map(repr, left))
        say(f"{path} has no soil for {groups} of the mesh, which therefore holds none, as air; add [soils.NAME], or air = {left!r} "
            "where it is meant")  # fmt: skip


def cell_size_of(path: Path) -> float | None:
    """Cell size [m] that a site names; None where it names none."""
    return read_site_table(path).get("cell_size")
