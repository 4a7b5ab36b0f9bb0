"""Rasters from and to GeoTIFF: places, coordinate references, gaps, and what is refused."""

import sys

import numpy as np
import pytest

import fenics_bridge as bridge
from fenics_bridge import terrain

WITH_RASTERIO = pytest.importorskip("rasterio")


def hill(crs="EPSG:25832"):
    x, y = 500_000.0 + 2.0 * np.arange(9), 5_400_000.0 + 2.0 * np.arange(7)
    return terrain.Raster(x, y, 300.0 + 0.25 * (x - x[0]) - 0.5 * (y - y[0])[:, None], crs)


def rewritten(path, heights=None, **changes):
    """A GeoTIFF with other properties."""
    with WITH_RASTERIO.open(path) as file:
        profile, values = file.profile | changes, file.read()
    with WITH_RASTERIO.open(path, "w", **profile) as file:
        file.write(np.repeat(values, profile["count"], axis=0) if heights is None else heights)
    return path


@pytest.mark.parametrize("crs", ["EPSG:25832", "local"])
def test_a_raster_goes_through_geotiff(tmp_path, crs):
    ground = hill(crs)
    terrain.write_raster(tmp_path / "ground.tif", ground)
    read = terrain.read_raster(tmp_path / "ground.tif")
    assert read.crs == crs
    assert read.x == pytest.approx(ground.x, rel=1e-12) and read.y == pytest.approx(ground.y, rel=1e-12)
    assert read.values == pytest.approx(ground.values, rel=1e-7)  # 32-bit numbers
    part = terrain.read_raster(tmp_path / "ground.tif", window=((500_003.0, 5_400_004.0), (500_009.0, 5_400_008.0)))
    assert part.values == pytest.approx(ground.values[2:5, 1:6], rel=1e-7)


def test_other_programs_find_the_heights_where_they_are(tmp_path):
    # GDAL counts rows from the north, and places the corner of a cell, not its centre.
    terrain.write_raster(tmp_path / "ground.tif", hill())
    with WITH_RASTERIO.open(tmp_path / "ground.tif") as file:
        assert file.crs.to_epsg() == 25832 and file.res == (2.0, 2.0) and file.nodata == -9999
        assert tuple(file.bounds) == (499_999.0, 5_399_999.0, 500_017.0, 5_400_013.0)
        (found,) = next(file.sample([(500_004.0, 5_400_010.0)]))
    assert found == pytest.approx(300.0 + 0.25 * 4 - 0.5 * 10)


def test_gaps_are_refused_where_they_matter(tmp_path):
    ground = hill()
    ground.values[1, 0] = np.nan
    terrain.write_raster(tmp_path / "ground.tif", ground)
    with pytest.raises(bridge.InputError, match="has 1 gap, the first one at x = 500000 m, y = 5400002 m"):
        terrain.read_raster(tmp_path / "ground.tif")
    terrain.read_raster(tmp_path / "ground.tif", window=((500_004.0, 5_400_004.0), (500_010.0, 5_400_008.0)))


@pytest.mark.parametrize(
    "changes, message",
    [
        ({"crs": "EPSG:4326"}, "is in degrees"),
        ({"crs": "EPSG:2263"}, "is in US survey foot"),
        ({"crs": None}, "coordinate reference of .* is unknown"),
        ({"count": 2}, "has 2 bands"),
        ({"transform": WITH_RASTERIO.transform.Affine(2, 0, 0, 0, -3, 0)}, "expected squares"),
        ({"transform": WITH_RASTERIO.transform.Affine(2, 0.1, 0, 0.1, -2, 0)}, "expected squares"),
    ],
)
def test_what_is_no_grid_of_metres_is_named(tmp_path, changes, message):
    terrain.write_raster(tmp_path / "ground.tif", hill())
    path = rewritten(tmp_path / "ground.tif", **changes)
    with pytest.raises(bridge.InputError, match=message):
        terrain.read_raster(path)
    if changes == {"crs": None}:
        assert terrain.read_raster(path, crs="EPSG:25832").crs == "EPSG:25832"


def test_damaged_files_and_unknown_references_are_named(tmp_path):
    (tmp_path / "ground.tif").write_text("no picture")
    for path in (tmp_path / "ground.tif", tmp_path / "nowhere.tif"):
        with pytest.raises(bridge.InputError, match=f"{path.name}' cannot be read"):
            terrain.read_raster(path)
    with pytest.raises(bridge.InputError, match="crs: 'EPSG:0' is unknown"):
        terrain.write_raster(tmp_path / "new.tif", hill("EPSG:0"))


@pytest.mark.parametrize(
    "crs, message", [("EPSG:999999", "'EPSG:999999' of .* is unknown"), ("EPSG:2263", "is in US survey foot")]
)
def test_the_reference_of_an_ascii_grid_is_looked_up(crs, message, tmp_path):
    terrain.write_raster(tmp_path / "ground.asc", hill())
    with pytest.raises(bridge.InputError, match=message):
        terrain.read_raster(tmp_path / "ground.asc", crs=crs)


def test_the_package_that_is_missing_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rasterio", None)
    for attempt in (lambda p: terrain.write_raster(p, hill()), terrain.read_raster):
        with pytest.raises(bridge.InputError, match="apt-get install python3-rasterio"):
            attempt(tmp_path / "ground.tif")
