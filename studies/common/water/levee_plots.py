"""Pictures of the study levee."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from particle_player import boundary_edges

from ..earthquake.plots import ground_figure
from ..field_plots import near_raster
from ..figures import curve_figure, paper_style, save_figure
from ..history import History
from ..plots import CURVES, DISPLACEMENT, WIDTH, colour_limits, draw_bar


def save_liquefaction(path: Path, history: History) -> None:
    """Excess pore pressure ratios above, settlement of the crest and spreading of the toes below, over time."""
    time = history["time_s"]
    ratios = {
        "free field": "pore_pressure_ratio_free_field",
        "below a toe": "pore_pressure_ratio_below_toe",
        "below the crest": "pore_pressure_ratio_below_crest",
    }
    moved = {
        "settlement of the crest": "crest_settlement_m",
        "of the free field": "ground_settlement_m",
        "spreading of the toes": "spreading_of_toes_m",
    }
    with curve_figure(path, (WIDTH, 4.8), rows=2) as axes:
        for panel, curves, label in zip(
            axes, (ratios, moved), ("Excess pore pressure ratio\n$1 - p'/p'_0$", "Displacement [m]")
        ):
            for k, (name, column) in enumerate(curves.items()):
                panel.plot(time, history[column], color=CURVES[k], linewidth=0.9, label=name)
            panel.set(ylabel=label, xmargin=0)
            low, high = panel.get_ylim()
            panel.set_ylim(low, high + 0.25 * (high - low))  # space for the names above the curves
            panel.legend(ncols=3, loc="upper left", fontsize=8)
        axes[0].axhline(1.0, color="#b0b0b0", linewidth=0.8, zorder=0)
        axes[-1].set_xlabel("Time [s]")


def save_displacement(path: Path, frame: Mapping[str, np.ndarray]) -> None:
    """Resting cells, displaced on an enlarged scale, in the colours of their displacement, with arrows and their outline before.

    Args:
        frame: of all rows, with ``time`` [s], the ``mesh_corners`` (n, 6) [m] of each row's cell without its displacement, as in
            the mesh to the last digit, and the vectors ``moved`` (n, 2) [m] of this.
    """
    points, cells = np.unique(frame["mesh_corners"].reshape(-1, 2), axis=0, return_inverse=True)
    cells = cells.reshape(-1, 3)
    moved = _means_at_points(cells, frame["moved"], len(points))
    lengths = np.linalg.norm(moved, axis=1)
    enlarged = enlargement(lengths.max(), np.ptp(points[:, 0]))
    shown, limits = points + enlarged * moved, colour_limits(DISPLACEMENT, [lengths])
    longer = 1.4 * _spacing(points) / limits[1]  # arrows over displacements
    with paper_style():
        every = np.concatenate([points, shown, shown + longer * moved])
        figure, axes, bar = ground_figure(every.min(axis=0), every.max(axis=0))
        axes.tripcolor(*shown.T, cells, lengths, cmap=DISPLACEMENT.colours, vmin=limits[0], vmax=limits[1], shading="gouraud",
                       rasterized=True)  # fmt: skip
        sides = boundary_edges(cells)
        axes.add_collection(LineCollection(shown[sides], colors="black", linewidths=0.8))
        axes.add_collection(
            LineCollection(
                points[sides], colors="#404040", linewidths=0.7, linestyles="dashed", label="before the earthquake"
            )
        )
        _arrows(axes, shown, moved, longer, limits[1])
        axes.legend(loc="lower right", bbox_to_anchor=(0.86, 1.0), borderaxespad=0.1, fontsize=8)
        scale = f", enlarged {enlarged:g} times" if enlarged > 1 else ""
        axes.set_title(f"$t$ = {frame['time']:.1f} s; displacements{scale}", loc="left", pad=4)
        draw_bar(figure, bar, DISPLACEMENT, limits)
        save_figure(figure, path)


def _means_at_points(cells: np.ndarray, values: np.ndarray, count: int) -> np.ndarray:
    """Means at each of `count` points of the values (n, k) of the cells (n, 3) around it: (count, k)."""
    sums, around = np.zeros((count, values.shape[1])), np.bincount(cells.ravel(), minlength=count)
    np.add.at(sums, cells.ravel(), np.repeat(values, 3, axis=0))
    return sums / around[:, None]


def enlargement(largest: float, width: float) -> float:
    """How many times displacements are enlarged so that the largest is up to a thirtieth of the width: 1, 2, 5, 10, 20, ..."""
    return max(1.0, round_below(width / 30 / largest)) if largest > 0 else 1.0


def round_below(value: float) -> float:
    """The largest number 1, 2 or 5 times a power of ten that is not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value) + 1e-9)
    return float(power * max(k for k in (1, 2, 5) if k * power <= value * (1 + 1e-9)))


def _spacing(points: np.ndarray) -> float:
    """Distance of arrows [m]."""
    return np.ptp(points[:, 0]) / 24


def _arrows(axes: Axes, points: np.ndarray, moved: np.ndarray, longer: float, largest: float) -> None:
    """Arrows at points that are nearest to a raster, `longer` times their displacement, and one above that gives their scale.

    largest: displacement at the end of the colour scale [m]; where it is far smaller there are no arrows
    """
    nodes = near_raster(points, _spacing(points))
    nodes = nodes[np.linalg.norm(moved[nodes], axis=1) > 0.08 * largest]
    arrows = axes.quiver(*points[nodes].T, *moved[nodes].T, angles="xy", scale_units="xy", scale=1 / longer, width=0.0026,
                         color="white", edgecolor="#202020", linewidth=0.4, zorder=4)  # fmt: skip
    key = round_below(0.8 * largest)
    axes.quiverkey(arrows, 0.91, 1.055, key, f"{key:g} m", labelpos="E", fontproperties={"size": 8})
