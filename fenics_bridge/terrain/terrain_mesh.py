"""A background mesh over ground: fine where a slide runs, coarse outside, in layers that follow the ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.collective import on_first_rank

from fenics_bridge.errors import InputError, is_finite
from fenics_bridge.mesh.gmsh_reader import gmsh, gmsh_message, gmsh_session
from fenics_bridge.mesh.meshes import arrays_from_model
from fenics_bridge.mesh.tagged import MeshArrays, distributed_mesh, empty_arrays
from fenics_bridge.terrain.raster import Raster
from fenics_bridge.types import MeshTags

SIDES, GROUND, SKY = 1, 2, 3
"""Facet tags of a terrain mesh: its upright sides, its lower side below the ground, and its upper side."""


def terrain_mesh(
    comm: MPI.Comm,
    ground: Raster,
    *,
    cell_size: float,
    height: float,
    fine: tuple[Sequence[float], Sequence[float]],
    coarse_size: float | None = None,
    depth: float | None = None,
) -> tuple[Mesh, MeshTags, MeshTags]:
    """Tetrahedra over ground: gmsh makes triangles in plan, which are extruded in layers parallel to the ground. Collective.

    Args:
        comm: the ranks that share the mesh.
        ground: heights; the mesh is as large as the raster less a cell of it on each side, so that no soil comes to its border.
        cell_size: size of the triangles where the mesh is fine, and thickness of the layers [m].
        height: height of the mesh above the ground [m]: more than the thickness of the slide, with what it is thrown up.
        fine: corners ((x, y), (x, y)) of the rectangle in plan where the mesh is fine [m].
        coarse_size: size of the triangles far from it [m], four times cell_size by default.
        depth: depth of the mesh below the ground [m], 1.5 cell_size by default: space for cells that the ground cuts.

    Returns:
        The mesh, the tags of its cells, and the tags of its facets, SIDES, GROUND and SKY.

    Raises:
        InputError: sizes that do not fit. Raised on all ranks alike.
    """
    coarse = 4 * cell_size if coarse_size is None else coarse_size
    below = 1.5 * cell_size if depth is None else depth

    def arrays() -> Any:
        _check(ground, cell_size, height, coarse, below, fine)
        plan = _plan(ground, cell_size, coarse, fine)
        return _extruded(plan, ground, below, height, max(1, round((height + below) / cell_size)))

    result = on_first_rank(comm, arrays)
    return distributed_mesh(comm, result if result is not None else empty_arrays(3), 3)


def _check(ground: Any, cell_size: float, height: float, coarse: Any, below: Any, fine: Any) -> None:
    for name, value in (("cell_size", cell_size), ("height", height), ("coarse_size", coarse), ("depth", below)):
        if not (is_finite(value) and value > 0):
            raise InputError(f"{name} is {value!r} m, expected a positive length")
    if coarse < cell_size:
        raise InputError(f"coarse_size is {coarse!r} m, expected at least cell_size, {cell_size!r} m")
    (x0, y0), (x1, y1) = fine
    if not (x0 < x1 and y0 < y1):
        raise InputError(f"fine is {fine!r} m, expected two corners, the lower left one first")
    if min(len(ground.x), len(ground.y)) < 4:
        raise InputError(f"ground has {len(ground.y)} rows and {len(ground.x)} columns, expected at least 4 of each")


def _plan(ground: Any, cell_size: float, coarse: Any, fine: Any) -> tuple[Any, ...]:
    """Triangles in plan, by gmsh."""
    x0, x1, y0, y1 = ground.x[1], ground.x[-2], ground.y[1], ground.y[-2]
    with gmsh_session() as model:
        try:
            model.add("terrain")
            model.occ.addRectangle(x0, y0, 0, x1 - x0, y1 - y0)
            model.occ.synchronize()
            field = model.mesh.field.add("Box")
            values = {"VIn": cell_size, "VOut": coarse, "XMin": fine[0][0], "XMax": fine[1][0], "YMin": fine[0][1],
                      "YMax": fine[1][1], "ZMin": -1, "ZMax": 1, "Thickness": 4 * coarse}  # fmt: skip
            for name, value in values.items():
                model.mesh.field.setNumber(field, name, float(value))
            model.mesh.field.setAsBackgroundMesh(field)
            for option in ("MeshSizeExtendFromBoundary", "MeshSizeFromPoints", "MeshSizeFromCurvature"):
                gmsh.option.setNumber(f"Mesh.{option}", 0)
            model.mesh.generate(2)
        except Exception as error:  # gmsh's Python interface raises nothing more special
            raise InputError(f"terrain_mesh: gmsh cannot mesh the plan: {gmsh_message(error)}") from error
        return arrays_from_model(2, "terrain_mesh")


def _extruded(plan: Any, ground: Any, below: Any, height: float, layers: Any) -> tuple[Any, ...]:
    """Prisms over the triangles, each in three tetrahedra.

    The diagonals of sides go up from the column of the lower number, so that neighbours agree (Dompierre et al. 1999).
    """
    columns, n = np.sort(plan.cells, axis=1), len(plan.points)
    floor = ground.at(plan.points) - below
    levels = (below + height) * np.arange(layers + 1) / layers
    points = np.concatenate([np.column_stack([plan.points, floor + level]) for level in levels])
    a, b, c = columns.T
    cells = [np.stack(four, axis=1) + k * n for k in range(layers)
             for four in ((a, b, c, c + n), (a, b, b + n, c + n), (a, a + n, b + n, c + n))]  # fmt: skip
    edges = np.concatenate([columns[:, pair] for pair in ((0, 1), (0, 2), (1, 2))])
    unique, counts = np.unique(edges, axis=0, return_counts=True)
    p, q = unique[counts == 1].T  # the border in plan
    sides = [np.stack(three, axis=1) + k * n for k in range(layers) for three in ((p, q, q + n), (p, p + n, q + n))]
    groups = [(SIDES, np.concatenate(sides)), (GROUND, columns), (SKY, columns + layers * n)]
    facets = np.concatenate([nodes for _, nodes in groups]).astype(np.int64)
    tags = np.concatenate([np.full(len(nodes), tag, np.int32) for tag, nodes in groups])
    names = {"sides": (SIDES,), "ground": (GROUND,), "sky": (SKY,)}
    tetrahedra = np.concatenate(cells).astype(np.int64)
    return MeshArrays(points, tetrahedra, np.zeros(len(tetrahedra), np.int32), facets, tags, {}, names)
