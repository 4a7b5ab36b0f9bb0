"""Pictures that several cases share: computed values as points, expected values as lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from common.figures import curve_figure
from common.plots import CURVES, WIDTH
from matplotlib.ticker import FuncFormatter, LogLocator

Curve = tuple[np.ndarray, np.ndarray]
COLOURS = (*CURVES, "#1a9c9c", "#c04f9e", "#8c6d31")
LINES = ("-", "--", ":", "-.")


def _legend(axes: plt.Axes) -> None:
    """Inside, or above when it would cover the curves."""
    many = len(axes.get_legend_handles_labels()[0]) > 5
    axes.legend(fontsize=8, **({"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "ncols": 2} if many else {}))


def save_comparison(
    path: Path,
    computed: Mapping[str, Curve],
    expected: Mapping[str, Curve],
    labels: tuple[str, str],
    *,
    limits: tuple[tuple[float | None, float | None], tuple[float | None, float | None]] = ((None, None), (None, None)),
    joined: bool = False,
    equal: bool = False,
    logarithmic: bool = False,
) -> None:
    """Draw computed points over expected lines.

    Args:
        computed: (horizontal, vertical) values by name, as shown; in colours, and small where there are thousands.
        expected: likewise; black lines.
        labels: of the axes, with units.
        limits: of the axes; None to fit.
        joined: lines through the computed points, of which some dozen are marked.
        equal: one scale for both axes.
        logarithmic: horizontal axis.
    """
    with curve_figure(path, (4.9, 3.4)) as axes:
        if logarithmic:
            axes.set_xscale("log")
        for k, (name, (x, y)) in enumerate(computed.items()):
            look = {
                "marker": "os^vDP"[k % 6],
                "markersize": 3 if len(x) < 1000 else 1,
                "linestyle": "-" if joined else "none",
                "linewidth": 1.0,
                "markevery": max(1, len(x) // 12) if joined else 1,
            }
            axes.plot(x, y, color=COLOURS[k % len(COLOURS)], label=name, **look)
        for k, (name, (x, y)) in enumerate(expected.items()):
            axes.plot(x, y, LINES[k % 4], color="black", linewidth=0.9, label=name)
        axes.set(xlabel=labels[0], ylabel=labels[1], xlim=limits[0], ylim=limits[1])
        if equal:
            axes.set_aspect("equal")
        _legend(axes)


def save_refinement(
    path: Path, numbers: Sequence[int], label: str, panels: Mapping[str, Mapping[str, Sequence[float]]]
) -> None:
    """Draw errors over a number of cells, both logarithmic.

    Args:
        numbers: of cells, rising; label: what they count.
        panels: errors by the name of their curve, by the label of their panel.
    """
    with curve_figure(path, (WIDTH if len(panels) > 1 else 4.9, 3.0), panels=len(panels)) as row:
        row = np.atleast_1d(row)
        for axes, (what, curves) in zip(row, panels.items()):
            for k, (name, values) in enumerate(curves.items()):
                axes.loglog(
                    numbers, values, "os^vD"[k % 5] + "-", color=CURVES[k % len(CURVES)], markersize=4, label=name
                )
            axes.set_xticks(numbers, [f"{number}" for number in numbers])
            axes.minorticks_off()
            axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
            axes.set(xlabel=label, ylabel=what)
        _legend(row[0])
