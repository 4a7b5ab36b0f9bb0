"""Sites of several soils from TOML as particles: factors of safety and slides."""

import importlib
import json
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from site_cases import SITE, give_room, site_in

import fenics_bridge as bridge
import mpm_core as mpm

ROOT = Path(__file__).parents[3]
site_file = importlib.import_module("common.site.file")


@pytest.mark.usefixtures("without_pictures")
def test_particles_give_a_second_opinion(tmp_path):
    """Linear finite elements and particles on the same cells, of a site with room to move and of a slope."""
    path = site_in(tmp_path, SITE)
    give_room(tmp_path)
    for options in (
        ["--site", path],
        ["--cell-size", 0.2, "--crest", 1, "--unit-weight", 20e3, "--no-without-dilation"],
    ):
        folder = tmp_path / f"{len(options)}"
        arguments = [*options, "--elements", "P1", "--meshes", 1, "--start", 0.7, "--particles", "--output", folder]
        assert importlib.import_module("safety").main([str(word) for word in arguments]) == 0
        summary = json.loads((folder / "summary.json").read_text())
        assert summary["failure_shown_by_particles"]
        assert summary["factor_of_safety_by_particles"] == pytest.approx(summary["factor_of_safety"], rel=0.02)


def test_a_site_slides_when_its_strength_is_reduced(tmp_path):
    """The upper metre, which stands free with 2 c / (gamma H) = 1, so with c = 9 kPa, has 36 kPa.

    Divided by 1.2 nothing yields, and all stays where the elements had it; divided by 8 it falls, by the order of g t^2 / 2.
    So it does with averaged strains, the default in such soil, since elements and particles average forces alike. The settlement
    by hand is 18 kPa 2 m / M below, with the weight of 10 kN/m3 of this soil itself, and that of the upper metre.
    """
    slope, path = importlib.import_module("slope"), site_in(tmp_path, SITE.replace("9e3", "36e3"))
    give_room(tmp_path)
    moved = {}
    for factor, nmd in ((1.2, "--no-nmd"), (1.2, "--nmd"), (8.0, "")):
        folder = tmp_path / f"{factor}{nmd}"
        options = f"--site {path} --factor {factor} --time 0.4 --frames 4 --particles-per-cell 3 --no-pictures {nmd} --output {folder}"
        assert slope.main(options.split()) == 0
        summary = json.loads((folder / "summary.json").read_text())
        assert summary["initial_out_of_balance_ratio"] < 1e-8 and summary["newly_yielded_fraction"] == 0
        moved[factor, nmd] = summary["largest_displacement_m"]
        assert (folder / "report.html").exists() and not list(folder.glob("*.png"))
    lower, upper = (5e6 * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) for nu in (0.45, 0.3))
    settlement = (18e3 * 2 + 10e3 * 2**2 / 2) / lower + 18e3 / 2 / upper
    assert max(moved[1.2, "--no-nmd"], moved[1.2, "--nmd"]) < 1e-5 * settlement
    assert 0.05 < moved[8.0, ""] < 9.81 / 2 * 0.4**2


@pytest.mark.parametrize("study", ["slope", "embankment"])
def test_numerical_damping_hardly_brakes_the_slide_of_a_site(tmp_path, study):
    """Both studies move a site as far as without any damping, to some percent, not by a part that depends on the study."""
    stages = '[[stages]]\nname = "all"\nfill = ["lower", "upper"]\n'
    path = site_in(tmp_path, SITE.replace("9e3", "36e3") + stages)
    give_room(tmp_path)
    moved = []
    for damping in ("", "--damping 0 --pic 0"):
        folder = tmp_path / f"results{len(moved)}"
        options = (
            f"--site {path} --cell-size 0.25 --factor 8 --time 0.5 --frames 2 --no-pictures {damping} --output {folder}"
        )
        assert importlib.import_module(study).main(options.split()) == 0
        history = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
        moved.append(history["largest_displacement_m"][-1])
    assert moved[1] > 0.2 and moved[0] == pytest.approx(moved[1], rel=0.05)


def test_a_site_that_does_not_carry_its_weight_does_not_slide(tmp_path):
    path = site_in(tmp_path, SITE.replace("9e3", "1e3"))
    with pytest.raises(
        mpm.InputError, match=r"site.toml: its soils carry [2-6]\d.\d% of their weight only: .*mechanism"
    ):
        importlib.import_module("slope").main(["--site", str(path), "--output", str(tmp_path / "results")])


def test_elastic_soil_of_a_site_stays_as_it_is_when_strength_is_reduced(tmp_path):
    elastic = 'material = "elastic"\nyoung = 5e6\npoisson = 0.25'
    lines = (
        'material = "tresca"\nyoung = 5e6\npoisson = 0.45\nshear_strength = {value = 20e3, per_metre = 10e3, top = 2.0}'
    )
    site = site_file.read_site(site_in(tmp_path, SITE.replace(lines, elastic)), MPI.COMM_WORLD)
    lower, upper = site.weaker_laws(1.5)
    assert isinstance(lower, mpm.LinearElastic) and lower.young == 5e6
    assert upper.cohesion == pytest.approx(9e3 / 1.5)
    folder = tmp_path / "results"
    options = f"--site {tmp_path / 'site.toml'} --factor 1.2 --time 0.01 --frames 1 --particles-per-cell 3 --no-pictures --output {folder}"
    assert importlib.import_module("slope").main(options.split()) == 0


@pytest.mark.parametrize("nmd", ["--nmd", "--no-nmd"])
def test_stages_of_the_embankment_average_strains_in_elements_as_in_particles(tmp_path, nmd):
    """Sand on soil ten times as stiff, where averages change stresses by more than the largest of them; elements and particles agree."""
    stages = '[[stages]]\nname = "ground"\nfill = "lower"\n[[stages]]\nname = "sand"\nfill = "upper"\n'
    sand = SITE.replace("shear_strength = {value = 20e3, per_metre = 10e3, top = 2.0}", "cohesion = 1e6")
    sand = sand.replace("friction_angle = 0.0\nyoung = 5e6", "friction_angle = 30.0\nyoung = 5e5").replace(
        "9e3", "36e3"
    )
    path, folder = (
        site_in(tmp_path, sand.replace('material = "tresca"', "friction_angle = 30.0") + stages),
        tmp_path / "results",
    )
    options = (
        f"--site {path} --factor 1 --time 0.01 --frames 1 --particles-per-cell 3 --no-pictures {nmd} --output {folder}"
    )
    assert importlib.import_module("embankment").main(options.split()) == 0
    assert json.loads((folder / "summary.json").read_text())["stress_difference_of_particles_to_fem"] < 1e-4


@pytest.mark.usefixtures("without_pictures")
def test_particles_average_strains_as_elements_do_and_beside_quadratic_ones(tmp_path):
    """Soil without friction: the factor is that of averaged elements on the same cells; without averages it is higher by a quarter."""
    path = site_in(tmp_path, SITE.replace("cell_size = 0.5", "cell_size = 0.25"))
    give_room(tmp_path)
    found = {}
    for elements in ("P1-averaged", "P2"):
        folder = tmp_path / elements
        options = f"--site {path} --elements {elements} --meshes 1 --start 0.7 --particles --output {folder}"
        assert importlib.import_module("safety").main(options.split()) == 0
        found[elements] = json.loads((folder / "summary.json").read_text())
    averaged = found["P1-averaged"]["factor_of_safety"]
    for summary in found.values():
        assert summary["factor_of_safety_by_particles"] == pytest.approx(averaged, rel=0.02)


def test_pore_pressures_of_an_embankment_stay_in_space_as_it_slides(tmp_path):
    """Soil that falls into the water gets its uplift, 9.81 kN/m3."""
    stages = '[[stages]]\nname = "all"\nfill = ["lower", "upper"]\nwater_level = 1.0\n'
    site = site_file.read_site(site_in(tmp_path, SITE + stages), MPI.COMM_WORLD)
    embankment = importlib.import_module("embankment")
    particles, failed = embankment.build(site, 3, 1.0, False)
    assert failed is None
    p, act = particles.model.particles, embankment.pore_water(particles)
    above = p.position[:, 1] > 1.0
    assert abs(p.traction[above]).max() == 0 and p.traction[~above, 1].sum() == pytest.approx(9810.0)
    particles.model.remove(~above)
    particles.model.place(p.position - [0.0, 1.0])
    assert p.traction[:, 1].sum() == 0
    act()
    assert p.traction[:, 1].sum() == pytest.approx(9810.0)


def test_a_boundary_of_the_air_holds_what_slides_and_not_the_soil(tmp_path):
    """A support by default, or in the file, is none of the elements where only empty cells are at its boundary."""
    path = site_in(tmp_path, SITE.replace('mesh = "block.geo"', 'mesh = "block.geo"\nair = ["pond"]'))
    give_room(tmp_path)
    geometry = (tmp_path / "block.geo").read_text().replace('"air"', '"pond"')
    (tmp_path / "block.geo").write_text(
        geometry + 'Physical Curve("right") = {Curve In BoundingBox{3 - e, -e, -e, 3 + e, 2 + e, e}};\n'
    )
    site = site_file.read_site(path, MPI.COMM_WORLD)
    assert [support.facet_tag for support in site.supports] == ["base", "left", "right"]
    fem = site.finite_elements(1)
    fem.solve(site.load())
    assert fem.converged and fem.reaction("base")[1] == pytest.approx(-28e3)
    assert site.particles(3).particles.mass.sum() == pytest.approx(28e3 / 9.81)


SLOPE = """
mesh = "{mesh}"
cell_size = 1.0
air = ["empty"]
constants = {{height = 10.0, angle = 45.0, crest = 15.0, runout = 25.0, headroom = 2.0}}
[soils.soil]
unit_weight = 19e3
young = 20e6
poisson = 0.3
cohesion = 12e3
friction_angle = 30.0
dilation_angle = 30.0
"""


@pytest.mark.usefixtures("without_pictures")
def test_a_slope_that_limit_analysis_lets_fail_does_not_stand_by_stiff_cells(tmp_path):
    """Its log-spiral is an upper bound of its factor of safety, so that under 15 % more it fails; linear cells without averages
    are stronger by a fifth, and hold it at 0.2 m."""
    path = tmp_path / "slope.toml"
    path.write_text(SLOPE.format(mesh=ROOT / "meshes" / "slope.geo"))
    factor = 1.15 * bridge.log_spiral_safety(10.0, 45.0, 12e3, 30.0, 19e3)
    options = ["--site", path, "--factor", factor, "--time", 5, "--frames", 5, "--output", tmp_path / "slide"]
    assert importlib.import_module("slope").main([str(word) for word in options]) == 0
    assert json.loads((tmp_path / "slide" / "summary.json").read_text())["largest_displacement_m"] > 0.5


@pytest.mark.usefixtures("without_pictures")
def test_a_steep_slope_with_little_cohesion_that_averages_do_not_carry_slides_without(tmp_path):
    """A slope of 60 degrees in soil of 52 degrees stands in quadratic elements, by a factor below the upper bound of its log-spiral."""
    path, strength = tmp_path / "slope.toml", (10.0, 60.0, 3e3, 52.0, 19e3)
    text = (
        SLOPE.format(mesh=ROOT / "meshes" / "slope.geo")
        .replace("angle = 45.0", "angle = 60.0")
        .replace("runout = 25.0", "runout = 5.0")
    )
    text = text.replace("cohesion = 12e3", "cohesion = 3e3").replace("friction_angle = 30.0", "friction_angle = 52.0")
    path.write_text(text.replace("dilation_angle = 30.0", "dilation_angle = 7.0"))
    site = site_file.read_site(path, MPI.COMM_WORLD)
    fem = site.finite_elements(2)
    fem.solve(site.load())
    assert fem.converged and bridge.log_spiral_safety(*strength) > 1
    options = ["--site", str(path), "--factor", "1", "--time", "0.01", "--frames", "1", "--output"]
    slope = importlib.import_module("slope")
    with pytest.raises(mpm.InputError, match="of their weight only"):
        slope.main([*options, str(tmp_path / "averaged"), "--nmd"])
    with pytest.warns(RuntimeWarning, match="The slide goes on without averages"):
        assert slope.main([*options, str(tmp_path / "plain")]) == 0
