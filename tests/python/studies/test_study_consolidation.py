"""The study consolidation: its site files, and a layer that settles as Terzaghi says."""

import csv
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from consolidation_cases import layer_settled
from mpi4py import MPI
from study_main import ended, main

from mpm_core import InputError

STUDIES = Path(__file__).parents[3] / "studies"
SITE = (STUDIES.parent / "meshes" / "fill.toml").read_text()


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("conductivity = 1e-9", "conductivity = 0.0", "soils.soil: conductivity is 0.0"),
        ("porosity = 0.5", "porosity = 1.5", "soils.soil: porosity is 1.5"),
        ("unit_weight = 17e3", "", "soils.soil has no unit_weight"),
        ("young = 3e6", "youngs = 3e6", "soils.soil: .*youngs"),
        ('axis = "roller"', 'axis = "slides"', "supports.axis is 'slides'"),
        ("[10.0, 20e3]", "[0.0, 20e3]", "pressures.footing: day 0 comes after day 0, .*rising days"),
        ("[10.0, 20e3]", "[10.0, nan]", "pressures.footing is .*expected finite numbers"),
        ("[10.0, 20e3]", "[10.0, -20e3]", "pressures.footing is -20000 Pa, expected at least 0: a pressure pushes"),
        ("[10.0, 20e3]", "[10.0]", "pressures.footing is .*expected a number or rows"),
        (
            "footing = [[0.0, 0.0]",
            "nowhere = [[0.0, 0.0]",
            "pressures.nowhere: no boundary of the mesh .* has the name 'nowhere'; it has ",
        ),
        ("middle = [0.0, 0.0]", "middle = [0.0]", r"points.middle is .*expected \[x, y\]"),
        ("[points]", "[places]", "unknown key 'places'"),
        (
            "edge = [2.0, 0.0]",
            "edge = [2.0, 1.0]",
            r"site.toml: points.edge is \[2.0, 1.0\], expected a place in the mesh",
        ),
    ],
)
def test_a_wrong_site_is_named(old, new, words, tmp_path):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    assert old in SITE
    path = tmp_path / "site.toml"
    path.write_text(SITE.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    with pytest.raises(InputError, match=words):
        read_consolidation_site(path, MPI.COMM_SELF).at_rest(water.Element.STABILISED)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("conductivity = 1e-9", "conductivity = [1e-9, 8.64]", "soils.soil: conductivity is 8.64 m/s, more than that of gravel"),
        ("[boundaries.footing]\nreservoir = 0.5", "[boundaries.footing]\nreservoir = [[0.0, 0.5], [1.0, 100.0]]",
         "the reservoir of 'footing' is 100 m, 100 m above the top of the mesh, which is 6 m high"),
        ("conductivity = 1e-9", "conductivity = 0.5",
         "soils.soil: conductivity is 0.5 m/s, that of rock fill or clean coarse gravel; conductivities are in m/s, and 0.5 m/day are 5.79e-06 m/s"),
        ("conductivity = 1e-9", "conductivity = 0.09", ""),
        ("[boundaries.footing]\nreservoir = 0.5", "[boundaries.footing]\nreservoir = 18.0", ""),  # deep water
        ("[10.0, 20e3]", "[10.0, 20.0]", "pressures.footing is 20 Pa, less than under 0.1 m of soil: 20 kPa are 20e3"),
    ],
)  # fmt: skip
def test_values_that_are_probably_mistakes_are_said(old, new, words, tmp_path):
    from common.consolidation.site import read_consolidation_site

    assert old in SITE
    path = tmp_path / "site.toml"
    path.write_text(SITE.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read_consolidation_site(path, MPI.COMM_SELF, 2.0)
    assert len(caught) == bool(words) and all(words in str(one.message) for one in caught)


RAMP = "footing = [[0.0, 0.0], [10.0, 20e3]]"


@pytest.mark.parametrize(
    "old, new, days, changes",
    [
        (RAMP, RAMP, 3.0, True),
        (RAMP, "footing = 20e3", 3000.0, False),
        (RAMP, "footing = [[5.0, 20e3]]", 3000.0, False),  # one row holds before it and after it
        (RAMP, "footing = [[0.0, 20e3], [10.0, 20e3]]", 3000.0, False),
        (RAMP, "footing = [[-1.0, 0.0], [0.0, 20e3]]", 3000.0, False),  # over at the beginning
        (RAMP, "footing = [[50.0, 0.0], [60.0, 20e3]]", 40.0, False),  # begins after the end
        (RAMP, "footing = [[50.0, 0.0], [60.0, 20e3]]", 55.0, True),
        (RAMP, "footing = [[0.0, 0.0], [1.0, 20e3], [2.0, 0.0]]", 3.0, True),  # as at the beginning again
        ("reservoir = 0.5  #", "reservoir = [[0.0, 0.5], [1.0, 1.0]]  #", 3.0, True),
    ],
)
def test_ground_in_which_nothing_changes_is_known(old, new, days, changes, tmp_path):
    from common.consolidation.site import read_consolidation_site

    assert SITE.count(old) == 1 and SITE.count(RAMP) == 1
    still = SITE if old == RAMP else SITE.replace(RAMP, "footing = 0.0")
    path = tmp_path / "site.toml"
    path.write_text(still.replace(old, new).replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    assert read_consolidation_site(path, MPI.COMM_SELF, 2.0).changes_until(86400.0 * days) == changes


@pytest.mark.parametrize("pressure, words", [("footing=20e3", 1), ("footing=0:0,1:20e3", 0)])
def test_ground_in_which_nothing_changes_is_said(pressure, words, tmp_path, without_pictures):
    options = ["--cell-size", 2, "--days", 1, "--first-step", 1, "--pressures", pressure, "--output", tmp_path / "out"]
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert main("consolidation", options) == 0
    assert sum("nothing changes within 1 days" in str(one.message) for one in caught) == words
    settled = json.loads((tmp_path / "out" / "summary.json").read_text())["settlement_middle_m"]
    assert (abs(settled) < 1e-9) == bool(words)


@pytest.mark.parametrize("options, words", [([], 0), (["--first-step", 0.25], 1)])
def test_cells_that_are_too_large_for_the_first_step_are_said(options, words, tmp_path, without_pictures):
    """The cells of 0.15 m under the fill are 0.13 m high, by which soil consolidates in the half day of the first step."""
    import consolidation
    from common.option_words import in_options

    run = ended("consolidation", tmp_path, "--days", 2, "--no-film", *options)
    assert run.returncode == 0
    assert run.stderr.count("the cells at the drained boundary 'footing'") == words
    assert in_options(run.stderr, consolidation.parser()).count("Take a longer --first-step, 0.") == words


def test_ground_that_fails_right_after_a_frame_is_not_drawn_twice(tmp_path, monkeypatch, without_pictures):
    import consolidation

    drawn = []
    monkeypatch.setattr(consolidation.Files, "_picture", lambda files: drawn.append(files._model.time / 86400.0))
    options = ["--cell-size", 2, "--days", 4, "--first-step", 0.5, "--frames", 2, "--no-film"]
    run = ended("consolidation", tmp_path, *options, "--pressures", "footing=0:0,2:1e3,2.00000001:2e6")
    assert run.returncode != 0 and "no equilibrium was found from 2 days on" in run.stdout + run.stderr
    assert drawn == [pytest.approx(2.0)]


@pytest.mark.parametrize(
    "dilation, reason, doubted",
    [(0, "residual 1e-7", True), (25, "residual 1e-7", False), (0, "it collapses: soil would move by 9 m", False)],
)
def test_steps_that_end_by_newtons_method_are_not_said_to_be_failure_of_the_ground(dilation, reason, doubted, tmp_path):
    import consolidation
    from common.consolidation.site import read_consolidation_site

    path, old = tmp_path / "site.toml", "friction_angle = 25.0"
    assert old in SITE
    text = SITE.replace(old, f"{old}\ndilation_angle = {dilation}.0")
    path.write_text(text.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    said = consolidation.without_equilibrium(read_consolidation_site(path, MPI.COMM_SELF, 2.0), 2 * 86400.0, reason)
    assert said.startswith("no equilibrium was found from 2 days on") and reason in said
    assert ("where 'soil' yields, whose dilation angle is below its friction angle" in said) == doubted
    assert ("as where ground fails under its load" in said) != doubted


def test_particles_take_no_other_water_than_reservoirs(tmp_path):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    site = SITE.replace("[boundaries.footing]\nreservoir", "[boundaries.footing]\nhead")
    path.write_text(site.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    ground = read_consolidation_site(path, MPI.COMM_SELF)
    with pytest.raises(InputError, match="boundary has Head.*expected reservoirs only for particles"):
        ground.particles(ground.at_rest(water.Element.STABILISED), 3)


@pytest.mark.parametrize("dilation", [0.0, 25.0])
@pytest.mark.parametrize("nmd", [False, True])
def test_particles_begin_at_rest(dilation, nmd, tmp_path):
    """Also in soil that does not dilate, of which elements and particles average strains and forces by half."""
    from common.consolidation.site import read_consolidation_site
    from common.water.wet_particles import SmallMotion

    from fenics_bridge import water

    path = tmp_path / "site.toml"
    site = SITE.replace("friction_angle = 25.0", f"friction_angle = 25.0\ndilation_angle = {dilation}")
    site = site.replace("[[0.0, 0.0], [10.0, 20e3]]", "0.0").replace("cell_size = 0.15", "cell_size = 1.0")
    path.write_text(site.replace('"footing.geo"', f'"{STUDIES.parent}/meshes/footing.geo"'))
    ground = read_consolidation_site(path, MPI.COMM_SELF)
    fem = ground.at_rest(water.Element.STABILISED, nmd)
    model = ground.particles(fem, 3, nmd)
    assert model.out_of_balance(nmd=nmd) < 1e-9
    there = fem.evaluate_at(model.particles.position)["pressure"][:, 0]
    np.testing.assert_allclose(model.particles.pore_pressure, there, rtol=0, atol=1e-9 * there.max())
    motion = SmallMotion(model, nmd)
    list(motion.advance(86400.0, 86400.0))
    assert np.abs(motion.moved).max() < 1e-10


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


@pytest.mark.parametrize(
    "word, words",
    [
        ("footing", "--pressures is 'footing', expected NAME=PA or NAME=DAYS:PA"),
        ("footing=1:2:3", "--pressures is 'footing=1:2:3'"),
        ("footing=0:0,5", "--pressures is 'footing=0:0,5'"),
        ("footing=5:0,5:1e3", "--pressures footing: day 5 comes after day 5, expected .* rising days"),
        ("footing=-20e3", "--pressures footing is -20000 Pa, expected at least 0: a pressure pushes"),
        ("footing=0:inf", "--pressures.footing is .*expected finite numbers"),
    ],
)
def test_wrong_pressures_on_the_command_line_are_named(word, words):
    from common.consolidation.stages import pressures_of

    with pytest.raises(InputError, match=words):
        pressures_of([word])


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


def test_the_pressure_between_smooth_plates_rises_as_mandel_says():
    """The pressure in the middle over half the load reaches 1.1555 at a time factor of 0.084 (Poisson ratio 0)."""
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    site = read_consolidation_site(STUDIES.parent / "meshes" / "slab.toml", MPI.COMM_WORLD, 0.1)
    model = site.at_rest(water.Element.TAYLOR_HOOD)
    middle = np.array([[0.0, 0.0]]) if MPI.COMM_WORLD.rank == 0 else np.empty((0, 2))
    pressure = lambda: MPI.COMM_WORLD.bcast(model.evaluate_at(middle)["pressure"])[0, 0]
    start, period = pressure(), 9810.0 / (1e-9 * 1e6)
    rise = []
    for factor in (0.01, 0.084):
        assert model.run(factor * period, 1e-3 * period, 1.2)[-1].converged
        rise.append((pressure() - start) / 5e3)
    assert rise[1] == pytest.approx(1.1555, rel=0.02) and rise[0] < 1.08


@pytest.mark.parametrize("width", [0.5, 20.0])
def test_settlements_of_more_than_a_tenth_of_the_height_are_warned_of_and_are_no_collapse(tmp_path, width):
    from common.consolidation.site import read_consolidation_site

    from fenics_bridge import water

    text = f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 1.0\n[soils.clay]\nconductivity = 1e-6\n[constants]\nwidth = {width}\n'
    (tmp_path / "site.toml").write_text(text)
    model = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_SELF).at_rest(water.Element.TAYLOR_HOOD)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert model.run(86400.0 * 200, 86400.0, 1.3)[-1].converged
    found = [str(one.message) for one in said if "more than a tenth of the height of the body" in str(one.message)]
    assert len(found) == 1
    assert -model.displacement.x.array.min() > 0.5


@pytest.mark.parametrize(
    ("settlement", "title"), [(0.02, "Displacements magnified 20 times"), (1.0, "Displacements to scale")]
)
def test_pictures_of_consolidation_do_not_reduce_displacements(settlement, title):
    from common.consolidation.plots import ExcessPicture, ExcessScale
    from common.field_plots import Field

    points, cells = np.array([(0.0, 0.0), (20.0, 0.0), (20.0, 8.0), (0.0, 8.0)]), np.array([(0, 1, 2), (0, 2, 3)])
    moved = np.array([(0.0, 0.0), (0.0, 0.0), (0.0, -settlement), (0.0, -settlement)])
    scale = ExcessScale.of([ExcessPicture("After 1 day", Field(points, cells, np.full((4, 1), 1e3)), moved)])
    assert scale.enlarged == max(0.05 * 8 / settlement, 1.0)  # a twentieth of the height, or as large as it is
    assert scale.title == title


def test_a_unit_weight_in_kn_is_named_also_where_ground_at_rest_has_no_equilibrium(tmp_path):
    from common.consolidation.site import read_consolidation_site

    import mpm_core as mpm
    from fenics_bridge import water

    (tmp_path / "site.toml").write_text(
        f'extends = "{STUDIES.parent}/meshes/soft_clay.toml"\ncell_size = 1.0\n[soils.clay]\nunit_weight = 16\nattraction = 5e3\nk0 = 0.8\n'
    )
    site = read_consolidation_site(tmp_path / "site.toml", MPI.COMM_SELF)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        with pytest.raises((mpm.InputError, mpm.RunError)):
            site.at_rest(water.Element.STABILISED, nmd=True)
    assert any("the unit weight of 'clay' is 16 N/m3" in str(one.message) for one in said)
