"""The study piezocone: clay that drains and clay that does not."""

import importlib
import json

import pytest
from study_main import ended

SMALL = "--cell-size 0.0059 --penetration 0.02 --width 15 --frames 20 --no-pictures --no-film".split()


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Summaries of a fast and of a slow cone."""
    found = {}
    for name, velocity in (("fast", "0.2"), ("slow", "2e-5")):
        folder = tmp_path_factory.mktemp(name)
        done = ended("piezocone", folder, *SMALL, "--conductivity", "1e-8", "--velocity", velocity)
        assert done.returncode == 0, done.stderr
        found[name] = json.loads((folder / "summary.json").read_text()) | {"folder": folder}
    return found


def test_the_slow_cone_meets_more_resistance_and_no_pore_pressure(results):
    fast, slow = results["fast"], results["slow"]
    assert fast["normalised_velocity"] == pytest.approx(1e4 * slow["normalised_velocity"], rel=1e-12)
    assert fast["normalised_velocity"] > 1e3 and slow["normalised_velocity"] < 1
    assert slow["net_resistance_Pa"] > 1.3 * fast["net_resistance_Pa"]
    for place in ("face", "shoulder"):
        pressure = f"pore_pressure_{place}_Pa"
        assert fast[pressure] > 100e3  # more than the initial effective stress
        assert abs(slow[pressure]) < 0.2 * fast[pressure]


def test_the_resistance_without_drainage_approaches_that_of_clay(results):
    # After a way of half a diameter it has three quarters of its final value; in deep clay factors are 10.5 to 11.3.
    fast = results["fast"]
    low, high = sorted(fast["undrained_cone_factors"].values())
    assert 0.65 * low < fast["cone_factor"] < high


def test_cells_that_are_too_large_are_refused(tmp_path):
    done = ended("piezocone", tmp_path, "--cell-size", "0.01")
    assert done.returncode == 2 and "--cell-size is 0.01 m, expected a third of --radius" in done.stderr


def test_files_for_paraview_have_the_pore_pressure(results):
    assert 'Name="pore_pressure"' in (results["fast"]["folder"] / "particles.xdmf").read_text()


def test_the_net_resistance_begins_with_zero(results):
    rows = (results["fast"]["folder"] / "history.csv").read_text().splitlines()
    assert rows[1].split(",")[:6] == ["0"] * 6
    assert float(rows[2].split(",")[2]) > 0


def test_a_run_that_fails_at_once_says_that_the_cone_has_not_moved(tmp_path):
    done = ended("piezocone", tmp_path, *SMALL, "--void-ratio", "0.001")
    assert done.returncode == 1
    assert "normalised velocity" in done.stdout and "the cone has not moved\n" in done.stdout
    assert json.loads((tmp_path / "summary.json").read_text())["net_resistance_Pa"] == 0


@pytest.mark.parametrize(
    ("options", "doubt"),
    [
        ("--pressure 100", "--pressure is 100 Pa, less than under 0.1 m of soil: 100 kPa are 100e3"),
        ("--void-ratio 150", "--void-ratio is 150, more than that of peat; 150 % are 1.5"),
        ("--compression-slope 20", "twice the pressure would press out more than the water of all pores"),
        ("--critical-slope 23", "6 sin(phi) / (3 - sin(phi)), 0.9 for 23 degrees"),
        ("--overconsolidation 20", "the rigidity index is 13.1, beyond the 50 to 500"),
        ("--velocity 2", "the inertia of the clay adds to the resistance above 1.3 m/s"),
    ],
)
def test_probable_mistakes_are_named(options, doubt):
    with pytest.warns(RuntimeWarning) as warned:
        importlib.import_module("piezocone").parse(options.split())
    assert any(doubt in str(w.message) for w in warned)


def test_nothing_is_doubted_of_usual_clay(recwarn):
    importlib.import_module("piezocone").parse([])
    assert not [w for w in recwarn if w.category is RuntimeWarning]
