"""The water table in pictures: a line with the inverted triangle of drawings, in the soil and over standing water."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from fenics_bridge.water.soils import WATER_WEIGHT

TABLE = "#1f6fd0"
WIDTH, MARKER = 1.6, 6.0
"""Of the line, and of the triangle over it [points]"""
HIGHEST = 1 / 3
"""Depth of water over a body that a picture shows, over the height of the body"""
MARGIN = 0.06
"""Height shown above that water, over that of the body"""


def zero_line(points: np.ndarray, cells: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Where a quantity that is linear in triangles passes through zero: segments (k, 2, 2), in the unit of the points.

    Args:
        points: (n, 2); cells: (m, 3) rows of points; values: (n,).
    """
    corners, at = points[cells], values[cells]
    cut = (at < 0).any(axis=1) & (at >= 0).any(axis=1)
    corners, at = corners[cut], at[cut]
    after = np.roll(at, -1, axis=1)
    crossed = (at < 0) != (after < 0)  # two sides of each triangle
    part = at[crossed] / (at[crossed] - after[crossed])
    start, end = corners[crossed], np.roll(corners, -1, axis=1)[crossed]
    return (start + part[:, None] * (end - start)).reshape(-1, 2, 2)


def polyline_segments(line: np.ndarray) -> np.ndarray:
    """Segments (k, 2, 2) of a line (n, 2) from point to point, without those that have an end that is not a number."""
    segments = np.stack([line[:-1], line[1:]], axis=1)
    return segments[np.isfinite(segments).all(axis=(1, 2))]


def level_line(
    pore_pressure: Callable[[np.ndarray], np.ndarray], lower: Sequence[float], upper: Sequence[float]
) -> np.ndarray:
    """The level of water at rest, such as that of `fenics_bridge.hydrostatic`: segments (k, 2, 2) [m], none where it is dry.

    Args:
        pore_pressure: function of positions (n, 2) [m] that returns pore pressures (n,) [Pa].
        lower, upper: corners of the body [m], to whose bottom the water reaches.
    """
    along = np.linspace(lower[0], upper[0], 400)
    pressure = np.broadcast_to(pore_pressure(np.column_stack([along, np.full(400, lower[1])])), 400)
    level = np.where(pressure > 0, lower[1] + pressure / WATER_WEIGHT, np.nan)
    return polyline_segments(np.column_stack([along, level]))


def top_with_water(lower: float, upper: float, waters: Iterable[np.ndarray]) -> float:
    """Height up to which a picture of a body shows water that stands over it, up to a third of the height of the body [m].

    Args:
        lower, upper: of the body [m].
        waters: segments (k, 2, 2) [m], may be none.
    """
    levels = np.concatenate([water[..., 1].ravel() for water in waters] or [[]])
    shown = levels[(levels > upper) & (levels <= upper + HIGHEST * (upper - lower))]
    return float(shown.max() + MARGIN * (upper - lower)) if len(shown) else upper


def draw_water_table(axes: Axes, segments: np.ndarray) -> bool:
    """Draw the water table over everything else, with one triangle that stands on it near the right of the picture.

    Args:
        segments: (k, 2, 2) [m], may be none; the limits of the axes must be set.

    Returns:
        Whether any of it lies within the picture.
    """
    # Not by a stroke, which each segment would have over the one before it.
    for colour, wide in (("white", WIDTH + 0.9), (TABLE, WIDTH)):
        axes.add_collection(LineCollection(segments, colors=colour, linewidths=wide, capstyle="round", zorder=5))
    (left, right), (bottom, top), middle = axes.get_xlim(), axes.get_ylim(), segments.mean(axis=1)
    seen = middle[np.all((middle >= (left, bottom)) & (middle <= (right, top)), axis=1)]
    if len(seen):
        place = seen[np.argmin(np.abs(seen[:, 0] - (left + 0.88 * (right - left))))]
        raised = axes.transData + ScaledTranslation(0, 0.5 * (MARKER + WIDTH) / 72, axes.figure.dpi_scale_trans)
        axes.plot(*place, marker="v", color=TABLE, markersize=MARKER, markeredgecolor="white", markeredgewidth=0.6,
                  linestyle="none", transform=raised, zorder=6, clip_on=False)  # fmt: skip
    return len(seen) > 0


def water_legend(axes: Axes, below: bool = False) -> None:
    """Name the line above the upper right corner of a panel, beside whatever legend the panel has, or below a narrow one."""
    place = (
        {"loc": "upper left", "bbox_to_anchor": (-0.5, -0.12)}
        if below
        else {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0)}
    )
    handle = Line2D([], [], color=TABLE, linewidth=WIDTH, marker="v", markersize=MARKER - 1)
    legend = Legend(axes, [handle], ["water table"], **place, borderaxespad=0.1, frameon=False, fontsize=8)  # fmt: skip
    axes.add_artist(legend)
    legend.set_clip_on(False)  # what is clipped has no space in the layout
