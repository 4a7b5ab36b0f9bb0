"""Pictures of seepage: total head in colour with its contours, flow lines, and the water table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from matplotlib.tri import LinearTriInterpolator, Triangulation

import fenics_bridge as bridge
from fenics_bridge import water
from fenics_bridge.water.boundary import value_at

from .animation import save_figure_film
from .field_plots import Field, gathered
from .figures import save_figure
from .plots import ROUND_TICKS, Quantity, paper_style

HEAD = Quantity("Total head", "m", colours="viridis")
PRESSURE = Quantity("Pore pressure", "kPa", scale=1e-3, colours="viridis")
SATURATION = Quantity("Degree of saturation", "-", colours="viridis")
TABLE = "#1f6fd0"


@dataclass
class FlowPicture:
    """A flow for pictures, on the first rank.

    head: pressure head at the corners of all cells [m]; velocity: at the corners too, averaged over cells [m/s]; saturation [-]
    unit_weight: of water [N/m3]; levels: standing water, lines (k, 2) from point to point [m]
    """

    name: str
    head: Field
    velocity: np.ndarray
    saturation: np.ndarray
    unit_weight: float
    levels: list[np.ndarray] = field(default_factory=list)

    @property
    def total(self) -> np.ndarray:
        """Total head at the corners [m]."""
        return self.head.values[:, 0] + self.head.points[:, 1]

    def values(self, quantity: Quantity) -> np.ndarray:
        """HEAD, PRESSURE or SATURATION at the corners, as shown."""
        if quantity is SATURATION:
            return np.minimum(self.saturation, 1 - 1e-9)  # full soil has one colour, whatever rounding adds
        return self.total if quantity is HEAD else quantity.scale * self.unit_weight * self.head.values[:, 0]


def flow_picture(flow: water.Seepage, name: str, reservoirs: Sequence[tuple] = ()) -> FlowPicture | None:
    """The flow as it is now; None but on the first rank. Collective.

    Args:
        reservoirs: to be shown: (condition, x, y), with the line of the ground below each.
    """
    head, velocity = gathered(flow.pressure_head), gathered(bridge.nodal_average(flow.velocity()))
    saturation = gathered(flow.saturation())
    if head is None or velocity is None or saturation is None:
        return None
    levels = [_level(value_at(condition.level, flow.time), x, y) for condition, x, y in reservoirs]
    return FlowPicture(name, head, velocity.values, saturation.values[:, 0], flow.unit_weight, levels)


def _level(level: float, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The surface of the water above the ground: (k, 2) [m], not a number where there is none."""
    along = np.linspace(x[0], x[-1], 1000)
    return np.column_stack([along, np.where(np.interp(along, x, y) < level, level, np.nan)])


MOST_PANELS = 4


def few(pictures: Sequence[FlowPicture]) -> list[FlowPicture]:
    """The first and the last picture and some between them, `MOST_PANELS` at most."""
    chosen = np.unique(np.linspace(0, len(pictures) - 1, MOST_PANELS).round().astype(int))
    return [pictures[k] for k in chosen]


def dries(pictures: Sequence[FlowPicture]) -> bool:
    """Whether soil is anywhere so dry that a picture of its saturation shows something."""
    return min(picture.saturation.min() for picture in pictures) < 0.99


def save_flow(path: Path, pictures: Sequence[FlowPicture], quantity: Quantity = HEAD) -> None:
    """Draw a panel for each flow, above one another, with one scale of the quantity."""
    with paper_style():
        figure = _figure(pictures, quantity, _scales(pictures, quantity))
        save_figure(figure, path)


def save_flow_film(path: Path, pictures: Sequence[FlowPicture], quantity: Quantity = HEAD) -> Path:
    """Draw a film of flows in time, with one scale of the quantity; the suffix is that of `save_film`."""
    scales = _scales(pictures, quantity)
    return save_figure_film(path, pictures, lambda picture: _figure([picture], quantity, scales))


def _scales(pictures: Sequence[FlowPicture], quantity: Quantity) -> tuple[tuple[float, float], float]:
    """Limits of the quantity as shown, and the largest velocity [m/s], of all pictures."""
    every = np.concatenate([picture.values(quantity) for picture in pictures])
    ticks = ROUND_TICKS.tick_values(every.min(), every.max())
    return (ticks[0], ticks[-1]), max(float(np.linalg.norm(one.velocity, axis=1).max()) for one in pictures)


def _figure(pictures: Sequence[FlowPicture], quantity: Quantity, scales: tuple[tuple[float, float], float]) -> Figure:
    """A panel for each flow, above one another."""
    points = pictures[0].head.points
    low, high = points.min(axis=0), points.max(axis=0)
    limits, fastest = scales
    aspect, levels = (high[1] - low[1]) / (high[0] - low[0]), np.linspace(*limits, 21)
    figure, panels = plt.subplots(len(pictures), 1, figsize=(6.9, len(pictures) * (5.8 * aspect + 0.35) + 0.4), sharex=True,
                                  squeeze=False, layout="constrained")  # fmt: skip
    table = False
    for axes, picture in zip(panels[:, 0], pictures):
        triangles = Triangulation(*picture.head.points.T, picture.head.cells)
        axes.tricontourf(triangles, picture.values(quantity), levels, cmap=quantity.colours, extend="both")
        values, lines = picture.values(quantity), levels[1:-1]
        if np.any((lines > values.min()) & (lines < values.max())):  # matplotlib warns of none
            axes.tricontour(triangles, values, lines, colors="black", linewidths=0.35, alpha=0.6)
        _flow_lines(axes, triangles, picture, (low, high), fastest)
        pressure_head = picture.head.values[:, 0]
        if pressure_head.min() < 0 < pressure_head.max():
            axes.tricontour(triangles, pressure_head, [0.0], colors=TABLE, linewidths=1.8)
            table = True
        for line in picture.levels:
            axes.plot(*line.T, color=TABLE, linewidth=1.8)
        axes.add_collection(LineCollection(picture.head.outline, colors="black", linewidths=0.8))
        axes.set_title(picture.name, loc="left", pad=3)
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]), ylabel="$y$ [m]")
    panels[-1, 0].set_xlabel("$x$ [m]")
    if table:
        panels[0, 0].legend(handles=[Line2D([], [], color=TABLE, linewidth=1.8, label="water table")], loc="lower right",
                            bbox_to_anchor=(1.0, 1.0), borderaxespad=0.1, frameon=False, fontsize=8)  # fmt: skip
    bar = figure.colorbar(
        ScalarMappable(Normalize(*limits), quantity.colours), ax=panels[:, 0].tolist(), shrink=0.7, pad=0.01
    )
    bar.set_label(quantity.label)
    return figure


def _flow_lines(axes, triangles: Triangulation, picture: FlowPicture, box: tuple, fastest: float) -> None:
    """Flow lines through the saturated soil, where water moves at all.

    fastest: velocity in all pictures [m/s]; a millionth of it is round-off in water at rest
    """
    low, high = box
    x, y = (np.linspace(a, b, n) for a, b, n in zip(low, high, (240, 120)))
    grid = np.meshgrid(x, y)
    u, v, p = (LinearTriInterpolator(triangles, values)(*grid)
               for values in (*picture.velocity.T, picture.head.values[:, 0]))  # fmt: skip
    speed = np.hypot(u, v)
    if not speed.max() > 1e-6 * fastest:
        return
    still = speed.mask | (speed.filled(0) < 1e-4 * speed.max()) | (p.filled(-1) < 0)
    drawn = axes.streamplot(x, y, np.ma.array(u, mask=still), np.ma.array(v, mask=still), color="white", linewidth=0.6,
                            density=0.9, arrowsize=0.6)  # fmt: skip
    drawn.lines.set_path_effects([withStroke(linewidth=1.5, foreground="#404040")])  # white alone is lost on yellow
