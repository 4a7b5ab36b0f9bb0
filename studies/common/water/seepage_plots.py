"""Pictures of seepage: total head in colour with its contours, flow lines, and the water table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.tri import LinearTriInterpolator, Triangulation

import fenics_bridge as bridge
from fenics_bridge import water
from fenics_bridge.water.boundary import value_at
from particle_player import axis_labels

from ..animation import save_figure_film
from ..field_plots import Field, gathered
from ..figures import label_axes, panel_figure, save_figure
from ..plots import MEMBER, ROUND_TICKS, Quantity, paper_style
from ..site.water_table import draw_water_table, polyline_segments, top_with_water, water_legend, zero_line

HEAD = Quantity("Total head", "m", colours="viridis")
PRESSURE = Quantity("Pore pressure", "kPa", scale=1e-3, colours="BrBG")
SATURATION = Quantity("Degree of saturation", "-", colours="viridis")
LIGHT, DARK = ("white", "#404040"), ("#303030", "white")
"""Flow lines on dark and on light colours: their own, and that around them"""
ROUND_OFF = 1e-6
"""Part of a scale by which a value may lie outside of it without an arrow at the colour bar"""
MODERATE = 50.0
"""Suction [kPa] that a scale of pore pressures shows, where there is so much"""


@dataclass
class FlowPicture:
    """A flow for pictures, on the first rank.

    head: pressure head at the corners of all cells [m]; velocity: at the corners too, averaged over cells [m/s]; saturation [-]
    unit_weight: of water [N/m3]; levels: standing water, lines (k, 2) from point to point [m]
    members: lines (n, 2) of structural members [m]
    """

    name: str
    head: Field
    velocity: np.ndarray
    saturation: np.ndarray
    unit_weight: float
    levels: list[np.ndarray] = field(default_factory=list)
    members: Sequence[np.ndarray] = ()

    def table(self) -> np.ndarray:
        """Water table in the soil, where the pressure is zero, and the surface of standing water: segments (k, 2, 2) [m]."""
        lines, head = [polyline_segments(line) for line in self.levels], self.head.values[:, 0]
        head = np.where(
            np.abs(head) > 1e-9 * np.abs(head).max(), head, 0.0
        )  # a seepage face has zero but for round-off
        return np.concatenate([zero_line(self.head.points, self.head.cells, head), *lines])

    @property
    def total(self) -> np.ndarray:
        """Total head at the corners [m]."""
        return self.head.values[:, 0] + self.head.points[:, 1]

    @property
    def moves(self) -> bool:
        """Whether water moves, beyond the round-off of water at rest."""
        return float(np.ptp(self.total)) > 1e-6 * float(np.ptp(self.head.points[:, 1]))

    def values(self, quantity: Quantity) -> np.ndarray:
        """HEAD, PRESSURE or SATURATION at the corners, as shown."""
        if quantity is SATURATION:
            return np.minimum(self.saturation, 1 - 1e-9)  # full soil has one colour, whatever rounding adds
        return self.total if quantity is HEAD else quantity.scale * self.unit_weight * self.head.values[:, 0]


def flow_picture(
    flow: water.Seepage, name: str, reservoirs: Sequence[tuple] = (), members: Sequence[np.ndarray] = ()
) -> FlowPicture | None:
    """The flow as it is now; None but on the first rank. Collective.

    Args:
        reservoirs: to be shown: (condition, x, y), with the line of the ground below each.
        members: lines (n, 2) of structural members [m].
    """
    head = gathered(flow.pressure_head, flow.geometry == bridge.Geometry.AXISYMMETRIC)
    velocity = gathered(bridge.nodal_average(flow.velocity()))
    saturation = gathered(flow.saturation())
    if head is None or velocity is None or saturation is None:
        return None
    levels = [_level(value_at(condition.level, flow.time), x, y) for condition, x, y in reservoirs]
    return FlowPicture(name, head, velocity.values, saturation.values[:, 0], flow.unit_weight, levels, members)


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


def _scales(pictures: Sequence[FlowPicture], quantity: Quantity) -> tuple[np.ndarray, float, float]:
    """Of all pictures: values at which the colours of the quantity change, as shown, largest velocity [m/s] and height shown [m]."""
    every = np.concatenate([picture.values(quantity) for picture in pictures])
    low, high = pressure_limits(pictures) if quantity is PRESSURE else (every.min(), every.max())
    if high - low < 1e-6 * max(abs(low), abs(high)):  # water at rest, but for round-off
        low, high = low - 0.5, low + 0.5
    ticks = ROUND_TICKS.tick_values(low, high)
    parts = 2 * (len(ticks) - 1) if quantity is PRESSURE else 20  # so that pressures change their colour at zero
    fastest = max(float(np.linalg.norm(one.velocity, axis=1).max()) for one in pictures)
    heights = pictures[0].head.points[:, 1]
    top = top_with_water(heights.min(), heights.max(), [picture.table() for picture in pictures])
    return np.linspace(ticks[0], ticks[-1], parts + 1), fastest, top


def pressure_limits(pictures: Sequence[FlowPicture]) -> tuple[float, float]:
    """Limits [kPa] for pore pressures, with zero between them; strong suction in a part of the dry soil is left out.

    Below the water table all pressures are shown. Above it suction is shown up to the largest pressure, up to `MODERATE`, and up to
    what half of the unsaturated soil exceeds in one of the pictures, whichever is most, as far as there is so much.
    """
    values = [picture.values(PRESSURE) for picture in pictures]
    high = max(0.0, *(v.max() for v in values))
    widespread = max(_median_suction(picture.head, v) for picture, v in zip(pictures, values))
    return max(min(0.0, *(v.min() for v in values)), -max(high, MODERATE, widespread)), high


def _median_suction(head: Field, pressure: np.ndarray) -> float:
    """Suction that half of the unsaturated soil exceeds; 0 where all is saturated. pressure: at the points of the head."""
    mean = pressure[head.cells].mean(axis=1)
    dry = mean < 0
    return -replace(head, cells=head.cells[dry]).exceeded_in(0.5, mean[dry]) if dry.any() else 0.0


def _colours(quantity: Quantity, limits: tuple[float, float]) -> Colormap:
    """Colours from limit to limit; those of pore pressure change from suction to pressure at zero."""
    colours = plt.get_cmap(quantity.colours)
    if quantity is not PRESSURE:
        return colours
    values = np.linspace(*limits, 256)
    return ListedColormap(colours(0.5 + 0.5 * values / np.abs(values).max()))


def _figure(pictures: Sequence[FlowPicture], quantity: Quantity, scales: tuple[np.ndarray, float, float]) -> Figure:
    """A panel for each flow, above one another."""
    points = pictures[0].head.points
    low, high = points.min(axis=0), points.max(axis=0)
    levels, fastest, top = scales
    aspect, limits = (top - low[1]) / (high[0] - low[0]), (levels[0], levels[-1])
    colours, norm = _colours(quantity, limits), Normalize(*limits)
    figure, panels = panel_figure(len(pictures), aspect)
    table, least = False, limits[0]
    for axes, picture in zip(panels.ravel(), pictures):
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], top))
        triangles = Triangulation(*picture.head.points.T, picture.head.cells)
        values, lines = picture.values(quantity), levels[1:-1]
        least = min(least, values.min())
        axes.tricontourf(triangles, values, levels, cmap=colours, norm=norm, extend="both")
        if np.any((lines > values.min()) & (lines < values.max())):  # matplotlib warns of none
            axes.tricontour(triangles, values, lines, colors="black", linewidths=0.35, alpha=0.6)
        _flow_lines(axes, picture, (low, high), fastest, DARK if quantity is PRESSURE else LIGHT)
        table = draw_water_table(axes, picture.table()) or table
        axes.add_collection(LineCollection(picture.head.outline, colors="black", linewidths=0.8))
        axes.add_collection(LineCollection(picture.members, colors=MEMBER, linewidths=1.6, capstyle="butt"))
        axes.set_title(picture.name, loc="left", pad=14 if aspect > 1 else 3)  # above marks of the table
    label_axes(panels, axis_labels(pictures[0].head.half_section))
    if table:
        water_legend(panels[0, 0], below=aspect > 1)
    bar = figure.colorbar(ScalarMappable(norm, colours), ax=panels.ravel().tolist(), shrink=0.7, pad=0.01,
                          extend="min" if least < limits[0] - ROUND_OFF * (limits[1] - limits[0]) else "neither")  # fmt: skip
    bar.set_label(quantity.label)
    return figure


def _flow_lines(axes: Axes, picture: FlowPicture, box: tuple, fastest: float, look: tuple[str, str]) -> None:
    """Flow lines through the saturated soil, where water moves at all.

    fastest: velocity in all pictures [m/s]; a millionth of it is round-off in water at rest
    look: colours of the lines and of what surrounds them
    """
    low, high = box
    # Matplotlib looks for the triangle of a point in meshes without two nodes at one place, as those along walls.
    places, first, number = np.unique(picture.head.points, axis=0, return_index=True, return_inverse=True)
    triangles = Triangulation(*places.T, number.ravel()[picture.head.cells])
    x, y = (np.linspace(a, b, n) for a, b, n in zip(low, high, (240, 120)))
    grid = np.meshgrid(x, y)
    u, v, p = (LinearTriInterpolator(triangles, values)(*grid)
               for values in (*picture.velocity[first].T, picture.head.values[first, 0]))  # fmt: skip
    flat = (high[1] - low[1]) / (high[0] - low[0])  # lines of a flat section would lie on one another
    speed = np.hypot(u, v)
    if not speed.max() > 1e-6 * fastest:
        return
    still = speed.mask | (speed.filled(0) < 1e-4 * speed.max()) | (p.filled(-1) < 0)
    drawn = axes.streamplot(x, y, np.ma.array(u, mask=still), np.ma.array(v, mask=still), color=look[0], linewidth=0.6,
                            density=(0.9, 0.9 * min(1.0, np.sqrt(flat))), arrowsize=0.6)  # fmt: skip
    drawn.lines.set_path_effects([withStroke(linewidth=1.5, foreground=look[1])])  # one colour alone is lost somewhere
