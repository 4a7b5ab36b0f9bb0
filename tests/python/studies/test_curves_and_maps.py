"""Curves of few points, and the light on maps."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

from fenics_bridge.terrain import Raster
from studies.common import figures
from studies.common.figures import FEW, curve_figure
from studies.common.runout import terrain_plots
from studies.common.runout.terrain_plots import hillshade


@pytest.mark.parametrize(
    "count, marked", [(1, True), (2, False), (3, True), (FEW - 1, True), (FEW, False), (100, False)]
)
def test_points_of_curves_that_have_few_are_marked(count, marked, monkeypatch):
    monkeypatch.setattr(figures, "save_figure", lambda figure, path: plt.close(figure))
    with curve_figure(None, panels=2) as axes:
        (line,) = axes[0].plot(np.arange(count), np.arange(count))
        level, (own,) = axes[1].axhline(1.0), axes[1].plot(np.arange(5), np.arange(5), "s")
    assert (line.get_marker() == "o") == marked
    assert level.get_marker() == "None" and own.get_marker() == "s"


def facing(azimuth, slope):
    """A plane that falls towards an azimuth [degrees from north, clockwise] by a slope [degrees]."""
    x, y = np.meshgrid(np.arange(5) * 2.0, np.arange(4) * 2.0)
    away = x * np.sin(np.radians(azimuth)) + y * np.cos(np.radians(azimuth))
    return hillshade(Raster(x[0], y[:, 0], -away * np.tan(np.radians(slope))))


def test_ground_is_the_darker_the_more_it_turns_away_from_the_north_west():
    light = terrain_plots.LIGHT.direction
    assert light == pytest.approx([-0.5, 0.5, np.sqrt(0.5)])
    assert facing(315.0, 45.0) == pytest.approx(np.ones((4, 5)))
    assert facing(0.0, 0.0) == pytest.approx(np.full((4, 5), 0.5 + 0.5 * np.sqrt(0.5)))
    shades = [facing(azimuth, 45.0).mean() for azimuth in (315, 270, 225, 180, 135)]
    assert shades == sorted(shades, reverse=True) and shades[-1] == pytest.approx(0.5)
    assert facing(90.0, 45.0).mean() == pytest.approx(0.5 + 0.25 * (1 - np.sqrt(0.5)))  # of the light's length 1
