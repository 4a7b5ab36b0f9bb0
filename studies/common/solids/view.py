"""The view of bodies in three dimensions: from above, along parallel lines, from the side to which the body moves."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

ELEVATION = 28.0
"""Of the eye over the horizon [degrees]"""
TURNED, TURNED_AT_CORNER = 35.0, 10.0
"""Angle between the eye and the direction to a side of a body, and to a corner [degrees]"""
ZOOM = 0.86
"""Of a body in its axes, so that the labels beside it stay within the picture"""
MOST_INTERVALS = 4
"""Between numbers along the longest side of a body"""
AXES = ("$x$ [m]", "$y$ [m]", "$z$ [m]")


def azimuth(side: np.ndarray) -> float:
    """Of the eye [degrees] that sees a body from a side, or from a corner between two, a little from its left."""
    return float(np.degrees(np.arctan2(side[1], side[0]))) - (TURNED if 0 in side else TURNED_AT_CORNER)


def set_view(axes: Any, points: np.ndarray, side: np.ndarray, zoom: float = ZOOM) -> None:
    """Equal axes around points (n, 3) [m], seen from the side to which a horizontal direction (2,) points."""
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=zoom)
    axes.set_proj_type("ortho")
    axes.view_init(elev=ELEVATION, azim=azimuth(side))
    relative = (high - low) / (high - low).max()
    for k, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        axis.set_label_text(AXES[k], fontsize=7)
        axis.set_tick_params(labelsize=6, pad=-2)
        slender = 1 - np.delete(relative, k).max()  # matplotlib measures distances along an axis by the other sides
        axis.labelpad = (-6 if k == 2 else 0) + 16 * slender
        most = max(1, round(MOST_INTERVALS * relative[k]))  # numbers on a short side would overlap
        axis.set_major_locator(plt.MaxNLocator(most))


def picture_axes(side: np.ndarray) -> np.ndarray:
    """Rows of unit vectors to the right and upwards in the picture, and to the eye: (3, 3)."""
    turned, up = np.radians(azimuth(side)), np.radians(ELEVATION)
    right = np.array([-np.sin(turned), np.cos(turned), 0.0])
    towards = np.array([np.cos(up) * np.cos(turned), np.cos(up) * np.sin(turned), np.sin(up)])
    return np.array([right, np.cross(towards, right), towards])
