"""Pictures of particles, background mesh and histories, ready for a paper; plane problems.

Each quantity keeps its colour map and unit everywhere (`particle_player.Quantity`), and one colour scale over time is found by
`particle_player.colour_limits`. Particles are drawn as discs that fit their volume, so that a picture shows how they fill space.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from particle_player import Quantity, Scene, axis_labels, boundary_edges, colour_limits, disc_diameter  # noqa: F401
from particle_player.scene import ROUND_TICKS

from .figures import curve_figure, paper_style, save_figure

SOIL = "#b98a5e"
GREY = "#8c8c8c"
BODY = "#1d3a5f"
"""Colour of rigid surfaces"""
MEMBER = "#c8401c"
"""Colour of structural members"""
CURVES = ("#0b559f", "#c8401c", "#2a8a4a", "#7a4fa3", "#444444", "#d49a00")
DASHES = ("-", "--", ":")
"""Of curves that are more than there are colours"""
MOST_WITHIN, IN_A_COLUMN = 5, 20
"""Names of curves within their axes, and in a column beside them, at most"""
WIDTH = 6.9  # in; a page's text width
DISPLACEMENT = Quantity("Total displacement", "m", colours="viridis")
SHEAR_STRAIN = Quantity("Accumulated plastic shear strain", "-", colours="inferno")
VERTICAL_STRESS = Quantity("Vertical stress", "kPa", scale=1e-3, colours="viridis")
PORE_PRESSURE = Quantity("Excess pore pressure", "kPa", scale=1e-3, colours="viridis")
WATER_PRESSURE = Quantity("Pore pressure", "kPa", scale=1e-3, colours="viridis")
POROSITY = Quantity("Porosity", "-", colours="cividis", least_range=0.02)
SPEED = Quantity("Speed", "m/s", colours="plasma")


def figure_with_bar(lower: np.ndarray, upper: np.ndarray, half_section: bool = False) -> tuple[Figure, Axes, Axes]:
    """A figure for a picture in equal axes that shows [lower, upper], with space for a horizontal colour bar below."""
    left, right, bottom, top, bar = 0.64, 0.18, 0.98, 0.34, 0.11  # in
    width = WIDTH - left - right
    height = np.clip(width * (upper[1] - lower[1]) / (upper[0] - lower[0]), 1.2, 6.5)
    total = bottom + height + top
    figure = plt.figure(figsize=(WIDTH, total))
    axes = figure.add_axes((left / WIDTH, bottom / total, width / WIDTH, height / total))
    bar_axes = figure.add_axes(((left + 0.2 * width) / WIDTH, 0.42 / total, 0.6 * width / WIDTH, bar / total))
    axes.set_aspect("equal")
    axes.set_xlim(lower[0], upper[0])
    axes.set_ylim(lower[1], upper[1])
    along, up = axis_labels(half_section)
    axes.set_xlabel(along, labelpad=1)
    axes.set_ylabel(up)
    return figure, axes, bar_axes


def draw_scene(axes: Axes, scene: Scene) -> None:
    """Boundary of the background mesh, and the outline of the soil at the start."""
    axes.add_collection(LineCollection(scene.boundary, colors="black", linewidths=1.0, zorder=3))
    axes.add_collection(LineCollection(scene.initial_outline, colors=GREY, linewidths=0.6, zorder=2))


def bodies_drawn(axes: Axes, segments: np.ndarray) -> LineCollection:
    """Draw rigid surfaces, as segments (k, 2, 2) [m]."""
    lines = LineCollection(segments, colors=BODY, linewidths=1.6, capstyle="round", zorder=4)
    axes.add_collection(lines)
    return lines


def discs(axes: Axes, position: np.ndarray, volume: np.ndarray, **look: object) -> EllipseCollection:
    """Particles as discs that belong to ``volume`` (per metre of thickness)."""
    diameter = disc_diameter(volume)
    collection = EllipseCollection(
        diameter, diameter, np.zeros(len(diameter)), units="xy", offsets=position, transOffset=axes.transData, **look
    )
    axes.add_collection(collection)
    return collection


def draw_bar(figure: Figure, bar_axes: Axes, quantity: Quantity, limits: tuple[float, float]) -> None:
    """The colour bar, with arrows where values beyond its ends may occur; a scale from zero has none below."""
    colours = ScalarMappable(Normalize(*limits), quantity.colours)
    extend = "max" if limits[0] == 0.0 else "both"
    bar = figure.colorbar(colours, cax=bar_axes, orientation="horizontal", extend=extend, ticks=copy(ROUND_TICKS))
    # The power of ten of small numbers, which would overlap, is written at the end of the bar.
    bar.formatter.set_powerlimits((-3, 5))
    bar.formatter.set_useMathText(True)
    bar.update_ticks()
    bar.set_label(quantity.label, labelpad=2)
    bar.outline.set_linewidth(0.5)


def save_particles(
    path: Path,
    scene: Scene,
    position: np.ndarray,
    volume: np.ndarray,
    values: np.ndarray,
    quantity: Quantity,
    *,
    limits: tuple[float, float] | None = None,
    title: str = "",
    bodies: np.ndarray | None = None,
    box: np.ndarray | None = None,
    labels: tuple[str, str] | None = None,
    legend: bool = False,
) -> None:
    """Draw particles coloured by a quantity.

    Args:
        path: of the PNG or PDF file.
        position: (n, 2), m.
        volume: (n,), m^3 per metre of thickness.
        values: (n,), SI units.
        limits: of the colour scale, from `colour_limits`; those of ``values`` if not given.
        title: stands above, for instance the time.
        bodies: segments of rigid surfaces (k, 2, 2), m.
        box: lower and upper corner of what is shown, m; all soil if not given.
        labels: of the axes, if these are not x and y or r and z.
        legend: name the grey line.
    """
    limits = limits or colour_limits(quantity, [values])
    with paper_style():
        segments = np.empty((0, 2, 2)) if bodies is None else bodies
        lower, upper = scene.limits([position], [segments]) if box is None else box
        figure, axes, bar_axes = figure_with_bar(lower, upper, scene.half_section)
        if labels is not None:
            axes.set(xlabel=labels[0], ylabel=labels[1])
        draw_scene(axes, scene)
        bodies_drawn(axes, segments)
        collection = discs(axes, position, volume, cmap=quantity.colours, norm=Normalize(*limits), linewidths=0)
        collection.set_array(quantity.scale * values)
        # Discs at the sides of the mesh reach beyond it.
        low = np.maximum(lower, scene.points.min(axis=0))
        high = np.minimum(upper, scene.points.max(axis=0))
        collection.set_clip_path(Rectangle(low, *(high - low), transform=axes.transData))
        if legend:
            axes.legend(
                handles=[Line2D([], [], color=GREY, linewidth=0.6, label="initial surface")],
                loc="upper right",
                fontsize=8,
            )
        axes.set_title(title, loc="left", pad=4)
        draw_bar(figure, bar_axes, quantity, limits)
        save_figure(figure, path)


def save_mesh(path: Path, scene: Scene, position: np.ndarray, volume: np.ndarray) -> None:
    """Draw the background mesh, whole, with the particles in it; each cell's edges and each particle show."""
    with paper_style():
        lower, upper = scene.points.min(axis=0), scene.points.max(axis=0)
        margin = 0.02 * (upper - lower).max()
        figure, axes, bar_axes = figure_with_bar(lower - margin, upper + margin, scene.half_section)
        bar_axes.remove()
        axes.triplot(*scene.points.T, scene.cells, color=GREY, linewidth=0.35, zorder=1)
        # Less than half the diameter, so that the particles stand apart and the mesh shows between them.
        discs(axes, position, 0.2 * volume, facecolors=SOIL, edgecolors="none", zorder=2)
        axes.add_collection(LineCollection(scene.boundary, colors="black", linewidths=1.0, zorder=3))
        axes.set_title(
            f"{len(scene.cells)} triangles, {int(np.sum(scene.is_soil)) if scene.is_soil is not None else len(scene.cells)}"
            f" of them filled with {len(position)} particles",
            loc="left",
            pad=4,
        )
        save_figure(figure, path)


def curve_look(number: int) -> dict[str, str]:
    """Colour and dashes of a curve among others by its number."""
    return {"color": CURVES[number % len(CURVES)], "linestyle": DASHES[number // len(CURVES) % len(DASHES)]}


def name_curves(axes: Axes, **look: object) -> None:
    """Draw the legend of curves within their axes, or beside them where there are so many that it would hide them; look: of the former."""
    count = len(axes.get_legend_handles_labels()[1])
    beside = {
        "loc": "upper left",
        "bbox_to_anchor": (1.01, 1.01),
        "fontsize": 7,
        "ncol": -(-count // IN_A_COLUMN),
        "columnspacing": 0.8,
    }
    axes.legend(**(beside if count > MOST_WITHIN else look))


def save_history(
    path: Path,
    time: np.ndarray,
    curves: Mapping[str, np.ndarray],
    label: str,
    *,
    limits: tuple[float, float] | None = None,
    dashed: Sequence[str] = (),
) -> None:
    """Draw curves over time.

    Args:
        time: s.
        curves: values by name; the names form a legend if there are several.
        label: of the vertical axis, with unit.
        limits: of the vertical axis.
        dashed: names of curves in dashes, so that one below that coincides with it is seen.
    """
    with curve_figure(path, (4.6, 3.0)) as axes:
        for k, (name, values) in enumerate(curves.items()):
            look = curve_look(k) | ({"linestyle": "--"} if name in dashed else {})
            axes.plot(time, values, label=name, **look)
        axes.set(xlabel="Time [s]", ylabel=label, xlim=(0, max(float(np.max(time, initial=0.0)), 1e-12)))
        if limits:
            axes.set_ylim(*limits)
        if len(curves) > 1:
            name_curves(axes)
