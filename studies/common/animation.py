"""Films of particles from stored frames: MP4 where ffmpeg is there, otherwise GIF."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.colors import Normalize

from .plots import Quantity, Scene, colour_limits, disc_diameter, draw_bar, draw_scene, figure_with_bar, paper_style


@dataclass
class Frame:
    """Particles at one time; kept in single precision, since films need many.

    Args:
        time: s.
        position: (n, 2), m.
        volume: (n,), m^3 per metre of thickness.
        values: (n,) of the quantity shown, SI units.
    """

    time: float
    position: np.ndarray
    volume: np.ndarray
    values: np.ndarray

    def __post_init__(self) -> None:
        self.position = np.array(self.position, np.float32)
        self.volume = np.array(self.volume, np.float32)
        self.values = np.array(self.values, np.float32)


def save_animation(
    path: Path,
    scene: Scene,
    frames: Sequence[Frame],
    quantity: Quantity,
    *,
    limits: tuple[float, float] | None = None,
    seconds: float = 10.0,
) -> Path:
    """Draw a film with one colour scale over time.

    Args:
        path: without suffix; ``.mp4`` or ``.gif`` is added.
        frames: in the order shown, at least one.
        limits: of the colour scale; found from all frames if not given.
        seconds: how long the film lasts; it shows at most 12 frames per second.

    Returns:
        The file that was written.
    """
    if not frames:
        raise ValueError("frames is empty, expected at least one")
    limits = limits or colour_limits(quantity, [frame.values for frame in frames])
    shown = frames[:: max(1, -(-len(frames) // int(12 * seconds)))]
    rate = max(1, round(len(shown) / seconds))
    has_ffmpeg = shutil.which("ffmpeg") is not None
    path = path.with_suffix(".mp4" if has_ffmpeg else ".gif")
    # The pixel format is the one that every player knows; it needs even numbers of pixels.
    even = ["-pix_fmt", "yuv420p", "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-loglevel", "error"]
    writer = FFMpegWriter(fps=rate, extra_args=even, bitrate=3000) if has_ffmpeg else PillowWriter(fps=rate)
    # Matplotlib may not crop frames, so the style's tight borders are off here.
    with paper_style():
        figure, axes, bar_axes = figure_with_bar(*scene.limits([frame.position for frame in frames]))
        draw_scene(axes, scene)
        draw_bar(figure, bar_axes, quantity, limits, has_less=limits[0] != 0.0)
        title = axes.set_title("", loc="left", pad=4)
        points = axes.scatter([], [], c=[], cmap=quantity.colours, norm=Normalize(*limits), linewidths=0)
        points_per_metre = 72 * figure.get_figwidth() * axes.get_position().width / np.ptp(axes.get_xlim())
        with writer.saving(figure, str(path), dpi=150):
            for frame in shown:
                title.set_text(f"$t$ = {frame.time:.2f} s")
                points.set_offsets(frame.position)
                points.set_sizes((disc_diameter(frame.volume) * points_per_metre) ** 2)
                points.set_array(quantity.scale * frame.values)
                writer.grab_frame()
        plt.close(figure)
    return path
