"""Pictures of an earthquake: the record, motions over time, and amplification over frequency."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from ..figures import curve_figure, save_figure
from ..plots import CURVES, WIDTH, Quantity, colour_limits, discs, draw_bar, paper_style
from .motions import accelerations

Curve = tuple[np.ndarray, np.ndarray]


def _integral(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Integral, from zero, of values that are linear between times."""
    return np.append(0.0, np.cumsum(0.5 * np.diff(time) * (values[1:] + values[:-1])))


def save_record(path: Path, time: np.ndarray, acceleration: np.ndarray, velocity: np.ndarray) -> None:
    """Acceleration, velocity and displacement of a record as it is, and after its baseline correction.

    Args:
        time: (n) [s].
        acceleration: before the correction (n) [m/s2].
        velocity: after the correction (n) [m/s].
    """
    raw = _integral(time, acceleration)
    rows = (
        ("Acceleration [m/s²]", (time, acceleration), accelerations(time, velocity)),
        ("Velocity [m/s]", (time, raw), (time, velocity)),
        ("Displacement [m]", (time, _integral(time, raw)), (time, _integral(time, velocity))),
    )
    with curve_figure(path, (WIDTH, 4.6), rows=3) as axes:
        for panel, (label, before, after) in zip(axes, rows):
            panel.plot(*before, color="#b0b0b0", linewidth=1.0, label="before baseline correction")
            panel.plot(*after, color=CURVES[0], linewidth=0.9, label="after baseline correction")
            panel.set(ylabel=label, xmargin=0)
        # Above the panel: a record may have its peak anywhere
        axes[0].legend(ncols=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, fontsize=8)
        axes[-1].set_xlabel("Time [s]")
        axes[0].figure.align_ylabels(axes)


def save_motions(path: Path, accelerations: Mapping[str, Curve], displacements: Mapping[str, Curve]) -> None:
    """Accelerations [m/s2] above and displacements [m] below, over time [s], by name."""
    with curve_figure(path, (WIDTH, 4.6), rows=2) as axes:
        for panel, curves, label in zip(
            axes, (accelerations, displacements), ("Acceleration [m/s²]", "Displacement [m]")
        ):
            for k, (name, (time, values)) in enumerate(curves.items()):
                panel.plot(time, values, color=CURVES[k], linewidth=0.9, label=name)
            panel.set(ylabel=label, xmargin=0)
            low, high = panel.get_ylim()
            panel.set_ylim(low, high + 0.4 * (high - low))  # space for the names above the curves
            panel.legend(fontsize=8, loc="upper left")
        axes[-1].set_xlabel("Time [s]")
        axes[0].figure.align_ylabels(axes)


def save_amplification(path: Path, exact: Curve, found: Mapping[str, Curve]) -> None:
    """Ratios of spectra over frequency [Hz]: the closed form in black, and what was found by name."""
    with curve_figure(path, (5.2, 3.4)) as axes:
        for k, (name, (frequency, ratio)) in enumerate(found.items()):
            axes.plot(frequency, ratio, color=CURVES[k], linewidth=2.2 if k == 0 else 1.0, label=name)
        axes.plot(*exact, "--", color="black", linewidth=0.9, label="linear layers, closed form")
        axes.set(xlabel="Frequency [Hz]", ylabel="Amplification (surface over outcrop) [-]", ylim=(0, None), xmargin=0)
        axes.legend(fontsize=8)


def ground_figure(low: np.ndarray, high: np.ndarray) -> tuple[Figure, Axes, Axes]:
    """A figure for the ground from the lower to the upper corner [m]: its axes, and those of a horizontal colour bar below."""
    height, margin = WIDTH * (high - low)[1] / (high - low)[0] + 1.3, 0.02 * (high - low)[0]
    figure, (axes, bar) = plt.subplots(
        2, 1, figsize=(WIDTH, height), height_ratios=(height - 0.9, 0.12), layout="constrained"
    )
    axes.set(aspect="equal", xlabel="$x$ [m]", ylabel="$y$ [m]", xlim=(low[0] - margin, high[0] + margin),
             ylim=(low[1] - margin, high[1] + margin))  # fmt: skip
    return figure, axes, bar


def save_ground(
    path: Path, frame: Mapping[str, np.ndarray], name: str, quantity: Quantity, within: str | None = None
) -> None:
    """Resting cells as triangles and particles as discs, in the colours of a quantity.

    Args:
        frame: of all rows, with ``time`` [s], ``position`` (n, 2) [m], ``volume`` (n,) [m2], ``resting`` (n,), the
            ``corners`` (n, 6) [m] of each row's cell, and the quantity.
        name: of the quantity in the frame.
        quantity: how it is shown.
        within: name in the frame of whether a row has the quantity, (n,); others are grey. By default all have it.
    """
    values, rest = np.ma.array(quantity.scale * frame[name]), frame["resting"].astype(bool)
    if within is not None:
        values[frame[within] == 0] = np.ma.masked
    limits = colour_limits(quantity, [frame[name]])
    colours = plt.get_cmap(quantity.colours).with_extremes(bad="0.8")
    look = {"cmap": colours, "norm": Normalize(*limits), "linewidths": 0.2}
    corners = frame["corners"].reshape(-1, 3, 2)
    with paper_style():
        figure, axes, bar = ground_figure(corners.min(axis=(0, 1)), corners.max(axis=(0, 1)))
        cells = PolyCollection(corners[rest], edgecolors="face", array=values[rest], **look)
        axes.add_collection(cells)
        discs(axes, frame["position"][~rest], frame["volume"][~rest], array=values[~rest], **{**look, "linewidths": 0})
        axes.set_title(f"$t$ = {frame['time']:.1f} s; resting cells drawn as triangles", loc="left", pad=4)
        draw_bar(figure, bar, quantity, limits)
        save_figure(figure, path)
