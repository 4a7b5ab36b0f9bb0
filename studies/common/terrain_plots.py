"""Maps over a hillshade of the ground with contour lines."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import LightSource
from matplotlib.patheffects import withStroke

from fenics_bridge.terrain import Raster

from .figures import save_figure
from .plots import ROUND_TICKS, WIDTH, paper_style

LIGHT = LightSource(azdeg=315, altdeg=45)


def hillshade(ground: Raster) -> np.ndarray:
    """Brightness of the ground in light from the north-west, from 0 to 1; ground that turns away from it still shows its shape."""
    north, east = np.gradient(ground.values, ground.spacing)
    normal = np.stack([-east, -north, np.ones_like(east)], axis=-1)
    shade: np.ndarray = 0.5 + 0.5 * (normal @ LIGHT.direction) / np.linalg.norm(normal, axis=-1)
    return shade


def save_map(path: Path, ground: Raster, shown: Raster, label: str) -> None:
    """Draw a map.

    Args:
        ground: what the hillshade and the contour lines are of.
        shown: what is drawn in colour; gaps are left open.
        label: with unit.
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
        colours = ax.imshow(
            np.ma.masked_invalid(shown.values), cmap="viridis", extent=extent, origin="lower", alpha=0.85
        )
        figure.colorbar(colours, ax=ax, label=label, shrink=0.9)
        ax.set(xlabel="$x$ [m]", ylabel="$y$ [m]", aspect="equal")
        ax.ticklabel_format(useOffset=False, style="plain")  # coordinates of a map as they are read there
        ax.locator_params(axis="x", nbins=5)
        save_figure(figure, path)
