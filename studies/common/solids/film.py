"""Films of particles in three dimensions: discs from back to front, lit as a surface, in the view of the other pictures of bodies."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from mpl_toolkits.mplot3d import proj3d
from scipy.ndimage import gaussian_filter

from ..animation import PIXELS_AT_ONCE, save_film
from ..plots import GREY, WIDTH, Quantity, colour_limits, disc_diameter, draw_bar, paper_style
from .members import NO_MEMBERS, PIECES, hidden_by_particles, joined, member_look, name_members, parted
from .plots import brightness
from .view import ZOOM, picture_axes, set_view

DPI = 150
HEIGHT = 4.6  # in
MARGIN = 0.45
"""Beside the body in its picture, for numbers and labels of its axes [in]"""


@dataclass(frozen=True)
class View:
    """Where points are in a picture: in pixels from its lower left corner, to the right and upwards, and how near to the eye [m].

    axes: as `picture_axes` gives them; origin: pixel of the point 0 (2,); per_metre: pixels
    """

    axes: np.ndarray
    origin: np.ndarray
    per_metre: float

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """Of points (..., 3) [m]: (..., 2)."""
        found: np.ndarray = self.origin + self.per_metre * (points @ self.axes[:2].T)
        return found

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Of points (..., 3), larger nearer to the eye (...) [m]."""
        found: np.ndarray = points @ self.axes[2]
        return found


def save_solid_film(
    path: Path,
    frames: Sequence[Mapping[str, np.ndarray]],
    field: str,
    quantity: Quantity,
    side: np.ndarray,
    outline: np.ndarray,
    seconds: float = 10.0,
) -> Path:
    """Draw a film with one colour scale over time; see `save_animation`.

    Args:
        path: without suffix.
        frames: in the order shown, at least one, as `solid_frame` has them.
        field: of the particles (n,), shown in the colours of the quantity.
        quantity: label, unit and colours.
        side: horizontal direction (2,) to the side from which the body is seen.
        outline: edges of the body at the start, segments (k, 2, 3) [m].
        seconds: how long the film lasts at most.

    Returns:
        The file that was written.
    """
    limits = colour_limits(quantity, [frame[field] for frame in frames])
    ends = np.concatenate(
        [[f(frame["position"], axis=0) for frame in frames for f in (np.min, np.max)], outline.reshape(-1, 3)]
    )
    draw = partial(
        _pictures,
        field=field,
        quantity=quantity,
        limits=limits,
        box=ends,
        side=side,
        outline=outline,
        members=any(len(frame.get("bodies", NO_MEMBERS)) for frame in frames),
    )
    return save_film(path, frames, draw, seconds)


def _pictures(
    frames: Iterable[Mapping[str, np.ndarray]],
    field: str,
    quantity: Quantity,
    limits: tuple[float, float],
    box: np.ndarray,
    side: np.ndarray,
    outline: np.ndarray,
    members: bool,
) -> Iterator[np.ndarray]:
    """Frames as pixels (height, width, 4), even numbers of them; axes and scale are drawn once."""
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, HEIGHT), dpi=DPI)
        canvas = FigureCanvasAgg(figure)
        axes = figure.add_axes((0.0, 0.17, 1.0, 0.78), projection="3d")
        view = fitted_view(axes, box, side)
        draw_bar(figure, figure.add_axes((0.25, 0.095, 0.5, 0.024)), quantity, limits)
        if members:
            name_members(figure, "hidden by the soil")
        over = _overlay(figure)
        title = over.text(0.02, 0.96, "", transform=over.transAxes, fontsize=plt.rcParams["axes.titlesize"])
        lines = over.add_collection(LineCollection(view.pixels(outline), colors=GREY, linewidths=0.5))
        full, dashed = (
            over.add_collection(LineCollection([], **member_look(is_hidden))) for is_hidden in (False, True)
        )
        for artist in (title, lines, full, dashed):
            artist.set_animated(True)
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())
        background = pixels.copy()
        step = np.linalg.norm(np.ptp(box, axis=0)) / PIECES
        for frame in frames:
            pixels[:] = background
            colours = colormaps[quantity.colours](Normalize(*limits)(quantity.scale * frame[field]), bytes=True)
            draw_particles(pixels, view, frame["position"], _diameters(frame), colours)
            size = float(np.median(_diameters(frame)))
            hides = partial(hidden_by_particles, particles=frame["position"], size=size, view=view.axes)
            for drawn, parts in zip((full, dashed), parted(joined(frame.get("bodies", NO_MEMBERS)), hides, step)):
                drawn.set_segments([view.pixels(part) for part in parts])
            title.set_text(f"$t$ = {float(frame['time']):.2f} s")
            for artist in (lines, dashed, full, title):
                over.draw_artist(artist)
            yield pixels[: len(pixels) // 2 * 2, : pixels.shape[1] // 2 * 2].copy()
        plt.close(figure)


def _overlay(figure: Any) -> Any:
    """Axes over the whole figure, in pixels."""
    over = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    over.set_axis_off()
    width, height = figure.get_size_inches() * figure.dpi
    over.set(xlim=(0, width), ylim=(0, height))
    return over


def _diameters(frame: Mapping[str, np.ndarray]) -> np.ndarray:
    """Of discs that leave no gaps between particles [m]."""
    return np.asarray(disc_diameter(np.cbrt(frame["volume"]) ** 2))


def fitted_view(axes: Any, points: np.ndarray, side: np.ndarray) -> View:
    """Set the view of axes in three dimensions so that a body and the labels beside it fill them; points: of the body (n, 3) [m]."""
    set_view(axes, points, side)
    low, high = points.min(axis=0), points.max(axis=0)
    corners = np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    axes.figure.canvas.draw()
    drawn = _on_screen(axes, corners)
    box, whole = axes.get_position(original=True), axes.figure.get_size_inches() * axes.figure.dpi
    # Axes in three dimensions are a square of this box, beyond which they draw as well.
    free = np.array(box.size) * whole - 2 * MARGIN * axes.figure.dpi
    set_view(axes, points, side, zoom=ZOOM * float((free / np.ptp(drawn, axis=0)).min()))
    axes.figure.canvas.draw()
    drawn = _on_screen(axes, corners)
    # The body in the middle: what is drawn beside it needs about as much on all sides.
    shift = (box.min + box.max) / 2 - (drawn.min(axis=0) + drawn.max(axis=0)) / 2 / whole
    axes.set_position((box.x0 + shift[0], box.y0 + shift[1], box.width, box.height))
    axes.figure.canvas.draw()
    own = picture_axes(side)
    first, right = _on_screen(axes, np.array([low, low + own[0]]))
    per_metre = float(right[0] - first[0])
    return View(own, first - per_metre * (own[:2] @ low), per_metre)


def draw_particles(
    pixels: np.ndarray, view: View, position: np.ndarray, diameter: np.ndarray, colours: np.ndarray
) -> None:
    """Draw particles as discs from back to front, and light them as the surface that they are seen to form.

    Args:
        pixels: (height, width, 4), changed.
        view: of the picture.
        position: (n, 3) [m].
        diameter: of the discs (n,) [m].
        colours: (n, 4), of 8 bits.
    """
    height, width = pixels.shape[:2]
    depth = view.depth(position)
    order = np.argsort(depth, kind="stable")
    # Whole pixels, in a picture that is wider by the largest disc on each side.
    sizes = np.maximum(np.rint(view.per_metre * diameter[order]), 1).astype(int)
    reach = int(sizes.max(initial=1)) // 2 + 1
    at = np.rint(view.pixels(position[order]) - 0.5).astype(int)
    columns, rows = at[:, 0] + reach, height - 1 - at[:, 1] + reach
    inside = (columns >= reach) & (columns < width + reach) & (rows >= reach) & (rows < height + reach)
    order, sizes, columns, rows = order[inside], sizes[inside], columns[inside], rows[inside]
    across, up = (offsets.ravel() for offsets in np.meshgrid(*2 * [np.arange(-reach, reach + 1)]))
    nearest = np.full((height + 2 * reach) * (width + 2 * reach), -1)
    for part in np.array_split(np.arange(len(order)), max(1, -(-len(order) * len(across) // PIXELS_AT_ONCE))):
        disc = across**2 + up**2 <= (0.5 * sizes[part, None]) ** 2
        place = (rows[part, None] + up) * (width + 2 * reach) + columns[part, None] + across
        nearest[place[disc]] = np.broadcast_to(order[part, None], disc.shape)[disc]  # the last one of a place stays
    nearest = nearest.reshape(height + 2 * reach, -1)[reach:-reach, reach:-reach]
    covered = nearest >= 0
    if not covered.any():
        return
    light = lit_surface(
        np.where(covered, view.per_metre * depth[nearest], 0.0), covered, float(np.median(sizes)), view.axes
    )
    pixels[covered, :3] = np.rint(colours[nearest[covered], :3] * light[covered, None])


def lit_surface(depth: np.ndarray, covered: np.ndarray, size: float, axes: np.ndarray) -> np.ndarray:
    """Brightness of the surface that particles form in a picture, each of whose pixels has the depth of the particle there.

    Args:
        depth: towards the eye (height, width) [pixels].
        covered: whether there is a particle (height, width).
        size: of a particle, over which depths are averaged [pixels].
        axes: as `picture_axes` gives them.

    Returns:
        Between 0 and 1: (height, width).
    """
    weight = gaussian_filter(covered.astype(float), size)
    smooth = gaussian_filter(np.where(covered, depth, 0.0), size) / np.maximum(weight, 1e-12)
    down, right = np.gradient(smooth)
    normal = np.stack([-right, down, np.ones_like(down)], axis=-1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return brightness(normal @ axes)


def _on_screen(axes: Any, points: np.ndarray) -> np.ndarray:
    """Pixels of points (n, 3) [m] in axes that have been drawn: (n, 2)."""
    found: np.ndarray = axes.transData.transform(np.column_stack(proj3d.proj_transform(*points.T, axes.get_proj())[:2]))
    return found
