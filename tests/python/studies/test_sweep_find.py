"""Back-analysis: the value of a parameter for which a result has a given value."""

import csv
import importlib
import json
import math

import pytest
import study_main
from common.sweep.find import MOST_RUNS, NEAR, find, wanted_of

from mpm_core import InputError


def searched(function, parameter="x=0:10", target="y=2"):
    """What a search finds, and the values at which it looked."""
    asked = []

    def results_at(values):
        asked.extend(values)
        return [function(value) for value in values]

    return find(wanted_of(parameter, target), results_at), asked


@pytest.mark.parametrize("function, value", [
    (lambda x: x / 3, 6.0), (lambda x: math.sqrt(x), 4.0), (lambda x: 12 - x, 10.0), (lambda x: math.exp(x / 3) + 1, 0.0),
    (lambda x: 1 + math.tanh(5 * (x - 7)) + (x - 7) / 100, 8.0),
])  # fmt: skip
def test_the_value_is_found_within_the_tolerance(function, value):
    """Either the value is within a thousandth of the interval, or the result within a thousandth of its range, of what is wanted."""
    found, asked = searched(function)
    assert not found.reason and len(asked) == len(set(asked)) <= MOST_RUNS
    near = NEAR * abs(function(10) - function(0))
    assert abs(found.result - 2) <= near or abs(found.value - value) <= NEAR * 10
    assert found.result == function(found.value)


def test_both_ends_are_asked_for_at_once_and_may_be_what_is_looked_for():
    assert searched(lambda x: x, target="y=10")[1] == [0.0, 10.0]


def test_a_target_that_is_not_between_the_ends_is_named():
    found, asked = searched(lambda x: x + 5)
    assert found.reason == "y is 5 and 15 at the ends of the interval, expected 2 between them"
    assert (found.value, found.result, len(asked)) == (0.0, 5.0, 2)


def test_a_run_without_the_result_ends_the_search():
    found, _ = searched(lambda x: math.nan if 1 < x < 9 else x)
    assert found.reason.startswith("y is not known where x is ") and found.value in (0.0, 10.0)
    found, _ = searched(lambda x: math.nan)
    assert found.reason == "y is not known where x is 0" and math.isnan(found.value)


def test_a_result_that_jumps_past_the_target_is_named():
    found, _ = searched(lambda x: 1.0 if x < 7.3 else 3.0)
    assert found.reason.startswith("y jumps past 2 where x is 7.") and found.value == pytest.approx(7.3, abs=0.02)


@pytest.mark.parametrize("parameter, target, expected", [
    ("x=1:inf", "y=1", "--find is 'x=1:inf', expected NAME=LOW:HIGH"),
    ("x=3", "y=1", "--find is 'x=3', expected NAME=LOW:HIGH"), ("x=3:1", "y=1", "with rising numbers"),
    ("=1:3", "y=1", "--find is '=1:3'"), ("x=1:3", "y", "--target is 'y', expected RESULT=VALUE"),
    ("x=1:3", "y=nan", "--target is 'y=nan'"),
])  # fmt: skip
def test_what_is_not_possible_is_refused(parameter, target, expected):
    with pytest.raises(InputError) as error:
        wanted_of(parameter, target)
    assert expected in str(error.value)


def test_the_cohesion_of_a_measured_strength_is_found(tmp_path, without_pictures):
    """The peak of a triaxial test is linear in the cohesion: 2 (c cos(phi) + 20 kPa sin(phi)) / (1 - sin(phi))."""
    phi = math.radians(25.0)
    peak = 2 * (1200 * math.cos(phi) + 20e3 * math.sin(phi)) / (1 - math.sin(phi))
    end = study_main.ended(
        "sweep", tmp_path, "--find", "cohesion=500:1500", "--target", f"q_Pa={peak}", "element_test", "--steps", "40"
    )
    assert end.returncode == 0, end.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["value"] == pytest.approx(1200, abs=1) and summary["q_Pa"] == pytest.approx(peak, rel=1e-4)
    with open(tmp_path / "sweep.csv", newline="") as file:
        assert len(list(csv.DictReader(file))) == summary["runs"] == 3


@pytest.mark.parametrize("words, expected", [
    (["--find", "cohesion=1:2"], "--find and --target are expected together"),
    (["--find", "cohesion=1:2", "--target", "q=1", "--vary", "young=1,2"], "--find is given, expected no --vary"),
    (["--find", "cohesion=1:2", "--target", "q=1", "--samples", "3"], "--samples is given, expected no --find"),
])  # fmt: skip
def test_options_that_do_not_fit_are_refused(tmp_path, words, expected):
    end = study_main.ended("sweep", tmp_path, *words, "element_test")
    assert end.returncode == 2 and expected in end.stderr


def test_a_search_that_is_interrupted_makes_no_further_run(tmp_path, without_pictures, monkeypatch):
    """Runs that end by themselves when the signal comes have results all the same."""
    sweep = importlib.import_module("sweep")

    def made(runs, *_):
        for run in runs:
            run.code, run.numbers = run.code or 0, {"y": run.values["cohesion"]}
        calls.append(len(runs))
        return 130  # of Ctrl-C

    calls = []
    monkeypatch.setattr(sweep, "make_all", made)
    a = sweep.parse(["--find", "cohesion=1:4", "--target", "y=2", "--output", str(tmp_path / "s"), "element_test"])
    assert sweep.back_analysis(a, sweep.study_named(a)) == 130 and calls == [2]
    assert json.loads((tmp_path / "s" / "summary.json").read_text())["stopped_because"] == "it was interrupted"
