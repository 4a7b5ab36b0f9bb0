"""The studies drawdown and rain: their sites, the limits of the factor of safety, its course, and the slide."""

import importlib
import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI
from study_main import ended, main

from mpm_core import InputError

STUDIES = Path(__file__).parents[3] / "studies"
MESHES = STUDIES.parent / "meshes"
SMALL = "--cell-size 2 --elements P1 --factor-times 1"


def site(name, folder, *changes):
    text = (MESHES / f"{name}.toml").read_text().replace('"bank_on_ground.geo"', f'"{MESHES}/bank_on_ground.geo"')
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "site.toml"
    path.write_text(text)
    return path


def run(name, path, folder, options):
    study = importlib.import_module(name)
    assert study.main([*SMALL.split(), *options.split(), "--site", str(path), "--output", str(folder / "results")]) == 0
    rows = np.genfromtxt(folder / "results" / "factors.csv", delimiter=",", names=True)
    return json.loads((folder / "results" / "summary.json").read_text()), rows


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("cohesion = 4e3", "cohesion = -4e3", "soils.bank.*cohesion"),
        ("conductivity = 3e-7", "conductivity = 0.0", "soils.bank: conductivity is 0.0"),
        ("unit_weight = 20e3  # N/m3, saturated\n", "", "soils.bank has no unit_weight"),
        ("[soils.bank]", "[soils.levee]", "levee"),
        ("[boundaries.face]", "[boundaries.front]", "front"),
        ("reservoir = [[0.0, 7.0], [3.0, 1.0]]", "rain = 1.0", "no boundary has reservoir"),
    ],
)
def test_a_wrong_site_is_named(old, new, words, tmp_path):
    with pytest.raises(InputError, match=words):
        run("drawdown", site("drawdown", tmp_path, (old, new)), tmp_path, "--days 1")


@pytest.mark.parametrize(
    ("study", "options", "message"),
    [
        ("drawdown", "--slide-water flows", "--slide-water is given, expected --slide with it"),
        ("rain", "--slide-from lowest", "--slide-from is given, expected --slide with it"),
        ("rain", "--time 3", "--time is given, expected --slide with it"),
        ("drawdown", "--slide --slide-step 0.1", "--slide-step is given, expected --slide-water flows with it"),
    ],
)
def test_options_of_a_slide_without_one_are_named(study, options, message, tmp_path):
    result = ended(study, tmp_path, *options.split())
    assert result.returncode == 2 and message in result.stderr


def test_a_reservoir_below_its_ground_is_said_with_its_file(tmp_path):
    path = site("drawdown", tmp_path, ("[[0.0, 7.0], [3.0, 1.0]]", "-20.0"))
    with pytest.raises(
        InputError, match=f"{path}: the steady flow at the beginning: .*undetermined.*; levels are elevations in m"
    ):
        run("drawdown", path, tmp_path, "--days 1")


@pytest.mark.parametrize("elements, said", [("P1", 1), ("P2", 0)])
def test_linear_elements_are_said_to_be_too_stiff(elements, said, tmp_path, monkeypatch):
    runs = importlib.import_module("common.water.runs")
    monkeypatch.setattr(runs, "open_results", lambda *_: (_ for _ in ()).throw(InputError("no more")))
    result = ended("drawdown", tmp_path, "--cell-size", "3", "--elements", elements)
    assert "no more" in result.stderr
    assert result.stderr.count("--elements is P1: linear triangles are too stiff") == said


def test_a_drawdown_that_is_followed_long_ends_at_the_limit_of_a_slow_one(tmp_path):
    # The same boundary conditions for ever: the flow in time becomes the steady one, and with it the factor.
    path = site("drawdown", tmp_path, ("= 3e-7", "= 1e-4"), ("conductivity = 1e-7", "conductivity = 1e-4"))
    summary, rows = run("drawdown", path, tmp_path, "--days 400 --no-pictures")
    slow, fast = (limit["factor_of_safety"] for limit in summary["limits"])
    assert rows["factor_of_safety"][-1] == pytest.approx(slow, rel=0.006)  # the width of the last step
    assert fast < rows["factor_of_safety"].min() * 1.006
    assert summary["failure_time_days"] is None or rows["factor_of_safety"].min() < 1


def test_a_drawdown_in_no_time_begins_at_the_limit_without_drainage(tmp_path):
    # Pore pressures then fall by the load of the water that left, times m_v / (m_v + n / K_w): 0.996 here.
    path = site(
        "drawdown", tmp_path, ("= 3e-7", "= 1e-11"), ("conductivity = 1e-7", "conductivity = 1e-11"), ("[3.0,", "[0.1,")
    )
    summary, rows = run("drawdown", path, tmp_path, "--days 0.1 --no-pictures")
    slow, fast = (limit["factor_of_safety"] for limit in summary["limits"])
    assert rows["factor_of_safety"][-1] == pytest.approx(fast, rel=0.012)
    assert fast < 0.8 * slow
    assert rows["factor_of_safety"][0] > 1 > fast
    assert 0 < summary["failure_time_days"] < 0.1


def test_a_reservoir_that_falls_below_its_ground_is_said_to_have_no_steady_flow(tmp_path):
    path = site("drawdown", tmp_path, ("[3.0, 1.0]", "[3.0, -9.0]"))
    with pytest.raises(
        InputError, match=r"slow drawdown, .*after 3 days: .*a reservoir that is emptied keeps the level"
    ):
        run("drawdown", path, tmp_path, "--days 3 --no-pictures")


def test_slower_tables_take_longer(tmp_path):
    from common.slope.site import read_slope_site

    path = site("drawdown", tmp_path)
    one, ten = (read_slope_site(path, MPI.COMM_WORLD, 3.0, slower).times(1e9) for slower in (1.0, 10.0))
    assert one == [3 * 86400.0] and ten == [30 * 86400.0]


# --- the slide -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("water", ["still", "flows"])
def test_the_slide_begins_in_equilibrium_and_gathers_speed(water, tmp_path):
    # Particles on the cells of the finite elements, under the same pore pressures, are in equilibrium to round-off; then the
    # slope, too weak for them, moves ever faster.
    path = site("drawdown", tmp_path, ("= 4e3", "= 2e3"), ("= 27.0", "= 20.0"))
    options = "--days 3 --slide --slide-from lowest --time 1 --frames 4 --particles-per-cell 3 --no-film"
    options += f" --slide-water {water}"
    summary, rows = run("drawdown", path, tmp_path, options)
    assert summary["slide_from_days"] == summary["lowest_factor_time_days"] == 3.0
    assert summary["initial_out_of_balance_ratio"] < 1e-9 and summary["newly_yielded_fraction"] == 0.0
    moved = np.genfromtxt(tmp_path / "results" / "history.csv", delimiter=",", names=True)["largest_displacement_m"]
    assert moved[0] == 0.0 and np.all(np.diff(moved, 2) > 0) and moved[-1] > 0.1
    assert not summary["slide_comes_to_rest"]
    drawn = {path.stem for path in (tmp_path / "results").iterdir()}
    assert "pore_pressure" in drawn and not drawn & {"flow", "slide"}  # these are films


def test_a_slope_that_fails_with_the_strength_of_davis_only_says_why_its_particles_rest(tmp_path, capsys):
    """After 1.5 days the factor by Davis is just below 1; with its own flow rule the soil carries some percent more."""
    path = site("drawdown", tmp_path)
    options = "--elements P2 --cell-size 1.6 --days 1.6 --slide --time 2 --frames 4 --no-pictures"
    summary, _ = run("drawdown", path, tmp_path, options)
    assert 0.9 < summary["last_factor_of_safety"] < 1 and summary["slide_comes_to_rest"]
    words = "although the factor of safety is below 1: they have the flow rule of the soil, with which it is stronger"
    assert words in capsys.readouterr().out


def test_a_slide_that_ends_early_does_not_come_to_rest(tmp_path, capsys, monkeypatch):
    from common.water import slides as water_slides

    whole = water_slides.slide
    monkeypatch.setattr(water_slides, "slide", lambda *given: (whole(*given)[0], "interrupted at 1 s"))
    options = "--elements P2 --cell-size 1.6 --days 1.6 --slide --time 2 --frames 4 --no-pictures --no-film"
    folder = tmp_path / "results"
    assert (
        main("drawdown", ["--site", site("drawdown", tmp_path), "--output", folder, *SMALL.split(), *options.split()])
        == 1
    )
    assert json.loads((folder / "summary.json").read_text())["slide_comes_to_rest"] is False
    assert "the particles rest again" not in capsys.readouterr().out


@pytest.mark.parametrize("change, said", [({}, True), ({"moved": 1.0}, False), ({"rests": False}, False), ({"davis": False}, False),
                                          ({"dilation": 27.0}, False)])  # fmt: skip
def test_only_particles_at_rest_that_are_stronger_than_davis_has_it_are_explained(change, said, tmp_path):
    from argparse import Namespace

    from common.slope.site import read_slope_site
    from common.water.runs import rests_all_the_same

    case = {"moved": 0.01, "rests": True, "davis": True, "dilation": 0.0} | change
    angle = f"friction_angle = 27.0\ndilation_angle = {case['dilation']}"
    path = site("drawdown", tmp_path, ("friction_angle = 27.0", angle), ("friction_angle = 30.0", angle))
    slope = read_slope_site(path, MPI.COMM_WORLD, 3.0)
    summary = {"largest_displacement_m": case["moved"], "slide_comes_to_rest": case["rests"]}
    assert bool(rests_all_the_same(Namespace(davis=case["davis"]), slope, summary)) == said


def test_a_slope_that_stands_does_not_slide(tmp_path):
    path = site("drawdown", tmp_path, ("cohesion = 4e3", "cohesion = 40e3"), ("cohesion = 8e3", "cohesion = 40e3"))
    summary, rows = run("drawdown", path, tmp_path, "--days 3 --slide --no-pictures")
    assert rows["factor_of_safety"].min() > 1 and summary["failure_time_days"] is None
    assert "largest_displacement_m" not in summary


# --- rain ------------------------------------------------------------------------------------------------------------

TABLE = "[[0.0, 0.5], [2.0, 100.0], [10.0, 100.0], [12.0, 0.5]]"


def test_rain_takes_the_suction_away_that_holds_a_slope(tmp_path):
    summary, rows = run("rain", site("rain", tmp_path), tmp_path, "--days 10 --no-pictures")
    factors = rows["factor_of_safety"]
    without = summary["limits"][0]["factor_of_safety"]
    assert factors[0] > 1.2 * without
    assert factors[-1] < 0.8 * factors[0] and np.all(np.diff(factors) < 0.006 * factors[:-1])
    assert np.all(np.diff(rows["stored_water_m2"]) > 0)


def test_a_slope_in_steady_rain_keeps_its_factor(tmp_path):
    path = site("rain", tmp_path, (TABLE, "[[0.0, 0.5], [8.0, 0.5]]"))
    summary, rows = run("rain", path, tmp_path, "--days 8 --no-suction --no-pictures")
    factors, without = rows["factor_of_safety"], summary["limits"][0]["factor_of_safety"]
    assert len(factors) == 5 and factors == pytest.approx(without, rel=1e-9)


def test_a_site_without_rain_is_refused(tmp_path):
    path = site("rain", tmp_path, (f"rain = {TABLE}", "seepage_face = true"))
    with pytest.raises(InputError, match="no boundary has rain"):
        run("rain", path, tmp_path, "--days 1")


def test_factors_of_safety_are_not_lost_with_a_slide_that_cannot_start(tmp_path, monkeypatch, capsys):
    slides = importlib.import_module("common.water.slides")
    monkeypatch.setattr(slides, "HOLDING", ())
    path = site("drawdown", tmp_path, ("friction_angle = 27.0", "friction_angle = 20.0"))
    arguments = f"{SMALL} --days 3 --slide --no-pictures --site {path} --output {tmp_path / 'results'}"
    assert importlib.import_module("drawdown").main(arguments.split()) == 1
    summary = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert summary["lowest_factor_of_safety"] < 1
    assert "the particles find no initial equilibrium" in summary["slide_stopped_because"]
    assert "another --slide-from or --cell-size" in capsys.readouterr().err


def test_pic_hardly_brakes_the_slide(tmp_path):
    """The bank slides as far as without PIC, to some percent."""
    path, moved = site("drawdown", tmp_path, ("friction_angle = 27.0", "friction_angle = 16.0")), []
    for pic in ("", "--pic 0"):
        folder = tmp_path / f"{len(moved)}"
        folder.mkdir()
        options = f"--cell-size 1.6 --days 3 --slide --slide-from lowest --time 3 --frames 2 --no-pictures {pic}"
        moved.append(run("drawdown", path, folder, options)[0]["largest_displacement_m"])
    assert moved[1] > 1 and moved[0] == pytest.approx(moved[1], rel=0.1)


def doubts(path):
    """What reading the site of a slope warns of."""
    from common.slope.site import read_slope_site

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_slope_site(path, MPI.COMM_WORLD, 3.0)
    return [str(one.message) for one in caught if one.category is RuntimeWarning]


@pytest.mark.parametrize(
    "changes, words",
    [
        ((), ""),
        (
            (("compressibility = 5e-8  # 1/Pa\n", ""), ("compressibility = 2e-8\n", "")),
            "'bank' and 'ground' have no compr",
        ),
        ((("compressibility = 2e-8\n", ""),), "'ground' has no compressibility"),
        ((("compressibility = 2e-8\n", ""), ("[[0.0, 7.0], [3.0, 1.0]]", "7.0")), ""),  # all stays as it is
    ],
)
def test_soil_without_a_compressibility_in_a_drawdown_is_said(changes, words, tmp_path):
    """Its pores would not bear the water that comes and goes: m_v / (m_v + n / K_w) of it is 0 for m_v = 0."""
    said = [text for text in doubts(site("drawdown", tmp_path, *changes)) if "compressibility" in text]
    assert len(said) == bool(words) and all(words in text for text in said), said


@pytest.mark.parametrize(
    "given, words",
    [
        (
            "rain = [[0.0, 0.0], [2.0, 5.8e-7]]",
            "boundaries.crest: rain is 5.8e-07 mm/day at most.*5.8e-07 m/s are 50.1 mm/day",
        ),
        ("rain = 0.0", ""),
        ("flux = [[0.0, 0.0], [2.0, 50.0]]", "boundaries.crest: flux is 50 m/s.*50 mm/day are 5.79e-07 m/s"),
        ("flux = 1e-6", ""),
        ("flux = -2e-6", ""),  # water that a drain takes
    ],
)
def test_rain_in_metres_a_second_and_a_flux_in_millimetres_a_day_are_said(given, words, tmp_path):
    """1 m/s is 8.64e7 mm/day."""
    text = "[boundaries.crest]\nrain = [[0.0, 0.5], [2.0, 100.0], [10.0, 100.0], [12.0, 0.5]]\n"
    said = doubts(site("rain", tmp_path, (text, f"[boundaries.crest]\n{given}\n")))
    assert len(said) == bool(words) and all(re.search(words, text) for text in said), said


@pytest.mark.parametrize(
    "change, words",
    [
        (("reservoir = [[0.0, 7.0]", "reservoir = [[0.0, 6.0]"), ""),
        (
            ("reservoir = [[0.0, 7.0], [3.0, 1.0]]", "head = [[0.0, 7.0], [3.0, 1.0]]"),
            "the head of 'face' is up to 7 m above",
        ),
        (
            ("[boundaries.face]", "[boundaries.right]\nhead = 7.0\n\n[boundaries.face]"),
            "",
        ),  # groundwater beside the section
        (("[boundaries.face]", "[boundaries.base]\nhead = 7.0\n\n[boundaries.face]"), ""),  # and below it
    ],
)
def test_a_head_above_the_ground_that_bears_no_water_is_said(change, words, tmp_path):
    """The toe of the bank is at y = 0."""
    said = [text for text in doubts(site("drawdown", tmp_path, change)) if "the head of" in text]
    assert len(said) == bool(words) and all(words in text for text in said), said
