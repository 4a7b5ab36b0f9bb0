"""Sites of several soils from TOML: collapse and safety studies on them, and how mistakes in the file are named."""

import importlib
import json
import warnings
from pathlib import Path

import pytest
from mpi4py import MPI
from site_cases import SITE, site_in
from study_main import ended

import fenics_bridge as bridge
import mpm_core as mpm

ROOT = Path(__file__).parents[3]
site_file = importlib.import_module("common.site.file")


def test_a_site_has_its_laws_weights_and_supports(tmp_path):
    site = site_file.read_site(site_in(tmp_path), MPI.COMM_WORLD)
    assert site.soils == ["lower", "upper"] and site.unit_weight == {"lower": 10e3, "upper": 18e3}
    assert [support.facet_tag for support in site.supports] == ["base", "left"]
    assert site.supports[0].displacement is None and site.supports[1].displacement == (0.0, None)
    strengths = sorted(law.cohesion for law in site.laws.values())
    assert strengths[0] == 9e3 and 30e3 < strengths[1] < strengths[-1] < 40e3  # 1 to 2 m below the top
    fem = site.finite_elements(1)
    fem.solve(site.load())
    assert fem.converged and fem.reaction("base")[1] == pytest.approx(-28e3)


def test_a_site_may_be_a_half_section(tmp_path):
    """Its weights and areas are those of one radian: the block is a cylinder of radius 1 m, area 1/2."""
    supports = 'cell_size = 0.5\naxisymmetric = true\nsupports = {base = "fixed", left = "roller"}'
    site = site_file.read_site(site_in(tmp_path, SITE.replace("cell_size = 0.5", supports)), MPI.COMM_WORLD)
    fem = site.finite_elements(1)
    fem.solve(site.load())
    assert fem.geometry == mpm.Geometry.AXISYMMETRIC and fem.reaction("base")[1] == pytest.approx(-28e3 / 2)
    particles = site.particles(3)
    assert particles.particles.mass.sum() == pytest.approx(28e3 / 2 / 9.81, rel=1e-3)
    scene = importlib.import_module("common.scenes").scene_of(particles, sorted(site.laws))
    assert (
        importlib.import_module("common.plots").axis_labels(scene.half_section)[0].startswith("$r$ [m] (half section")
    )
    frame = importlib.import_module("common.movie").particle_frame(particles, 0.0)
    assert frame["volume"].sum() == pytest.approx(2.0)  # discs have the area of the section
    folder = tmp_path / "collapse"
    options = ["--site", str(tmp_path / "site.toml"), "--meshes", "1", "--output", str(folder)]
    assert importlib.import_module("collapse").main(options) == 0
    assert (folder / "mechanism.png").exists()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cell_size = 0.5", "cell_size = 0.5\naxisymmetric = 1", "axisymmetric is 1, expected true or false"),
        ("unit_weight = 18e3", "", "soils.upper has no unit_weight"),
        ("cohesion = 9e3", "cohesionn = 9e3", "soils.upper: unknown key 'cohesionn'"),
        ("cohesion = 9e3", "cohesion = -1.0", "soils.upper: cohesion is '-1.0', expected a number at least 0"),
        ("top = 2.0", "bottom = 2.0", "soils.lower: shear_strength is .* expected {value = , per_metre = , top = }"),
        ('mesh = "block.geo"', "", "has no 'mesh'"),
        ("[soils.upper]", "[soils.sand]", "soils.sand: no cell has the name 'sand'; the mesh has "),
        ('mesh = "block.geo"', 'mesh = "block.geo"\nair = ["pond"]', "air: no cell has the name 'pond'; the mesh has "),
        ('"tresca"', '"clay"', "soils.lower: material is 'clay', expected one of"),
        ("cell_size = 0.5", "cell_size = 0.5\nsize = 1", "unknown key 'size'"),
        (
            "cell_size = 0.5",
            'cell_size = 0.5\nsupports = {base = "glued"}',
            "supports.base is 'glued', expected 'fixed' or 'roller'",
        ),
        ("cell_size = 0.5", 'cell_size = 0.5\nstages = [{fill = ["sand"]}]', "soil 'sand' is not among the soils lower, upper"),
        ("cell_size = 0.5", "cell_size = 0.5\nstages = [{full = []}]", r"stages\[0\]: unknown key 'full'"),
        ("cell_size = 0.5", "cell_size = [", "is not TOML"),
        ("unit_weight = 18e3", 'unit_weight = "18e3"', r"soils.upper: unit_weight is '18e3', expected a number from 0 on \[N/m3\]"),
        ("cell_size = 0.5", 'cell_size = "2 m"', r"cell_size is '2 m', expected a number above 0 \[m\]"),
        ("cell_size = 0.5", "cell_size = -1", r"cell_size is -1, expected a number above 0 \[m\]"),
        ("per_metre = 10e3", "per_metre = -30e3", "soils.lower: shear_strength is '-.*', expected a number at least 0 Pa, at a height of 0"),
        ("unit_weight = 18e3", "unit_weight = -18e3", r"soils.upper: unit_weight is -18000.0, expected a number from 0 on"),
        ("per_metre = 10e3", 'per_metre = "10e3"', "soils.lower: shear_strength is .* expected {value = , per_metre = , top = }"),
        ("cell_size = 0.5", 'cell_size = 0.5\nstages = [{reset_displacement = "false"}]', "reset_displacement is 'false', expected true"),
        ("cell_size = 0.5", 'cell_size = 0.5\nstages = [{water_level = "low"}]', "water_level is 'low', expected a number"),
        ("cell_size = 0.5", "cell_size = 0.5\nstages = [{water_level = [[3, 1], [0, 1]]}]", r"water_level is \[.* with x rising"),
        ("cell_size = 0.5", 'cell_size = 0.5\nstages = [{support = ["left"]}]', r"support is \['left'\], expected a table such as"),
        ("cell_size = 0.5", "cell_size = 0.5\nlaws = {soft = {young = {value = 1e6, per_metre = 1e5, top = 2.0}}}",
         "laws.soft: young is .* expected one value: only parameters of"),
        ("cell_size = 0.5", "cell_size = 0.5\nstages = [{unit_weight = 5e3}]", "unit_weight is 5000.0, expected a table such as"),
    ],
)  # fmt: skip
def test_a_mistake_in_the_file_is_named(tmp_path, old, new, message):
    def use():
        site_file.read_site(site_in(tmp_path, SITE.replace(old, new)), MPI.COMM_WORLD).finite_elements(1)

    with pytest.raises(mpm.InputError, match=message):
        use()


def test_without_friction_more_weight_is_as_less_strength(tmp_path):
    """Only c / gamma counts: collapse and safety give the same factor, to the widths of their last steps (2e-3 of it each).

    The upper 1 m (c 9 kPa, 18 kN/m3) stands free on its right: limit analysis has at least 2 c / (gamma H) = 1.
    """
    path, factors = site_in(tmp_path), {}
    for study, key in (("safety", "factor_of_safety"), ("collapse", "collapse_weight_factor")):
        folder = tmp_path / study
        assert importlib.import_module(study).main(["--site", str(path), "--meshes", "1", "--output", str(folder)]) == 0
        summary = json.loads((folder / "summary.json").read_text())
        factors[study] = summary[key], summary["failed_at"]
        assert summary["failure_shown"] and (folder / "mechanism.png").exists()
    (low, high), (lower, higher) = factors.values()
    assert low >= 1 and max(low, lower) <= min(high, higher) + 4e-3 * low
    assert high - low <= 4e-3 * low


@pytest.mark.usefixtures("without_pictures")
def test_a_site_is_shaken_along_the_first_axis(tmp_path):
    """Its right side is free, so that forces to the right weaken it, which fails at some coefficient, and forces to the left do not."""
    path, factors = site_in(tmp_path), {}
    for coefficient, more in ((0.0, ["--critical-seismic"]), (0.1, []), (-0.1, ["--critical-seismic"])):
        folder = tmp_path / f"{coefficient}"
        options = ["--site", str(path), "--meshes", "1", "--seismic-coefficient", str(coefficient), *more]
        assert importlib.import_module("safety").main([*options, "--output", str(folder)]) == 0
        factors[coefficient] = json.loads((folder / "summary.json").read_text())
    values = [factors[k]["factor_of_safety"] for k in (0.1, 0.0, -0.1)]
    assert values[0] < 0.95 * values[1] and values[1] < values[2]
    critical = factors[0.0]["critical_seismic_coefficient"]
    assert (critical > 0.1) == (values[0] > 1) and critical > 0
    assert factors[-0.1]["critical_seismic_coefficient"] > 1.2 * critical  # to the left


STAGES = """
[[stages]]
name = "in situ"
fill = ["lower", "upper"]
water_level = 1.0
[[stages]]
name = "cut"
excavate = "upper"
unit_weight = {lower = 11e3}
release = "left"
"""


@pytest.mark.usefixtures("without_pictures")
def test_stages_that_are_left_out_are_named(tmp_path):
    options = ["--site", site_in(tmp_path, SITE + STAGES), "--meshes", 1, "--output", tmp_path / "collapse"]
    said = "left out: water_level of 'in situ', excavate of 'cut', unit_weight of 'cut', release of 'cut'; the study safety"
    with pytest.warns(RuntimeWarning, match=said):
        importlib.import_module("collapse").main([str(word) for word in options])
    placed = SITE + STAGES.partition("water_level")[0]
    assert site_file.read_site(site_in(tmp_path, placed), MPI.COMM_SELF).left_out_at_once() == ""


@pytest.mark.usefixtures("without_pictures")
def test_the_factor_of_safety_is_that_after_the_last_stage(tmp_path):
    """Ground far below a water level has the factor of dry ground under its buoyant weight: water at rest presses on all sides.

    A block under 2 m of water, whose upper half was dug away, is therefore the lower half with its weight less 9.81 kN/m3, in the
    same cells. It does not carry its own weight, so that the first stage has no equilibrium.
    """
    heavy = SITE.replace("20e3, per_metre = 10e3", "1e3, per_metre = 0.5e3").replace("10e3", "19.81e3")
    staged = (
        heavy
        + """
[[stages]]
fill = ["lower", "upper"]
water_level = 4.0
[[stages]]
excavate = "upper"
"""
    )
    lower = heavy.partition("[soils.upper]")[0].replace("19.81e3", "10e3")
    factors = []
    for name, text in (("staged", staged), ("lower", lower)):
        options = ["--site", site_in(tmp_path, text), "--meshes", 1, "--start", 0.2, "--output", tmp_path / name]
        with warnings.catch_warnings():
            warnings.filterwarnings("error", message="all soils are there at once")
            assert importlib.import_module("safety").main([str(word) for word in options]) == 0
        factors.append(json.loads((tmp_path / name / "summary.json").read_text())["factor_of_safety"])
    assert 0.2 < factors[1] < 1.0
    assert factors[0] == pytest.approx(factors[1], rel=4e-3)  # twice the tolerance of the search


FRICTION = "cohesion = 10e3\nfriction_angle = 35.0\nyoung = 5e6\npoisson = 0.3\n"
CUT = f"""
mesh = "block.geo"
cell_size = 0.5
[soils.lower]
unit_weight = 18e3
{FRICTION}
[soils.upper]
unit_weight = 18e3
{FRICTION}
[laws.undrained]
{FRICTION}undrained = true
water_modulus = 2e8
[[stages]]
fill = ["lower", "upper"]
[[stages]]
law = {{lower = "undrained", upper = "undrained"}}
"""


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("staged", [True, False])
def test_soil_that_ceases_to_drain_keeps_its_effective_stress(staged, tmp_path):
    """Another law changes no stress, so that a cut that carries its weight still does: its factor is 1 or more.

    Soil that is placed undrained carries its weight by its water, and has the strength c cos(phi) alone. In the block 2 m high that
    makes 4 c cos(phi) / (18 kN/m3 * 2 m) = 0.91 by the wedge of 45 degrees, an upper bound.
    """
    text = CUT
    if not staged:
        text = CUT.partition("[laws.undrained]")[0].replace(
            FRICTION, FRICTION + "undrained = true\nwater_modulus = 2e8\n"
        )
    options = ["--site", site_in(tmp_path, text), "--meshes", 1, "--output", tmp_path / "out"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert importlib.import_module("safety").main([str(word) for word in options]) == 0
    said = [str(one.message) for one in caught]
    assert any("the water of 'lower', 'upper' bears the weight of this soil, too" in text for text in said) != staged
    factor = json.loads((tmp_path / "out" / "summary.json").read_text())["factor_of_safety"]
    assert factor >= 1.0 if staged else factor < 0.91 * 1.15  # coarse cells


@pytest.mark.usefixtures("without_pictures")
def test_a_stage_without_equilibrium_has_no_factor_of_safety(tmp_path):
    text = CUT.replace("unit_weight = 18e3", "unit_weight = 60e3")
    options = ["--site", site_in(tmp_path, text), "--meshes", 1, "--output", tmp_path / "out"]
    with pytest.raises(mpm.RunError, match="no equilibrium to find a factor of safety of, which is below 1: .*stage 1"):
        importlib.import_module("safety").main([str(word) for word in options])


def test_stages_are_placed_at_once_on_a_new_site_only(tmp_path):
    site = site_file.read_site(site_in(tmp_path, SITE + STAGES), MPI.COMM_WORLD)
    once = bridge.FemSite(site.finite_elements(1))
    with pytest.raises(mpm.InputError, match="stages is empty"):
        once.place([])
    pull = bridge.Stage("pull", support=bridge.prescribed("left", (-0.01, None)))
    with pytest.raises(mpm.InputError, match="stage 'pull': support prescribes a displacement"):
        once.place([site.stages[0], pull])
    load = once.place(site.stages)
    assert once.state.there == tuple(sorted(site.tags_of(["lower"]))) and set(load.unit_weight.values()) == {11e3}
    with pytest.raises(mpm.InputError, match="stage 2 has been carried out"):
        once.place(site.stages)


@pytest.mark.usefixtures("without_pictures")
def test_results_keep_the_file_of_the_site_as_it_was(tmp_path):
    path = site_in(tmp_path, SITE.replace("cell_size = 0.5", "cell_size = 1.0  # coarse"))
    text, options = path.read_text(), ["--site", str(path), "--meshes", "1", "--output", str(tmp_path / "results")]
    assert importlib.import_module("safety").main(options) == 0
    path.write_text(SITE.replace("18e3", "20e3"))
    assert (tmp_path / "results" / "site.toml").read_text() == text
    assert importlib.import_module("safety").main([*options, "--overwrite"]) == 0
    assert (tmp_path / "results" / "site.toml").read_text() == path.read_text()


@pytest.mark.usefixtures("without_pictures")
def test_the_cell_size_of_a_site_may_be_given_beside_it(tmp_path):
    path = site_in(tmp_path, SITE)
    options = ["--site", path, "--cell-size", 1.0, "--meshes", 1]
    for study in ("safety", "collapse"):
        folder = tmp_path / study
        assert importlib.import_module(study).main([str(word) for word in [*options, "--output", folder]]) == 0
        assert json.loads((folder / "summary.json").read_text())["meshes"][0]["cell_size_m"] == 1.0
    assert importlib.import_module("slope").parse(["--site", str(path), "--cell-size", "2.5"]).cell_size == 2.5


@pytest.mark.usefixtures("without_pictures")
def test_a_soil_of_a_site_may_keep_its_strength(tmp_path):
    """More strength never lowers the factor of soils that flow without a change of volume, by limit analysis."""
    path, factors = site_in(tmp_path, SITE.replace("cell_size = 0.5", "cell_size = 1.0")), {}
    for kept in ((), ("lower",), ("upper",)):
        folder = tmp_path / "-".join(("safety", *kept))
        options = ["--site", path, "--meshes", 1, "--output", folder, "--unreduced", *kept]
        assert importlib.import_module("safety").main([str(word) for word in options]) == 0
        factors[kept] = json.loads((folder / "summary.json").read_text())["factor_of_safety"]
    assert factors[()] <= factors["lower",] * (1 + 4e-3) and 1.1 * factors[()] < factors["upper",]


def test_the_files_of_a_law_are_beside_the_site(tmp_path):
    (tmp_path / "law.py").write_text(
        "class Clay:\n"
        "    n_state, p_wave_modulus, c = 1, 7e6, 9e3\n"
        "    strength_parameters = {'c': 'strength'}\n"
        "    def update(self, *points):\n"
        "        pass\n"
    )
    own = SITE.replace("cohesion = 9e3\nfriction_angle = 0.0\nyoung = 5e6", 'python_law = "law.py:Clay"')
    site = site_file.read_site(site_in(tmp_path, own), MPI.COMM_WORLD)
    tag = site.tags_of(["upper"])[0]
    assert bridge.reduced_strength(site.laws, 1.5)[tag].law.c == pytest.approx(6e3)


def test_a_soil_that_the_site_does_not_have_cannot_keep_its_strength(tmp_path):
    options = ["--site", site_in(tmp_path), "--meshes", 1, "--output", tmp_path / "safety", "--unreduced", "rock"]
    with pytest.raises(mpm.InputError, match="'rock' is not among the soils lower, upper"):
        importlib.import_module("safety").main([str(word) for word in options])


@pytest.mark.parametrize(
    "study",
    ["collapse", "consolidation", "drawdown", "embankment", "excavation", "rain", "safety", "seepage", "slope"],
)
def test_earlier_results_stay_where_the_site_has_a_mistake(tmp_path, study):
    """A file with a typing error must not cost the results that --overwrite would replace."""
    path, folder = site_in(tmp_path, SITE.replace("unit_weight", "unitweight")), tmp_path / "results"
    folder.mkdir()
    (folder / "summary.json").write_text("{}")
    with pytest.raises(mpm.InputError):
        importlib.import_module(study).main(["--site", str(path), "--output", str(folder), "--overwrite"])
    assert [file.name for file in folder.iterdir()] == ["summary.json"]


def test_rows_of_ground_that_stiffens_with_depth_are_averaged_together():
    """Averaged by themselves, rows of clay lock: the factor of linear elements on cells of 1 m was 9 % above that of quadratic ones."""
    found = {}
    for degree in (1, 2):
        site = site_file.read_site(ROOT / "meshes" / "embankment.toml", MPI.COMM_WORLD, 1.0)
        stiffness = {law.young for law in site.laws.values() if law.friction_angle == 0}
        assert len(stiffness) > 1
        fem = site.finite_elements(degree=degree, nmd=degree == 1)
        found[degree] = bridge.factor_of_safety(fem, site.load(), start=1.0, tolerance=5e-3).value
    assert found[1] == pytest.approx(found[2], rel=0.04)


ELASTIC = """
mesh = "block.geo"
cell_size = 0.5
[soils.lower]
unit_weight = 18e3
material = "elastic"
young = 5e6
poisson = 0.2
[soils.upper]
unit_weight = 18e3
material = "elastic"
young = 5e6
poisson = 0.2
[laws.stiff]
material = "elastic"
young = 5e9
poisson = 0.4
[supports]
base = "fixed"
[[stages]]
fill = ["lower", "upper"]
law = {lower = "stiff"}
support = {left = "roller"}
[[stages]]
excavate = "upper"
"""


@pytest.mark.usefixtures("without_pictures")
def test_an_excavation_is_compared_with_the_laws_and_supports_that_stages_bring(tmp_path):
    """Elastic soil that has its last laws and supports from the first stage on has the same stresses at once."""
    options = ["--site", site_in(tmp_path, ELASTIC), "--output", tmp_path / "out"]
    assert importlib.import_module("excavation").main([str(word) for word in options]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["difference_to_at_once"] < 1e-8
    assert "difference_to_at_once_elastic" not in summary  # in general elastic soil, too, depends on when they come


@pytest.mark.usefixtures("without_pictures")
def test_a_site_that_carries_many_times_its_weight_is_said_not_to_fail_by_it(tmp_path):
    """A bank 0.05 m high of clay of 20 kPa: its stability number of some 4 is reached at a hundred times its weight."""
    site = f"""
mesh = "{ROOT}/meshes/bank.geo"
[constants]
height = 0.05
crest = 0.055
[soils.soil]
unit_weight = 16e3
material = "tresca"
young = 10e6
poisson = 0.4
shear_strength = 20e3
[supports]
left = "roller"
base = "fixed"
"""
    (tmp_path / "site.toml").write_text(site)
    options = f"--site {tmp_path / 'site.toml'} --meshes 1 --output {tmp_path / 'results'}"
    with pytest.warns(RuntimeWarning, match=r"carries \d+ times its weight: its weight hardly makes it fail"):
        assert importlib.import_module("collapse").main(options.split()) == 0


def test_layers_placed_later_are_not_compared_in_elastic_soil(tmp_path):
    """A layer is free of stress on soil that has settled, and so elastic soil, too, has other stresses than at once."""
    stages = '[[stages]]\nfill = ["lower"]\n[[stages]]\nfill = ["upper"]\n'
    text = ELASTIC[: ELASTIC.index("[[stages]]")] + stages
    options = ["--site", site_in(tmp_path, text), "--output", tmp_path / "out"]
    assert importlib.import_module("excavation").main([str(word) for word in options]) == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["difference_to_at_once"] > 1e-3 and "difference_to_at_once_elastic" not in summary


@pytest.mark.parametrize("elements, dilation, said", [("P1", 30.0, 1), ("P1", 0.0, 0), ("P2", 30.0, 0)])
def test_linear_elements_are_said_to_be_too_stiff(elements, dilation, said, tmp_path, monkeypatch):
    """Where soil keeps its volume as it fails the finite elements say so themselves."""
    runs = importlib.import_module("common.site.runs")
    monkeypatch.setattr(runs, "open_results", lambda *_: (_ for _ in ()).throw(mpm.InputError("no more")))
    frictional = f"friction_angle = 30.0\ndilation_angle = {dilation}"
    path = site_in(tmp_path, SITE.replace("friction_angle = 0.0", frictional).replace('"tresca"', '"elastic"'))
    result = ended("safety", tmp_path, "--site", path, "--elements", elements, "--meshes", "1")
    assert "no more" in result.stderr
    assert result.stderr.count("--elements is P1: linear triangles are too stiff") == said
