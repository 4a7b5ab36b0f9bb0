"""Settlement of level ground at the surface after each stage, beside a pit or above a tunnel, and the volume loss of a tunnel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..figures import Pictures, curve_figure
from ..plots import CURVES

if TYPE_CHECKING:
    from .plots import StagePicture

LEVEL = 1e-6
"""Distance from the highest point up to which ground is level with it, over the height of the ground"""
FEWEST = 5
"""Points that a surface has at least"""


def surface_points(pictures: Sequence[StagePicture]) -> np.ndarray:
    """Rows of the points of the highest level ground that is there in all stages, from left to right.

    None where a stage places soil, on which displacements begin anew.
    """
    none = np.empty(0, dtype=int)
    if not pictures or any((after.there & ~before.there).any() for before, after in zip(pictures, pictures[1:])):
        return none
    whole = pictures[0].displacement
    x, y = whole.points.T
    first, last = (np.unique(whole.cells[picture.there]) for picture in (pictures[0], pictures[-1]))
    heights = y[first]
    rows = last[y[last] > heights.max() - LEVEL * np.ptp(heights)]
    return rows[np.argsort(x[rows])] if len(rows) >= FEWEST else none


def settlements(picture: StagePicture, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places x [m] and settlements [m] of points of the surface."""
    return picture.displacement.points[rows, 0], -picture.displacement.values[rows, 1]


def gaps(picture: StagePicture, rows: np.ndarray) -> np.ndarray:
    """Whether there is no ground at the surface between each of its points and the next one, as across a pit: (n - 1,)."""
    cells = picture.displacement.cells[picture.there]
    return np.array([np.isin(cells, pair).sum(axis=1).max() < 2 for pair in zip(rows, rows[1:])])


def is_whole_width(picture: StagePicture, rows: np.ndarray) -> bool:
    """Whether the points of the surface are those of the whole width of the ground, as they must be to have all of a trough."""
    x = picture.displacement.points[:, 0]
    ground = x[picture.displacement.cells[picture.there]]
    ends = np.allclose(x[rows[[0, -1]]], (ground.min(), ground.max()), rtol=0, atol=LEVEL * np.ptp(ground))
    return bool(ends and not gaps(picture, rows).any())


def tunnel_area(before: StagePicture, now: StagePicture) -> float:
    """Area [m2] in the section of the ground that has been dug away below the surface; 0 where a pit is open to it."""
    dug = before.there & ~now.there
    corners = before.displacement.points[before.displacement.cells[dug]]
    highest = before.displacement.points[before.displacement.cells[before.there], 1].max()
    if not len(corners) or corners[..., 1].max() >= highest:
        return 0.0
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return float(abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2)


def surface_rows(pictures: Sequence[StagePicture], first: int) -> list[dict[str, float]]:
    """Results of the surface after each stage: its largest settlement and, of a tunnel, the volume of its trough and the volume loss.

    The volume loss is the volume of the trough over the area of the tunnel, which half of a section has as the whole one does; the trough is that of
    the half. Below ground that is not level over its whole width neither is known.

    Args:
        pictures: of all stages, none but on the first rank.
        first: number of the first of them from which displacements count.
    """
    rows = surface_points(pictures[first:])
    found: list[dict[str, float]] = [{} for _ in pictures]
    if not len(rows):
        return found
    for k in range(first, len(pictures)):
        x, settlement = settlements(pictures[k], rows)
        found[k]["surface_settlement_m"] = float(settlement.max())
        area = tunnel_area(pictures[0], pictures[k])
        if area > 0 and not pictures[k].displacement.half_section and is_whole_width(pictures[k], rows):
            volume = float(np.sum(np.diff(x) * (settlement[1:] + settlement[:-1]) / 2))
            found[k] |= {"trough_m3_per_m": volume, "volume_loss": volume / area}
    return found


def surface_lines(row: Mapping[str, Any]) -> list[str]:
    """What the last row of results has of a tunnel, in words."""
    if "volume_loss" not in row:
        return []
    return [
        f"{row['stage']}: trough of {row['trough_m3_per_m']:.3g} m3/m at the surface, volume loss {row['volume_loss']:.2%}"
    ]


def _with_gaps(picture: StagePicture, rows: np.ndarray) -> list[np.ndarray]:
    """Places and settlements as `settlements`, with NaN between where there is no ground, over which no curve is drawn."""
    after = 1 + np.flatnonzero(gaps(picture, rows))
    return [np.insert(values, after, np.nan) for values in settlements(picture, rows)]


def surface_picture(pictures: Sequence[StagePicture], folder: Path) -> Pictures:
    """A picture of the settlement of the surface after each stage, downwards; none without level ground, or where nothing moves."""
    rows = surface_points(pictures)
    curves = {picture.name: _with_gaps(picture, rows) for picture in pictures} if len(rows) else {}
    if not any(np.nan_to_num(settlement).any() for _, settlement in curves.values()):
        return {}

    def draw() -> None:
        with curve_figure(folder / "surface.png", (5.4, 3.0)) as axes:
            for k, (name, (x, settlement)) in enumerate(curves.items()):
                axes.plot(x, 1e3 * settlement, color=CURVES[k % len(CURVES)], linewidth=1.2, label=name)
            axes.axhline(0, color="black", linewidth=0.5)
            axes.invert_yaxis()
            axes.set(xlabel="$r$ [m]" if pictures[0].displacement.half_section else "$x$ [m]", ylabel="Settlement [mm]")
            axes.legend(fontsize=8)

    return {"surface": draw}
