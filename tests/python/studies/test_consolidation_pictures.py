"""Pictures of consolidation: the scale of time, primary and secondary settlement, borders of soils; tables that begin late."""

import warnings

import matplotlib.pyplot as plt
import numpy as np
import pytest


@pytest.fixture
def drawn(monkeypatch):
    """The figures that would be written."""
    from common import figures

    found = []
    monkeypatch.setattr(figures, "save_figure", lambda figure, path: found.append(figure))
    yield found
    plt.close("all")


@pytest.mark.parametrize(
    "stages, last, scale",
    [([], 400.0, "log"), ([10.0], 400.0, "linear"), ([10.0], 600.0, "log"), ([], 600.0, "log")],
)
def test_time_is_drawn_by_its_logarithm_over_more_than_three_decades(stages, last, scale, drawn, tmp_path):
    from common.consolidation.plots import by_logarithm, save_over_time

    days = np.array([0.0, 0.5, 20.0, last])
    logarithmic = by_logarithm(days, stages)
    save_over_time(
        tmp_path / "x.png",
        days[logarithmic:],
        {"a": np.ones(4 - logarithmic)},
        "y",
        stages=stages,
        logarithmic=logarithmic,
    )
    assert drawn[0].axes[0].get_xscale() == scale


def test_primary_consolidation_ends_when_a_twentieth_of_the_pressure_is_left(drawn, tmp_path):
    """At the base of a layer 4 / pi exp(-pi^2 T / 4) is left, 0.05 at T = 4 / pi^2 ln(80 / pi)."""
    from common.consolidation.plots import end_of_primary, save_over_time
    from common.consolidation.theory import layer_pressure

    factors = np.linspace(0.01, 3.0, 1000)
    pressure = np.array([float(layer_pressure([0.0], factor)[0]) for factor in factors])
    end = end_of_primary(factors, pressure)
    assert end == pytest.approx(4 / np.pi**2 * np.log(80 / np.pi), abs=0.003)
    assert end_of_primary(factors[:300], pressure[:300]) is None  # not over
    save_over_time(tmp_path / "x.png", factors, {"a": factors}, "y", primary=end)
    assert [text.get_text().strip() for text in drawn[0].axes[0].texts] == ["primary", "secondary"]


def test_a_load_that_comes_after_the_first_is_over_ends_primary_consolidation_later():
    from common.consolidation.plots import end_of_primary

    assert end_of_primary(np.arange(7.0), np.array([0.0, 10.0, 0.1, 8.0, 0.6, 0.5, 0.4])) == 5.0


def test_borders_of_soils_move_with_the_ground(drawn):
    """Clay below a fill, each of a square of two triangles: the border is at the height 1 and sinks by 5 times 0.1."""
    from common.consolidation.plots import ExcessPicture, ExcessScale, _excess_figure
    from common.field_plots import Field

    points = np.array([(x, y) for y in (0.0, 1.0, 2.0) for x in (0.0, 1.0)])
    cells = np.array([(0, 1, 3), (0, 3, 2), (2, 3, 5), (2, 5, 4)])
    moved = np.outer(points[:, 1], (0.0, -0.1))
    picture = ExcessPicture("After 1 day", Field(points, cells, np.zeros((6, 1))), moved, soils=np.array([0, 0, 1, 1]))
    assert {tuple(sorted(edge)) for edge in picture.borders} == {(0, 1), (0, 2), (1, 3), (2, 3), (2, 4), (3, 5), (4, 5)}
    axes = _excess_figure([picture], ExcessScale((0.0, 1.0), 5.0)).axes[0]
    segments = [one for lines in axes.collections if hasattr(lines, "get_segments") for one in lines.get_segments()]
    assert any(np.allclose(np.sort(one, axis=0), [(0.0, 0.5), (1.0, 0.5)]) for one in segments)
    assert not len(ExcessPicture("", picture.excess, moved).borders)


@pytest.mark.parametrize(
    "rows, said",
    [
        ([[10.0, 20e3], [20.0, 30e3]], True),
        ([[10.0, 20e3]], True),
        ([[10.0, 0.0], [20.0, 30e3]], False),
        ([[0.0, 20e3], [20.0, 30e3]], False),
        ([[-5.0, 20e3], [20.0, 30e3]], False),
        (20e3, False),
    ],
)
def test_a_pressure_that_holds_before_its_table_begins_is_said(rows, said):
    from common.consolidation.stages import pressure_table

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        pressure_table(rows, "site.toml: pressures.top")
    texts = [str(one.message) for one in caught]
    assert [
        "site.toml: pressures.top begins on day 10 with 20000 Pa, which act before it as well" in text for text in texts
    ] == [True] * said
