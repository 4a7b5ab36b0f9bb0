"""Places in the way of a run-out, such as houses, at which its thickness and speed are recorded and drawn."""

from __future__ import annotations

import csv
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

import mpm_core as mpm
from fenics_bridge.terrain import Raster, SlideMaps

from ..figures import curve_figure
from ..history import History
from ..plots import CURVES


@dataclass(frozen=True)
class Places:
    """Places by their names."""

    names: list[str] = field(default_factory=list)
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    """[m], shape (n, 2)"""

    @property
    def columns(self) -> list[str]:
        """Columns of a history."""
        return [
            f"{kind}_{name}_{unit}" for name in self.names for kind, unit in (("thickness", "m"), ("speed", "m_per_s"))
        ]

    def row(self, maps: SlideMaps) -> dict[str, float]:
        """Thickness and speed at the places now, by column. Collective."""
        if not self.names:
            return {}
        return dict(zip(self.columns, np.stack(maps.at(self.points), axis=1).ravel(), strict=True))


def read_places(path: Path, ground: Raster) -> Places:
    """Places of a CSV file with a name, x and y [m] in each row; a first row of headings is left out.

    Raises:
        InputError: a row that is not so, a name that occurs twice, or a place that is not on the ground.
    """
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            rows = [
                (number, row) for number, row in enumerate(csv.reader(file), 1) if any(word.strip() for word in row)
            ]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise mpm.InputError(f"--places: {path} cannot be read: {error}") from None
    places = Places([], np.empty((0, 2)))
    for number, row in rows:
        numbers = [_number(word) for word in row[1:3]]
        if number == rows[0][0] and len(row) == 3 and not np.isfinite(numbers).any():
            continue
        if len(row) != 3 or not np.isfinite(numbers).all() or not row[0].strip():
            raise mpm.InputError(
                f"--places: line {number} of {path} is '{','.join(row)}', expected a name, x and y in metres, divided by commas"
            )
        name = row[0].strip()
        if name in places.names:
            raise mpm.InputError(
                f"--places: line {number} of {path} has the name '{name}' again, expected another one for each place"
            )
        x, y = numbers
        if not (ground.x[0] <= x <= ground.x[-1] and ground.y[0] <= y <= ground.y[-1]):
            raise mpm.InputError(
                f"--places: '{name}' is at x {x:.10g} m, y {y:.10g} m, expected a place on the ground, x {ground.x[0]:.10g} to "
                f"{ground.x[-1]:.10g} m and y {ground.y[0]:.10g} to {ground.y[-1]:.10g} m"
            )
        places = Places([*places.names, name], np.vstack([places.points, numbers]))
    if not places.names:
        raise mpm.InputError(f"--places: {path} has no places, expected a name, x and y in metres in each row")
    return places


def _number(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return np.nan


def results_at(places: Places, history: History) -> dict[str, dict[str, float | None]]:
    """By place: when the slide arrives, None where it does not; its largest thickness and speed, and its thickness in the end."""
    found = {}
    for name in places.names:
        thickness, speed = history[f"thickness_{name}_m"], history[f"speed_{name}_m_per_s"]
        reached = np.flatnonzero(thickness > 0)
        found[name] = {
            "arrival_s": float(history["time_s"][reached[0]]) if len(reached) else None,
            "largest_thickness_m": float(thickness.max()), "largest_speed_m_per_s": float(speed.max()),
            "final_thickness_m": float(thickness[-1]),
        }  # fmt: skip
    return found


def draw_places(path: Path, places: Places, history: History) -> None:
    """Thickness and speed over time at all places."""
    with curve_figure(path, size=(5.2, 4.6), rows=2) as (upper, lower):
        for k, name in enumerate(places.names):
            colour = CURVES[k % len(CURVES)]
            style = "-" if k < len(CURVES) else "--"
            thickness = history[f"thickness_{name}_m"]
            label = name if thickness.any() else f"{name} (not reached)"
            upper.plot(history["time_s"], thickness, style, color=colour, label=label)
            lower.plot(history["time_s"], history[f"speed_{name}_m_per_s"], style, color=colour)
        upper.set(ylabel="Thickness [m]", ylim=(0, None))
        lower.set(ylabel="Mean speed [m/s]", xlabel="Time [s]", ylim=(0, None), xlim=(0, None))
        upper.legend(fontsize=8)
