"""Pictures of consolidation: excess pore pressure on the deformed ground, settlements over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.tri import Triangulation

from .field_plots import Field
from .figures import save_figure
from .plots import CURVES, ROUND_TICKS, Quantity, paper_style

EXCESS = Quantity("Excess pore pressure", "kPa", scale=1e-3, colours="viridis")


@dataclass
class ExcessPicture:
    """Excess pore pressure [Pa] at a time, and where the corners have moved (n, 2) [m], on the first rank."""

    name: str
    excess: Field
    moved: np.ndarray


def save_excess(path: Path, pictures: Sequence[ExcessPicture]) -> None:
    """Panels above one another with one scale; displacements are enlarged to a twentieth of the picture's height."""
    points = pictures[0].excess.points
    low, high = points.min(axis=0), points.max(axis=0)
    largest = max(np.abs(picture.moved).max() for picture in pictures)
    enlarged = float(f"{0.05 * (high[1] - low[1]) / largest:.1g}") if largest > 0 else 1.0
    every = np.concatenate([EXCESS.scale * picture.excess.values[:, 0] for picture in pictures])
    least = (
        0.0 if every.min() > -0.03 * every.max() else every.min()
    )  # what falls below zero by a little takes its colour
    ticks = ROUND_TICKS.tick_values(least, max(every.max(), least + 1e-6))
    limits, levels = (ticks[0], ticks[-1]), np.linspace(ticks[0], ticks[-1], 21)
    aspect = (high[1] - low[1]) / (high[0] - low[0])
    with paper_style():
        figure, panels = plt.subplots(len(pictures), 1, figsize=(6.9, len(pictures) * (5.6 * aspect + 0.4) + 0.4), sharex=True,
                                      squeeze=False, layout="constrained")  # fmt: skip
        for axes, picture in zip(panels[:, 0], pictures):
            field = picture.excess
            moved = field.points + enlarged * picture.moved
            triangles = Triangulation(*moved.T, field.cells)
            values = EXCESS.scale * field.values[:, 0]
            axes.tricontourf(triangles, values, levels, cmap=EXCESS.colours, extend="both")
            if values.min() < levels[1] < values.max():
                axes.tricontour(triangles, values, levels[1:-1], colors="black", linewidths=0.3, alpha=0.6)
            segments = Field(moved, field.cells, field.values).outline
            axes.add_collection(LineCollection(segments, colors="black", linewidths=0.8))
            axes.set_title(f"{picture.name}, displacements {enlarged:g} times", loc="left", pad=3)
            axes.set(aspect="equal", xlim=(low[0], high[0]), ylabel="$y$ [m]")
            axes.set_ylim(low[1], high[1] + 0.06 * (high[1] - low[1]))
        panels[-1, 0].set_xlabel("$x$ [m]")
        bar = figure.colorbar(
            ScalarMappable(Normalize(*limits), EXCESS.colours), ax=panels[:, 0].tolist(), shrink=0.8, pad=0.01
        )
        bar.set_label(EXCESS.label)
        save_figure(figure, path, bbox_inches="tight", pad_inches=0.06)


def save_over_time(
    path: Path, days: np.ndarray, curves: Mapping[str, np.ndarray], label: str, downward: bool = False
) -> None:
    """Curves over the logarithm of the time, by name; downward: with the vertical axis turned over, as for settlements."""
    with paper_style():
        figure, axes = plt.subplots(figsize=(4.9, 3.3), layout="constrained")
        for colour, (name, values) in zip(cycle(CURVES), curves.items()):
            axes.semilogx(days, values, "o-", color=colour, markersize=2.5, linewidth=1.1, label=name)
        axes.set(xlabel="Time [days]", ylabel=label)
        axes.tick_params(top=True, right=True, which="both")
        axes.grid(linewidth=0.3, color="#d0d0d0")
        if downward:
            axes.invert_yaxis()
        if len(curves) > 1:
            axes.legend(fontsize=8)
        save_figure(figure, path, bbox_inches="tight", pad_inches=0.06)
