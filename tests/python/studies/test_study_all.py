"""What holds for every study: its help, the file that repeats a run, and the page of a run."""

import importlib
import json
import re

import matplotlib.pyplot as plt
import pytest
from browser import NEEDED, move_slider, number_of_colours, open_page, picture, started
from matplotlib.figure import Figure
from study_main import NAMES, ON_TWO_RANKS, main

SMALL = {
    "balance": "--cell-size 0.5 --mesh fitted --particles-per-cell 1 --time 0.02 --frames 2",
    "barrier": "--cell-size 0.5 --particles-per-cell 1 --length 5 --duration 1 --frames 2",
    "collapse": "--cell-size 0.5 --meshes 1 --elements P1 --no-without-dilation",
    "collapse_schemes": "--cell-size 0.5 --meshes 1 --elements P1",
    "compare_fem": "--cell-size 0.5 --meshes 1 --particles-per-cell 1 --scheme implicit",
    "cone": "--cell-size 0.006 --particles-per-cell 1 --penetration 0.01 --speed 0.02 --width 5 --frames 8",
    "consolidation": "--days 20 --first-step 5 --growth 2 --frames 2 --particles",
    "cost": "--meshes 1 --mesh fitted --cell-size 0.5 --particles-per-cell 1 --water-modulus 1e6",
    "coupled_slope": "--cell-size 0.5 --width 6 --depth 2 --particles-per-cell 1 --time 0.02 --frames 2 --unit-weight 20e3 "
    "--displacement 1e-6",
    "drawdown": "--cell-size 3 --elements P1 --days 1 --factor-times 1",
    "earthquake": "--cell-size 2.5 --level 10 --soil-depth 5 --stiff-depth 5 --particles-per-cell 1 --motion ricker "
    "--peak 1 --frequency 3 --duration 1 --rest 0 --frames 2",
    "element_test": "--steps 5",
    "embankment": "--cell-size 2 --particles-per-cell 1 --time 0.05 --frames 2",
    "excavation": "--cell-size 3 --elements P1",
    "footing": "--cell-size 0.25 --meshes 1 --elements P1",
    "footing_push": "--cell-size 0.1 --particles-per-cell 1 --penetration 0.01 --speed 5e-3 --frames 2",
    "handover": "--time 0.02 --mesh fitted --cell-size 0.5 --particles-per-cell 1",
    "levee": "--cell-size 2 --beside 8 --sand-depth 4 --motion ricker --frequency 3 --duration 1 --rest 0 --frames 2",
    "liquefaction": "--cell-size 1 --particles-per-cell 3 --time 0.02 --frames 4",
    "locking": "--cases footing,slope --schemes implicit --meshes 1 --reference-mesh 1",
    "piezocone": "--cell-size 0.0059 --particles-per-cell 3 --penetration 0.003 --width 6 --conductivity 1e-6 --frames 2",
    "rain": "--cell-size 3 --elements P1 --days 1 --factor-times 1",
    "retrogression": "--meshes one --cell-size 3 --time 0.2 --frames 2",
    "runout": "--cell-size 16 --spacing 8 --thickness 12 --time 0.5 --frames 2",
    "safety": "--cell-size 0.5 --meshes 1 --elements P1 --no-without-dilation --start 0.9",
    "scaling": "--side-2d 4 --side-3d 2 --steps 2",
    "seepage": "--cell-size 4 --days 20 --frames 2",
    "slope": "--time 0.1 --frames 2 --mesh fitted --cell-size 0.5 --particles-per-cell 1",
    "slope_schemes": "--time 0.1 --frames 2 --mesh fitted --cell-size 0.5 --particles-per-cell 1 " "--longer-steps 1",
    "sweep": "--vary young=1e5,2e5 --result volumetric_strain element_test --steps 5",
    "wall": "--cell-size 0.25 --particles-per-cell 1 --speed 0.05 --frames 2",
    "verification": "--quick --cases column",
}
"""Each study at a size that takes a second or less; a new study needs its line here."""
WITH_PARTICLES = (
    "balance",
    "barrier",
    "compare_fem",
    "cone",
    "consolidation",
    "coupled_slope",
    "earthquake",
    "embankment",
    "footing_push",
    "handover",
    "levee",
    "liquefaction",
    "piezocone",
    "retrogression",
    "slope",
    "slope_schemes",
    "wall",
)
WITH_FILM = (
    "barrier",
    "cone",
    "consolidation",
    "drawdown",
    "earthquake",
    "embankment",
    "footing_push",
    "levee",
    "piezocone",
    "liquefaction",
    "rain",
    "retrogression",
    "seepage",
    "slope",
    "wall",
)
WITHOUT_PICTURES = ("scaling", "verification")
"""The latter has pictures of each case, and one file of results for all"""
FAIL_AT_THEIR_END = ("element_test", "verification")
"""Studies whose pictures fail when they are saved; those of others at their beginning, as drawing takes longer than the run"""
TIMED = re.compile("seconds|date$|per_second|finished$|versions|not_written|^output$|^parameters_file$")


def untimed(value):
    """Results without what depends on the computer's clock, and on where the results are."""
    if isinstance(value, dict):
        return {key: untimed(one) for key, one in value.items() if not TIMED.search(key)}
    return [untimed(one) for one in value] if isinstance(value, list) else value


@pytest.fixture(scope="module", autouse=True)
def short_films_and_small_figures():
    """A frame of the flow takes a second to draw, and figures of so many pixels as for print a tenth of a second each."""
    save = Figure.savefig
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(importlib.import_module("seepage"), "FILM_FRAMES", 3)
        patch.setattr(Figure, "savefig", lambda *figure_and_file, **how: save(*figure_and_file, **{**how, "dpi": 50}))
        yield


@pytest.fixture(scope="module")
def first_run(tmp_path_factory):
    """Folder and exit code of a small run of a study; run once."""
    known = {}

    def run(name):
        if name not in known:
            folder = tmp_path_factory.mktemp(name)
            known[name] = folder, main(name, ["--output", folder, *SMALL[name].split()])
        return known[name]

    return run


def test_every_study_is_run_here():
    assert sorted(SMALL) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_help_gives_units_and_defaults(name, capsys):
    with pytest.raises(SystemExit) as ended:
        main(name, ["--help"])
    assert ended.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert f"usage: studies/run {name}" in text
    numbers = re.findall(r"--[a-z0-9-]+ X (.*?)(?= --[a-z]|$)", text)
    without_unit = [line for line in numbers if "[" not in line]
    assert without_unit == []


@pytest.mark.parametrize("name", NAMES)
def test_a_run_is_repeated_by_its_file_of_parameters_even_without_pictures(name, first_run, tmp_path, monkeypatch):
    folder, code = first_run(name)
    drawn_first = []

    def fail(*_, **__):
        drawn_first.append(not (tmp_path / "summary.json").exists())
        raise ValueError("out of ink")

    monkeypatch.setattr(*((Figure, "savefig") if name in FAIL_AT_THEIR_END else (plt, "figure")), fail)
    assert code == 0
    assert len([path for path in folder.iterdir() if path.suffix in (".mp4", ".gif")]) == (name in WITH_FILM)
    text = (folder / "parameters.toml").read_text()
    assert f"studies/run {name} --parameters" in text
    assert main(name, ["--parameters", folder / "parameters.toml", "--output", tmp_path]) == 0
    assert (tmp_path / "parameters.toml").read_text() == text
    summary = "verification.json" if name == "verification" else "summary.json"
    one, other = (untimed(json.loads((place / summary).read_text())) for place in (folder, tmp_path))
    assert_alike(one, other, name)
    if name not in (*ON_TWO_RANKS, *WITHOUT_PICTURES):  # the former do not run in this process
        reasons = json.loads((tmp_path / summary).read_text())["not_written"]
        assert len(reasons) == len(drawn_first) > 0 and not any(drawn_first)
        assert all("ValueError: out of ink" in reason for reason in reasons)


def assert_alike(one, other, where):
    """The same but for round-off: explicit steps repeat to the last bit, finite elements and implicit steps to 1e-10."""
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key, value in one.items():
            assert_alike(value, other[key], f"{where}: {key}")
    elif isinstance(one, list):
        assert len(one) == len(other), where
        for k, (a, b) in enumerate(zip(one, other)):
            assert_alike(a, b, f"{where}[{k}]")
    elif isinstance(one, float):
        assert other == pytest.approx(one, rel=1e-8, abs=1e-12, nan_ok=True), where
    else:
        assert one == other, where


@pytest.mark.parametrize("name", NAMES)
def test_the_page_has_everything_in_it(name, first_run):
    folder, _ = first_run(name)
    page = (folder / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "") and "https://" not in page
    assert page.count("data:image/png") >= len(list(folder.glob("*.png")))
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL).group(1))
    assert bool(data["movies"]) == (name in WITH_PARTICLES)
    for movie in data["movies"]:
        assert movie["count"] > 0 and {"x", "y", "radius"} < set(movie["fields"])
    options = re.findall(r"^([a-z0-9-]+) = ", (folder / "parameters.toml").read_text(), re.MULTILINE)
    assert options and all(f'<td class="name">{option}</td>' in page for option in options)


PLACES = "return page.player.views.map((v) => Array.from({ length: v.movie.count }, (_, i) => v.screenOf(i)))"


@pytest.fixture(scope="module")
def browser():
    with started() as driver:
        yield driver


@NEEDED
@pytest.mark.parametrize("name", NAMES)
def test_the_page_opens_and_its_slider_moves_the_particles(name, first_run, browser):
    open_page(browser, first_run(name)[0] / "report.html")
    assert browser.get_log("browser") == []
    assert number_of_colours(picture(browser)) > 50  # not blank
    if name in WITH_PARTICLES:
        places = []
        for frame in (0, int(browser.execute_script("return document.getElementById('time').max"))):
            move_slider(browser, frame)
            places.append(browser.execute_script(PLACES))
        assert places[0] != places[1]
