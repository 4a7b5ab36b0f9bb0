"""Values of the runs of a sweep, and the statistics of their results."""

import math
from pathlib import Path

import numpy as np
import pytest
import study_main  # noqa: F401
from common.site.tables import merged
from common.sweep.maps import hazard_maps
from common.sweep.plan import correlation_of, plan, variable_of
from common.sweep.plots import in_order
from common.sweep.results import (
    changes_alone,
    drawn_results,
    ended_before,
    probability_below,
    rank_correlations,
    said,
    statistics,
    summarise,
    values_of,
    write_table,
)
from common.sweep.runs import Run, Study, numbers_of, runs_of, site_with, take_results
from scipy import stats
from sweep import refusal

from fenics_bridge.terrain import Raster, read_raster, write_raster
from mpm_core import InputError

SITE = Path("site.toml")


def column(rows, name):
    return np.array([row[name] for row in rows])


def run(number, values, **results):
    return Run(number, values, Path(), [], 0, 0.0, results)


def test_lists_and_steps_give_all_combinations():
    rows = plan([variable_of("cohesion=1e3,2e3"), variable_of("friction-angle=20:30:3")])
    assert rows == [{"cohesion": c, "friction-angle": phi} for c in (1e3, 2e3) for phi in (20.0, 25.0, 30.0)]


def test_values_of_a_list_have_their_types():
    assert variable_of("a=3,0.5,true,P2").values == (3, 0.5, True, "P2")
    for word, values in (
        ("seed=1:4:4", (1, 2, 3, 4)),
        ("angle=1.0:4.0:4", (1.0, 2.0, 3.0, 4.0)),
        ("c=1:2:3", (1.0, 1.5, 2.0)),
    ):
        found = variable_of(word).values
        assert found == values and [type(one) for one in found] == [type(one) for one in values]
    assert variable_of("python-law=law.py:Sand").values == ("law.py:Sand",)


@pytest.mark.parametrize("text, distribution", [
    ("normal:5:2", stats.norm(5, 2)),
    ("uniform:2:6", stats.uniform(2, 4)),
    ("triangular:0:1:4", stats.triang(0.25, 0, 4)),
    ("normal:5:2:4:9", stats.truncnorm(-0.5, 2, 5, 2)),
])  # fmt: skip
def test_samples_have_the_moments_of_their_distribution(text, distribution):
    values = column(plan([variable_of(f"x={text}")], samples=2000), "x")
    assert values.mean() == pytest.approx(distribution.mean(), abs=0.01 * distribution.std())
    assert values.std() == pytest.approx(distribution.std(), rel=0.01)
    # A sequence that fills the interval evenly is nearer to the distribution than 1/sqrt(n), which random numbers are.
    assert stats.kstest(values, distribution.cdf).statistic < 0.1 / math.sqrt(2000)


def test_lognormal_values_have_the_mean_and_the_deviation_that_are_given():
    values = column(plan([variable_of("x=lognormal:10e3:4e3")], samples=4000), "x")
    assert values.mean() == pytest.approx(10e3, rel=0.01)
    assert values.std() == pytest.approx(4e3, rel=0.03)


def test_correlated_samples_keep_their_distributions():
    variables = [variable_of("c=normal:10:2"), variable_of("phi=uniform:20:30")]
    rows = plan(variables, 4000, {("c", "phi"): -0.5})
    both = [variable_of("c=normal:10:2"), variable_of("friction-angle=uniform:20:30")]
    assert column(plan(both, 4000, {("c", "friction_angle"): -0.5}), "friction-angle") == pytest.approx(
        column(rows, "phi")
    )
    c, phi = column(rows, "c"), column(rows, "phi")
    scores = stats.norm.ppf((phi - 20) / 10)
    assert np.corrcoef(c, scores)[0, 1] == pytest.approx(-0.5, abs=0.02)
    assert (phi.mean(), phi.std()) == pytest.approx((25, 10 / math.sqrt(12)), rel=0.01)


def test_more_samples_continue_the_same_sequence_at_each_value_of_a_list():
    variables = [variable_of("size=1,2"), variable_of("c=normal:10:2")]
    few, many = plan(variables, 3, seed=7), plan(variables, 5, seed=7)
    assert many[:6] == few and len(many) == 10
    assert column(few, "c")[::2] == pytest.approx(column(few, "c")[1::2])  # the same samples for both sizes
    assert plan(variables, 3, seed=8) != few


def test_one_at_a_time_begins_with_an_unchanged_run():
    rows = plan([variable_of("a=1,2"), variable_of("b=normal:10:2")], one_at_a_time=True)
    tail = 2 * 1.6448536
    assert rows[:3] == [{}, {"a": 1}, {"a": 2}]
    assert [row["b"] for row in rows[3:]] == pytest.approx([10 - tail, 10 + tail], rel=1e-5)


@pytest.mark.parametrize("word, expected", [
    ("cohesion", "expected NAME=VALUES"),
    ("=3", "expected NAME=VALUES"),
    ("c=1:2", "expected FROM:TO:COUNT"),
    ("c=1:2:1", "at least two values"),
    ("c=1,,2", "a value before and after each comma"),
    ("c=norml:5:1", "expected one of the distributions normal, lognormal, uniform, triangular; there is no 'norml'"),
    ("c=normal:5", "expected normal:MEAN:SD, or with :LOW:HIGH"),
    ("c=normal:5:-1", "standard deviation above 0"),
    ("c=normal:5:0.1:90:91", "limits LOW:HIGH between which there are values"),
    ("c=lognormal:-5:1", "a mean and a standard deviation above 0"),
    ("c=uniform:5:1", "rising numbers LOW:HIGH"),
    ("c=triangular:1:5:2", "rising numbers LOW:MODE:HIGH"),
])  # fmt: skip
def test_impossible_values_are_refused_by_name(word, expected):
    with pytest.raises(InputError, match="--vary is") as error:
        variable_of(word)
    assert expected in str(error.value) and repr(word) in str(error.value)


def test_a_parameter_has_its_values_once():
    with pytest.raises(InputError, match="--vary names friction_angle twice"):
        plan([variable_of("friction-angle=20,25"), variable_of("friction_angle=30")])


def test_samples_and_distributions_need_each_other():
    with pytest.raises(InputError, match="--samples is None, expected a number with c"):
        plan([variable_of("c=normal:5:1")])
    with pytest.raises(InputError, match="--samples is 4, expected none"):
        plan([variable_of("c=1,2")], 4)


def test_impossible_correlations_are_refused():
    for word in ("a,b", "a,a=0.5", "a,b=1", "a=0.5"):
        with pytest.raises(InputError, match="expected two names and a coefficient"):
            correlation_of(word)
    variables = [variable_of(f"{name}=normal:0:1") for name in "abc"]
    with pytest.raises(InputError, match="names d, expected two parameters with distributions; these are a, b, c"):
        plan(variables, 4, {("a", "d"): 0.5})
    with pytest.raises(InputError, match="names a, expected two parameters with distributions; these are none"):
        plan([variable_of("a=1,2")], None, {("a", "b"): 0.5})
    with pytest.raises(InputError, match="not possible together"):
        plan(variables, 4, {("a", "b"): 0.9, ("b", "c"): 0.9, ("a", "c"): -0.9})


def test_keys_of_a_site_change_values_in_tables_and_lists():
    table = {"soils": {"layer 1": {"cohesion": 1.0, "young": 5.0}, "layer 2": {"cohesion": 1.0}, "clay": {"cohesion": {"value": 2.0}}},
             "stages": [{"name": "in situ"}, {"name": "dam", "water_level": 1.0}]}  # fmt: skip
    changes = {
        "soils.layer*.cohesion": 3.0,
        "soils.clay.cohesion.value": 4.0,
        "stages.1.water-level": 5.0,
        "classes": 7,
    }
    new = merged(table, site_with(table, changes, SITE))
    assert new["soils"] == {
        "layer 1": {"cohesion": 3.0, "young": 5.0},
        "layer 2": {"cohesion": 3.0},
        "clay": {"cohesion": {"value": 4.0}},
    }
    assert new["stages"] == [{"name": "in situ"}, {"name": "dam", "water_level": 5.0}] and new["classes"] == 7
    assert table["stages"][1]["water_level"] == 1.0


@pytest.mark.parametrize("name, there", [("soils.sand.cohesion", "it has clay"), ("soils.clay.cohesion.value", "no table but 1.0"),
                                         ("stages.3.name", "the numbers 0 to 0")])  # fmt: skip
def test_a_key_in_a_table_that_a_site_does_not_have_is_refused(name, there):
    table = {"soils": {"clay": {"cohesion": 1.0}}, "stages": [{"name": "in situ"}]}
    with pytest.raises(InputError, match=f"names {name}, but site.toml has no .*{there}"):
        site_with(table, {name: 1.0}, SITE)


def test_numbers_of_a_summary_have_names_with_dots():
    summary = {"factor": 1.5, "curve": [1, 2], "text": "a", "meshes": [{"size": 1.0, "shown": True}, {"size": 0.5}]}
    found = {name: one for key, part in summary.items() for name, one in numbers_of(part, key).items()}
    assert found == {"factor": 1.5, "meshes.0.size": 1.0, "meshes.0.shown": True, "meshes.1.size": 0.5}


def test_the_probability_of_failure_is_that_of_a_normal_factor_of_safety():
    # F = c / 8 with c normal (10, 2): P(F < 1) = Phi(-1), reliability index 1.
    values = column(plan([variable_of("c=normal:10:2")], 1000), "c") / 8
    found = probability_below(values, 1.0)
    assert found["probability_below"] == pytest.approx(stats.norm.cdf(-1), abs=2e-3)
    assert found["reliability_index"] == pytest.approx(1, abs=0.01)
    assert found["interval_low"] < stats.norm.cdf(-1) < found["interval_high"]


def test_no_failure_in_some_runs_leaves_an_upper_bound():
    # Wilson's interval of 0 of n ends at z^2 / (n + z^2), with z = 1.96.
    found = probability_below(np.full(40, 2.0), 1.0)
    assert found["probability_below"] == 0 and found["reliability_index"] is None
    assert found["interval_low"] == 0 and found["interval_high"] == pytest.approx(
        1.96**2 / (40 + 1.96**2), rel=1e-3
    )


def test_statistics_leave_out_runs_without_a_result():
    found = statistics(np.array([1.0, math.nan, 3.0]))
    assert (found["runs"], found["mean"], found["standard_deviation"]) == (2, 2.0, pytest.approx(math.sqrt(2)))
    assert statistics(np.array([math.nan])) == {"runs": 0}
    assert statistics(np.array([2.0]))["standard_deviation"] is None  # JSON has no NaN


def test_runs_without_the_result_may_be_those_below_the_limit():
    # Of 10 runs 2 are below and 3 have no result: 2 of 7, and 5 of 10 if these are below too.
    found = probability_below(np.array([0.5, 0.6, *[1.5] * 5, *[math.nan] * 3]), 1.0)
    assert (found["runs"], found["runs_without_result"]) == (7, 3)
    assert (found["probability_below"], found["probability_if_those_are_below"]) == (2 / 7, 0.5)
    runs = [run(1, {"c": 1.0}, F=0.5), run(2, {"c": 2.0}, F=2.0), Run(3, {"c": 3.0}, Path("003"), [], 2, 0.0, {}, "no equilibrium"),
            Run(4, {"c": 4.0}, Path("004"), [])]  # fmt: skip
    results = summarise(runs, [variable_of("c=uniform:0:5")], ["F"], {"F": 1.0}, False)
    assert results["probabilities"]["F"]["runs_without_result"] == 1  # the last one has not begun
    assert "F is not known in 1 of 3 runs; if it is below 1 there, the probability is 66.67%" in said(runs, results)


def test_what_a_run_that_ended_early_has_found_is_in_no_statistics(tmp_path):
    early = Run(1, {"x": 1.0}, tmp_path, [], 143)
    (tmp_path / "summary.json").write_text('{"front_m": 3.0, "angle": null, "stopped_because": "interrupted at 2 s"}')
    take_results(early)
    assert early.numbers == {"front_m": 3.0, "angle": None} and early.reason == "interrupted at 2 s"
    assert values_of([early, run(2, {"x": 2.0}, front_m=5.0)], "front_m") == pytest.approx([math.nan, 5.0], nan_ok=True)
    write_table(tmp_path, [early], ["x"])
    assert (tmp_path / "sweep.csv").read_text().splitlines()[1].startswith("1,1.0,143,0,interrupted at 2 s,3.0,")


def test_a_result_that_is_not_known_in_the_first_run_is_one_of_the_study():
    first = run(1, {}, front_m=3.0, angle=None)
    assert refusal(first, ["angle"]) == [] and math.isnan(first.result("angle"))
    assert refusal(first, ["angel"]) == [
        "angel is no result of the study, expected one of front_m, angle; did you mean angle?"
    ]


def test_a_run_that_fails_in_its_work_does_not_speak_for_the_others(tmp_path):
    """Soil of the first strength may not carry its weight, which ends the study with the code of bad input."""
    first = Run(1, {}, tmp_path, [], 2, 0.0, {}, "no equilibrium")
    assert refusal(first, []) == ["run 1 was refused: no equilibrium"]
    (tmp_path / "parameters.toml").write_text("")
    assert refusal(first, []) == []


def test_runs_keep_their_names_when_more_samples_follow(tmp_path):
    study = Study(Path("study.py"), [], 1, {})
    few, many = (runs_of(study, [{"x": 1.0}] * n, tmp_path) for n in (999, 1000))
    assert [run.folder for run in many[:999]] == [run.folder for run in few]


def test_a_sweep_goes_on_where_results_have_the_names_of_parameters(tmp_path):
    runs = [run(1, {"cell_size": 2.0, "seconds": 3.0}, cell_size=1.99, seconds=4.0)]
    names = ["cell_size", "seconds"]
    write_table(tmp_path, runs, names)
    rows = [{"cell_size": 2.0, "seconds": 3.0}, {"cell_size": 1.0, "seconds": 3.0}]
    assert ended_before(tmp_path, rows, names, ["slope"]) == {1: (0, 0.0)}
    with pytest.raises(InputError, match="run 1 in .* has other values than this sweep; .*at least as many --samples"):
        ended_before(tmp_path, [], names, ["slope"])
    with pytest.raises(InputError, match="is of a sweep with other parameters, expected the same --vary"):
        ended_before(tmp_path, rows, ["cell_size"], ["slope"])
    (tmp_path / "parameters.toml").write_text('run = ["slope", "--time", "5"]')
    with pytest.raises(
        InputError, match="are of 'slope --time 5', not of 'slope'; expected the same study and options"
    ):
        ended_before(tmp_path, rows, names, ["slope"])


def test_curves_go_through_values_in_their_order():
    runs = [run(k, {"x": x, "kind": kind}) for k, (x, kind) in enumerate([(3.0, "P2"), (1, "P1"), (2.5, "P3")])]
    assert [one.values["x"] for one in in_order(runs, "x")] == [1, 2.5, 3.0]
    assert in_order(runs, "kind") == runs


def test_how_well_a_run_is_in_balance_is_not_drawn():
    runs = [run(k, {}, initial_out_of_balance_ratio=1e-9 * k, runout_m=float(k)) for k in (1, 2)]
    assert drawn_results(runs, []) == ["runout_m"]


def test_of_several_sites_the_last_one_counts():
    assert Study(Path(), ["--site", "a.toml", "--site=b.toml"], 1, {}).site() == Path("b.toml")


def test_rank_correlations_are_those_of_monotonic_functions():
    runs = [
        run(k, {"x": x, "y": (7 * k) % 10, "kind": "P1"}, f=math.exp(-x)) for k, x in enumerate(np.linspace(0, 9, 10))
    ]
    found = rank_correlations(runs, ["x", "y", "kind"], "f")
    assert found["x"] == pytest.approx(-1) and abs(found["y"]) < 0.5 and "kind" not in found


def test_what_changes_a_result_most_comes_last():
    runs = [run(1, {}, f=10.0), run(2, {"a": 1}, f=14.0), run(3, {"a": 2}, f=11.0), run(4, {"b": 1}, f=8.0)]
    assert changes_alone(runs, "f") == [("b", 1, 8.0), ("a", 1, 14.0), ("a", 2, 11.0)]


def slide_maps(folder, number, reached, speed):
    place = folder / f"{number:03d}"
    place.mkdir()
    x, y = np.array([0.0, 2.0, 4.0]), np.array([0.0, 2.0])
    reached, speed = np.array(reached, float), np.where(np.array(reached) > 0, speed, np.nan)
    for name, values in {"reached": reached, "speed": speed, "most": 0.5 * speed, "ground": np.tile(x, (2, 1))}.items():
        write_raster(place / f"{name}.asc", Raster(x, y, values, "local"))
    return Run(number, {}, place, [], 0, 0.0, {"front_m": 1.0})


def test_maps_of_hazard_are_fractions_and_quantiles_of_the_runs(tmp_path):
    # 20 runs with the speeds 1 to 20 m/s: the first place is reached by all, the second by those above 15 m/s, the third by the last.
    # At most one of 20 runs exceeds what 95 % do not: 19 m/s, where the slide has been in the 19th run.
    runs = [slide_maps(tmp_path, k, [[1, k > 15, k > 19], [0, 0, 0]], float(k)) for k in range(1, 21)]
    runs.append(Run(21, {}, tmp_path / "none", [], 1))
    pictures = hazard_maps(runs, tmp_path)
    maps = {name: read_raster(tmp_path / f"{name}.asc", heights=False).values for name in pictures}
    assert maps["reach_probability"] == pytest.approx(np.array([[1, 0.25, 0.05], [0, 0, 0]]))
    assert maps["speed_95_percent"] == pytest.approx(np.array([[19, 19, np.nan], [np.nan] * 3]), nan_ok=True)
    assert maps["most_95_percent"] == pytest.approx(0.5 * maps["speed_95_percent"], nan_ok=True)
    pictures["reach_probability"]()
    assert (tmp_path / "reach_probability.png").stat().st_size > 1000


def test_runs_on_other_grounds_have_no_common_map(tmp_path):
    runs = [slide_maps(tmp_path, k, [[1, 1, 0], [0, 0, 0]], 1.0) for k in (1, 2)]
    write_raster(tmp_path / "002" / "reached.asc", Raster(np.arange(4.0), np.arange(3.0), np.ones((3, 4)), "local"))
    assert hazard_maps(runs, tmp_path) == {} and not list(tmp_path.glob("*.asc"))
    assert hazard_maps([run(1, {}, f=1.0), run(2, {}, f=2.0)], tmp_path) == {}
