"""The mesh of a site, and the soils that it has."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

from ..checks import say
from .keys import read_site_table
from .laws import is_number
from .names import names_at, require_boundaries

AIR = ("air", "water", "empty")
"""Groups of a mesh that hold no soil by their names"""


def geometry_of(table: dict[str, Any], path: Path) -> mpm.Geometry | None:
    """Axial symmetry where the table of a site says so, None for plane strain; path: of the file, for messages."""
    axisymmetric = table.get("axisymmetric", False)
    if not isinstance(axisymmetric, bool):
        raise mpm.InputError(f"{path}: axisymmetric is {axisymmetric!r}, expected true or false")
    if axisymmetric and dimension_of(table, path) == 3:
        raise mpm.InputError(
            f"{path} has axisymmetric = true and dimension = 3, expected one of them: a half section is plane"
        )
    return mpm.Geometry.AXISYMMETRIC if axisymmetric else None


def dimension_of(table: dict[str, Any], path: Path) -> int:
    """Dimension of the mesh that the table of a site names; path: of the file, for messages."""
    dimension = table.get("dimension", 2)
    if dimension not in (2, 3) or isinstance(dimension, bool):
        raise mpm.InputError(f"{path}: dimension is {dimension!r}, expected 2 or 3")
    return int(dimension)


def require_plane(table: dict[str, Any], path: Path) -> None:
    """Raise InputError where the table of a site has a body in three dimensions, which a study of the flow of water does not take."""
    if dimension_of(table, path) == 3:
        raise mpm.InputError(
            f"{path}: dimension is 3, expected 2: the studies safety, collapse, excavation, embankment and slope have bodies in three dimensions"
        )


def site_mesh(table: dict, path: Path, comm: MPI.Comm, cell_size: float | None) -> tuple[Any, Any, Any]:
    """The mesh that the table of a site's file names, cell tags and facet tags; `cell_size` [m] instead of the one there."""
    size = table.get("cell_size") if cell_size is None else cell_size
    constants = _constants(table, path) | ({} if size is None else {"cell_size": size})
    mesh = path.parent / str(table["mesh"])
    try:
        domain, cell_tags, facet_tags = bridge.read_mesh(mesh, comm, dimension_of(table, path), parameters=constants)
    except mpm.InputError as error:
        text = str(error).replace(
            "tetrahedra are read with dim=3", "of tetrahedra it needs dimension = 3 in the file of the site"
        )
        raise mpm.InputError(f"{path}: mesh: {text}") from None
    if geometry_of(table, path) is not None:
        _require_radii(domain, path)
    require_boundaries(table, path, facet_tags)
    return domain, cell_tags, facet_tags


def _constants(table: dict[str, Any], path: Path) -> dict[str, float]:
    """Constants of the .geo file that the table of a site gives; path: of the file, for the error."""
    given = table.get("constants", {})
    if not isinstance(given, dict):
        raise mpm.InputError(f"{path}: constants is {given!r}, expected a table such as constants = {{width = 8.0}}")
    for name, value in given.items():
        if not is_number(value):
            raise mpm.InputError(f"{path}: constants.{name} is {value!r}, expected a number")
    return dict(given)


def _require_radii(domain: Any, path: Path) -> None:
    """Require that no node of the mesh of an axisymmetric site is beyond the axis; path: of the file, for the error. Collective."""
    least = min(domain.comm.allgather(float(domain.geometry.x[:, 0].min(initial=np.inf))))
    if least < 0:
        raise mpm.InputError(f"{path}: axisymmetric is true, but the mesh begins at x = {least:g} m; expected x from 0 on, which is the radius: draw "
                             "only the half of the section on that side of the axis, and the axis at x = 0")  # fmt: skip


def part_of_mesh(mesh: tuple[Any, Any, Any], soils: Collection[str]) -> tuple[Any, Any, Any]:
    """Domain, cell tags and facet tags of some soils; the mesh itself where it has no others. Collective."""
    return mesh if set(bridge.names_of(mesh[1])) == set(soils) else bridge.soil_mesh(*mesh, tag=list(soils))


def check_soils(table: dict, path: Path, cell_tags: Any) -> None:
    """Compare the soils of a site with the groups of its mesh: warns of groups without a soil, whose cells hold none.

    Raises:
        InputError: a soil, or a group of `air`, that the mesh does not have.
    """
    names = list(bridge.names_of(cell_tags))
    air = names_at(table, "air", str(path), "groups of the mesh")
    for name, where in [*((soil, f"soils.{soil}") for soil in table["soils"]), *((name, "air") for name in air)]:
        if name not in names:
            raise mpm.InputError(
                f"{path}: {where}: no cell has the name {name!r}; the mesh has {', '.join(map(repr, names))}"
            )
    named = {*table["soils"], *AIR, *air}
    left = [name for name in bridge.names_of(cell_tags) if name not in named]
    if left:
        groups = ", ".join(map(repr, left))
        say(f"{path} has no soil for {groups} of the mesh, which therefore holds none, as air; add [soils.NAME], or air = {left!r} "
            "where it is meant")  # fmt: skip


def cell_size_of(path: Path) -> float | None:
    """Cell size [m] that a site names; None where it names none."""
    return read_site_table(path).get("cell_size")
