"""Pictures of the study locking: error over the cell size, and the mean stress with and without locking."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from common.figures import save_figure
from common.plots import CURVES, WIDTH, Quantity, colour_limits, draw_bar, paper_style
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter

from .runs import Field

MARKERS = {"plain": ("s", CURVES[1]), "NMD": ("o", CURVES[0]), "Taylor-Hood": ("^", CURVES[2])}
LEVELS = {1 / 3: "a third", 0.05: "5 %"}
LINES = ("-", "--", "-.", ":")


def save_errors(path: Path, rows: Sequence[Mapping], title: str) -> None:
    """Draw the error over the cell size, one panel for each scheme.

    Args:
        rows: with scheme, elements, poisson, cell_size_m and error; no curve is drawn where errors are zero or nan.
    """
    schemes = list(dict.fromkeys(row["scheme"] for row in rows))
    poissons = list(dict.fromkeys(row["poisson"] for row in rows))
    with paper_style():
        width = WIDTH if len(schemes) > 1 else 4.6
        figure, panels = plt.subplots(1, len(schemes), figsize=(width, 3.6), sharey=True, squeeze=False)
        figure.subplots_adjust(left=0.82 / width, right=1 - 0.45 / width, bottom=0.24, top=0.93, wspace=0.05)
        for axes, scheme in zip(panels[0], schemes):
            _errors(axes, [row for row in rows if row["scheme"] == scheme], poissons)
            axes.set_title(f"{title}, {scheme}", loc="left")
        panels[0][0].set_ylabel("Error, relative")
        for level, name in LEVELS.items():
            panels[0][-1].annotate(name, (1.02, level), xycoords=("axes fraction", "data"), fontsize=8, va="center")
        shown = [
            Line2D([], [], color=colour, marker=marker, markersize=4, label=name)
            for name, (marker, colour) in MARKERS.items()
        ]
        shown += [Line2D([], [], color="black", linestyle=line, linewidth=1.1, label=f"$\\nu$ = {poisson:.9g}")
                  for poisson, line in zip(poissons, LINES)]  # fmt: skip
        figure.legend(handles=shown, loc="lower center", ncols=4, fontsize=8, columnspacing=1.5, handlelength=2.4)
        save_figure(figure, path)


def _errors(axes: Axes, rows: Sequence[Mapping], poissons: Sequence[float]) -> None:
    for elements, (marker, colour) in MARKERS.items():
        for poisson, line in zip(poissons, LINES):
            mine = [row for row in rows if row["elements"] == elements and row["poisson"] == poisson and row["error"]]
            axes.loglog([row["cell_size_m"] for row in mine], [row["error"] for row in mine], marker + line, color=colour,
                        markersize=4, linewidth=1.1)  # fmt: skip
    for level in LEVELS:
        axes.axhline(level, color="#707070", linewidth=0.7)
    sizes = sorted({row["cell_size_m"] for row in rows})
    axes.set_xticks(sizes, [f"{size:.3g}" for size in sizes])
    axes.minorticks_off()
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
    axes.set_xlabel("Cell size [m]")
    axes.tick_params(top=True, right=True, which="both")
    axes.grid(linewidth=0.3, color="#d0d0d0")


def save_pressures(path: Path, fields: Mapping[str, Field], unit: tuple[float, str], title: str) -> None:
    """Draw the mean stress in the cells side by side, in one colour scale: that with NMD.

    Args:
        fields: stresses by the name of their panel, "NMD" among them; that of locked triangles is larger by orders.
        unit: what the stress is divided by [Pa], and its name.
    """
    quantity = Quantity(f"Mean stress over {unit[1]}", "-", scale=1 / unit[0], colours="viridis")
    limits = colour_limits(quantity, [fields["NMD"].mean_stress])
    points = fields["NMD"].corners.reshape(-1, 2)
    lower, upper = points.min(axis=0), points.max(axis=0)
    margin = 0.03 * (upper - lower).max()
    lower, upper = lower - margin, upper + margin
    width = (WIDTH - 0.75) / len(fields)
    height = width * (upper[1] - lower[1]) / (upper[0] - lower[0])
    total = height + 1.25
    with paper_style():
        figure, panels = plt.subplots(1, len(fields), figsize=(WIDTH, total), sharey=True)
        figure.subplots_adjust(
            left=0.55 / WIDTH, right=1 - 0.1 / WIDTH, bottom=1.0 / total, top=1 - 0.25 / total, wspace=0.03
        )
        for axes, (name, field) in zip(panels, fields.items()):
            axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), aspect="equal", xlabel="$x$ [m]")
            cells = PolyCollection(
                field.corners, cmap=quantity.colours, norm=Normalize(*limits), edgecolors="face", linewidths=0.1
            )
            cells.set_array(quantity.scale * field.mean_stress)
            axes.add_collection(cells)
            low, high = (np.percentile(quantity.scale * field.mean_stress, percent) for percent in (1, 99))
            axes.set_title(f"{name}: {low:.3g} to {high:.3g}", loc="left", pad=4)
        panels[0].set_ylabel("$y$ [m]")
        bar = figure.add_axes((0.25, 0.5 / total, 0.5, 0.11 / total))
        draw_bar(figure, bar, quantity, limits)
        bar.set_xlabel(f"{quantity.label}; {title}", labelpad=2)
        save_figure(figure, path)
