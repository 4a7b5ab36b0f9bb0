"""Heights on a grid of square cells, from and to ESRI ASCII grids, GeoTIFF and XYZ files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import mpm_core as mpm
from fenics_bridge.errors import InputError
from fenics_bridge.terrain.geotiff import check_reference, read_geotiff, write_geotiff

TIFF = (".tif", ".tiff")
STEEPEST = 20.0
"""Mean slope above which the coordinates of a raster are taken for degrees"""


@dataclass(frozen=True)
class Raster:
    """Values at the points of a grid, commonly heights of ground."""

    x: NDArray[np.float64]
    """Coordinates of the columns [m], shape (nx,), rising, with the same spacing as the rows"""
    y: NDArray[np.float64]
    """Coordinates of the rows [m], shape (ny,), rising"""
    values: NDArray[np.float64]
    """Values at the points, such as heights [m], shape (ny, nx)"""
    crs: str = "local"
    """Coordinate reference, for instance "EPSG:25832", or "local" for metres on a plane"""

    def __repr__(self) -> str:
        known = self.values[np.isfinite(self.values)]
        values = f"{known.min():.6g} to {known.max():.6g}" if len(known) else "none"
        return (
            f"<Raster: {len(self.x)} by {len(self.y)} points {self.spacing:g} m apart, x {self.x[0]:.10g} to {self.x[-1]:.10g} m, "
            f"y {self.y[0]:.10g} to {self.y[-1]:.10g} m, values {values}, {self.crs}>"
        )

    @property
    def spacing(self) -> float:
        """Distance between neighbouring points [m]."""
        return float(self.x[-1] - self.x[0]) / (len(self.x) - 1)

    def place(self, points: ArrayLike) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Cells of points; points outside are moved to the border.

        Args:
            points: positions [m], shape (n, 2) or (n, 3).

        Returns:
            Rows and columns of the cells, and the fractions of a cell by which the points are beyond its first corner, along x
            and along y, each of shape (n,).
        """
        across = np.clip((np.asarray(points)[:, 0] - self.x[0]) / self.spacing, 0, len(self.x) - 1)
        up = np.clip((np.asarray(points)[:, 1] - self.y[0]) / self.spacing, 0, len(self.y) - 1)
        column = np.minimum(across.astype(int), len(self.x) - 2)
        row = np.minimum(up.astype(int), len(self.y) - 2)
        return row, column, across - column, up - row

    def at(self, points: ArrayLike) -> NDArray[np.float64]:
        """Values at points, bilinear between those of the grid and constant beyond it.

        Args:
            points: positions [m], shape (n, 2) or (n, 3).

        Returns:
            Shape (n,).
        """
        row, column, s, t = self.place(points)
        v = self.values
        low = (1 - s) * v[row, column] + s * v[row, column + 1]
        return (1 - t) * low + t * ((1 - s) * v[row + 1, column] + s * v[row + 1, column + 1])

    def slope(self, points: ArrayLike) -> NDArray[np.float64]:
        """Gradient of the bilinear values at points.

        Args:
            points: positions [m], shape (n, 2) or (n, 3).

        Returns:
            Shape (n, 2) [-].
        """
        row, column, s, t = self.place(points)
        v = self.values
        a, b, c, d = v[row, column], v[row, column + 1], v[row + 1, column], v[row + 1, column + 1]
        return np.stack([(1 - t) * (b - a) + t * (d - c), (1 - s) * (c - a) + s * (d - b)], axis=1) / self.spacing

    def window(self, low: Sequence[float], high: Sequence[float]) -> Raster:
        """The part between two corners, rounded outwards to whole cells.

        Args:
            low: lower left corner (x, y) [m].
            high: upper right corner (x, y) [m].

        Raises:
            InputError: it is not inside the raster.
        """
        eps = 1e-9 * self.spacing
        columns = np.flatnonzero((self.x > low[0] - self.spacing + eps) & (self.x < high[0] + self.spacing - eps))
        rows = np.flatnonzero((self.y > low[1] - self.spacing + eps) & (self.y < high[1] + self.spacing - eps))
        inside = (
            self.x[0] <= low[0] + eps
            and high[0] - eps <= self.x[-1]
            and self.y[0] <= low[1] + eps
            and high[1] - eps <= self.y[-1]
        )
        if not (low[0] < high[0] and low[1] < high[1] and inside):
            raise InputError(f"window is {tuple(low)} to {tuple(high)} m, expected corners inside of x "
                             f"{self.x[0]:.10g} to {self.x[-1]:.10g} m "
                             f"and y {self.y[0]:.10g} to {self.y[-1]:.10g} m")  # fmt: skip
        return Raster(self.x[columns], self.y[rows], self.values[np.ix_(rows, columns)], self.crs)

    def triangles(self) -> mpm.Triangles:
        """The ground as a rigid surface, two triangles for each cell, with normals that point upwards."""
        nx, ny = len(self.x), len(self.y)
        x, y = np.meshgrid(self.x, self.y)
        corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).ravel()
        low = np.stack([corner, corner + 1, corner + nx + 1], axis=1)
        high = np.stack([corner, corner + nx + 1, corner + nx], axis=1)
        vertices = np.stack([x.ravel(), y.ravel(), self.values.ravel()], axis=1)
        return mpm.Triangles(vertices, np.concatenate([low, high]).astype(np.int32))


def read_raster(
    path: str | Path,
    *,
    crs: str | None = None,
    window: tuple[Sequence[float], Sequence[float]] | None = None,
    heights: bool = True,
) -> Raster:
    """Read heights, or another map, from a file: an ESRI ASCII grid (.asc), GeoTIFF (.tif), or points x y z of a grid in any order (.xyz, .txt).

    GeoTIFF needs rasterio (Debian: python3-rasterio).

    Args:
        path: the file.
        crs: coordinate reference, where neither the file nor a .prj beside it names one; "local" for metres on a plane.
        window: corners ((x, y), (x, y)) [m] of the part to take; outside of it there may be gaps.
        heights: whether the values are heights of the ground; False for a map such as that of a slide, whose gaps are NaN.

    Raises:
        InputError: a file that is missing or damaged, points that are no grid of square cells, gaps in heights (with their number and
            the first one), degrees in place of metres, an unknown coordinate reference, and GeoTIFF without rasterio.
    """
    path = Path(path)
    readers = {".asc": _read_ascii, ".xyz": _read_points, ".txt": _read_points}
    ending = path.suffix.lower()
    if ending in TIFF:
        x, y, values, inside = read_geotiff(path)
    elif ending in readers:
        try:
            x, y, values = readers[ending](path.read_text(), str(path))
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"path: {str(path)!r} cannot be read: {error}") from None
        inside = ""
    else:
        raise InputError(f"path is {str(path)!r}, expected a file ending in {', '.join((*readers, *TIFF))}")
    raster = Raster(x, y, values, _reference(path, crs if crs is not None else inside or None))
    raster = raster if window is None else raster.window(*window)
    if heights:
        _check_heights(raster, str(path))
    return raster


def write_raster(path: str | Path, raster: Raster) -> None:
    """Write a GeoTIFF (.tif), or else an ESRI ASCII grid, and a .prj beside it that names the coordinate reference.

    Args:
        path: the file.
        raster: values; those that are not numbers are gaps (-9999).

    Raises:
        InputError: GeoTIFF without rasterio, or with a coordinate reference that it does not know.
    """
    path = Path(path)
    if path.suffix.lower() in TIFF:
        write_geotiff(path, raster.x, raster.y, raster.values, raster.crs)
        return
    x, y, cell = (repr(float(number)) for number in (raster.x[0], raster.y[0], raster.spacing))
    header = (f"ncols {len(raster.x)}\nnrows {len(raster.y)}\nxllcenter {x}\nyllcenter {y}\ncellsize {cell}\n"
              "NODATA_value -9999\n")  # fmt: skip
    values = np.where(np.isfinite(raster.values), raster.values, -9999)[::-1]
    path.write_text(header + "\n".join(" ".join(f"{v:.9g}" for v in row) for row in values) + "\n")
    path.with_suffix(".prj").write_text(raster.crs + "\n")


def _reference(path: Path, crs: Any) -> Any:
    """The coordinate reference of a file, by what is given or by a .prj beside it."""
    beside = path.with_suffix(".prj")
    found = crs if crs is not None else beside.read_text().strip() if beside.is_file() else ""
    if not found:
        raise InputError(f"crs: the coordinate reference of {str(path)!r} is unknown; name it by crs=, for instance "
                         "crs='EPSG:25832', or crs='local' for metres on a plane")  # fmt: skip
    if found.upper().startswith(("GEOGCS", "GEOGCRS")) or found.upper() in ("EPSG:4326", "EPSG:4258", "WGS84"):
        raise InputError(
            f"crs: {str(path)!r} is in degrees ({found[:40]}), expected metres; project it first, for instance by gdalwarp"
        )
    if found != "local":
        check_reference(path, str(found))
    return found


_KEYS = {"ncols", "nrows", "xllcorner", "yllcorner", "xllcenter", "yllcenter", "cellsize", "nodata_value"}


def _read_ascii(text: Any, name: str) -> tuple[Any, ...]:
    header, lines = {}, text.splitlines()
    while lines and lines[0].split() and lines[0].split()[0].lower() in _KEYS:
        key, *values = lines.pop(0).split()
        try:
            header[key.lower()] = float(values[0])
        except (IndexError, ValueError):
            raise InputError(f"path: {name!r} has no number for {key}") from None
    missing = [key for key in ("ncols", "nrows", "cellsize") if key not in header]
    for axis in "xy":
        if not {f"{axis}llcorner", f"{axis}llcenter"} & set(header):
            missing.append(f"{axis}llcorner")
    if missing:
        raise InputError(f"path: {name!r} has no {', '.join(missing)} in its header, expected an ESRI ASCII grid")
    nx, ny, cell = int(header["ncols"]), int(header["nrows"]), header["cellsize"]
    try:
        values = np.array(" ".join(lines).split(), dtype=float)
    except ValueError as error:
        raise InputError(f"path: {name!r}: {error}") from None
    if nx < 2 or ny < 2 or not cell > 0 or len(values) != nx * ny:
        raise InputError(
            f"path: {name!r} has {len(values)} heights, expected {nx} columns by {ny} rows of cells of {cell} m"
        )
    values[values == header.get("nodata_value", -9999.0)] = np.nan
    start = {axis: header.get(f"{axis}llcenter", header.get(f"{axis}llcorner", 0.0) + cell / 2) for axis in "xy"}
    return start["x"] + cell * np.arange(nx), start["y"] + cell * np.arange(ny), values.reshape(ny, nx)[::-1]


def _read_points(text: str, name: str) -> tuple[Any, ...]:
    try:
        rows = np.array(text.replace(",", " ").split(), dtype=float)
    except ValueError as error:
        raise InputError(f"path: {name!r}: {error}; expected three numbers x y z to a line") from None
    if len(rows) == 0 or len(rows) % 3:
        raise InputError(f"path: {name!r} has {len(rows)} numbers, expected three to a line")
    points = rows.reshape(-1, 3)
    (x, column), (y, row) = (np.unique(points[:, k], return_inverse=True) for k in (0, 1))
    steps = np.concatenate([np.diff(x), np.diff(y)])
    if len(x) < 2 or len(y) < 2 or np.ptp(steps) > 1e-3 * steps.mean():
        raise InputError(f"path: {name!r} has points {steps.min(initial=np.inf):g} to {steps.max(initial=0):g} m apart, "
                         "expected a grid of square cells")  # fmt: skip
    values = np.full((len(y), len(x)), np.nan)
    values[row, column] = points[:, 2]
    return np.linspace(x[0], x[-1], len(x)), np.linspace(y[0], y[-1], len(y)), values


def _check_heights(raster: Any, name: str) -> None:
    gaps = np.argwhere(~np.isfinite(raster.values))
    if len(gaps):
        at = raster.x[gaps[0][1]], raster.y[gaps[0][0]]
        raise InputError(f"path: {name!r} has {len(gaps)} gap{'s' * (len(gaps) > 1)}, the first one at x = {at[0]:.10g} m, y = {at[1]:.10g} m; fill them, "
                         "for instance by gdal_fillnodata, or take a window without any")  # fmt: skip
    steep = np.abs(np.diff(raster.values, axis=1)).mean() / raster.spacing
    small = max(np.abs(raster.x).max(), np.abs(raster.y).max()) <= 360
    if small and steep > STEEPEST:
        raise InputError(f"path: {name!r} has a mean slope of {np.degrees(np.arctan(steep)):.1f} degrees on cells of "
                         f"{raster.spacing:g}: its "
                         "coordinates seem to be in degrees, expected metres")  # fmt: skip
