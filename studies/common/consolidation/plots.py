"""Pictures of consolidation: excess pore pressure on the deformed ground, settlements over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.tri import LinearTriInterpolator, Triangulation

from particle_player import axis_labels, boundary_edges

from ..animation import save_figure_film
from ..field_plots import Field
from ..figures import curve_figure, label_axes, panel_figure, save_figure
from ..plots import CURVES, MEMBER, ROUND_TICKS, Quantity, paper_style

EXCESS = Quantity("Excess pore pressure", "kPa", scale=1e-3, colours="viridis")
DECADES = 3
"""Tenfold times from the first step to the end, from which on the time is drawn by its logarithm also where soil comes in stages"""
LEFT = 0.05
"""Of the largest excess pore pressure: once no more is left, primary consolidation counts as complete"""


@dataclass
class ExcessPicture:
    """Excess pore pressure [Pa] at a time, and displacements of the corners (n, 2) [m], on the first rank.

    members: nodes (k, 2) [m] of each structural member, and their displacements [m]
    soils: number of the soil of each cell of `excess`, whose borders are drawn; None to draw none
    """

    name: str
    excess: Field
    moved: np.ndarray
    members: Sequence[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    soils: np.ndarray | None = None

    @property
    def borders(self) -> np.ndarray:
        """Sides of cells around each soil: rows of points (k, 2)."""
        if self.soils is None:
            return np.empty((0, 2), dtype=int)
        cells = self.excess.cells
        return np.concatenate([boundary_edges(cells[self.soils == number]) for number in np.unique(self.soils)])


@dataclass(frozen=True)
class ExcessScale:
    """What pictures of one run have in common: limits of the excess pressure as shown, and a factor of the displacements."""

    limits: tuple[float, float]
    enlarged: float

    @property
    def title(self) -> str:
        """What the pictures say of the factor."""
        return "Displacements to scale" if self.enlarged == 1 else f"Displacements magnified {self.enlarged:g} times"

    @classmethod
    def of(cls, pictures: Sequence[ExcessPicture]) -> ExcessScale:
        """The largest displacement is a twentieth of the ground's height, or its true size where that is more."""
        height = np.ptp(pictures[0].excess.points[:, 1])
        largest = max(np.abs(picture.moved).max() for picture in pictures)
        every = np.concatenate([EXCESS.scale * picture.excess.values[:, 0] for picture in pictures])
        # What falls below zero by a little takes its colour.
        least = 0.0 if every.min() > -0.03 * every.max() else every.min()
        ticks = ROUND_TICKS.tick_values(least, max(every.max(), least + 1e-6))
        enlarged = max(float(f"{0.05 * height / largest:.1g}"), 1.0) if largest > 0 else 1.0
        return cls((ticks[0], ticks[-1]), enlarged)


def save_excess(path: Path, pictures: Sequence[ExcessPicture]) -> None:
    """Draw panels with one scale, side by side where the ground is higher than wide."""
    with paper_style():
        save_figure(_excess_figure(pictures, ExcessScale.of(pictures)), path)


def save_excess_film(path: Path, pictures: Sequence[ExcessPicture]) -> Path:
    """Draw a film with one scale; the suffix is that of `save_film`."""
    scale = ExcessScale.of(pictures)
    return save_figure_film(path, pictures, lambda picture: _excess_figure([picture], scale))


def _excess_figure(pictures: Sequence[ExcessPicture], scale: ExcessScale) -> Figure:
    points = pictures[0].excess.points
    low, high = points.min(axis=0), points.max(axis=0)
    aspect, count, levels = (high[1] - low[1]) / (high[0] - low[0]), len(pictures), np.linspace(*scale.limits, 21)
    figure, panels = panel_figure(count, aspect)
    for axes, picture in zip(panels.ravel(), pictures):
        _draw_excess(axes, picture, scale.enlarged, levels)
        axes.set(aspect="equal", xlim=(low[0], high[0]))
        axes.set_ylim(low[1], high[1] + 0.06 * (high[1] - low[1]))
    figure.suptitle(scale.title, fontsize=9)
    label_axes(panels, axis_labels(pictures[0].excess.half_section))
    bar = figure.colorbar(
        ScalarMappable(Normalize(*scale.limits), EXCESS.colours), ax=panels.ravel().tolist(), shrink=0.8, pad=0.01
    )
    bar.set_label(EXCESS.label)
    return figure


def _draw_excess(axes: Axes, picture: ExcessPicture, enlarged: float, levels: np.ndarray) -> None:
    """Excess pressure on the ground as it has moved, and its outline."""
    field = picture.excess
    moved = field.points + enlarged * picture.moved
    triangles, values = Triangulation(*moved.T, field.cells), EXCESS.scale * field.values[:, 0]
    axes.tricontourf(triangles, values, levels, cmap=EXCESS.colours, extend="both")
    if values.min() < levels[1] < values.max():
        axes.tricontour(triangles, values, levels[1:-1], colors="black", linewidths=0.3, alpha=0.6)
    segments = Field(moved, field.cells, field.values).outline
    axes.add_collection(
        LineCollection(
            moved[picture.borders],
            colors="white",
            linewidths=0.7,
            path_effects=[withStroke(linewidth=1.3, foreground="black")],
        )
    )
    axes.add_collection(LineCollection(segments, colors="black", linewidths=0.8))
    lines = [nodes + enlarged * displaced for nodes, displaced in picture.members]
    axes.add_collection(LineCollection(lines, colors=MEMBER, linewidths=1.6, capstyle="butt"), autolim=False)
    axes.set_title(picture.name, loc="left", pad=3, fontsize=9)


def save_isochrones(
    path: Path, x: float, pictures: Sequence[ExcessPicture], particles: Sequence[tuple[np.ndarray, np.ndarray]] = ()
) -> None:
    """Excess pore pressure over the height along a vertical line through the ground, a curve for each picture.

    Args:
        x: of the line [m].
        particles: for each picture heights [m] and excess pressures [Pa] of particles next to the line, drawn as marks.
    """
    with curve_figure(path, (4.9, 3.6)) as axes:
        for colour, picture in zip(cycle(CURVES), pictures):
            field = picture.excess
            low, high = field.points.min(axis=0), field.points.max(axis=0)
            inside = min(max(x, low[0] + 1e-6), high[0] - 1e-6)
            heights = np.linspace(low[1], high[1], 201)
            values = LinearTriInterpolator(Triangulation(*field.points.T, field.cells), field.values[:, 0])(
                np.full(201, inside), heights
            )
            axes.plot(EXCESS.scale * values, heights, color=colour, linewidth=1.1, label=picture.name.lower())
        for colour, (heights, values) in zip(cycle(CURVES), particles):
            axes.plot(EXCESS.scale * values, heights, ".", color=colour, markersize=2.5)
        axes.set(xlabel=EXCESS.label, ylabel="$y$ [m]")
        axes.set_title(
            f"$x$ = {x:g} m" + (": elements (lines), particles (dots)" if particles else ""), loc="left", pad=4
        )
        axes.legend(fontsize=8)


def by_logarithm(days: np.ndarray, stages: Sequence[float]) -> bool:
    """Whether the time is drawn on a logarithmic scale: without stages, and over more than three decades.

    Args:
        days: of the history, which begins at 0.
        stages: days at which further stages begin.
    """
    return not stages or (len(days) > 1 and days[-1] > 10**DECADES * days[1])


def end_of_primary(days: np.ndarray, largest: np.ndarray) -> float | None:
    """Day from which on less than `LEFT` of the largest excess pore pressure is left for good, or None if it is not over.

    Args:
        days: (n,) of the history.
        largest: excess pore pressure in the ground (n,) [Pa].
    """
    wet = np.flatnonzero(largest > LEFT * largest.max(initial=0.0))
    return float(days[wet[-1] + 1]) if len(wet) and wet[-1] + 1 < len(days) else None


def save_over_time(
    path: Path,
    days: np.ndarray,
    curves: Mapping[str, np.ndarray],
    label: str,
    downward: bool = False,
    particles: Mapping[str, np.ndarray] | None = None,
    stages: Sequence[float] = (),
    logarithmic: bool = True,
    primary: float | None = None,
) -> None:
    """Curves over the time, by name; particles: values beside those of the same name, as open marks.

    downward: with the vertical axis turned over, as for settlements
    stages: days at which further stages begin, which are marked
    logarithmic: scale of the time
    primary: day at which primary consolidation is complete, between it and secondary compression; None to mark none
    """
    with curve_figure(path, (4.9, 3.3)) as axes:
        if logarithmic:
            axes.set_xscale("log")
        for day in stages:
            axes.axvline(day, color="0.75", linewidth=0.7, linestyle="--", zorder=0)
        for colour, (name, values) in zip(cycle(CURVES), curves.items()):
            axes.plot(days, values, "-" if particles else "o-", color=colour, markersize=2.5, linewidth=1.1, label=name)
        for colour, (name, values) in zip(cycle(CURVES), (particles or {}).items()):
            axes.plot(
                days, values, "o", color=colour, markersize=3.5, markerfacecolor="none", label=f"{name}, particles"
            )
        axes.set(xlabel="Time [days]", ylabel=label)
        if downward:
            axes.invert_yaxis()
        if primary is not None:
            axes.axvline(primary, color="0.35", linewidth=0.9, linestyle=":", zorder=0)
            for side, word in (("right", "primary "), ("left", " secondary")):
                axes.annotate(word, (primary, 0.97), xycoords=("data", "axes fraction"), ha=side, va="top", fontsize=8)
        if len(curves) > 1 or particles:
            axes.legend(fontsize=8)
