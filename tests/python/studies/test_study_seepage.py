"""The study seepage: its site files, and the flow that it reports."""

import json
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

from mpm_core import InputError, RunError

STUDIES = Path(__file__).parents[3] / "studies"
SITE = (STUDIES.parent / "meshes" / "dam.toml").read_text()


def read(text, folder):
    from common.water.site import read_water_site

    path = folder / "site.toml"
    path.write_text(text.replace('"dam.geo"', f'"{STUDIES.parent}/meshes/dam.geo"'))
    return read_water_site(path, MPI.COMM_WORLD, 3.0)


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("conductivity = 1e-8", "conductivity = 0.0", "soils.core: conductivity is 0.0"),
        ("conductivity = 1e-8", 'conductivity = "low"', "soils.core: conductivity is 'low', expected numbers"),
        (
            "{alpha = 6e-5, n = 1.4, residual = 0.15, air_entry = 200.0}",
            "1.4",
            "van_genuchten is 1.4, expected a table",
        ),
        ("n = 1.4, ", "n = true, ", "soils.core: van_genuchten is .*expected numbers"),
        ("[15.0, 3.0]", '["day 15", 3.0]', "boundaries.upstream: reservoir is .*expected a number or rows"),
        ("conductivity = 1e-8", "permeability = 1e-8", "soils.core: unknown key 'permeability'"),
        ("n = 1.4, ", "", "soils.core: .*missing.*'n'"),
        ("[soils.core]", "[soils.clay]", "soils.clay: no cell has the name 'clay'; the mesh has "),
        ("reservoir = 0.0", 'reservoir = "full"', "boundaries.downstream: reservoir is 'full'"),
        (
            "reservoir = 0.0",
            "level = 0.0",
            "boundaries.downstream: unknown key 'level', expected some of head, reservoir",
        ),
        ("rain = 0.0", "rain = -1.0", "boundaries.crest: rain is -1 mm/day, expected 0 or more"),
        ("rain = 0.0", "rain = [[0.0, 1.0], [2.0, -3.0]]", "boundaries.crest: rain is -3 mm/day, expected 0 or more"),
        (
            "[15.0, 3.0]",
            "[5.0, 3.0]",
            "boundaries.upstream: reservoir has day 5 after day 10, expected rows of rising days",
        ),
        ('mesh = "dam.geo"', 'mesh = "no.geo"', "there is no file"),
    ],
)
def test_a_wrong_site_is_named(old, new, words, tmp_path):
    assert old in SITE
    with pytest.raises(InputError, match=words):
        read(SITE.replace(old, new), tmp_path).seepage(1)


def test_the_flow_of_a_homogeneous_block_is_darcys(tmp_path, capsys):
    import seepage

    lines = ['SetFactory("OpenCASCADE");', "DefineConstant[ cell_size = 1 ];", "Rectangle(1) = {0, 0, 0, 4, 2};",
             'Physical Surface("sand") = {1};', 'Physical Curve("left") = {4};', 'Physical Curve("right") = {2};',
             "Mesh.MeshSizeMax = cell_size;"]  # fmt: skip
    (tmp_path / "block.geo").write_text("\n".join(lines) + "\n")
    (tmp_path / "block.toml").write_text(
        'mesh = "block.geo"\n[soils.sand]\nconductivity = 1e-5\n'
        "[boundaries.left]\nhead = 5.0\n[boundaries.right]\nhead = 3.0\n"
    )
    folder = tmp_path / "results"
    assert seepage.main(["--site", str(tmp_path / "block.toml"), "--output", str(folder)]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    darcy = 86400 * 1e-5 * (5.0 - 3.0) / 4.0 * 2.0
    assert summary["steady_inflow_left_m2_per_day"] == pytest.approx(darcy, rel=1e-9)
    assert summary["steady_inflow_right_m2_per_day"] == pytest.approx(-darcy, rel=1e-9)
    assert summary["steady_largest_exit_gradient"] == pytest.approx((5.0 - 3.0) / 4.0, rel=1e-9)
    assert abs(summary["steady_largest_upward_exit_gradient"]) < 1e-9
    assert (folder / "seepage_steady.png").stat().st_size > 10_000
    assert f"left: {1000 * darcy:.4g} litres" in capsys.readouterr().out


def test_half_of_k_h_flows_under_a_pile_down_to_the_middle_of_a_layer():
    """K' / 2K of the modulus sin(pi / 4) (Polubarinova-Kochina 1962); the pile has a width here."""
    from common.water.site import read_water_site

    flow = read_water_site(STUDIES.parent / "meshes" / "sheet_pile.toml", MPI.COMM_WORLD).seepage(2)
    flow.solve()
    assert flow.inflow("upstream") / (1e-5 * 2.0) == pytest.approx(0.5, rel=0.015)
    assert flow.inflow("downstream") == pytest.approx(-flow.inflow("upstream"), rel=1e-9)


@pytest.mark.usefixtures("without_pictures")
def test_the_history_of_a_drawdown_balances(tmp_path):
    import seepage

    folder = tmp_path / "results"
    arguments = ["--cell-size", "2", "--days", "20", "--frames", "2", "--output", str(folder)]
    assert seepage.main(arguments) == 0
    rows = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    inflow = sum(rows[name] for name in rows.dtype.names if name.startswith("inflow"))
    # Backward Euler: what came in over a step is the inflow at its end times its length.
    change, came = np.diff(rows["stored_water_m2"]), np.diff(rows["time_days"]) * inflow[1:]
    assert came == pytest.approx(change, abs=1e-6 * rows["stored_water_m2"][0])
    assert rows["stored_water_m2"][-1] < rows["stored_water_m2"][0]


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize("curve, left, said", [("", 10.0, True), ("free_surface = {}", 10.0, False), ("", 12.0, False)])
def test_soil_that_stays_saturated_far_above_the_water_table_is_said(curve, left, said, tmp_path):
    """A dam with vertical faces conducts k (h1^2 - h2^2) / 2 L (Dupuit), and more if the soil above the water table conducts, too."""
    import seepage

    lines = ['SetFactory("OpenCASCADE");', "Rectangle(1) = {0, 0, 0, 16, 12};", 'Physical Surface("sand") = {1};',
             'Physical Curve("left") = {4};', 'Physical Curve("right") = {2};', "Mesh.MeshSizeMax = 0.8;"]  # fmt: skip
    (tmp_path / "dam.geo").write_text("\n".join(lines) + "\n")
    right = 2.0 if left == 10.0 else 12.0
    (tmp_path / "dam.toml").write_text(
        f'mesh = "dam.geo"\n[soils.sand]\nconductivity = 1e-5\n{curve}\n'
        f"[boundaries.left]\nreservoir = {left}\n[boundaries.right]\nreservoir = {right}\n"
    )
    folder = tmp_path / "results"
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert seepage.main(["--site", str(tmp_path / "dam.toml"), "--no-film", "--output", str(folder)]) == 0
    assert (
        any("'sand' is up to" in str(one.message) and "no retention curve" in str(one.message) for one in caught)
        == said
    )
    inflow = json.loads((folder / "summary.json").read_text())["steady_inflow_left_m2_per_day"]
    dupuit = 86400 * 1e-5 * (left**2 - right**2) / (2 * 16.0)
    assert inflow > 1.2 * dupuit if said else inflow == pytest.approx(dupuit, rel=0.03, abs=1e-9)


def test_water_that_falls_over_level_ground_presses_none_out_of_it(tmp_path):
    """The load falls with the pore pressure, so that effective stresses stay: only compressed water expands, n w / K_w."""
    import seepage

    lines = ['SetFactory("OpenCASCADE");', "Rectangle(1) = {0, 0, 0, 4, 2};", 'Physical Surface("clay") = {1};',
             'Physical Curve("top") = {3};', "Mesh.MeshSizeMax = 0.5;"]  # fmt: skip
    (tmp_path / "ground.geo").write_text("\n".join(lines) + "\n")
    (tmp_path / "ground.toml").write_text(
        'mesh = "ground.geo"\n[soils.clay]\nconductivity = 1e-9\nporosity = 0.4\ncompressibility = 1e-7\n'
        "[boundaries.top]\nreservoir = [[0.0, 7.0], [1.0, 2.0]]\n"
    )
    folder = tmp_path / "results"
    arguments = ["--days", "200", "--frames", "2", "--no-film", "--output", str(folder)]
    assert seepage.main(["--site", str(tmp_path / "ground.toml"), *arguments]) == 0
    rows = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    left = -np.diff(rows["time_days"]) @ rows["inflow_top_m2_per_day"][1:]
    pressure, area = 9810.0 * 5.0, 4.0 * 2.0
    assert 0 <= left < 0.01 * 1e-7 * pressure * area  # m_v w would leave if the skeleton took the load
    assert left == pytest.approx(0.4 / 2.2e9 * pressure * area, rel=0.15)


@pytest.mark.parametrize("level, said", [(10.0, ""), (12.0, ""), (13.0, "x = 2[4-8][.0-9]* m, y = 12 m")])
def test_a_crest_that_is_overtopped_is_said(level, said, tmp_path):
    """The crest of the dam, 12 m high from x = 24 to 28 m, is no part of the reservoir."""
    text = SITE.replace(
        "reservoir = [[0.0, 10.0], [10.0, 10.0], [15.0, 3.0]]", f"reservoir = [[0.0, 3.0], [10.0, {level}]]"
    )
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read(text, tmp_path)
    found = [str(one.message) for one in caught if "above the ground beside it" in str(one.message)]
    assert bool(found) == bool(said)
    if said:
        assert re.search(
            f"the reservoir of 'upstream' rises to {level:g} m, above the ground beside it at {said}", found[0]
        )


def test_a_floor_that_a_reservoir_leaves_out_is_said(tmp_path):
    """Water stands on a slope from (4, 3) to (10, 0) up to 2 m, but not on the level ground before its toe."""
    from common.water.site import read_water_site

    lines = ["Point(1) = {0, -2, 0}; Point(2) = {14, -2, 0}; Point(3) = {14, 0, 0}; Point(4) = {10, 0, 0}; Point(5) = {4, 3, 0};",
             "Point(6) = {0, 3, 0};", *(f"Line({k}) = {{{k}, {k % 6 + 1}}};" for k in range(1, 7)), "Curve Loop(1) = {1:6};",
             'Plane Surface(1) = {1}; Physical Surface("clay") = {1};', 'Physical Curve("slope") = {4};',
             'Physical Curve("floor") = {3};', "Mesh.MeshSizeMax = 1;"]  # fmt: skip
    (tmp_path / "slope.geo").write_text("\n".join(lines) + "\n")
    site = 'mesh = "slope.geo"\n[soils.clay]\nconductivity = 1e-9\nporosity = 0.4\ncompressibility = 1e-7\n[boundaries.slope]\nreservoir = 2.0\n'
    (tmp_path / "one.toml").write_text(site)
    (tmp_path / "both.toml").write_text(site + "[boundaries.floor]\nreservoir = 2.0\n")
    with pytest.warns(
        RuntimeWarning,
        match="reservoir of 'slope' rises to 2 m, above the ground beside it at x = 10[.0-9]* m, y = 0 m",
    ):
        read_water_site(tmp_path / "one.toml", MPI.COMM_WORLD)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_water_site(tmp_path / "both.toml", MPI.COMM_WORLD)


def test_no_film_writes_none(tmp_path):
    import seepage

    folder = tmp_path / "results"
    assert seepage.main(["--cell-size", "4", "--days", "5", "--frames", "1", "--no-film", "--output", str(folder)]) == 0
    assert (folder / "seepage_in_time.png").exists() and not list(folder.glob("film.*"))


def test_times_are_in_units_that_can_be_read():
    from common.water.site import DAY, time_in_words

    words = {0.0: "0 days", 4.86: "4.86 s", 60.0: "1 min", 432.0: "7.2 min", 0.01 * DAY: "0.01 days", DAY: "1 day",
             2.5 * DAY: "2.5 days", 1234.4 * DAY: "1234 days"}  # fmt: skip
    assert {time: time_in_words(time) for time in words} == words


UPSTREAM = "[boundaries.upstream]\nreservoir = 5.0\n"
DOWNSTREAM = "[boundaries.downstream]\nreservoir = 3.0\n"
SEALED = "[boundaries.weir]\nflux = 0.0\n"


def weir_in(folder, conditions):
    """The file of a layer 8 m long and 2 m thick, on which a weir stands from x = 3 m to 5 m, with conditions of the water."""
    points = [(0, 2), (3, 2), (5, 2), (8, 2), (8, 0), (0, 0)]
    lines = [f"Point({k}) = {{{x}, {y}, 0}};" for k, (x, y) in enumerate(points, 1)]
    lines += ["For k In {1:6}", "  Line(k) = {k, k % 6 + 1};", "EndFor", "Curve Loop(1) = {1:6};", "Plane Surface(1) = {1};",
              'Physical Surface("sand") = {1};', 'Physical Curve("upstream") = {1};', 'Physical Curve("weir") = {2};',
              'Physical Curve("downstream") = {3};', "Mesh.MeshSizeMax = 0.5;"]  # fmt: skip
    (folder / "weir.geo").write_text("\n".join(lines) + "\n")
    (folder / "weir.toml").write_text(f'mesh = "weir.geo"\n[soils.sand]\nconductivity = 1e-5\n{conditions}')
    return folder / "weir.toml"


@pytest.mark.usefixtures("without_pictures")
@pytest.mark.parametrize(
    "conditions, said",
    [
        (UPSTREAM + DOWNSTREAM + SEALED, []),  # as one writes a weir
        (
            UPSTREAM + DOWNSTREAM,
            ["'upstream' rises to 5 m, above the ground.*flux = 0.0", "'downstream' rises", "no boundary has a"],
        ),
        # Without a way out the head is 5 m everywhere, and water presses with (5 - 2) m against what seals the ground.
        (UPSTREAM + SEALED, [r"boundaries: no boundary has a condition.*y = 2 m.*pressure of 29\.4 kPa.*seepage_face"]),
    ],
)
def test_ground_that_is_sealed_by_mistake_is_said(conditions, said, tmp_path):
    import seepage

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        site = weir_in(tmp_path, conditions)
        assert seepage.main(["--site", str(site), "--output", str(tmp_path / "out")]) == 0
    texts = [str(one.message) for one in caught if one.category is RuntimeWarning]
    assert len(texts) == len(said) and all(re.search(words, text) for words, text in zip(said, texts)), texts


@pytest.mark.usefixtures("without_pictures")
def test_a_steady_flow_that_is_not_found_ends_the_study_with_its_message(tmp_path, monkeypatch):
    """`run_study` shows the message alone of a RunError."""
    import seepage

    from fenics_bridge import water

    monkeypatch.setattr(water.Seepage, "_solve", lambda *_: "it diverges")
    monkeypatch.setattr(water.Seepage, "_sharpen", lambda *_: "it diverges")
    site = weir_in(tmp_path, UPSTREAM + DOWNSTREAM + SEALED)
    with pytest.raises(RunError, match="steady seepage was not found: it diverges"):
        seepage.main(["--site", str(site), "--output", str(tmp_path / "out")])


ROWS = ((0.0, 5.0), (10 * 86400.0, 3.0), (20 * 86400.0, 3.0))


@pytest.mark.parametrize(
    "days, starts, said",
    [
        (30.0, {"fill": 86400.0 * 29}, ""),
        (15.0, {}, ""),  # the level stays from day 10 on
        (9.0, {}, r"after 9 days .*boundaries.face \(changes until day 10\)$"),  # 3.2 m on day 9
        (15.0, {"fill": 86400.0 * 15}, r"after 15 days .*stage 'fill' \(day 15\)$"),
    ],
)
def test_what_a_site_describes_for_days_after_the_end_is_said(days, starts, said):
    from common.site.flow_doubts import warn_of_later_changes

    from fenics_bridge import water

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        boundary = [water.Reservoir("face", ROWS), water.Head("far", 4.0)]
        warn_of_later_changes(days, boundary, "site.toml", {"top": ((0.0, 0.0), (86400.0, 2e4))}, starts)
    assert [bool(re.search(said, str(one.message))) for one in caught] == [True] * bool(said)


@pytest.mark.usefixtures("without_pictures")
def test_the_gradient_beside_a_sheet_pile_is_that_of_the_water_that_leaves(tmp_path):
    """pi H / (4 K T sin(pi s / 2 T)) with K of the modulus cos(pi s / 2 T), 1.8541 for a pile through half of the layer (Harr 1962). At the tip of
    the pile it is singular, but no water leaves there."""
    import seepage

    site, folder = STUDIES.parent / "meshes" / "sheet_pile.toml", tmp_path / "out"
    assert seepage.main(["--site", str(site), "--elements", "P2", "--output", str(folder)]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    expected = np.pi * 2.0 / (4 * 1.8541 * 4.0 * np.sin(np.pi / 4))
    assert summary["steady_largest_exit_gradient"] == pytest.approx(expected, rel=0.04)
    assert summary["steady_largest_upward_exit_gradient"] == pytest.approx(expected, rel=0.04)


@pytest.mark.parametrize("lowest", [1.0, 1.0 - 1e-12, 0.7])
def test_round_off_gives_the_colour_bar_of_heads_no_arrow(lowest):
    """Linear elements have the head of a reservoir to their round-off; all heads are on the scale."""
    from common.field_plots import Field
    from common.water.seepage_plots import HEAD, FlowPicture, _figure, _scales

    points, cells = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (0.0, 1.0)]), np.array([(0, 1, 2), (0, 2, 3)])
    total = np.array([6.0, lowest, lowest, 6.0])
    head = Field(points, cells, (total - points[:, 1])[:, None], [])
    flow = FlowPicture("flow", head, np.zeros((4, 2)), np.ones(4), 9810.0)
    figure = _figure([flow], HEAD, _scales([flow], HEAD))
    assert figure.axes[-1]._colorbar.extend == "neither"


@pytest.mark.parametrize(
    "degree, varies, curve, said",
    [(2, True, True, True), (1, True, True, False), (2, False, True, False), (2, True, False, False)],
)
def test_quadratic_elements_for_rain_on_dry_soil_are_said(degree, varies, curve, said):
    """Rain that ponds enters dry sand on cells of 0.5 m with 0.1 mm in a day in quadratic elements, of 86 mm by gravity alone."""
    from common.site.flow_doubts import warn_of_degree

    from fenics_bridge import water

    retention = water.VanGenuchten(1.5e-3, 2.7) if curve else water.AlwaysSaturated()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_degree(degree, varies, {"sand": water.PorousSoil(1e-5, retention=retention)})
    assert ["'sand' dries" in str(one.message) for one in caught] == [True] * said
