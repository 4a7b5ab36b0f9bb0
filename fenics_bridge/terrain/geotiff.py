"""Rasters from and to GeoTIFF, by rasterio (Debian: python3-rasterio), which is imported where it is needed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenics_bridge.errors import InputError

_LOCAL = 'LOCAL_CS["local",UNIT["metre",1]]'
_GAP = -9999.0


def _rasterio(path: Path) -> Any:
    try:
        import rasterio
    except ImportError:
        raise InputError(f"path: {str(path)!r} needs rasterio, which is not installed (Debian: apt-get install "
                         "python3-rasterio); ESRI ASCII grids (.asc) need nothing") from None  # fmt: skip
    return rasterio


def read_geotiff(path: Path) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], str]:
    """Columns, rows and values at the centres of the cells, with gaps that are not numbers; and the coordinate reference, or "".

    Args:
        path: of one band, its cells squares along the axes.

    Raises:
        InputError: without rasterio, a file that GDAL cannot read, of another shape, or in degrees or feet.
    """
    rasterio = _rasterio(path)
    try:
        with rasterio.open(path) as file:
            bands, grid, reference = file.count, file.transform, file.crs
            values = file.read(1, masked=True).astype(float).filled(np.nan)
    except (rasterio.errors.RasterioError, OSError) as error:
        raise InputError(f"path: {str(path)!r} cannot be read: {error}") from None
    if bands != 1:
        raise InputError(f"path: {str(path)!r} has {bands} bands, expected one, of heights")
    ny, nx = values.shape
    straight = grid.b == grid.d == 0 and grid.a > 0 and abs(grid.a + grid.e) <= 1e-6 * grid.a
    if not straight or nx < 2 or ny < 2:
        raise InputError(f"path: {str(path)!r} has {nx} by {ny} cells of {grid.a:g} by {-grid.e:g}, rotated by {grid.b:g}, "
                         "expected squares, with north up; see gdalwarp -tr")  # fmt: skip
    x = grid.c + grid.a * (np.arange(nx) + 0.5)
    y = grid.f + grid.e * (np.arange(ny)[::-1] + 0.5)
    return x, y, np.ascontiguousarray(values[::-1]), _name(path, reference)


def _name(path: Path, reference: Any) -> str:
    """Name of a coordinate reference system of rasterio in a raster."""
    if not reference:
        return ""
    if reference.to_wkt().startswith(("LOCAL_CS", "ENGCRS")):
        return "local"
    name = str(reference.to_string())
    if reference.is_geographic:
        raise InputError(
            f"crs: {str(path)!r} is in degrees ({name[:40]}), expected metres; project it first, for instance by gdalwarp"
        )
    if reference.linear_units.lower() not in ("metre", "meter", "m"):
        raise InputError(
            f"crs: {str(path)!r} is in {reference.linear_units} ({name[:40]}), expected metres; see gdalwarp"
        )
    return name


def check_reference(path: Path, name: str) -> None:
    """Look up the coordinate reference that a raster or its user names, where rasterio is installed.

    Raises:
        InputError: one that rasterio does not know, or in degrees or feet.
    """
    try:
        import rasterio
    except ImportError:
        return
    try:
        reference = rasterio.crs.CRS.from_user_input(name)
    except rasterio.errors.CRSError as error:
        raise InputError(f"crs: {name[:40]!r} of {str(path)!r} is unknown ({error}), expected for instance 'EPSG:25832', or "
                         "'local'") from None  # fmt: skip
    _name(path, reference)


def write_geotiff(
    path: Path, x: NDArray[np.float64], y: NDArray[np.float64], values: NDArray[np.float64], crs: str
) -> None:
    """Write values at the centres of square cells as 32-bit numbers; those that are no numbers are gaps.

    Args:
        path: the file.
        x: columns [m], rising.
        y: rows [m], rising.
        values: shape (ny, nx).
        crs: coordinate reference, or "local".

    Raises:
        InputError: without rasterio, or a coordinate reference that it does not know.
    """
    rasterio = _rasterio(path)
    cell = float(x[-1] - x[0]) / (len(x) - 1)
    try:
        reference = rasterio.crs.CRS.from_user_input(_LOCAL if crs == "local" else crs)
    except rasterio.errors.CRSError as error:
        raise InputError(f"crs: {crs!r} is unknown ({error}), expected for instance 'EPSG:25832', or 'local'") from None
    grid = rasterio.transform.from_origin(x[0] - 0.5 * cell, y[-1] + 0.5 * cell, cell, cell)
    filled = np.where(np.isfinite(values), values, _GAP)[::-1].astype(np.float32)
    with rasterio.open(path, "w", driver="GTiff", width=len(x), height=len(y), count=1, dtype="float32", crs=reference,
                       transform=grid, nodata=_GAP, compress="deflate") as file:  # fmt: skip
        file.write(filled, 1)
