"""Pictures of particles in three dimensions: all of them from above, and those of a vertical section through the one that moves most."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import Normalize

import mpm_core as mpm

from ..figures import save_figure
from ..movie import bodies_of, gathered
from ..plots import WIDTH, Quantity, colour_limits, discs, paper_style
from .members import NO_MEMBERS, draw_members, draw_members_of_section, hidden_by_particles, joined, member_legend
from .plots import draw_bar, thin_numbers
from .site import Solid
from .view import AXES, picture_axes, set_view


def solid_frame(model: mpm.Model, time: float) -> dict[str, np.ndarray] | None:
    """All particles and structural members as they are, on the first rank; None on the others. Collective."""
    p = model.particles.single("volume", "id", "displacement", "velocity", "plastic_strain")
    frame = {"time": np.float64(time), "position": p["position"], "volume": p["volume"], "id": p["id"], "moved": p["displacement"],
             "displacement": np.linalg.norm(p["displacement"], axis=1), "shear_strain": p["plastic_strain"],
             "speed": np.linalg.norm(p["velocity"], axis=1), **bodies_of(model)}  # fmt: skip
    return gathered(model.comm, frame)


def body_of(frame: Mapping[str, np.ndarray]) -> Solid:
    """Particles as a body without cells, for the way it moves and the side from which it is seen."""
    return Solid(
        frame["position"].astype(float), np.empty((0, 4), dtype=np.int64), frame["moved"].astype(float), np.empty(0)
    )


def save_solid_particles(path: Path, frame: Mapping[str, np.ndarray], key: str, quantity: Quantity) -> None:
    """Draw particles by a quantity, from above and in a section.

    Args:
        path: of the picture.
        frame: as `solid_frame` has it.
        key: of the quantity in the frame.
        quantity: label, unit and colours.
    """
    body, members = body_of(frame), joined(frame.get("bodies", NO_MEMBERS))
    points, values = body.points, quantity.scale * frame[key]
    axis = body.section_axis()
    at = float(body.place_that_moves_most()[axis])
    size = np.cbrt(np.median(frame["volume"]))
    near = np.abs(points[:, axis] - at) < size
    kept = [k for k in range(3) if k != axis]
    norm = Normalize(*colour_limits(quantity, [frame[key]]))
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, 3.6), layout="constrained")
        above = figure.add_subplot(1, 2, 1, projection="3d")
        width = 72 * 2.4 * size / np.ptp(points, axis=0).max()  # of a panel some 2.4 inches wide
        above.scatter(*points.T, c=values, cmap=quantity.colours, norm=norm, s=max(width, 0.6) ** 2, linewidths=0, depthshade=False,
                      rasterized=True)  # fmt: skip
        set_view(above, points, body.side_to_see())
        hides = partial(hidden_by_particles, particles=points, size=size, view=picture_axes(body.side_to_see()))
        draw_members(above, members, hides, body.size())
        above.set_title(f"$t$ = {float(frame['time']):.1f} s", loc="left", pad=0)
        axes = figure.add_subplot(1, 2, 2)
        # discs that fill a slab which is two particles thick
        drawn = discs(
            axes,
            points[near][:, kept],
            frame["volume"][near] / size,
            cmap=quantity.colours,
            norm=norm,
            linewidths=0,
            rasterized=True,
        )
        drawn.set_array(values[near])
        draw_members_of_section(axes, members, axis, at, 2 * float(size))
        member_legend(figure, members)
        axes.set(
            aspect="equal",
            xlabel=AXES[kept[0]],
            ylabel=AXES[2],
            xlim=_span(points[:, kept[0]]),
            ylim=_span(points[:, 2]),
        )
        thin_numbers(axes, points[:, kept])
        axes.set_title(f"Section at {AXES[axis][:3]} = {at:.3g} m", loc="left", fontsize=8)
        draw_bar(figure, [above, axes], quantity, norm, "max", shrink=0.5)
        save_figure(figure, path)


def _span(values: np.ndarray) -> tuple[float, float]:
    """Lower and upper end of an axis that shows values, with a margin."""
    low, high = float(values.min()), float(values.max())
    return low - 0.03 * (high - low), high + 0.03 * (high - low)
