"""The background mesh of a slope: soil and empty cells of one conforming mesh."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.collective import on_first_rank
from mpm_core.input_warnings import warn_of_radians
from numpy.typing import NDArray

from fenics_bridge.errors import InputError, is_finite
from fenics_bridge.mesh.gmsh_reader import gmsh, gmsh_message, gmsh_session
from fenics_bridge.mesh.meshes import arrays_from_model
from fenics_bridge.mesh.names import name_tags
from fenics_bridge.mesh.tagged import MeshArrays, distributed_mesh, empty_arrays
from fenics_bridge.types import MeshTags

SOIL, EMPTY = 1, 2
"""Cell tags of a slope mesh."""

LEFT, BASE, RIGHT, TOP, SLOPE, CREST = 1, 2, 3, 4, 5, 6
"""Facet tags of a slope mesh: the four sides of the background, and the free surface of the soil."""

_NAMES = (
    {"soil": SOIL, "empty": EMPTY},
    {"left": LEFT, "base": BASE, "right": RIGHT, "top": TOP, "slope": SLOPE, "crest": CREST},
)


def slope_mesh(
    comm: MPI.Comm,
    height: float = 1.0,
    angle: float = 45.0,
    crest: float | None = None,
    cell_size: float = 0.1,
    kind: str = "crossed",
    runout: float | None = None,
    headroom: float | None = None,
    depth: float = 0.0,
) -> tuple[Mesh, MeshTags, MeshTags]:
    """Background mesh of a slope, with the soil before failure tagged. Collective.

    The soil has the corners (0, 0), (base, 0), (crest, height) and (0, height), base = crest + height / tan(angle).
    The background reaches from x = 0 to base + runout and from y = -depth to height + headroom; the ground below y = 0 is soil
    over the whole of that length.

    Args:
        comm: the ranks that share the mesh.
        height: height of the slope [m].
        angle: angle of the slope to the horizontal [degrees], above 0 and up to 90.
        crest: length of the level ground behind the slope [m]; None for 1.1 times the height, with "crossed" the next whole cells.
        cell_size: edge of the squares, or of the triangles of an unstructured mesh [m].
        kind: "crossed", squares cut in four by their diagonals (angle 45 or 90; height and crest whole cells); "fitted", the same
            with the squares stretched to fit any slope; "gmsh", unstructured.
        runout: length of the background past the toe [m]; None for twice the height. All kinds but "gmsh" round it up to whole cells.
        headroom: height of the background above the crest [m], rounded like `runout`; None for one cell.
        depth: of the soil below the toe [m], rounded like `runout`; none with "gmsh".

    Returns:
        The mesh, the tags of its cells, SOIL and EMPTY, and the tags of its facets: LEFT, BASE, RIGHT, TOP on the sides of the
        background, SLOPE and CREST on the free surface of the soil (CREST also where it is a side of the background).

    Raises:
        InputError: dimensions that are out of range or do not fit, or another kind. Raised on all ranks alike.
    """

    def arrays() -> Any:
        lengths = _lengths(height, cell_size, kind, crest, runout, headroom)
        shape = _checked(height, angle, lengths[0], cell_size, *lengths[1:], depth)
        makers = {"crossed": _crossed, "fitted": _fitted, "gmsh": _unstructured}
        if kind not in makers:
            raise InputError(f"kind is {kind!r}, expected one of {', '.join(makers)}")
        return makers[kind](*shape)

    result = on_first_rank(comm, arrays)
    if comm.rank == 0:
        warn_of_radians(angle=angle)
    domain, cell_tags, facet_tags = distributed_mesh(comm, result if result is not None else empty_arrays(2), 2)
    return domain, name_tags(cell_tags, _NAMES[0]), name_tags(facet_tags, _NAMES[1])


def _lengths(
    height: float, cell_size: float, kind: str, crest: float | None, runout: float | None, headroom: float | None
) -> tuple[float, float, float]:
    """Crest, runout and headroom [m], those that are None by the height and the cells."""
    for name, value in (("height", height), ("cell_size", cell_size)):
        if not (is_finite(value) and value > 0):
            raise InputError(f"{name} is {value!r} m, expected a positive length")
    if crest is None:
        crest = 1.1 * height
        if kind == "crossed":
            crest = cell_size * math.ceil(crest / cell_size - 1e-9)
    return crest, 2.0 * height if runout is None else runout, cell_size if headroom is None else headroom


def _checked(
    height: float,
    angle: float,
    crest: float,
    cell_size: float,
    runout: Any,
    headroom: Any,
    depth: Any,
) -> tuple[Any, ...]:
    for name, value in (("crest", crest), ("runout", runout)):
        if not (is_finite(value) and value > 0):
            raise InputError(f"{name} is {value!r} m, expected a positive length")
    if not (is_finite(headroom) and headroom >= 0):
        raise InputError(f"headroom is {headroom!r} m, expected a length, zero or more")
    if not (is_finite(depth) and depth >= 0):
        raise InputError(f"depth is {depth!r} m, expected a length, zero or more")
    if not (is_finite(angle) and 0 < angle <= 90):
        raise InputError(f"angle is {angle!r} degrees, expected more than 0 and at most 90")
    if cell_size > min(height, crest):
        raise InputError(f"cell_size is {cell_size!r} m, expected at most the height {height} m and crest {crest} m")
    slope_length = 0.0 if angle == 90 else height / math.tan(math.radians(angle))
    return height, crest, crest + slope_length, cell_size, runout, headroom, depth


def _crossed(
    height: float, crest: float, base: float, size: float, runout: float, headroom: float, depth: float
) -> tuple[Any, ...]:
    _require_multiple("height", height, size)
    _require_multiple("crest", crest, size)
    run = base - crest
    if min(abs(run - height), run) > 1e-9 * height:
        raise InputError(
            f"angle is {_angle(height, run):.6g} degrees; kind='crossed' has cell edges at 45 and 90 "
            "degrees only, use kind='fitted' or 'gmsh'"
        )
    return _fitted(height, crest, base, size, runout, headroom, depth)


def _require_multiple(name: str, value: float, cell_size: float) -> None:
    if abs(round(value / cell_size) * cell_size - value) > 1e-9 * value:
        raise InputError(
            f"{name}: {value!r} m is not a multiple of cell_size={cell_size!r} m, as kind='crossed' "
            "needs; use kind='fitted' or 'gmsh'"
        )


def _angle(height: float, run: float) -> float:
    return math.degrees(math.atan2(height, run))


def _fitted(
    height: float, crest: float, base: float, size: float, runout: float, headroom: float, depth: float
) -> tuple[Any, ...]:
    """Rectangles cut in four; under the slope there are as many columns as rows, so that it runs along diagonals."""
    run = base - crest
    if run > 0 and not 0.2 <= height / run <= 5:
        raise InputError(
            f"angle is {_angle(height, run):.6g} degrees; kind='fitted' would need cells that are too "
            "long, expected 11.4 to 78.6, or 90, degrees; use kind='gmsh'"
        )
    rows, columns = round(height / size), round(crest / size)
    slope_columns = rows if run > 0 else 0
    x = np.concatenate(
        [
            np.linspace(0, crest, columns + 1),
            np.linspace(crest, base, slope_columns + 1)[1:],
            base + size * np.arange(1, math.ceil(runout / size - 1e-9) + 1),
        ]
    )
    y = np.concatenate(
        [
            -size * np.arange(math.ceil(depth / size - 1e-9), 0, -1),
            np.linspace(0, height, rows + 1),
            height + size * np.arange(1, math.ceil(headroom / size - 1e-9) + 1),
        ]
    )
    points, cells = _crossed_rectangles(x, y)
    centroids = points[cells].mean(axis=1)
    above_toe = (centroids[:, 1] < height) & (centroids[:, 0] < crest + run * (1 - centroids[:, 1] / height))
    soil = above_toe | (centroids[:, 1] < 0)
    facets, values = _tagged_edges(points, cells, soil, crest)
    return MeshArrays(points, cells, np.where(soil, SOIL, EMPTY).astype(np.int32), facets, values)


def _crossed_rectangles(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[Any, ...]:
    """The rectangles of a grid, each cut in four by its diagonals: corner nodes first, then the centres."""
    centres = 0.5 * (x[:-1] + x[1:]), 0.5 * (y[:-1] + y[1:])
    points = np.vstack([np.column_stack([a.ravel() for a in np.meshgrid(*axes)]) for axes in ((x, y), centres)])
    nx, ny = len(x) - 1, len(y) - 1
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny)))
    corner = j * (nx + 1) + i
    ring = np.stack([corner, corner + 1, corner + nx + 2, corner + nx + 1])
    centre = (nx + 1) * (ny + 1) + np.arange(nx * ny)
    cells = [np.column_stack([ring[k], ring[(k + 1) % 4], centre]) for k in range(4)]
    return points, np.stack(cells, axis=1).reshape(-1, 3)


def _tagged_edges(
    points: NDArray[np.float64], cells: NDArray[np.integer], soil: NDArray[np.bool_], crest: Any
) -> tuple[Any, ...]:
    """Edges of the outer boundary and of the soil's free surface, (k, 2) nodes, with their tags."""
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, inverse, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    soil_sides = np.bincount(inverse.ravel(), weights=np.repeat(soil, 3))
    x, y = points[edges].mean(axis=1).T
    right, top = points.max(axis=0)
    bottom = points[:, 1].min()
    outer = count == 1
    free = (soil_sides == 1) & (~outer | (y == top))
    level = points[edges[:, 0], 1] == points[edges[:, 1], 1]
    values = np.select(
        [free & level & (x < crest), free, outer & (x == 0), outer & (y == bottom), outer & (x == right), outer],
        [CREST, SLOPE, LEFT, BASE, RIGHT, TOP],
        0,
    ).astype(np.int32)
    return edges[values > 0], values[values > 0]


def _unstructured(
    height: float, crest: float, base: float, size: float, runout: float, headroom: float, depth: float
) -> tuple[Any, ...]:
    if depth > 0:
        raise InputError(f"depth is {depth!r} m, expected 0 with kind='gmsh'; use kind='fitted'")
    with gmsh_session():
        try:
            _slope_geometry(height, crest, base, size, runout, headroom)
            gmsh.model.mesh.generate(2)
        except Exception as error:  # gmsh's Python interface raises nothing more special
            raise InputError(f"slope_mesh: gmsh cannot mesh this slope: {gmsh_message(error)}") from error
        return arrays_from_model(2, "slope_mesh")


def _slope_geometry(height: float, crest: float, base: float, size: float, runout: float, headroom: float) -> None:
    geo = gmsh.model.geo
    right, top = base + runout, height + headroom
    origin, toe, shoulder, back, end, corner, above = (
        geo.addPoint(x, y, 0, size)
        for x, y in ((0, 0), (base, 0), (crest, height), (0, height), (right, 0), (right, top), (0, top))
    )
    base_line, slope, crest_line, left = (
        geo.addLine(a, b) for a, b in ((origin, toe), (toe, shoulder), (shoulder, back), (back, origin))
    )
    run, side = geo.addLine(toe, end), geo.addLine(end, corner)
    groups = {BASE: [base_line, run], SLOPE: [slope], CREST: [crest_line], LEFT: [left], RIGHT: [side]}
    if headroom > 0:
        roof, left_above = geo.addLine(corner, above), geo.addLine(above, back)
        groups[LEFT].append(left_above)
        rest = [roof, left_above, -crest_line, -slope]
    else:
        roof = geo.addLine(corner, shoulder)
        rest = [roof, -slope]
    groups[TOP] = [roof]
    soil = geo.addPlaneSurface([geo.addCurveLoop([base_line, slope, crest_line, left])])
    empty = geo.addPlaneSurface([geo.addCurveLoop([run, side, *rest])])
    geo.synchronize()
    for tag, lines in groups.items():
        gmsh.model.addPhysicalGroup(1, lines, tag)
    for tag, surface in ((SOIL, soil), (EMPTY, empty)):
        gmsh.model.addPhysicalGroup(2, [surface], tag)
