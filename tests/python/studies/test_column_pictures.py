"""Pictures of columns: panels beside one another, of a size that can be written."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from common.field_plots import Field
from common.figures import panel_figure
from common.water.seepage_plots import HEAD, FlowPicture, _scales, save_flow


def column(width, head):
    """Flow down a column 2 m high, of two triangles, with the total head [m] at its lower and its upper end."""
    points = np.array([[0.0, 0.0], [width, 0.0], [width, 2.0], [0.0, 2.0]])
    pressure = Field(
        points,
        np.array([[0, 1, 2], [0, 2, 3]]),
        np.array([head[0], head[0], head[1], head[1]])[:, None] - points[:, 1:],
    )
    velocity = np.tile([0.0, head[0] - head[1]], (4, 1))
    return FlowPicture("After a day", pressure, velocity, np.ones(4), 9810.0, [])


@pytest.mark.parametrize("width", [20.0, 0.1, 0.01])
def test_flow_in_columns_of_any_width_is_drawn(tmp_path, width):
    """At 0.1 m four panels above one another were 460 inches high, which no file takes."""
    path = tmp_path / "flow.png"
    save_flow(path, 4 * [column(width, (0.0, 1.0))])
    high, wide = plt.imread(path).shape[:2]
    assert 0.3 < high / wide < 3


def test_low_panels_lie_above_one_another_and_high_ones_side_by_side():
    for aspect, shape in ((0.5, (3, 1)), (5.0, (1, 3))):
        figure, panels = panel_figure(3, aspect)
        plt.close(figure)
        assert panels.shape == shape


def test_water_at_rest_shows_one_head_and_not_the_round_off():
    levels, _, _ = _scales([column(1.0, (-1.0, -1.0 + 1e-13))], HEAD)
    assert levels[0] <= -1.5 and levels[-1] >= -0.5
