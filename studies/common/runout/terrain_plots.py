"""Maps over a hillshade of the ground with contour lines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import LightSource
from matplotlib.patheffects import withStroke

import mpm_core as mpm
from fenics_bridge.terrain import Raster

from ..figures import save_figure
from ..plots import BODY, ROUND_TICKS, WIDTH, paper_style
from .places import Places

LIGHT = LightSource(azdeg=315, altdeg=45)


def hillshade(ground: Raster) -> np.ndarray:
    """Brightness of the ground in light from the north-west, from 0 to 1; ground that turns away from it still shows its shape."""
    north, east = np.gradient(ground.values, ground.spacing)
    normal = np.stack([-east, -north, np.ones_like(east)], axis=-1)
    shade: np.ndarray = 0.5 + 0.5 * (normal @ LIGHT.direction) / np.linalg.norm(normal, axis=-1)
    return shade


def save_map(
    path: Path,
    ground: Raster,
    shown: Raster,
    label: str,
    bodies: Sequence[mpm.Triangles] = (),
    places: Places | None = None,
    limits: tuple[float, float] | None = None,
) -> None:
    """Draw a map.

    Args:
        ground: what the hillshade and the contour lines are of.
        shown: what is drawn in colour; gaps are left open.
        label: with unit.
        bodies: rigid structures, drawn in plan.
        places: marked and named.
        limits: of the colours; None to fit.
    """
    x, y = ground.x, ground.y
    h = ground.spacing / 2
    extent = (x[0] - h, x[-1] + h, y[0] - h, y[-1] + h)
    wide = (extent[1] - extent[0]) / (extent[3] - extent[2])
    with paper_style():
        figure, ax = plt.subplots(figsize=(WIDTH, min(9.0, 0.85 * WIDTH / wide + 0.6)), layout="constrained")
        ax.imshow(
            hillshade(ground), cmap="gray", extent=extent, origin="lower", vmin=-0.3, vmax=1.1, interpolation="bilinear"
        )
        lines = ax.contour(x, y, ground.values, levels=ROUND_TICKS.tick_values(ground.values.min(), ground.values.max()),
                           colors="#222222", linewidths=0.6)  # fmt: skip
        for label_of_line in ax.clabel(lines, fmt="%g m", fontsize=7):
            label_of_line.set_path_effects([withStroke(linewidth=1.5, foreground="white")])
        low, high = limits or (None, None)
        colours = ax.imshow(np.ma.masked_invalid(shown.values), cmap="viridis", extent=extent, origin="lower", alpha=0.85, vmin=low,
                            vmax=high)  # fmt: skip
        for body in bodies:
            corners = body.vertices[body.triangles][:, :, :2]
            ax.add_collection(PolyCollection(corners, facecolors=BODY, edgecolors=BODY, linewidths=0.6, zorder=3))
        for name, place in zip(places.names, places.points, strict=True) if places is not None else ():
            ax.plot(*place, "o", color="white", markeredgecolor="black", markersize=4, zorder=4)
            ax.annotate(name, place, xytext=(4, 3), textcoords="offset points", fontsize=7, zorder=4,
                        path_effects=[withStroke(linewidth=1.5, foreground="white")])  # fmt: skip
        figure.colorbar(colours, ax=ax, label=label, shrink=0.9)
        ax.set(xlabel="$x$ [m]", ylabel="$y$ [m]", aspect="equal")
        ax.ticklabel_format(useOffset=False, style="plain")  # coordinates of a map as they are read there
        ax.locator_params(axis="x", nbins=5)
        save_figure(figure, path)
