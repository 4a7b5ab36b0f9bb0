"""The study consolidation: a layer that settles as Terzaghi says, under loads and below layers that come in stages."""

import csv
import json
import warnings

import numpy as np
import pytest
from consolidation_cases import layer_settled
from mpi4py import MPI

from mpm_core import InputError


def _write_layer(folder, heights=(2.0,)):
    """A column of the layers `heights` of clay, first and second; the curve "top" is on the clay."""
    lines = [
        "DefineConstant[ cell_size = 0.1 ];",
        "Point(1) = {0, 0, 0};",
        "Point(2) = {0.3, 0, 0};",
        "Line(1) = {1, 2};",
    ]
    for k, height in enumerate(heights):
        low, left, right, up = 10 * k + 1, 10 * k + 13, 10 * k + 14, 10 * k + 11
        lines += [f"Point({up}) = {{0, {height}, 0}};", f"Point({up + 1}) = {{0.3, {height}, 0}};",
                  f"Line({up}) = {{{up}, {up + 1}}};", f"Line({left}) = {{{low}, {up}}};",
                  f"Line({right}) = {{{low + 1}, {up + 1}}};",
                  f"Curve Loop({up}) = {{{low}, {right}, -{up}, -{left}}};", f"Plane Surface({up}) = {{{up}}};",
                  f'Physical Surface("{("clay", "first", "second")[k]}") = {{{up}}};']  # fmt: skip
    sides = [", ".join(str(10 * k + side) for k in range(len(heights))) for side in (13, 14)]
    lines += ['Physical Curve("base") = {1};', 'Physical Curve("top") = {11};', f'Physical Curve("left") = {{{sides[0]}}};',
              f'Physical Curve("right") = {{{sides[1]}}};', "Mesh.MeshSizeMax = cell_size;"]  # fmt: skip
    (folder / "layer.geo").write_text("\n".join(lines) + "\n")


CLAY = """mesh = "layer.geo"
[soils.clay]
unit_weight = 18e3
conductivity = 1e-9
material = "elastic"
young = 4e6
poisson = 0.25
[boundaries.top]
reservoir = 2.0
[points]
middle = [0.15, 2.0]
"""
OEDOMETER = 4.8e6
DAYS = 2.0**2 * 9810.0 / (1e-9 * OEDOMETER) / 86400
"""Time factor 1 of CLAY [days]"""


def _settled(factors, ramps):
    """Settlement [m] of CLAY under loads that rise by q [Pa] between two time factors (Olson 1977): each (a, b, q)."""
    m = np.pi * (2 * np.arange(200) + 1) / 2
    late = lambda factor: np.maximum(np.subtract.outer(factors, factor), 0.0)
    rising = lambda f: f - np.sum(2 / m**4 * (1 - np.exp(-np.multiply.outer(f, m**2))), axis=-1)
    return sum(q * (rising(late(a)) - rising(late(b))) / (b - a) for a, b, q in ramps) * 2.0 / OEDOMETER


def _history(folder, *names):
    with open(folder / "history.csv", newline="") as file:
        return np.transpose([[float(row[name]) for name in names] for row in csv.DictReader(file)])


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("symmetry", ["", "axisymmetric = true\n"], ids=["plane", "axisymmetric"])
def test_loads_in_stages_settle_as_the_sum_of_olsons_ramps(tmp_path, symmetry):
    """Rise, pause, rise, pause, and a part that is taken away at once; from the command line, by elements and particles."""
    import consolidation

    _write_layer(tmp_path)
    (tmp_path / "layer.toml").write_text(symmetry + CLAY)
    rows = ((0, 0), (0.1, 20e3), (0.3, 20e3), (0.4, 50e3), (0.6, 50e3), (0.60001, 30e3))
    words = ["top=" + ",".join(f"{factor * DAYS}:{load}" for factor, load in rows)]
    arguments = ["--site", tmp_path / "layer.toml", "--days", 0.8 * DAYS, "--first-step", 1.5e-3 * DAYS, "--growth", 1.2,
                 "--frames", 1, "--no-film", "--particles", "--output", tmp_path / "results", "--pressures", *words]  # fmt: skip
    assert consolidation.main([str(word) for word in arguments]) == 0
    days, *found = _history(tmp_path / "results", "time_days", "settlement_middle_m", "settlement_middle_particles_m")
    expected = _settled(days / DAYS, [(0, 0.1, 20e3), (0.3, 0.4, 30e3), (0.6, 0.60001, -20e3)])
    for one in found:
        assert np.abs(one - expected).max() < 0.01 * expected.max()
    assert all(np.abs(days / DAYS - corner).min() < 1e-8 for corner in (0.1, 0.3, 0.4, 0.6))  # where steps end


STAGES = """
[soils.first]
unit_weight = 20e3
material = "elastic"
young = 10e6
poisson = 0.3
[soils.second]
unit_weight = 20e3
material = "elastic"
young = 10e6
poisson = 0.3
"""


@pytest.mark.usefixtures("without_pictures")
def test_layers_that_are_placed_in_stages_settle_the_clay_below_as_their_weights_do(tmp_path):
    import consolidation

    _write_layer(tmp_path, (2.0, 2.2, 2.4))
    stages = [f"[[stages]]\nday = {start * DAYS}\nduration = {0.1 * DAYS}\nfill = '{soil}'\n"
              for start, soil in ((0.1, "first"), (0.4, "second"))]  # fmt: skip
    last = f"[[stages]]\nday = {0.6 * DAYS}\nexcavate = ['second']\nname = 'dug away'\n"
    (tmp_path / "layer.toml").write_text(CLAY + STAGES + "".join(stages) + last)
    arguments = ["--site", tmp_path / "layer.toml", "--days", 0.8 * DAYS, "--first-step", 1.5e-3 * DAYS, "--growth", 1.2,
                 "--frames", 2, "--no-film", "--particles", "--output", tmp_path / "results"]  # fmt: skip
    assert consolidation.main([str(word) for word in arguments]) == 0
    days, *both = _history(tmp_path / "results", "time_days", "settlement_middle_m", "settlement_middle_particles_m")
    ramps = [(0.1, 0.2, 4e3), (0.4, 0.5, 4e3), (0.6, 0.60001, -4e3)]
    expected = _settled(days / DAYS, ramps)
    for found in both:
        assert np.abs(found[days < 0.1 * DAYS]).max() < 1e-9 * expected.max()
        assert np.abs(found - expected).max() < 0.01 * expected.max()


@pytest.mark.parametrize("weight, said", [("20e3", False), ("20.0", True)])
def test_a_unit_weight_of_soil_that_is_placed_later_is_looked_at_too(weight, said, tmp_path):
    from common.consolidation.site import read_consolidation_site

    _write_layer(tmp_path, (2.0, 2.2))
    fill = f"[soils.first]\nunit_weight = {weight}\nmaterial = 'elastic'\nyoung = 4e6\npoisson = 0.25\n"
    (tmp_path / "layer.toml").write_text(CLAY + fill + "[[stages]]\nday = 1.0\nfill = 'first'\n")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_consolidation_site(tmp_path / "layer.toml", MPI.COMM_SELF)
    texts = [str(one.message) for one in caught if one.category is RuntimeWarning]
    assert ["unit weight of 'first' is 20 N/m3" in text for text in texts] == [True] * said, texts


@pytest.mark.parametrize(
    "stages, words",
    [
        ("day = 1.0\nfill = 'sand'", r"stages\[0\]: fill: soil 'sand' is not among the soils clay, first, second"),
        ("day = 1.0", r"stages\[0\] has neither fill nor excavate"),
        (
            "day = 1.0\nfill = 'first'\n[[stages]]\nfill = 'second'",
            r"stages\[1\]: day is None, expected a number of days",
        ),
        (
            "day = 1.0\nduration = -1\nfill = 'first'",
            r"stages\[0\]: duration is -1, expected a number of days from 0 on",
        ),
        ("day = 1.0\nlayer = 'first'", r"stages\[0\]: unknown key 'layer', expected some of name, day"),
        ("day = 2.0\nfill = 'first'\n[[stages]]\nday = 1.0\nfill = 'second'", r"stages\[1\]: day 1 comes after day 2"),
        ("day = 1.0\nfill = 'first'\n[[stages]]\nday = 2.0\nfill = 'first'", r"stages\[1\]: 'first' is there before"),
        (
            "day = 1.0\nfill = 'first'\nexcavate = 'second'\n[[stages]]\nday = 2.0\nfill = 'second'",
            "'second' is not there",
        ),
        ("day = 1.0\nfill = 'clay'", "soils: no soil that is there at the beginning has a conductivity"),
    ],
)
def test_wrong_stages_are_named(stages, words, tmp_path):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    _write_layer(tmp_path, (2.0, 2.2, 2.4))
    (tmp_path / "layer.toml").write_text(f"{CLAY}{STAGES}[[stages]]\n{stages}\n")
    with pytest.raises(InputError, match=words):
        read_consolidation_site(tmp_path / "layer.toml", MPI.COMM_SELF).at_rest(water.Element.STABILISED)


@pytest.mark.parametrize(
    "change, stage, words",
    [
        (
            ("[soils.first]", "[soils.first]\nconductivity = 1e-6"),
            "fill = ['first', 'second']",
            "'first, second' places 'first', which has a conductivity",
        ),
        (
            ("", ""),
            "excavate = 'second'\nduration = 2.0",
            "'second' digs soil away in 2 days, expected a duration of 0",
        ),
    ],
)
def test_stages_that_particles_cannot_follow_are_named(change, stage, words, tmp_path):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    _write_layer(tmp_path, (2.0, 2.2, 2.4))
    (tmp_path / "layer.toml").write_text(f"{CLAY}{STAGES.replace(*change)}[[stages]]\nday = 1.0\n{stage}\n")
    ground = read_consolidation_site(tmp_path / "layer.toml", MPI.COMM_SELF)
    with pytest.raises(InputError, match=f"particles: stage {words}"):
        ground.particles(ground.at_rest(water.Element.STABILISED), 3)


@pytest.mark.parametrize("elements", ["P2-P1", "P1-P1"])
def test_a_layer_settles_as_terzaghi_says(elements, tmp_path):
    import consolidation

    _write_layer(tmp_path)
    young, poisson, load, k, height = 4e6, 0.25, 30e3, 1e-9, 2.0
    (tmp_path / "layer.toml").write_text(
        f'mesh = "layer.geo"\n[soils.clay]\nunit_weight = 18e3\nconductivity = {k}\nmaterial = "elastic"\nyoung = {young}\n'
        f"poisson = {poisson}\n[boundaries.top]\nreservoir = 2.0\n"
        f"[pressures]\ntop = [[0.0, 0.0], [0.001, {load}]]\n[points]\nmiddle = [0.15, 2.0]\n"
    )
    oedometer = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    period = height**2 * 9810.0 / (k * oedometer) / 86400  # days
    folder = tmp_path / "results"
    arguments = ["--site", tmp_path / "layer.toml", "--elements", elements, "--days", period, "--first-step", 1e-3 * period,
                 "--growth", 1.1, "--frames", 2, "--no-film", "--particles", "--output", folder]  # fmt: skip
    assert consolidation.main([str(word) for word in arguments]) == 0
    with open(folder / "history.csv", newline="") as file:
        columns = ("time_days", "settlement_middle_m", "settlement_middle_particles_m")
        rows = [[float(row[name]) for name in columns] for row in csv.DictReader(file)]
    days, settled, by_particles = np.transpose(rows[1:])
    exact = [layer_settled(factor) for factor in days / period]
    late = days > 0.02 * period
    for found in (settled, by_particles):
        assert found[late] * oedometer / (load * height) == pytest.approx(np.array(exact)[late], abs=0.02)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["largest_water_error_m2"] < 1e-10 * load * height / oedometer
    assert (folder / "settlement.png").exists() and not list(folder.glob("film.*"))
    assert summary["largest_excess_pressure_Pa"] == pytest.approx(load, rel=0.01 if elements == "P1-P1" else 0.1)


def test_a_load_that_goes_leaves_less_pressure_than_there_was(tmp_path):
    """Half of the load goes after the layer has drained: the pressure falls by as much at once, and is drawn."""
    import consolidation

    _write_layer(tmp_path)
    load = 20e3
    (tmp_path / "layer.toml").write_text(
        'mesh = "layer.geo"\n[soils.clay]\nunit_weight = 18e3\nconductivity = 1e-7\nmaterial = "elastic"\nyoung = 2e6\n'
        "poisson = 0.3\n[boundaries.top]\nreservoir = 2.0\n"
        f"[pressures]\ntop = [[0.0, 0.0], [0.001, {load}], [40.0, {load}], [40.001, {load / 2}]]\n[points]\nmiddle = [0.15, 2.0]\n"
    )
    folder = tmp_path / "results"
    arguments = ["--site", tmp_path / "layer.toml", "--elements", "P1-P1", "--days", 41, "--first-step", 1e-3,
                 "--growth", 2, "--frames", 2, "--no-film", "--output", folder]  # fmt: skip
    assert consolidation.main([str(word) for word in arguments]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["least_excess_pressure_Pa"] == pytest.approx(-load / 2, rel=0.02)
    assert summary["largest_excess_pressure_Pa"] == pytest.approx(load, rel=0.02)
