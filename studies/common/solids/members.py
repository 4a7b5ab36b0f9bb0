"""Structural members in pictures of bodies: what is seen of them in full lines, and in dashes what the soil hides."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from ..plots import MEMBER

PIECES = 200
"""Pieces of a line as long as a body of which each is seen or hidden"""
BELOW = 1e-3
"""Depth of a hidden point below the surface at least, over the diagonal of the body"""
AT_ONCE = 2_000_000
"""Pairs of points and triangles that are compared at once"""
MOST_SQUARES = 1500
"""Along a picture, in which the nearest particles are found"""
DASHES = (0, (2.2, 1.3))
NO_MEMBERS = np.empty((0, 2, 3))

Lines = Sequence[np.ndarray]


def hidden(points: np.ndarray, corners: np.ndarray, view: np.ndarray) -> np.ndarray:
    """Whether triangles lie between points and the eye.

    Args:
        points: (n, 3) [m].
        corners: of the triangles (m, 3, 3) [m].
        view: as `picture_axes` gives it.

    Returns:
        For each point (n,).
    """
    at, corners = points @ view.T, corners @ view.T
    edges = corners[:, 1:, :2] - corners[:, :1, :2]
    area = np.linalg.det(edges)
    # A triangle that is seen from its edge hides nothing.
    corners, edges, area = (each[np.abs(area) > 1e-12 * np.abs(area).max()] for each in (corners, edges, area))
    below = BELOW * np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))
    found = np.zeros(len(points), dtype=bool)
    for part in np.array_split(np.arange(len(points)), max(1, -(-len(points) * len(corners) // AT_ONCE))):
        away = at[part, None, :2] - corners[None, :, 0, :2]
        second = (edges[:, 0, 0] * away[..., 1] - edges[:, 0, 1] * away[..., 0]) / area
        first = (away[..., 0] * edges[:, 1, 1] - away[..., 1] * edges[:, 1, 0]) / area
        depth = (
            corners[:, 0, 2]
            + first * (corners[:, 1, 2] - corners[:, 0, 2])
            + second * (corners[:, 2, 2] - corners[:, 0, 2])
        )
        inside = (first >= 0) & (second >= 0) & (first + second <= 1)
        found[part] = (inside & (depth > at[part, None, 2] + below)).any(axis=1)
    return found


def parted(
    lines: Lines, hides: Callable[[np.ndarray], np.ndarray], step: float
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """The parts of lines that are seen, and those that are hidden, each a line (k, d).

    Args:
        lines: each (n, d) [m].
        hides: function of points (k, d) that says which of them are hidden.
        step: length of the pieces of which each is one or the other [m].
    """
    seen: list[np.ndarray] = []
    unseen: list[np.ndarray] = []
    for line in lines:
        counts = np.maximum(1, np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / step)).astype(int)
        ends = np.concatenate([a + np.linspace(0, 1, n, endpoint=False)[:, None] * (b - a) for a, b, n in zip(line, line[1:], counts)]
                              + [line[-1:]])  # fmt: skip
        is_hidden = hides(0.5 * (ends[1:] + ends[:-1]))
        borders = [0, *(np.flatnonzero(np.diff(is_hidden)) + 1), len(is_hidden)]
        for first, last in zip(borders, borders[1:]):
            (unseen if is_hidden[first] else seen).append(ends[first : last + 1])
    return seen, unseen


def hidden_by_particles(points: np.ndarray, particles: np.ndarray, size: float, view: np.ndarray) -> np.ndarray:
    """Whether particles lie between points and the eye.

    Args:
        points: (n, 3) [m].
        particles: their positions (m, 3) [m].
        size: of a particle [m].
        view: as `picture_axes` gives it.

    Returns:
        For each point (n,).
    """
    at, around = points @ view.T, particles @ view.T
    corner = np.minimum(at[:, :2].min(axis=0, initial=np.inf), around[:, :2].min(axis=0))
    # Squares that are a particle wide, with the depth of the nearest particle in each.
    square = square_size(around[:, :2], size)
    squares, columns = (np.floor((each[:, :2] - corner) / square).astype(int) for each in (around, at))
    shape = np.maximum(squares.max(axis=0), columns.max(axis=0, initial=0)) + 1
    nearest = np.full(shape, -np.inf)
    np.maximum.at(nearest, tuple(squares.T), around[:, 2])
    found: np.ndarray = nearest[tuple(columns.T)] > at[:, 2] + size
    return found


def square_size(places: np.ndarray, size: float) -> float:
    """Width of the squares into which places (n, 2) [m] are sorted: a size, but more where single ones are so far that squares would be too many."""
    return max(size, float(np.ptp(places, axis=0).max()) / MOST_SQUARES)


def joined(segments: np.ndarray) -> list[np.ndarray]:
    """Segments (k, 2, d) as lines (n, d) of those that follow one another."""
    if not len(segments):
        return []
    starts = np.flatnonzero((segments[1:, 0] != segments[:-1, 1]).any(axis=1)) + 1
    return [np.concatenate([part[:, 0], part[-1:, 1]]) for part in np.split(segments, starts)]


def draw_members(axes: Any, members: Lines, hides: Callable[[np.ndarray], np.ndarray], size: float) -> None:
    """Draw members over a body.

    Args:
        axes: in three dimensions, of which the body has been drawn.
        members: lines (n, 3) [m].
        hides: function of points (k, 3) that says which of them the body hides.
        size: of the body [m].
    """
    if not len(members):
        return
    axes.computed_zorder = False
    for lines, is_hidden in zip(parted(members, hides, size / PIECES), (False, True)):
        axes.add_collection3d(Line3DCollection(lines, zorder=12 - is_hidden, **member_look(is_hidden)))


def draw_members_of_section(axes: Any, members: Lines, axis: int, at: float, near: float) -> None:
    """Draw members over a section, those beside it in dashes.

    Args:
        axes: of the section.
        members: lines (n, 3) [m].
        axis: at right angles to the section, 0 or 1; at: where it is on this axis [m].
        near: distance up to which they are not beside it [m].
    """
    if not len(members):
        return
    parts = parted(members, lambda points: np.abs(points[:, axis] - at) > near, 0.25 * near)
    kept = [k for k in range(3) if k != axis]
    for lines, beside in zip(parts, (False, True)):
        axes.add_collection(
            LineCollection([line[:, kept] for line in lines], zorder=12 - beside, **member_look(beside))
        )


def member_look(beside: bool) -> dict[str, Any]:
    """How members are drawn: in full lines, or, where they are hidden or beside a section, in dashes."""
    halo = [withStroke(linewidth=1.3 if beside else 2.6, foreground="white")]
    return {
        "colors": MEMBER,
        "linewidths": 0.8 if beside else 1.6,
        "linestyles": [DASHES if beside else "-"],
        "path_effects": halo,
    }


def member_legend(figure: Any, members: Lines) -> None:
    """Name full and dashed lines of members above the panels of a figure, where there are some."""
    if len(members):
        figure.get_layout_engine().set(rect=(0, 0, 1, 1 - 0.22 / figure.get_size_inches()[1]))
        name_members(figure, "hidden by the soil, or beside the section")


def name_members(figure: Any, dashed: str) -> None:
    """Draw the legend of members at the top of a figure; dashed: what dashes mean."""
    handles = [
        Line2D([], [], color=MEMBER, linewidth=1.6, label="structural members"),
        Line2D([], [], color=MEMBER, linewidth=0.8, linestyle=DASHES, label=dashed),
    ]
    figure.legend(handles=handles, loc="upper right", ncol=2, fontsize=8, frameon=False, borderaxespad=0.2)
