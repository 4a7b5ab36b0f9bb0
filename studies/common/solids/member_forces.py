"""Axial forces of the structural members of bodies: by colours in the body, and along each member."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import Normalize
from matplotlib.patheffects import withStroke
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

import mpm_core as mpm

from ..figures import Pictures, save_figure
from ..plots import WIDTH, Quantity, curve_look, paper_style
from .plots import draw_bar, sharp_edges
from .site import Solid
from .view import picture_axes, set_view

GHOST = (0.62, 0.60, 0.57, 0.16)
"""Colour of a body through which its members are seen"""
FEW_NAMES = 12
"""Members of which a legend has the names"""
AXIAL = Quantity("Axial force", "kN", scale=1e-3, colours="viridis")


def force_picture(solid: Solid, forces: Mapping[str, mpm.MemberForces], title: str, folder: Path) -> Pictures:
    """The picture of axial forces in a body, where there are members."""
    if not forces:
        return {}
    return {"members": lambda: save_member_forces(folder / "members.png", solid, forces, title)}


def save_member_forces(path: Path, solid: Solid, forces: Mapping[str, mpm.MemberForces], title: str) -> None:
    """Draw the axial forces of members: by colours in a body that is seen through, and along each member.

    Args:
        path: of the picture.
        solid: the body.
        forces: by name of the member.
        title: above the body.
    """
    lines = [AXIAL.scale * one.axial_force for one in forces.values()]
    norm = Normalize(min(0.0, *(line.min() for line in lines)), max(0.0, *(line.max() for line in lines)) or 1.0)
    side = solid.side_to_see()
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, 3.6), layout="constrained")
        body = figure.add_subplot(1, 2, 1, projection="3d")
        triangles, _ = solid.surface()
        corners, normal = solid.points[triangles], solid.normals(triangles)
        seen = normal @ picture_axes(side)[2] > 1e-6
        body.computed_zorder = False
        body.add_collection3d(Poly3DCollection(corners[seen], facecolors=[GHOST], linewidths=0, rasterized=True))
        ridges = solid.points[sharp_edges(triangles, normal, picture_axes(side)[2])]
        body.add_collection3d(Line3DCollection(ridges, colors="#808080", linewidths=0.5, zorder=5))
        segments = np.concatenate(
            [np.stack([one.positions[:-1], one.positions[1:]], axis=1) for one in forces.values()]
        )
        halo = [withStroke(linewidth=3.4, foreground="#303030")]
        drawn = Line3DCollection(segments, cmap=AXIAL.colours, norm=norm, linewidths=2.2, zorder=12, path_effects=halo)
        drawn.set_array(np.concatenate(lines))
        body.add_collection3d(drawn)
        set_view(body, solid.points, side)
        body.set_title(title, loc="left", pad=0)
        draw_bar(figure, body, AXIAL, norm, "neither")
        _draw_along(figure.add_subplot(1, 2, 2), forces)
        save_figure(figure, path)


def _draw_along(axes: Any, forces: Mapping[str, mpm.MemberForces]) -> None:
    """Draw axial forces over the distance from the first point of each member."""
    for k, (name, one) in enumerate(forces.items()):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(one.positions, axis=0), axis=1))])
        ends = np.column_stack([along[:-1], along[1:]]).ravel()
        axes.plot(ends, AXIAL.scale * np.repeat(one.axial_force, 2), linewidth=1.1, label=name, **curve_look(k))
    axes.axhline(0, color="black", linewidth=0.5)
    axes.grid(True)
    axes.set(xlabel="Distance from the first point [m]", ylabel=AXIAL.label)
    if len(forces) <= FEW_NAMES:
        axes.legend(
            fontsize=7,
            ncol=min(4, len(forces)),
            loc="upper center",
            bbox_to_anchor=(0.45, -0.18),
            frameon=False,
            columnspacing=1.2,
        )
