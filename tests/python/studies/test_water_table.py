"""The water table in pictures, and the scale of pore pressures."""

import importlib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgba
from matplotlib.legend import Legend

import fenics_bridge as bridge
from studies.common import field_plots
from studies.common.field_plots import Field, save_mechanism
from studies.common.site.water_table import TABLE, draw_water_table, level_line, zero_line
from studies.common.stages import plots as stage_plots
from studies.common.water import seepage_plots
from studies.common.water.seepage_plots import MODERATE, PRESSURE, FlowPicture, pressure_limits, save_flow

ROOT = Path(__file__).parents[3]
GAMMA = 10e3
"""Unit weight of water [N/m3]: 10 kPa in a metre"""


def grid(n=20, m=10, width=20.0, height=10.0):
    """Points and cells of a rectangle from (0, 0), each of n by m of them divided in two."""
    x, y = np.meshgrid(np.linspace(0, width, n + 1), np.linspace(0, height, m + 1))
    first = (np.arange(m)[:, None] * (n + 1) + np.arange(n)).ravel()
    lower, upper = np.stack([first, first + 1, first + n + 2], 1), np.stack([first, first + n + 2, first + n + 1], 1)
    return np.column_stack([x.ravel(), y.ravel()]), np.concatenate([lower, upper])


def flow(head, levels=()):
    """A flow at rest; head: function of positions [m]."""
    points, cells = grid()
    values = np.asarray(head(points), float)[:, None]
    return FlowPicture(
        "", Field(points, cells, values), np.zeros_like(points), np.ones(len(points)), GAMMA, list(levels)
    )


def drawn(monkeypatch, module, save, *arguments, **options):
    """The figure that a function would have written."""
    figures = []
    monkeypatch.setattr(module, "save_figure", lambda figure, path: figures.append(figure))
    save(None, *arguments, **options)
    return figures[0]


def water_lines(axes):
    """Segments of the water table in a panel."""
    lines = [one for one in axes.collections if isinstance(one, LineCollection)]
    return [s for one in lines if np.allclose(one.get_colors()[0], to_rgba(TABLE)) for s in one.get_segments()]


def triangles(axes):
    return [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "v"]


def test_a_linear_quantity_is_zero_along_its_line():
    points, cells = grid()
    segments = zero_line(points, cells, points[:, 1] - 0.25 * points[:, 0] - 3.1)
    x, y = segments.reshape(-1, 2).T
    assert np.allclose(y, 0.25 * x + 3.1)
    assert np.linalg.norm(np.diff(segments, axis=1)[:, 0], axis=1).sum() == pytest.approx(20 * np.hypot(1, 0.25))
    assert len(zero_line(points, cells, points[:, 1] + 1.0)) == 0


def test_the_level_of_water_at_rest_is_found_from_its_pressures():
    surface = np.array([[0.0, 5.0], [8.0, 5.0], [14.0, 7.0], [30.0, 9.0]])
    x, y = level_line(bridge.hydrostatic(surface), (0.0, -2.0), (30.0, 8.0)).reshape(-1, 2).T
    assert np.allclose(y, np.interp(x, *surface.T)) and x.min() == 0 and x.max() == 30
    sinking = bridge.hydrostatic(np.array([[0.0, 2.0], [30.0, -4.0]]))  # below the bottom from x = 20 on
    assert level_line(sinking, (0.0, -2.0), (30.0, 8.0))[..., 0].max() == pytest.approx(20.0, abs=0.08)
    assert len(level_line(bridge.hydrostatic(-3.0), (0.0, -2.0), (30.0, 8.0))) == 0


def test_a_triangle_stands_on_the_water_that_is_seen():
    axes = plt.figure().add_subplot(xlim=(0, 10), ylim=(0, 5))
    level = np.array([[[x, 4.0 if x < 6 else 9.0], [x + 1, 4.0 if x < 6 else 9.0]] for x in range(10)])
    draw_water_table(axes, level)
    assert triangles(axes) == [pytest.approx((5.5, 4.0))]
    draw_water_table(axes, level + [0, 9])
    assert len(triangles(axes)) == 1
    plt.close(axes.figure)


# --- scale of pore pressures -----------------------------------------------------------------------------------------


def test_all_pressures_and_moderate_suction_are_shown():
    # The soil reaches from 0 to 10 m, so that the pressures at its ends are 60 and -40, 40 and -60, and 120 and 20 kPa
    assert pressure_limits([flow(lambda x: 6 - x[:, 1])]) == pytest.approx((-40, 60))
    assert pressure_limits([flow(lambda x: 4 - x[:, 1])]) == pytest.approx((-MODERATE, 40))
    assert pressure_limits([flow(lambda x: 12 - x[:, 1])]) == pytest.approx((0, 120))


def test_a_strip_of_strong_suction_is_left_out():
    def head(x):
        return np.where(x[:, 1] < 9.5, 4 - x[:, 1], -100.0)  # -1 MPa in the last of six metres above the water table

    assert pressure_limits([flow(head)]) == pytest.approx((-MODERATE, 40))
    assert pressure_limits([flow(head), flow(lambda x: 8 - x[:, 1])]) == pytest.approx((-80, 80))


def test_suction_of_half_of_the_dry_soil_is_shown():
    low, high = pressure_limits([flow(lambda x: -10.0 - x[:, 1])])
    assert high == 0 and low == pytest.approx(-150, abs=5)  # 100 to 200 kPa over the height, 150 kPa in the middle


@pytest.mark.parametrize(("strip", "extend"), [(0.0, "neither"), (-100.0, "min")])
def test_the_colours_of_pressures_change_at_zero_and_say_what_lies_beyond(strip, extend, monkeypatch):
    picture = flow(lambda x: np.where(x[:, 1] < 9.5, 4 - x[:, 1], strip))
    figure = drawn(monkeypatch, seepage_plots, save_flow, [picture], PRESSURE)
    shown = figure.axes[1]._colorbar
    assert shown.extend == extend
    dry, neither, wet = (shown.cmap(shown.norm(value))[:3] for value in (-10.0, 0.0, 10.0))
    assert dry[0] > dry[2] and wet[0] < wet[2]  # brown and blue-green
    assert np.ptp(neither) < 0.03
    plt.close(figure)


def test_the_water_table_and_the_reservoir_are_drawn(monkeypatch):
    level = np.array([[0.0, np.nan], [5.0, 12.0], [20.0, 12.0]])
    figure = drawn(monkeypatch, seepage_plots, save_flow, [flow(lambda x: 4.2 - x[:, 1], [level])], PRESSURE)
    heights = np.array(water_lines(figure.axes[0]))[..., 1]
    assert np.allclose(heights[:-1], 4.2) and np.allclose(heights[-1], 12.0)
    assert not water_lines(drawn(monkeypatch, seepage_plots, save_flow, [flow(lambda x: 12 - x[:, 1])]).axes[0])


@pytest.mark.parametrize(("level", "named"), [(6.0, True), (12.0, True), (14.0, False)])
def test_only_water_within_a_picture_is_in_its_legend(level, named, monkeypatch):
    """The soil reaches from 0 to 10 m; all pictures show water that stands up to a third of this over it."""
    water = level_line(bridge.hydrostatic(level), (0.0, 0.0), (20.0, 10.0))
    line = np.concatenate([water[:1, 0], water[:, 1]])
    soil = flow(lambda x: 12 - x[:, 1], [line])  # all of it saturated
    at_rest = Field(soil.head.points, soil.head.cells, np.zeros((len(soil.head.points), 2)))
    stage = stage_plots.StagePicture(
        "", at_rest, np.ones(len(at_rest.cells), bool), np.zeros(len(at_rest.cells)), water
    )
    figures = [drawn(monkeypatch, seepage_plots, save_flow, [soil], PRESSURE),
               drawn(monkeypatch, field_plots, save_mechanism, at_rest, "", water=water),
               drawn(monkeypatch, stage_plots, stage_plots.save_stages, [stage], stage_plots.MOVED)]  # fmt: skip
    for figure in figures:
        legends = [one for axes in figure.axes for one in axes.artists if isinstance(one, Legend)]
        assert len(legends) == named == len(triangles(figure.axes[0]))
        top = figure.axes[0].get_ylim()[1]
        assert named == (top > level) and top < 13.5
        plt.close(figure)


def test_a_film_of_water_that_falls_has_frames_of_one_height(monkeypatch):
    frames = []
    monkeypatch.setattr(
        seepage_plots, "save_figure_film", lambda path, pictures, draw: frames.extend(map(draw, pictures))
    )
    levels = [np.array([[0.0, level], [20.0, level]]) for level in (12.0, 8.0)]
    seepage_plots.save_flow_film(None, [flow(lambda x: 8 - x[:, 1], [level]) for level in levels])
    first, last = (frame.axes[0].get_ylim() for frame in frames)
    assert first == last and 12.0 < first[1] < 13.0
    plt.close("all")


# --- mechanisms ------------------------------------------------------------------------------------------------------


def test_a_mechanism_shows_the_water_and_names_the_soils(monkeypatch):
    points, cells = grid()
    values = np.column_stack([points[:, 1] ** 2, np.zeros(len(points))])

    def around(low, high):
        corners = np.array([[0.0, low], [20.0, low], [20.0, high], [0.0, high]])
        return np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)

    field = Field(points, cells, values, soils={"sand": around(4.0, 10.0), "clay": around(0.0, 4.0)})
    water = np.array([[[0.0, 6.0], [20.0, 11.0]]])
    figure = drawn(monkeypatch, field_plots, save_mechanism, field, "", water=water)
    left, right = figure.axes[:2]
    for axes in (left, right):
        assert np.allclose(water_lines(axes), water) and axes.get_ylim()[1] > 11.0
    names = {text.get_text(): text.get_position() for text in right.texts}
    assert set(names) == {"sand", "clay"}
    assert 5 < names["sand"][1] < 9 and 1 < names["clay"][1] < 3

    dry = drawn(monkeypatch, field_plots, save_mechanism, Field(points, cells, values), "")
    assert not water_lines(dry.axes[0]) and not dry.axes[1].texts
    plt.close("all")


@pytest.mark.parametrize(("study", "level"), [("safety", 7.0), ("collapse", None)])
def test_a_site_shows_the_water_of_its_last_stage(study, level, tmp_path, monkeypatch):
    """The flood of the dike stands at 7 m; collapse leaves out what stages change, and with it their water."""
    waters = []
    runs = importlib.import_module("common.site.runs")
    monkeypatch.setattr(runs, "save_mechanism", lambda path, field, title, water=None, members=(): waters.append(water))
    options = f"--site {ROOT}/meshes/dike.toml --meshes 1 --cell-size 3 --output {tmp_path / 'results'}"
    assert importlib.import_module(study).main(options.split()) == 0
    assert np.allclose(waters[0][..., 1], level) if level else waters == [None]
    page = (tmp_path / "results" / "report.html").read_text()
    assert "over the largest displacement on the way to failure" in page and "Value displacement" not in page


def test_stages_show_the_water_of_each(tmp_path, monkeypatch):
    drawn = []
    excavation, runs = importlib.import_module("excavation"), importlib.import_module("common.stages.runs")
    monkeypatch.setattr(runs, "stage_pictures", lambda stages, rows, pictures, folder: drawn.extend(pictures) or {})
    options = f"--site {ROOT}/meshes/dike.toml --cell-size 3 --elements P1 --no-compare --output {tmp_path / 'results'}"
    assert excavation.main(options.split()) == 0
    levels = [(picture.water[..., 1].min(), picture.water[..., 1].max()) for picture in drawn]
    assert levels == [pytest.approx((level, level)) for level in (0.0, 0.0, 7.0)]
