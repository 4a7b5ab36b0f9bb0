"""One file of a site serves all studies that take sites, and its mistakes are named by all of them."""

import importlib
import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from study_main import ended

import mpm_core as mpm

ROOT = Path(__file__).parents[3]
pytestmark = pytest.mark.usefixtures("without_pictures")
DIKE = ROOT / "meshes" / "dike.toml"
SMALL = {
    "collapse": "--meshes 1",
    "consolidation": "--days 100 --first-step 10 --growth 2 --frames 1 --no-film",
    "drawdown": "--days 1 --factor-times 1 --no-davis --no-pictures",
    "embankment": "--factor 1 --time 0.01 --frames 1 --no-nmd --no-pictures",
    "excavation": "--elements P1",
    "rain": "--days 1 --factor-times 1 --no-davis --no-suction --no-pictures",
    "safety": "--meshes 1",
    "seepage": "--days 1 --frames 1 --no-film",
    "slope": "--time 0.01 --frames 1 --no-pictures",
}


def run(study, path, folder, options=""):
    words = [*SMALL[study].split(), *options.split(), "--site", str(path), "--output", str(folder)]
    assert importlib.import_module(study).main(words) == 0, study
    return json.loads((folder / "summary.json").read_text())


def written(folder, *changes):
    text = DIKE.read_text().replace('"bank_on_ground.geo"', f'"{ROOT}/meshes/bank_on_ground.geo"')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "site.toml").write_text(text)
    return folder / "site.toml"


def test_studies_that_take_sites_are_all_here():
    sources = {path.stem: path.read_text() for path in (ROOT / "studies").glob("*.py")}
    options = "add_site_file|add_site_option|add_stage_options|add_water_slope_options"
    assert sorted(SMALL) == sorted(name for name, text in sources.items() if re.search(options, text))


def test_one_file_serves_all_studies(tmp_path):
    """At the beginning the flow is at rest under 7 m of water, so that drawdown, rain and safety have the same pore pressures.

    Their factors are between the last equilibrium and the failure that each of them found. Linear elements of the studies of
    stages are the same, and so are the cells of their particles.
    """
    found = {study: run(study, DIKE, tmp_path / study, "--cell-size 3") for study in SMALL}
    assert all(abs(found["seepage"][f"steady_inflow_{name}_m2_per_day"]) < 1e-9 for name in ("face", "crest"))
    brackets = [(found["safety"]["factor_of_safety"], found["safety"]["failed_at"])]
    for study in ("drawdown", "rain"):
        rows = np.genfromtxt(tmp_path / study / "factors.csv", delimiter=",", names=True)
        brackets.append((rows["factor_of_safety"][0], rows["failed_at_factor"][0]))
    assert max(low for low, _ in brackets) < min(high for _, high in brackets)
    stages = [found[study]["stages"] for study in ("embankment", "excavation")]
    assert [row["stage"] for row in stages[0]] == ["in situ", "dike", "flood"]
    for one, other in zip(*stages):
        assert one["settlement_m"] == pytest.approx(other["settlement_m"], rel=1e-6)
    assert found["embankment"]["stress_difference_of_particles_to_fem"] < 1e-6
    assert found["slope"]["initial_out_of_balance_ratio"] < 1e-8
    assert found["collapse"]["collapse_weight_factor"] > 1
    assert found["consolidation"]["finished_run"] and found["consolidation"]["settlement_below_m"] > 0


@pytest.mark.parametrize("study", SMALL)
@pytest.mark.parametrize(
    "old, new, words",
    [
        ("[points]", "[point]", "unknown key 'point'; did you mean points"),
        ("porosity = 0.4\n", "porousity = 0.4\n", "soils.bank: unknown key 'porousity'; did you mean porosity"),
        ("cohesion = 10e3  #", "cohesionn = 10e3  #", "soils.bank: unknown key 'cohesionn'; did you mean .*cohesion"),
        ("reservoir = [[", "resevoir = [[", "boundaries.face: unknown key 'resevoir'; did you mean reservoir"),
        ("duration =", "durations =", r"stages\[1\]: unknown key 'durations'; did you mean duration"),
        ("crest = {rain", "crest = {rian", r"stages\[0\].boundaries.crest: unknown key 'rian'"),
        ('"bank_on_ground.geo"', '"bank.msh"', "site.toml: mesh: .*bank.msh"),
        ("[soils.ground]", "[[soils.ground]]", "soils.ground is .*, expected a table of keys"),
    ],
)
def test_a_mistake_is_named_by_every_study(study, old, new, words, tmp_path):
    text = DIKE.read_text()
    assert old in text
    (tmp_path / "site.toml").write_text(text.replace(old, new))
    with pytest.raises(mpm.InputError, match=words):
        run(study, tmp_path / "site.toml", tmp_path / "results")


@pytest.mark.parametrize(
    "study, change, words",
    [
        ("drawdown", ("[boundaries", "[constants.boundaries"), "has no 'boundaries', which this study needs: .*what the water"),
        ("consolidation", ("[points]", "[pressures]"), "has no 'points', which this study needs: places"),
        ("embankment", ("[[stages]]", "[[constants.stages]]"), "has no 'stages', which this study needs"),
        ("consolidation", ("day = 1.0\n", ""), r"stages\[1\]: day is None, expected a number of days from 0 on, when the stage begins"),
        ("rain", ("conductivity = 3e-7  # m/s\nporosity = 0.4\ncompressibility = 5e-8  # 1/Pa, for seepage; consolidation has "
                  "that of the law\nvan_genuchten = {alpha = 1e-4, n = 1.6, residual = 0.1, air_entry = 200.0}  # 1/Pa, -, -, Pa\n",
                  ""), "soils.bank has no conductivity"),
        ("safety", ("unit_weight = 20e3  # N/m3, saturated\n", ""), "soils.bank has no unit_weight"),
        ("drawdown", ("[constants]", "axisymmetric = true\n[constants]"), "axisymmetric is True, expected false"),
    ],
)  # fmt: skip
def test_what_a_study_needs_is_named(study, change, words, tmp_path):
    with pytest.raises(mpm.InputError, match=words):
        run(study, written(tmp_path, change), tmp_path / "results")


def test_a_soil_without_a_law_is_named(tmp_path):
    (tmp_path / "site.toml").write_text(
        f'mesh = "{ROOT}/meshes/layer.geo"\n[soils.clay]\nunit_weight = 18e3\nporosity = 0.5\n'
    )
    with pytest.raises(mpm.InputError, match="soils.clay has no law, which this study needs: material"):
        run("safety", tmp_path / "site.toml", tmp_path / "results")


def ground_alone(folder, first_line=""):
    """The site without the bank, its point on it, and the stages."""
    text = written(folder, ("crest = [5.0, 8.0]  # m\n", "")).read_text()
    bank, ground, stages = (text.index(words) for words in ("[soils.bank]", "[soils.ground]", "[[stages]]"))
    (folder / "site.toml").write_text(f"{first_line}\n{text[:bank]}{text[ground:stages]}")
    return folder / "site.toml"


def reads():
    """Functions that read a site, by study."""
    for study, module in (("safety", "site.file"), ("seepage", "water.site"), ("drawdown", "slope.site"),
                          ("consolidation", "consolidation.site")):  # fmt: skip
        reader = {"site.file": "read_site"}.get(module, f"read_{module.replace('.', '_')}")
        yield pytest.param(getattr(importlib.import_module(f"common.{module}"), reader), id=study)


@pytest.mark.parametrize("read", reads())
@pytest.mark.parametrize("declared", [False, True])
def test_a_group_of_the_mesh_without_a_soil_is_named_unless_it_is_declared_as_air(read, declared, tmp_path):
    path = ground_alone(tmp_path, 'air = "bank"' if declared else "")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read(path, MPI.COMM_WORLD, 3.0)
    named = [str(one.message) for one in said if "no soil for 'bank'" in str(one.message)]
    assert len(named) == (not declared)
    assert not any("'air'" in str(one.message) for one in said)


def test_a_soil_that_no_stage_fills_is_named(tmp_path):
    from common.site.file import read_site

    text = written(tmp_path).read_text()
    stages = text.index("[[stages]]")
    path = tmp_path / "site.toml"
    path.write_text(text[:stages] + '[[stages]]\nname = "in situ"\nfill = ["ground"]\n')
    with pytest.warns(RuntimeWarning, match="no stage fills the cells of 'bank', which therefore hold no soil"):
        read_site(path, MPI.COMM_WORLD, 3.0)


@pytest.mark.parametrize(
    "change, words",
    [
        (("cohesion = 10e3  # Pa", "cohesion = 10.0"), "soils.bank: cohesion is 10 Pa, which hardly any soil has"),
        (("young = 20e6  # Pa", "young = 20e3"), "soils.bank: young is 20000 Pa, which hardly any soil has"),
        (
            ("cohesion = 10e3  # Pa", "cohesion = {value = 10.0, per_metre = 2.0, top = 8.0}"),
            r"soils.bank: cohesion is 2\d\.\d+ Pa at most, which hardly any soil has",
        ),
        (
            ('"mohr-coulomb"  # of effective', '"hardening-soil"\nvertical_preconsolidation = 200.0  # of effective'),
            "soils.bank: vertical_preconsolidation is 200 Pa, which hardly any soil has",
        ),
        (
            ("[soils.bank]", "[laws.weak]\nyoung = 20e3\n[soils.bank]"),
            "laws.weak: young is 20000 Pa, which hardly any soil has",
        ),
    ],
)
def test_stiffness_and_strength_in_kilopascals_are_named(change, words, tmp_path):
    from common.site.file import read_site

    with pytest.warns(RuntimeWarning, match=words):
        read_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)


@pytest.mark.parametrize("table", ["soils.bank", "laws.weak"])
def test_a_key_without_effect_on_the_law_is_named(table, tmp_path):
    from common.site.file import read_site

    change = "[soils.bank]", "[laws.weak]\nyoung = 5e6\n[soils.bank]\n"
    change = change[0], change[1].replace(f"[{table}]\n", f"[{table}]\nviscosity = 1e3\n")
    with pytest.warns(RuntimeWarning, match=f"{table}: viscosity has no effect with the law mohr-coulomb"):
        read_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)


def test_parameters_that_a_law_needs_and_a_soil_leaves_out_are_named_with_their_values(tmp_path):
    from common.site.file import read_site
    from common.site.laws import left_out_doubt

    change = "[soils.bank]", "[laws.weak]\nyoung = 5e6\ncohesion = 2e3\n[soils.bank]"
    words = (
        "laws.weak leaves out what its law mohr-coulomb needs: poisson = 0.33, friction_angle = 25 degrees are taken"
    )
    with pytest.warns(RuntimeWarning, match=words):
        read_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)
    clay = {"material": "tresca", "young": 5e6, "poisson": 0.45, "shear_strength": 20e3}
    assert left_out_doubt(clay, "clay") == "" and left_out_doubt({"umat": "soil.so"}, "clay") == ""
    del clay["poisson"]
    assert left_out_doubt(clay, "clay") == "clay leaves out what its law tresca needs: poisson = 0.33 is taken"


def test_a_strength_that_is_small_at_the_top_only_is_not_named(tmp_path):
    from common.site.file import read_site

    change = "cohesion = 10e3  # Pa", "cohesion = {value = 0.0, per_metre = 2e3, top = 8.0}"
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".*which hardly any soil has")
        read_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)


@pytest.mark.parametrize("given, words", [(2e7, 1), (5e-5, 1), (5e-8, 0)])
def test_a_modulus_or_kilopascals_in_the_place_of_a_compressibility_are_named(given, words, tmp_path):
    from common.water.site import read_water_site

    change = "compressibility = 5e-8", f"compressibility = {given}"
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read_water_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)
    assert sum("soils.bank: compressibility is " in str(one.message) for one in said) == words


@pytest.mark.parametrize("modulus, words", [(2.2, 1), (2.2e9, 0)])
def test_a_modulus_of_the_water_in_gigapascals_is_named(modulus, words, tmp_path):
    from common.site.file import read_site

    change = "[soils.bank]", f"[soils.bank]\nundrained = true\nwater_modulus = {modulus}"
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)
    text = "soils.bank: water_modulus is 2.2 Pa, less than that of air; moduli are in Pa"
    assert sum(text in str(one.message) for one in said) == words


@pytest.mark.parametrize(
    "module, study, where",
    [
        ("site.file", "read_site", r"stages\[2\]: water_level"),
        ("slope.site", "read_slope_site", "the reservoir of 'face'"),
        ("water.site", "read_water_site", "the reservoir of 'face'"),
    ],
)
@pytest.mark.parametrize("level, words", [(200.0, 1), (7.0, 0)])
def test_water_far_above_the_ground_is_said(module, study, where, level, words, tmp_path):
    read = getattr(importlib.import_module(f"common.{module}"), study)
    changes = ("water_level = 7.0", f"water_level = {level}"), ("[0.0, 7.0]", f"[0.0, {level}]")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        read(written(tmp_path, *changes), MPI.COMM_WORLD, 3.0)
    text = f"{where} is 200 m, 19[12] m above the top of the mesh, which is .* m high: levels are elevations"  # dike of 8 m, or air
    assert sum(bool(re.search(text, str(one.message))) for one in said) == words


def test_a_pressure_of_a_stage_that_pulls_is_refused(tmp_path):
    from common.site.file import read_site

    change = "water_level = 7.0", "water_level = 7.0\npressure = {crest = -10e3}"
    with pytest.raises(
        mpm.InputError, match=r"stages\[\d\]: pressure of 'crest' is -10000 Pa, expected at least 0: a pressure pushes"
    ):
        read_site(written(tmp_path, change), MPI.COMM_WORLD, 3.0)


WEAK = ("cohesion = 10e3", "cohesion = 0.5e3"), ("friction_angle = 24.0", "friction_angle = 10.0")


@pytest.mark.parametrize(
    "study, options, words",
    [
        ("slope", "", "its soils carry"),
        ("excavation", "", "has no equilibrium beyond"),
        ("safety", "--start 100", "start: with the strength divided by 100.0 only"),
        ("drawdown", "--start 100", "start: with the strength divided by 100.0 only"),
    ],
)
def test_why_the_ground_fails_is_said_once(study, options, words, tmp_path):
    run = ended(
        study,
        tmp_path / "results",
        *SMALL[study].split(),
        "--cell-size",
        "3",
        "--site",
        written(tmp_path, *WEAK),
        *options.split(),
    )
    assert run.returncode != 0 and words in run.stderr
    assert run.stderr.count("a mechanism: ") + run.stderr.count("no equilibrium: ") <= 1
    assert "the load was not reached" not in run.stderr


def test_a_run_on_several_meshes_warns_once(tmp_path):
    words = f"--site {ground_alone(tmp_path)} --cell-size 3 --meshes 2 --elements P1 --output {tmp_path}/results"
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("default")
        importlib.import_module("safety").main(words.split())
    for words in ("no soil for 'bank'", "the water of [boundaries] is left out"):
        assert len([one for one in said if words in str(one.message)]) == 1


def test_what_a_study_leaves_out_is_named(tmp_path):
    from common.consolidation.site import read_consolidation_site
    from common.site.file import read_site
    from common.slope.site import read_slope_site

    dry = [("water_level = 0.0", "release = 'left'"), ("water_level = 7.0\n", "")]
    path = written(tmp_path, ("[points]", "[pressures]\ncrest = 10e3\n[points]"), *dry)
    with pytest.warns(RuntimeWarning, match=r"the water of \[boundaries\] is left out") as said:
        read_site(path, MPI.COMM_WORLD, 3.0)
    assert any("the loads of [pressures] are left out" in str(one.message) for one in said)
    with pytest.warns(
        RuntimeWarning, match="this study leaves out release of 'in situ', boundaries of 'in situ'"
    ) as said:
        read_slope_site(path, MPI.COMM_WORLD, 3.0)
    assert any("the loads of [pressures] are left out" in str(one.message) for one in said)
    with pytest.warns(RuntimeWarning, match="this study leaves out release of 'in situ'$"):
        read_consolidation_site(path, MPI.COMM_WORLD, 3.0)


def test_the_beginning_is_the_same_in_all_studies_of_stages(tmp_path):
    """A first stage without a day is the beginning; otherwise what no stage fills is there."""
    from common.consolidation.site import read_consolidation_site
    from common.site.file import read_site

    staged = ROOT / "meshes" / "staged_embankment.toml"
    mechanical = read_site(staged, MPI.COMM_WORLD, 2.0).stages
    assert [list(stage.fill) for stage in mechanical] == [["clay"], *([f"layer {k}"] for k in range(1, 5))]
    assert [stage.reset_displacement for stage in mechanical] == [False, True, False, False, False]
    assert read_consolidation_site(staged, MPI.COMM_WORLD, 2.0).stages[0].off == tuple(
        f"layer {k}" for k in range(1, 5)
    )
    single = DIKE.read_text().partition("[[stages]]")[0] + '[stages]\nday = 2.0\nfill = "bank"\n'
    path = tmp_path / "single.toml"
    path.write_text(single.replace('"bank_on', f'"{ROOT}/meshes/bank_on'))
    assert [list(stage.fill) for stage in read_site(path, MPI.COMM_WORLD, 3.0).stages] == [["ground"], ["bank"]]
    dike = read_consolidation_site(DIKE, MPI.COMM_WORLD, 3.0)
    assert [stage.off for stage in dike.stages] == [("bank",), (), ()]
    assert [stage.boundary["face"].level for stage in dike.stages] == [0.0, 0.0, 7.0]
    assert [stage.name for stage in read_site(DIKE, MPI.COMM_WORLD, 3.0).stages] == ["in situ", "dike", "flood"]


def test_stiffness_that_grows_with_depth_has_its_settlement_in_consolidation(tmp_path):
    """A layer under a wide load q settles by the integral of q / M, with M = 1.2 E for Poisson's ratio 1/4, as Terzaghi's."""
    text = (ROOT / "meshes" / "layer.toml").read_text().replace('"layer.geo"', f'"{ROOT}/meshes/layer.geo"')
    text = text.replace("young = 4e6", "young = {value = 2e6, per_metre = 2e6, top = 2.0}").replace("1e-9", "1e-7")
    (tmp_path / "site.toml").write_text("classes = 400\n" + text)
    words = f"--site {tmp_path}/site.toml --days 400 --growth 2 --frames 1 --no-film --particles --output {tmp_path}/results"
    assert importlib.import_module("consolidation").main(words.split()) == 0
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    exact = 30e3 / (1.2 * 2e6) * np.log(1 + 2.0)
    for name in ("settlement_surface_m", "settlement_surface_particles_m"):
        assert summary[name] == pytest.approx(exact, rel=1e-3)  # (dE / E)^2 in a cell, at most 2.5e-3, over 3


def test_laws_are_of_effective_stresses_where_the_water_is_computed(tmp_path):
    from common.site.file import read_site
    from common.slope.site import read_slope_site

    path = written(tmp_path, ("cohesion = 10e3  # Pa", "cohesion = 10e3\nundrained = true\nwater_modulus = 1e8"))
    undrained = [isinstance(law, mpm.Undrained) for law in read_site(path, MPI.COMM_WORLD, 3.0).laws.values()]
    assert undrained.count(True) == 1
    slope = read_slope_site(path, MPI.COMM_WORLD, 3.0)
    assert not any(isinstance(law, mpm.Undrained) for law in slope.site.laws.values())
    assert slope.porous["bank"].porosity == 0.4


def test_steps_that_apply_the_load_are_called_so(tmp_path, capsys):
    run("safety", DIKE, tmp_path / "safety", "--cell-size 3")
    lines = [line for line in capsys.readouterr().err.splitlines() if "step " in line]
    loading = [line for line in lines if line.startswith("cells of 3 m: step") and "part of the load" in line]
    values = [line for line in lines if line.startswith("cells of 3 m, factor of safety [-]: step")]
    assert loading and values and len(loading) + len(values) == len(lines)
    assert all(float(re.search(r"value (\S+)", line)[1]) > 0.5 for line in values)  # they begin above --start


@pytest.mark.parametrize("study", ["collapse", "safety", "slope"])
def test_parameters_of_a_run_of_a_site_have_its_options_only(study, tmp_path):
    from common.results import open_results
    from common.summary import write_summary

    options = importlib.import_module(study).parse(["--site", str(DIKE), "--output", str(tmp_path / "results")])
    text = (open_results(options) / "parameters.toml").read_text()
    names = set(re.findall(r"^([a-z0-9-]+) = ", text, re.MULTILINE))
    assert "site" in names and not names & {"height", "angle", "cohesion", "unit-weight", "friction-angle", "depth"}
    write_summary(tmp_path / "results", options, {})
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert {name.replace("-", "_") for name in names} <= set(summary["parameters"])
    assert not set(summary["parameters"]) & {"height", "angle", "cohesion", "unit_weight", "friction_angle", "depth"}
    again = importlib.import_module(study).parse(["--parameters", str(tmp_path / "results" / "parameters.toml")])
    assert again.site == DIKE and {one.name for one in again.parameters()} >= names
