"""Run-out over terrain: rasters that do not fit together, the strength of the ground, places, structures, and the end of a slide."""

import importlib
from pathlib import Path

import meshio
import numpy as np
import pytest
from study_main import ended

import mpm_core as mpm

STUDIES = Path(__file__).parents[3] / "studies"


def write(path, values, corner=500000.0):
    """An ESRI ASCII grid of cells of 5 m."""
    rows = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in values)
    path.write_text(
        f"ncols {values.shape[1]}\nnrows {values.shape[0]}\nxllcorner {corner}\nyllcorner {corner}\ncellsize 5\n{rows}\n"
    )
    return str(path)


@pytest.fixture
def elevations():
    """A plane, and a cap 4 m high in the middle."""
    x, y = np.meshgrid(np.arange(20) * 5.0, np.arange(20) * 5.0)
    plane = 60 - 0.5 * x
    return plane, plane + 4 * np.maximum(1 - ((x - 47.5) / 20) ** 2 - ((y - 47.5) / 20) ** 2, 0)


def built(a):
    runout = importlib.import_module("runout")
    return runout.build(a, *runout.grounds(a))


def test_rasters_of_other_places_are_refused(tmp_path, elevations):
    plane, ground = elevations
    runout = importlib.import_module("runout")
    files = "--terrain", write(tmp_path / "a.asc", ground), "--rupture", write(tmp_path / "b.asc", plane, corner=0.0)
    # points are the centres of the cells
    with pytest.raises(
        mpm.InputError,
        match=r"--rupture covers x 2.5 to 97.5 m .*, expected a part of --terrain, x 500002.5 to 500097.5 m",
    ):
        runout.grounds(runout.parse([*files, "--crs", "local"]))


def test_elevations_in_other_units_are_refused(tmp_path, elevations):
    plane, ground = elevations
    files = "--terrain", write(tmp_path / "feet.asc", ground / 0.3048), "--rupture", write(tmp_path / "b.asc", plane)
    # at the edge the ground is the highest at 60 m, which is 196.85 ft
    with pytest.raises(mpm.InputError, match=r"--terrain is up to 137 m above --rupture at the edge of the rasters"):
        built(importlib.import_module("runout").parse([*files, "--crs", "local"]))


@pytest.mark.parametrize(("shift", "refused"), [(0.5, False), (1.0, True)])
def test_surveys_that_differ_by_less_than_half_a_particle_at_the_edge_are_taken(shift, refused, tmp_path, elevations):
    """As two surveys of the same ground do, by decimetres; particles are 1.33 m apart."""
    plane, ground = elevations
    ground[:3, :3] += shift
    files = "--terrain", write(tmp_path / "a.asc", ground), "--rupture", write(tmp_path / "b.asc", plane)
    runout = importlib.import_module("runout")
    a = runout.parse([*files, "--crs", "local"])
    if refused:
        with pytest.raises(mpm.InputError, match=f"--terrain is up to {shift:g} m above --rupture at the edge"):
            runout.body_between(a, *runout.grounds(a))
    else:
        body = runout.body_between(a, *runout.grounds(a))
        # those of the cap of more than 0.133 m, and the corner
        expected = ground - plane > 0.133
        assert body.sum() == expected.sum()


def test_a_slide_too_small_for_its_cells_names_their_options():
    with pytest.raises(
        mpm.InputError, match=r"--thickness is 8 m with --height 0.06 m and --cell-size 4 m, expected a slide"
    ):
        built(importlib.import_module("runout").parse(["--height", "0.06"]))


@pytest.mark.parametrize("last, said", [(200.0, "by 2 m/s"), (5.0, "")])
def test_a_slide_that_still_moves_is_said(last, said):
    history = {"kinetic_energy_J": np.array([0.0, 1000.0, last])}
    words = importlib.import_module("common.runout.endings").still_moving(
        history, 100.0
    )  # sqrt(2 x 200 J / 100 kg) = 2 m/s
    assert said in words and bool(words) == bool(said)


def strength(*words):
    runout = importlib.import_module("runout")
    a = runout.parse(list(words))
    _, rupture = runout.grounds(a)
    return runout.ground_strength(a, rupture), rupture


def map_of(path, rupture, values):
    """A raster over all of the ground, with the last value where x is above its middle, else the first."""
    from fenics_bridge import terrain

    x, _ = np.meshgrid(rupture.x, rupture.y)
    terrain.write_raster(
        path, terrain.Raster(rupture.x, rupture.y, np.where(x > rupture.x.mean(), values[1], values[0]))
    )
    return str(path)


def test_the_strength_of_the_ground_follows_its_options(tmp_path):
    # tan(20) (1 - 0.4), and g / xi
    found, rupture = strength(
        "--ground-friction-angle",
        "20",
        "--pore-pressure-ratio",
        "0.4",
        "--turbulence",
        "500",
        "--ground-adhesion",
        "2e3",
    )
    assert found["friction"] == pytest.approx(0.6 * np.tan(np.radians(20)))
    assert found["drag"] == pytest.approx(9.81 / 500) and found["adhesion"] == 2e3
    angles, turbulence = (
        map_of(tmp_path / name, rupture, values) for name, values in (("f.asc", (10, 30)), ("t.asc", (200, 2000)))
    )
    found, _ = strength("--friction-map", angles, "--turbulence-map", turbulence, "--pore-pressure-ratio", "0.5")
    assert found["friction"].values[0, [0, -1]] == pytest.approx(0.5 * np.tan(np.radians([10, 30])))
    assert found["drag"].values[0, [0, -1]] == pytest.approx(9.81 / np.array([200, 2000]))


@pytest.mark.parametrize("option, values, message", [
    ("--friction-map", (-1, 30), "--friction-map has values of -1 to 30, expected angles from 0 to below 90 degrees"),
    ("--turbulence-map", (0, 500), "--turbulence-map has values from 0 on, expected some above 0 m/s2"),
])  # fmt: skip
def test_wrong_maps_of_the_ground_are_named(tmp_path, option, values, message):
    _, rupture = strength()
    with pytest.raises(mpm.InputError, match=message):
        strength(option, map_of(tmp_path / "m.asc", rupture, values))


@pytest.mark.parametrize("option", ["--friction-map", "--turbulence-map"])
def test_maps_of_other_places_are_named_by_their_option(tmp_path, option):
    from fenics_bridge import terrain

    _, rupture = strength()
    values = np.full(rupture.values.shape, 100.0 if "turb" in option else 20.0)
    shifted = terrain.Raster(rupture.x + 100.0, rupture.y, values)
    terrain.write_raster(tmp_path / "m.asc", shifted)
    with pytest.raises(mpm.InputError, match=f"{option}: .*m.asc covers x 62.5 to .* m, expected -37.5 to"):
        strength(option, str(tmp_path / "m.asc"))
    (tmp_path / "m.prj").write_text("EPSG:25832\n")
    with pytest.raises(mpm.InputError, match=f"{option}: .*m.asc is in 'EPSG:25832', expected 'local' as the ground"):
        strength(option, str(tmp_path / "m.asc"))


def test_weak_coefficients_of_turbulence_are_doubted(tmp_path):
    with pytest.warns(
        RuntimeWarning, match="--turbulence is 5 m/s2, expected Voellmy's coefficient xi, some 100 to 2000 m/s2"
    ):
        _, rupture = strength("--turbulence", "5")
    with pytest.warns(
        RuntimeWarning, match="--turbulence-map has values from 0.5 m/s2, expected Voellmy's coefficient xi"
    ):
        strength("--turbulence-map", map_of(tmp_path / "t.asc", rupture, (0.5, 400)))


@pytest.mark.parametrize(
    "study, option",
    [
        ("runout", "--ground-friction-angle"),
        ("runout", "--structure-friction-angle"),
        ("barrier", "--base-friction-angle"),
        ("barrier", "--wall-friction-angle"),
    ],
)
def test_friction_angles_of_surfaces_in_radians_are_doubted(study, option):
    """As those of soils are: 0.3 rad are 17 degrees, and a slide on 0.3 degrees runs as if without friction."""
    with pytest.warns(RuntimeWarning, match=f"{option} is 0.3 degrees; angles are in degrees, and 0.3 rad are 17.2"):
        importlib.import_module(study).parse(
            [option, "0.3", *(["--structure", __file__] if "structure" in option else [])]
        )


def test_a_map_of_coefficients_is_doubted(tmp_path):
    _, rupture = strength()
    with pytest.warns(RuntimeWarning, match="--friction-map has values up to 0.4 only, which are angles in degrees"):
        strength("--friction-map", map_of(tmp_path / "m.asc", rupture, (0.2, 0.4)))


@pytest.mark.parametrize("text, message", [
    ("house,10,0\nmill,5", "line 2 of .* is 'mill,5', expected a name, x and y in metres"),
    ("house;10;0", "line 1 of .* is 'house;10;0', expected a name, x and y in metres, divided by commas"),
    ("house,10,0\nhouse,5,1", "line 2 of .* has the name 'house' again"),
    ("name,x,y\nhouse,1e4,0", "'house' is at x 10000 m, y 0 m, expected a place on the ground"),
    ("name,x,y\n", "has no places, expected a name, x and y"),
    ("name,x,y\nhouse,a,b", "line 2 of .* is 'house,a,b', expected"),
])  # fmt: skip
def test_wrong_places_are_named(tmp_path, text, message):
    (tmp_path / "places.csv").write_text(text)
    _, rupture = strength()
    with pytest.raises(mpm.InputError, match=message):
        importlib.import_module("common.runout.places").read_places(tmp_path / "places.csv", rupture)


def box_file(path, lower, upper, sides=6):
    """A box as an STL file, the last sides left out."""
    corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    quads = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)][:sides]
    triangles = [corner for a, b, c, d in quads for corner in ((a, b, c), (a, c, d))]
    points = np.asarray(lower) + corners * (np.asarray(upper) - lower)
    meshio.write(path, meshio.Mesh(points, [("triangle", np.array(triangles))]))
    return path


SMALL = "--height 20 --thickness 4 --cell-size 4 --spacing 2 --headroom 8 --time 6 --frames 12 --no-film --ground-friction-angle 10"


def test_places_and_structures_are_followed(tmp_path):
    """A dam across the channel stops the slide: it takes the horizontal momentum, and one place is reached, the other is not."""
    (tmp_path / "places.csv").write_text("name,x,y\nabove,20,0\nbelow,60,0\n")
    dam = box_file(tmp_path / "dam.stl", (32.0, -21.0, -10.0), (44.0, 21.0, 17.0))
    folder = tmp_path / "there"
    options = f"{SMALL} --places {tmp_path / 'places.csv'} --structure {dam} --output {folder}"
    run = ended("runout", folder, *options.split())
    assert run.returncode == 0, run.stderr
    history = np.genfromtxt(folder / "history.csv", delimiter=",", names=True, deletechars="")
    above, below = history["thickness_above_m"], history["thickness_below_m"]
    assert above[0] == 0 and above.max() > 0.5 and not below.any() and not history["speed_below_m_per_s"].any()
    force = history["force_dam_x_N"]
    assert force[0] == 0 and force.max() > 0
    assert abs(history["force_dam_y_N"]).max() < 0.2 * force.max()  # the valley is symmetric
    assert {"places.png", "structures.png", "most.png"} <= {path.name for path in folder.iterdir()}
    assert "dam" in (folder / "summary.json").read_text()


def read_structures(*paths):
    _, rupture = strength()  # x -37.5 to 226.5 m, y -60 to 60 m
    return importlib.import_module("common.runout.structures").read_structures(list(paths), rupture)


def test_an_open_structure_and_two_of_one_name_are_refused(tmp_path):
    with pytest.raises(mpm.InputError, match="hole|has a border, expected a closed surface"):
        read_structures(box_file(tmp_path / "dam.stl", (0, 0, 0), (1, 1, 1), sides=3))
    (tmp_path / "b").mkdir()
    twice = [box_file(folder / "wall.stl", (0, 0, 0), (1, 1, 100)) for folder in (tmp_path, tmp_path / "b")]
    with pytest.raises(mpm.InputError, match="--structure names two files wall"):
        read_structures(*twice)


@pytest.mark.parametrize("lower, upper, message", [
    ((110, 10, 10), (100, 0, 0), "is inside out, expected triangles that run counterclockwise as seen from outside"),
    ((5000, 0, 0), (5010, 10, 50), "--structure dam is at x 5000 to 5010 m, y 0 to 10 m, expected a place on the ground, x -37.5 to"),
    ((100, 80, 0), (110, 90, 50), "--structure dam is at x 100 to 110 m, y 80 to 90 m, expected a place on the ground"),
])  # fmt: skip
def test_structures_that_are_inside_out_or_elsewhere_are_refused(tmp_path, lower, upper, message):
    with pytest.raises(mpm.InputError, match=message):
        read_structures(box_file(tmp_path / "dam.stl", lower, upper))


@pytest.mark.parametrize("low, high, message", [
    (50, 60, "--structure dam is .* m above the ground at least"), (-20, -10, "--structure dam is .* m below the ground at least"),
])  # fmt: skip
def test_structures_that_do_not_stand_in_the_ground_are_doubted(tmp_path, low, high, message):
    with pytest.warns(RuntimeWarning, match=message):
        read_structures(box_file(tmp_path / "dam.stl", (100, 0, low), (110, 10, high)))
    assert list(read_structures(box_file(tmp_path / "dam.stl", (100, 0, -10), (110, 10, 60)))) == ["dam"]


@pytest.mark.parametrize("words, message", [
    ("--material cam-clay", "--material is cam-clay, expected a law that can begin without stress"),
    ("--dilation-angle 40", "--dilation-angle is 40 degrees, expected at most --friction-angle, 28 degrees"),
    ("--friction-map no.asc", "--friction-map is no.asc, but there is no such file"),
    ("--structure-friction-angle 20", "--structure-friction-angle is given, expected --structure with it"),
])  # fmt: skip
def test_wrong_options_are_named(capfd, words, message):
    with pytest.raises(SystemExit):
        importlib.import_module("runout").parse(words.split())
    assert message in capfd.readouterr().err


def smooth_and_steep(folder):
    """Options of a slide on a plane of 45 degrees without friction."""
    from fenics_bridge import terrain

    x, y = np.arange(0.0, 81.0, 4.0), np.arange(0.0, 61.0, 4.0)
    u, v = np.meshgrid(x, y)
    plane = -1.0 * u
    cap = 4 * np.maximum(1 - ((u - 20) / 12) ** 2 - ((v - 30) / 12) ** 2, 0)
    for name, values in (("a", plane + cap), ("b", plane)):
        terrain.write_raster(folder / f"{name}.asc", terrain.Raster(x, y, values))
    files = f"--terrain {folder / 'a.asc'} --rupture {folder / 'b.asc'} --output {folder / 'there'}"
    return [*files.split(), *"--cell-size 4 --spacing 2 --ground-friction-angle 0 --frames 20 --no-film".split()]


def test_a_slide_that_leaves_its_mesh_says_so(tmp_path):
    """On smooth, steep ground it is gone after some seconds; the run ends with its results."""
    run = ended("runout", tmp_path / "there", *smooth_and_steep(tmp_path), *"--headroom 8 --time 20".split())
    assert run.returncode == 1 and "all of the slide has left the mesh by" in run.stderr, run.stderr
    assert "100% of its mass left the mesh at its sides" in run.stdout and (tmp_path / "there" / "most.png").exists()


def test_a_slide_that_splashes_out_of_the_top_of_its_mesh_names_the_headroom(tmp_path):
    """The error asked for supports or outflow, which the study has no options of."""
    dam = box_file(tmp_path / "dam.stl", (60, -10, -90), (70, 70, 0))
    options = "--headroom 3 --time 6 --structure-friction-angle 0 --no-pictures --structure".split()
    run = ended("runout", tmp_path / "there", *smooth_and_steep(tmp_path), *options, str(dam))
    assert run.returncode == 1 and "what leaves it at its top needs more --headroom than 3 m" in run.stderr, run.stderr


def test_particles_that_are_faster_than_they_can_fall_are_said_to_be_noise():
    """A slide that met a wall with 23 m/s ended with "fastest 114 m/s"."""
    too_fast = importlib.import_module("common.runout.endings").too_fast
    fall = np.sqrt(2 * 9.81 * 31.0)
    assert f"single particles are faster than free fall through all of the height, {fall:.3g} m/s" in too_fast(
        1.6 * fall, 31.0
    )
    assert too_fast(1.4 * fall, 31.0) == ""
