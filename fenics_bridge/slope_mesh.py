"""The background mesh of a slope: soil and empty cells of one conforming mesh."""

from __future__ import annotations

import math

import gmsh
import numpy as np

from fenics_bridge.errors import InputError, on_root
from fenics_bridge.meshes import arrays_from_model, gmsh_message, gmsh_session
from fenics_bridge.tagged import MeshArrays, distributed_mesh, empty_arrays

SOIL, EMPTY = 1, 2
"""Cell tags of a slope mesh."""

LEFT, BASE, RIGHT, TOP, SLOPE, CREST = 1, 2, 3, 4, 5, 6
"""Facet tags of a slope mesh: the four sides of the background, and the free surface of the soil."""


def slope_mesh(comm, height=1.0, angle=45.0, crest=1.1, cell_size=0.1, kind="crossed", runout=2.0, headroom=None):
    """Background mesh of a slope, with the soil before failure tagged.

    The soil has the corners (0, 0), (base, 0), (crest, height) and (0, height), base = crest + height / tan(angle).
    The background reaches from x = 0 to base + runout and from y = 0 to height + headroom.

    height, crest: [m], angle: of the slope [degrees], above 0 and up to 90
    cell_size: [m] edge of the squares, or of the triangles of an unstructured mesh
    kind: "crossed", squares cut in four by their diagonals (angle 45 or 90), or "gmsh", unstructured
    runout: length of the background past the toe [m]; headroom: its height above the crest [m], None for one cell.
        A crossed mesh rounds both up to whole cells.
    Returns (domain, cell_tags, facet_tags): cells SOIL and EMPTY; facets LEFT, BASE, RIGHT, TOP on the sides of the
    background, SLOPE and CREST on the free surface of the soil (CREST also where it is a side of the background).
    Raises InputError, on all ranks, for dimensions that do not fit. Collective.
    """
    headroom = cell_size if headroom is None else headroom

    def arrays():
        shape = _checked(height, angle, crest, cell_size, runout, headroom)
        if kind == "crossed":
            return _crossed(*shape)
        if kind == "gmsh":
            return _unstructured(*shape)
        raise InputError(f"kind: got {kind!r}, expected 'crossed' or 'gmsh'")

    result = on_root(comm, arrays)
    return distributed_mesh(comm, result if result is not None else empty_arrays(2), 2)


def _checked(height, angle, crest, cell_size, runout, headroom):
    for name, value in (("height", height), ("crest", crest), ("cell_size", cell_size), ("runout", runout)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name}: got {value!r} m, expected a positive length")
    if not (np.isfinite(headroom) and headroom >= 0):
        raise InputError(f"headroom: got {headroom!r} m, expected a length, zero or more")
    if not 0 < angle <= 90:
        raise InputError(f"angle: got {angle!r} degrees, expected more than 0 and at most 90")
    if cell_size > min(height, crest):
        raise InputError(f"cell_size: got {cell_size!r} m, expected at most the height {height} m and crest {crest} m")
    slope_length = 0.0 if angle == 90 else height / math.tan(math.radians(angle))
    return height, crest, crest + slope_length, cell_size, runout, headroom


def _multiple(name, value, cell_size):
    count = round(value / cell_size)
    if abs(count * cell_size - value) > 1e-9 * value:
        raise InputError(f"{name}: {value!r} m is not a multiple of cell_size={cell_size!r} m, as kind='crossed' "
                         "needs; use kind='gmsh'")
    return count


def _crossed(height, crest, base, size, runout, headroom):
    rows, columns = _multiple("height", height, size), _multiple("crest", crest, size)
    run = base - crest
    slope_columns = round(run / size)
    if min(abs(run - height), run) > 1e-9 * height:
        angle = math.degrees(math.atan2(height, run))
        raise InputError(f"angle: got {angle:.6g} degrees; kind='crossed' has cell edges at 45 and 90 degrees only, "
                         "use kind='gmsh'")
    nx = columns + slope_columns + math.ceil(runout / size - 1e-9)
    ny = rows + math.ceil(headroom / size - 1e-9)
    points, cells = _crossed_squares(nx, ny)
    centroids = points[cells].mean(axis=1)
    surface = columns + (slope_columns * (rows - centroids[:, 1]) / rows)
    soil = (centroids[:, 1] < rows) & (centroids[:, 0] < surface)
    facets, values = _tagged_edges(points, cells, soil, (columns, rows, nx, ny))
    return MeshArrays(points * size, cells, np.where(soil, SOIL, EMPTY).astype(np.int32), facets, values)


def _crossed_squares(nx, ny):
    """nx by ny unit squares, each cut in four: corner nodes first, then the centres."""
    x, y = np.meshgrid(np.arange(nx + 1.0), np.arange(ny + 1.0))
    cx, cy = np.meshgrid(np.arange(nx) + 0.5, np.arange(ny) + 0.5)
    points = np.vstack([np.column_stack([x.ravel(), y.ravel()]), np.column_stack([cx.ravel(), cy.ravel()])])
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny)))
    corner = j * (nx + 1) + i
    ring = np.stack([corner, corner + 1, corner + nx + 2, corner + nx + 1])
    centre = (nx + 1) * (ny + 1) + np.arange(nx * ny)
    cells = [np.column_stack([ring[k], ring[(k + 1) % 4], centre]) for k in range(4)]
    return points, np.stack(cells, axis=1).reshape(-1, 3)


def _tagged_edges(points, cells, soil, extent):
    """Edges of the outer boundary and of the soil's free surface with their tags; lengths in cells."""
    columns, rows, nx, ny = extent
    edges = np.sort(cells[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges, inverse, count = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    soil_sides = np.bincount(inverse.ravel(), weights=np.repeat(soil, 3))
    middle = points[edges].mean(axis=1)
    x, y = middle.T
    outer = count == 1
    free = (soil_sides == 1) & (~outer | (y == ny))
    values = np.select(
        [free & (y == rows) & (x < columns), free, outer & (x == 0), outer & (y == 0), outer & (x == nx), outer],
        [CREST, SLOPE, LEFT, BASE, RIGHT, TOP], 0).astype(np.int32)
    return edges[values > 0], values[values > 0]


def _unstructured(height, crest, base, size, runout, headroom):
    with gmsh_session():
        try:
            _slope_geometry(height, crest, base, size, runout, headroom)
            gmsh.model.mesh.generate(2)
        except Exception as error:  # gmsh's Python interface raises nothing more special
            raise InputError(f"slope_mesh: gmsh cannot mesh this slope: {gmsh_message(error)}") from error
        return arrays_from_model(2, "slope_mesh")


def _slope_geometry(height, crest, base, size, runout, headroom):
    geo = gmsh.model.geo
    right, top = base + runout, height + headroom
    origin, toe, shoulder, back, end, corner, above = (
        geo.addPoint(x, y, 0, size) for x, y in
        ((0, 0), (base, 0), (crest, height), (0, height), (right, 0), (right, top), (0, top)))
    base_line, slope, crest_line, left = (
        geo.addLine(a, b) for a, b in ((origin, toe), (toe, shoulder), (shoulder, back), (back, origin)))
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
