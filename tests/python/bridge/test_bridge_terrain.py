"""Ground from rasters: files and their errors, the mesh over it, a slide between two rasters, and its maps."""

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import terrain

COMM = MPI.COMM_SELF


def tilted(nx=9, ny=7, spacing=2.0, slope=(-0.3, 0.1), start=(100.0, 200.0)):
    x, y = start[0] + spacing * np.arange(nx), start[1] + spacing * np.arange(ny)
    return terrain.Raster(x, y, 50.0 + slope[0] * (x - x[0]) + slope[1] * (y - y[0])[:, None])


def test_values_and_slopes_of_a_tilted_plane_are_exact():
    ground = tilted()
    places = np.random.default_rng(1).uniform((100, 200), (116, 212), (50, 2))
    assert ground.at(places) == pytest.approx(50 - 0.3 * (places[:, 0] - 100) + 0.1 * (places[:, 1] - 200))
    assert ground.slope(places) == pytest.approx(np.tile((-0.3, 0.1), (50, 1)))
    assert ground.at([(90.0, 200.0)]) == pytest.approx([50.0])  # constant beyond it
    surface = ground.triangles()
    normals = np.cross(*(np.diff(surface.vertices[surface.triangles], axis=1)[:, k] for k in (0, 1)))
    assert (normals[:, 2] > 0).all() and normals[:, 2].sum() / 2 == pytest.approx(16 * 12)


@pytest.mark.parametrize("kind", ["asc", "corner", "xyz"])
def test_a_raster_goes_through_files(tmp_path, kind):
    ground = tilted()
    path = tmp_path / ("ground.xyz" if kind == "xyz" else "ground.asc")
    if kind == "xyz":
        x, y = np.meshgrid(ground.x, ground.y)
        rows = np.stack([x.ravel(), y.ravel(), ground.values.ravel()], axis=1)
        np.savetxt(path, np.random.default_rng(2).permutation(rows), delimiter=",")
    else:
        terrain.write_raster(path, ground)
        assert path.with_suffix(".prj").read_text() == "local\n"
    if kind == "corner":  # of the cell, half a spacing beyond its centre
        path.write_text(path.read_text().replace("xllcenter 100.0", "xllcorner 99.0"))
    read = terrain.read_raster(path, crs="EPSG:25832" if kind == "xyz" else None)
    assert read.crs == ("EPSG:25832" if kind == "xyz" else "local")
    assert read.x == pytest.approx(ground.x) and read.y == pytest.approx(ground.y)
    assert read.values == pytest.approx(ground.values, rel=1e-8)
    part = terrain.read_raster(path, crs="local", window=((103.0, 204.0), (109.0, 208.0)))
    assert part.x.tolist() == [102, 104, 106, 108, 110] and part.y.tolist() == [204, 206, 208]
    assert part.values == pytest.approx(ground.values[2:5, 1:6])


def text_of(tmp_path, change=lambda text: text):
    terrain.write_raster(tmp_path / "ground.asc", tilted())
    path = tmp_path / "ground.asc"
    path.write_text(change(path.read_text()))
    return path


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda t: t.replace("cellsize 2.0\n", ""), "has no cellsize in its header"),
        (lambda t: t.replace("xllcenter 100.0\n", ""), "has no xllcorner in its header"),
        (lambda t: t.replace("ncols 9", "ncols 8"), "has 63 heights, expected 8 columns by 7 rows"),
        (lambda t: t.replace("ncols 9", "ncols nine"), "has no number for ncols"),
        (lambda t: t.replace("50.2", "high"), "could not convert"),
        (lambda t: t.replace(" 50.6 ", " -9999 "), r"has 1 gap, the first one at x = 102 m, y = 212 m"),
        (lambda t: t.replace("cellsize 2.0", "cellsize 0.00002"), "seem to be in degrees"),
        (lambda t: "", "expected an ESRI ASCII grid"),
    ],
)
def test_damaged_rasters_are_named(tmp_path, change, message):
    path = text_of(tmp_path, change)
    with pytest.raises(bridge.InputError, match=message):
        terrain.read_raster(path)


def test_gaps_outside_of_a_window_do_no_harm(tmp_path):
    path = text_of(tmp_path, lambda t: t.replace(" 50.6 ", " -9999 "))
    assert terrain.read_raster(path, window=((104.0, 202.0), (110.0, 208.0))).values.shape == (4, 4)
    with pytest.raises(bridge.InputError, match="expected corners inside of x 100 to 116 m"):
        terrain.read_raster(path, window=((90.0, 202.0), (110.0, 208.0)))


@pytest.mark.parametrize("reference", ['GEOGCS["WGS 84",...', "EPSG:4326"])
def test_degrees_are_refused_by_the_coordinate_reference(tmp_path, reference):
    path = text_of(tmp_path)
    path.with_suffix(".prj").write_text(reference)
    with pytest.raises(bridge.InputError, match="is in degrees"):
        terrain.read_raster(path)


def test_an_unknown_reference_or_file_is_named(tmp_path):
    path = text_of(tmp_path)
    path.with_suffix(".prj").unlink()
    with pytest.raises(bridge.InputError, match="coordinate reference of .*ground.asc' is unknown"):
        terrain.read_raster(path)
    with pytest.raises(bridge.InputError, match="cannot be read"):
        terrain.read_raster(tmp_path / "nowhere.asc", crs="local")
    with pytest.raises(bridge.InputError, match="expected a file ending in"):
        terrain.read_raster(tmp_path / "ground.jpg", crs="local")
    (tmp_path / "points.xyz").write_text("0 0 1\n1 0 2\n0 1 3\n3 1 4\n")
    with pytest.raises(bridge.InputError, match="expected a grid of square cells"):
        terrain.read_raster(tmp_path / "points.xyz", crs="local")


SIZES = {"cell_size": 1.0, "height": 4.0, "fine": ((104, 204), (110, 208)), "coarse_size": 2.0}


def test_a_mesh_follows_the_ground():
    # Its volume is area times height, and that of its facets on the ground the tilted area; it is finer where it should be.
    ground = tilted(nx=21, ny=16)
    domain, _, tags = terrain.terrain_mesh(COMM, ground, **SIZES)
    arrays = bridge.background_arrays(domain, facet_tags=tags)
    mesh = bridge.background_mesh(domain, facet_tags=tags)
    area, thickness = 36.0 * 26.0, 4.0 + 1.5
    volumes = np.abs(np.linalg.det(np.diff(mesh.points[mesh.cells], axis=1))) / 6
    assert volumes.sum() == pytest.approx(area * thickness) and volumes.min() > 0
    centres = mesh.points[mesh.cells].mean(axis=1)
    fine = ((centres[:, :2] > (104, 204)) & (centres[:, :2] < (110, 208))).all(axis=1)
    far = (np.abs(centres[:, :2] - (107, 206)) > 14).any(axis=1)
    assert volumes[far].mean() > 2 * volumes[fine].mean()
    heights = mesh.points[:, 2] - ground.at(mesh.points)
    assert heights.min() == pytest.approx(-1.5) and heights.max() == pytest.approx(4.0)
    for tag, level in ((terrain.GROUND, -1.5), (terrain.SKY, 4.0)):
        corners = mesh.points[arrays["facets"][arrays["facet_tags"] == tag]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert np.linalg.norm(normals, axis=1).sum() / 2 == pytest.approx(area * np.sqrt(1.1))
        assert corners[..., 2] - ground.at(corners.reshape(-1, 3)).reshape(-1, 3) == pytest.approx(level)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"cell_size": 0.0}, "cell_size is 0.0 m"),
        ({"height": np.nan}, "height is nan m"),
        ({"coarse_size": 0.5}, "coarse_size is 0.5 m"),
        ({"fine": ((110, 204), (104, 208))}, "expected two corners"),
    ],
)
def test_wrong_sizes_are_named(change, message):
    with pytest.raises(bridge.InputError, match=message):
        terrain.terrain_mesh(COMM, tilted(), **{**SIZES, **change})


def slab(thickness=2.0, slope=-0.5):
    """Ground with a slope along x, and a slab of this vertical thickness on a part of it."""
    rupture = tilted(nx=31, ny=21, spacing=1.0, slope=(slope, 0.0))
    x, y = np.meshgrid(rupture.x, rupture.y)
    on = (np.abs(x - 108) <= 4) & (np.abs(y - 210) <= 4)
    return terrain.Raster(rupture.x, rupture.y, rupture.values + thickness * on), rupture


def slide_model(before, rupture, cohesion=1.0, **options):
    domain, _, tags = terrain.terrain_mesh(
        COMM, rupture, cell_size=1.0, height=5.0, fine=((103, 203), (125, 217)), coarse_size=2.0
    )
    model = mpm.Model(
        bridge.background_mesh(domain, facet_tags=tags),
        mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=cohesion, friction_angle=30),
    )
    return model, *terrain.seed_slide(model, before, rupture, spacing=0.5, density=1800.0, **options)


@pytest.mark.parametrize("spacing, error", [(2.0, 0.01), (0.8, 0.002)])
def test_a_cap_that_thins_out_has_its_volume(spacing, error):
    """A paraboloid of 4 m over a radius of 8 m has half the volume of its cylinder, 402 m3. Rows count rounded to whole numbers."""
    x, y = np.arange(0.0, 24.01, 0.4), np.arange(0.0, 40.01, 0.4)
    u, v = np.meshgrid(x, y)
    level = terrain.Raster(x, y, np.zeros_like(u))
    before = terrain.Raster(x, y, 4.0 * np.maximum(1 - ((u - 12) / 8) ** 2 - ((v - 20) / 8) ** 2, 0.0))
    domain, _, tags = terrain.terrain_mesh(COMM, level, cell_size=4.0, height=8.0, fine=((2, 10), (22, 30)))
    model = mpm.Model(bridge.background_mesh(domain, facet_tags=tags), mpm.LinearElastic(young=1e6, poisson=0.3))
    terrain.seed_slide(model, before, level, spacing=spacing, density=1800.0)
    assert model.particles.volume.sum() == pytest.approx(np.pi * 8**2 * 4 / 2, rel=error)
    assert model.particles.position[:, 0].max() - model.particles.position[:, 0].min() > 15.0 - spacing


def test_a_slide_has_the_volume_between_the_rasters_and_slides_as_coulomb_says():
    # A slab of 30 by its own length slides with g cos(theta) (tan(theta) - mu) along the ground.
    before, rupture = slab()
    model, ground, lift = slide_model(before, rupture, friction=0.2)
    between = terrain.Raster(before.x, before.y, before.values - rupture.values)
    plan = np.stack(np.meshgrid(*(np.arange(a[0] + 0.25, a[-1], 0.5) for a in (before.x, before.y))), axis=-1).reshape(
        -1, 2
    )
    thickness = between.at(plan)
    volume = (thickness * (thickness > 0.05)).sum() * 0.25
    assert model.particles.volume.sum() == pytest.approx(volume)
    # A particle of a column of thickness t in spacings is lifted by t^(1/3) / (2 cos theta) - t / 2, at most 0.2276 spacings.
    assert 0 <= lift < 0.2277 * 0.5 and not model.particles.displacement.any()
    model.set_gravity((0.0, 0.0, -9.81), ramp=0.1)
    theta, end, rise = np.arctan(0.5), 0.6, 0.1
    *_, report = model.explicit(end, energy_limit=np.inf)
    a, u = 9.81 * (np.sin(theta) - 0.2 * np.cos(theta)), end - rise
    inner = (np.abs(model.particles.initial_position[:, :2] - (108, 210)) < 3).all(axis=1)
    moved = model.particles.displacement[inner] @ (np.cos(theta), 0, -np.sin(theta))
    assert moved.mean() == pytest.approx(a * (rise**2 / 6 + rise * u / 2 + u**2 / 2), rel=0.05)
    assert ground.sticking_fraction < 0.1


def test_ground_may_differ_from_place_to_place():
    # Two slabs that do not spread: one on ground with the friction 0.1, north of y = 210 m one with 0.3; both feel the turbulent resistance C v^2 / h
    # of Voellmy: with h = 2 m cos(theta) across the slope, x = v_t^2 / a ln cosh(a t / v_t), v_t^2 = a h / C.
    before, rupture = slab()
    _, y = np.meshgrid(rupture.x, rupture.y)
    before = terrain.Raster(before.x, before.y, np.where(abs(y - 210) < 1.5, rupture.values, before.values))
    friction = terrain.Raster(rupture.x, rupture.y, np.where(y < 210, 0.1, 0.3))
    drag = terrain.Raster(rupture.x, rupture.y, np.full(y.shape, 1.0))
    model, ground, _ = slide_model(before, rupture, cohesion=50e3, friction=friction, drag=drag)
    model.set_gravity((0.0, 0.0, -9.81), ramp=0.1)
    theta, end = np.arctan(0.5), 0.8
    list(model.explicit(end, energy_limit=np.inf))
    x, p = model.particles.initial_position, model.particles
    for mu, side in ((0.1, -1), (0.3, 1)):
        inner = (np.abs(x[:, 0] - 108) < 3) & (np.abs(x[:, 1] - (210 + 3 * side)) < 1)
        moved = (p.displacement[inner] @ (np.cos(theta), 0, -np.sin(theta))).mean()
        a = 9.81 * (np.sin(theta) - mu * np.cos(theta))
        limit = np.sqrt(a * 2 * np.cos(theta) / 1.0)
        assert moved == pytest.approx(limit**2 / a * np.log(np.cosh(a * (end - 0.05) / limit)), rel=0.1)
    assert "friction up to 0.3, adhesion 0 Pa, drag up to 1" in repr(ground)


@pytest.mark.parametrize("values, message", [
    (terrain.Raster(np.arange(100.0, 120.0), np.arange(200.0, 221.0), np.full((21, 20), 0.2)), "friction covers x 100 to 119 m, expected 100 to 130 m"),
    (terrain.Raster(np.arange(100.0, 131.0), np.arange(200.0, 221.0), np.full((21, 31), 0.2), "EPSG:25832"), "friction is in 'EPSG:25832', expected 'local'"),
    (terrain.Raster(np.arange(100.0, 131.0), np.arange(200.0, 221.0), np.full((21, 31), -0.2)), "friction is -0.2"),
])  # fmt: skip
def test_rasters_of_the_ground_that_do_not_fit_are_named(values, message):
    with pytest.raises(bridge.InputError, match=message):
        slide_model(*slab(), friction=values)


def test_thickness_and_speed_at_places():
    before, rupture = slab()
    model, *_ = slide_model(before, rupture)
    speeds = np.where(model.particles.position[:, 2] > rupture.at(model.particles.position) + 1.0, 3.0, 1.0)
    model.particles.set("velocity", speeds[:, None] * (0.0, 0.6, 0.8))
    maps = terrain.SlideMaps(model, rupture)
    thickness, speed = maps.at([(108.0, 210.0), (120.0, 210.0), (107.3, 208.8)])
    assert thickness == pytest.approx([2.0, 0.0, 2.0], rel=0.02, abs=0)
    assert speed == pytest.approx([2.0, 0.0, 2.0], rel=0.02, abs=0)  # the mean of 1 and 3 m/s


def test_maps_keep_the_volume_and_the_greatest_values():
    before, rupture = slab()
    model, *_ = slide_model(before, rupture)
    maps = terrain.SlideMaps(model, rupture)
    assert maps.thickness().sum() * rupture.spacing**2 == pytest.approx(model.particles.volume.sum())
    model.particles.set("velocity", np.tile((3.0, 4.0, 0.0), (len(model.particles), 1)))
    maps.record()
    model.particles.set("velocity", np.zeros_like(model.particles.velocity))
    model.place(model.particles.position + (6.0, 0.0, -3.0))
    maps.record()
    found = maps.maps()
    assert np.nanmax(found["speed"].values) == pytest.approx(5.0)
    x, y = np.meshgrid(rupture.x, rupture.y)
    assert np.nanmax(found["deposit"].values[np.abs(x - 114) < 3]) == pytest.approx(2.0, rel=0.2)
    assert np.isnan(found["deposit"].values[x < 108]).all() and found["reached"].values[(x == 106) & (y == 210)] == 1
    assert np.nansum(found["most"].values) > np.nansum(found["deposit"].values)
    assert found["reached"].values[x < 101].sum() == 0


def test_rasters_that_do_not_fit_are_named():
    before, rupture = slab()
    other = terrain.Raster(before.x, before.y, before.values, "EPSG:25832")
    with pytest.raises(bridge.InputError, match="rupture is in 'local', expected 'EPSG:25832'"):
        slide_model(other, rupture)
    with pytest.raises(bridge.InputError, match="nowhere higher than rupture"):
        slide_model(rupture, rupture)


def test_places_with_coordinates_of_a_country_are_named_to_the_metre():
    """Northings have seven digits, such as those of EPSG:25832."""
    x, y = 512001.0 + 2 * np.arange(4), 5403001.0 + 2 * np.arange(3)
    ground = terrain.Raster(x, y, np.add.outer(0.5 * np.arange(3), np.arange(4.0)), crs="EPSG:25832")
    assert repr(ground) == (
        "<Raster: 4 by 3 points 2 m apart, x 512001 to 512007 m, y 5403001 to 5403005 m, values 0 to 4, EPSG:25832>"
    )
    with pytest.raises(mpm.InputError, match="x 512001 to 512007 m and y 5403001 to 5403005 m"):
        ground.window((511000.0, 5403001.0), (512005.0, 5403005.0))
