"""Films of particles from stored frames: MP4 where ffmpeg is there, otherwise GIF."""

from __future__ import annotations

import contextlib
import errno
import itertools
import shutil
import subprocess
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import matplotlib.pyplot as plt
import numpy as np
from matplotlib import colormaps
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from PIL import Image

from .files import expendable
from .plots import (
    Quantity,
    Scene,
    bodies_drawn,
    colour_limits,
    disc_diameter,
    draw_bar,
    draw_scene,
    figure_with_bar,
    paper_style,
)
from .progress import counted

T = TypeVar("T")


FASTEST, SHORTEST = 25, 4.0
"""Frames per second of a film, at most, and how many seconds it lasts, at least"""
PIXELS_AT_ONCE = 100_000
"""Pixels of discs that are drawn together: few enough for the processor's cache"""
NO_BODIES = np.empty((0, 2, 2))


def save_animation(
    path: Path,
    scene: Scene,
    frames: Sequence[Mapping[str, np.ndarray]],
    field: str,
    quantity: Quantity,
    *,
    limits: tuple[float, float] | None = None,
    seconds: float = 10.0,
) -> Path:
    """Draw a film with one colour scale over time; see `expendable` for a disk that is full.

    Args:
        path: without suffix; ``.mp4`` or ``.gif`` is added.
        frames: in the order shown, at least one; particles with ``time`` [s], ``position`` (n, 2) [m], ``volume`` (n,) [m^3 per
            metre of thickness], and rigid surfaces as ``bodies``, segments (k, 2, 2) [m], if there are any.
        field: of the particles, (n,), shown in the colours of ``quantity``.
        limits: of the colour scale; found from all frames if not given.
        seconds: how long the film lasts at most; of more than 25 frames per second some are left out.

    Returns:
        The file that was written.
    """
    if not frames:
        raise ValueError("frames is empty, expected at least one")
    limits = limits or colour_limits(quantity, [frame[field] for frame in frames])
    corners = scene.limits(
        [frame["position"] for frame in frames], [frame.get("bodies", NO_BODIES) for frame in frames]
    )
    return save_film(path, frames, lambda shown: _pictures(scene, shown, field, quantity, limits, corners), seconds)


def save_film(
    path: Path,
    frames: Sequence[T],
    pictures_of: Callable[[Iterable[T]], Iterator[np.ndarray]],
    seconds: float = 10.0,
) -> Path:
    """Write a film of any frames; see `save_animation` for path, seconds and what is returned.

    Args:
        frames: in the order shown, at least one.
        pictures_of: draws frames as pixels (height, width, 4), even numbers of them, all of one size.
    """
    shown = frames[:: max(1, -(-len(frames) // int(FASTEST * seconds)))]
    rate = min(FASTEST, max(1, round(len(shown) / min(SHORTEST, seconds))))
    has_ffmpeg = shutil.which("ffmpeg") is not None
    path = path.with_suffix(".mp4" if has_ffmpeg else ".gif")
    with expendable(path) as aside:
        (_save_mp4 if has_ffmpeg else _save_gif)(aside, pictures_of(counted("film, frames", shown)), rate)
    return path


def save_figure_film(path: Path, frames: Sequence[T], figure_of: Callable[[T], Figure]) -> Path:
    """Write a film of figures of one size; see `save_film`.

    Args:
        frames: in the order shown, at least one.
        figure_of: draws the figure of a frame.
    """

    def pixels(shown: Iterable[T]) -> Iterator[np.ndarray]:
        with paper_style():
            for frame in shown:
                figure = figure_of(frame)
                canvas = FigureCanvasAgg(figure)
                figure.set_dpi(150)
                canvas.draw()
                drawn = np.asarray(canvas.buffer_rgba())
                yield drawn[: len(drawn) // 2 * 2, : drawn.shape[1] // 2 * 2].copy()
                plt.close(figure)

    return save_film(path, frames, pixels)


def _pictures(
    scene: Scene,
    frames: Iterable[Mapping[str, np.ndarray]],
    field: str,
    quantity: Quantity,
    limits: tuple[float, float],
    corners: tuple[np.ndarray, np.ndarray],
) -> Iterator[np.ndarray]:
    """Frames as pixels (height, width, 4), even numbers of them as films need. What does not move is drawn once."""
    with paper_style():
        figure, axes, bar_axes = figure_with_bar(*corners, scene.half_section)
        figure.set_dpi(150)
        draw_bar(figure, bar_axes, quantity, limits)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        pixels = np.asarray(canvas.buffer_rgba())
        background = pixels.copy()
        still = list(axes.collections)
        draw_scene(axes, scene)
        lines = sorted((c for c in axes.collections if c not in still), key=lambda c: c.get_zorder())
        above = _Overlay.of(canvas, axes, lines)
        title, bodies = axes.set_title("", loc="left", pad=4), bodies_drawn(axes, NO_BODIES)
        for frame in frames:
            pixels[:] = background
            colours = colormaps[quantity.colours](Normalize(*limits)(quantity.scale * frame[field]), bytes=True)
            _draw_discs(pixels, axes, frame["position"], frame["volume"], colours)
            above.draw(pixels)
            title.set_text(f"$t$ = {float(frame['time']):.2f} s")
            bodies.set_segments(frame.get("bodies", NO_BODIES))
            axes.draw_artist(bodies)
            axes.draw_artist(title)
            yield pixels[: len(pixels) // 2 * 2, : pixels.shape[1] // 2 * 2].copy()
        plt.close(figure)


@dataclass(frozen=True)
class _Overlay:
    """Pixels that are drawn over each frame: rows of the pixels (k,), their colours (k, 3) and opacities (k, 1)."""

    rows: np.ndarray
    colours: np.ndarray
    opacity: np.ndarray

    @classmethod
    def of(cls, canvas: FigureCanvasAgg, axes: Axes, artists: Sequence[Artist]) -> _Overlay:
        """Overlay of artists, drawn on a transparent ground; the canvas is left empty."""
        canvas.get_renderer().clear()
        for artist in artists:
            axes.draw_artist(artist)
        drawn = np.array(canvas.buffer_rgba()).reshape(-1, 4)
        rows = np.flatnonzero(drawn[:, 3])
        return cls(rows, drawn[rows, :3].astype(np.float32), drawn[rows, 3:].astype(np.float32) / 255)

    def draw(self, pixels: np.ndarray) -> None:
        flat = pixels.reshape(-1, 4)
        below = flat[self.rows, :3]
        flat[self.rows, :3] = np.rint(below + self.opacity * (self.colours - below))


def _draw_discs(pixels: np.ndarray, axes: Axes, position: np.ndarray, volume: np.ndarray, colours: np.ndarray) -> None:
    """Particles as discs of the given colours (n, 4), each with whole pixels; a tenth of the time that matplotlib takes for smooth ones."""
    height, width = pixels.shape[:2]
    left, bottom, right, top = (int(round(edge)) for edge in axes.bbox.extents)
    centres = axes.transData.transform(position)
    columns, rows = np.rint(centres[:, 0] - 0.5).astype(int), height - 1 - np.rint(centres[:, 1] - 0.5).astype(int)
    inside = (columns >= left) & (columns < right) & (rows >= height - top) & (rows < height - bottom)
    per_metre = axes.bbox.width / np.ptp(axes.get_xlim())
    # Twice the radius in whole pixels: so many kinds of discs there are.
    kinds = np.maximum(np.rint(disc_diameter(volume) * per_metre), 1).astype(int)
    shown = np.ascontiguousarray(colours).view(np.uint32)[:, 0]
    flat = pixels.reshape(-1, 4).view(np.uint32)[:, 0]
    for kind in np.unique(kinds[inside]):
        chosen = np.flatnonzero(inside & (kinds == kind))
        reach = np.arange(-(kind // 2), kind // 2 + 1)
        across, up = (offsets.ravel() for offsets in np.meshgrid(reach, reach))
        disc = np.flatnonzero(across**2 + up**2 <= (kind / 2) ** 2)
        # Many pixels at once: large discs of coarse cells are few particles with very many pixels each.
        for part in np.array_split(disc, -(-disc.size * chosen.size // PIXELS_AT_ONCE)):
            column = np.clip(columns[chosen] + across[part, np.newaxis], left, right - 1)
            row = np.clip(rows[chosen] + up[part, np.newaxis], height - top, height - bottom - 1)
            flat[row * width + column] = shown[chosen]


def _save_mp4(path: Path, pictures: Iterator[np.ndarray], rate: int) -> None:
    first = next(pictures)
    size = f"{first.shape[1]}x{first.shape[0]}"
    # The pixel format is the one that every player knows.
    words = ["-f", "rawvideo", "-pix_fmt", "rgba", "-s", size, "-r", str(rate), "-i", "-", "-f", "mp4", "-vcodec", "h264",
             "-preset", "veryfast", "-pix_fmt", "yuv420p", str(path)]  # fmt: skip
    with subprocess.Popen(["ffmpeg", "-loglevel", "error", "-y", *words], stdin=subprocess.PIPE,
                          stderr=subprocess.PIPE) as encoder:  # fmt: skip
        assert encoder.stdin is not None and encoder.stderr is not None
        with contextlib.suppress(BrokenPipeError):  # then it says why
            for picture in itertools.chain([first], pictures):
                encoder.stdin.write(picture.data)
            encoder.stdin.close()
        reason = encoder.stderr.read().decode(errors="replace").strip()
    if encoder.returncode != 0:
        raise OSError(errno.EIO, f"ffmpeg: {reason.splitlines()[-1] if reason else 'it failed'}")


def _save_gif(path: Path, pictures: Iterator[np.ndarray], rate: int) -> None:
    first, *others = (Image.fromarray(picture).convert("RGB") for picture in pictures)
    first.save(path, format="GIF", save_all=True, append_images=others, duration=1000 / rate, loop=0)
