"""Pictures of bodies of tetrahedra: the body from above, and a vertical section through the place that moves most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Colormap, LightSource, Normalize
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from particle_player import boundary_edges

from ..field_plots import INCREMENT, INCREMENT_SHEAR
from ..figures import save_figure
from ..plots import WIDTH, Quantity, paper_style
from .members import draw_members, draw_members_of_section, hidden, member_legend
from .site import Section, Solid, section_of
from .view import AXES, MOST_INTERVALS, picture_axes, set_view

LIGHT = LightSource(azdeg=225, altdeg=55).direction
AMBIENT = 0.65
"""Brightness of what turns away from the light"""
UPWARD = 0.2
"""Vertical part of the normal of a surface that is seen from above"""
TURN = np.radians(30.0)
"""Angle between the normals of triangles beside a sharp edge"""


CAPTIONS = {
    "mechanism": "Mechanism on the finest mesh: displacement of the last increment on the body, and its shear strain in the section along the black line",
    "stages_displacement": "The body after each stage, and its section along the black line, by the displacement",
    "stages_strain": "The body after each stage, and its section along the black line, by the strain accumulated since the displacements were reset",
    **dict.fromkeys(("random_cohesion", "random_friction_angle"), "Strength of the soils that is a random field, on the body and in the section along the black line"),
    "undrained_strength": "Undrained strength of the soils in which it follows the vertical effective stress, on the body and in the section along the black line",
    "members": "Axial force of each structural member: its colour in the body, and its values along the member; tension is positive",
    "slide_displacement": "Displacement at the end of the slide: all particles, and those of a section through the one that has moved most",
    "slide_strain": "Accumulated plastic shear strain at the end of the slide: all particles, and those of a section through the one that has moved most",
}  # fmt: skip
"""Of pictures of bodies, by the names of their files, in the place of those of sections"""


def captions_for(captions: Mapping[str, str], dimension: int) -> dict[str, str]:
    """Captions of the pictures of a site of two or three dimensions, by file name, where `captions` are those of a section."""
    return dict(captions) | (CAPTIONS if dimension == 3 else {})


@dataclass
class Shown:
    """Values in colours: by_cell: whether they are of cells, else of points; norm: of the colours; colours: their map, or its name."""

    values: np.ndarray
    by_cell: bool
    norm: Normalize
    colours: str | Colormap


def save_solid_mechanism(path: Path, solid: Solid, title: str) -> None:
    """Draw a displacement increment: its length on the body, and its deviatoric strain in a section, both relative.

    Args:
        path: of the picture.
        solid: the increment, in any unit, and its strain.
        title: above the body.
    """
    section = main_section(solid)
    top = float(np.quantile(section.values, 0.98)) or 1.0
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, 3.6), layout="constrained")
        body = figure.add_subplot(1, 2, 1, projection="3d")
        moved = Shown(solid.lengths() / solid.lengths().max(), False, Normalize(0, 1), INCREMENT.colours)
        draw_body(body, solid, moved, section, solid.side_to_see())
        body.set_title(title, loc="left", pad=0)
        axes = figure.add_subplot(1, 2, 2)
        draw_section(
            axes, section, Shown(section.values / top, True, Normalize(0, 1), INCREMENT_SHEAR.colours), solid.members
        )
        member_legend(figure, solid.members)
        for below, quantity, extend in ((body, INCREMENT, "neither"), (axes, INCREMENT_SHEAR, "max")):
            draw_bar(figure, below, quantity, Normalize(0, 1), extend)
        save_figure(figure, path)


def save_solid_stages(
    path: Path, names: Sequence[str], solids: Sequence[Solid], quantity: Quantity, by_cell: bool
) -> None:
    """Draw the body and a section after each stage, above one another, in one colour scale.

    Args:
        path: of the picture.
        names: of the stages.
        solids: the body after each of them.
        quantity: displacement, or strain.
        by_cell: whether it is the strain of the cells.
    """
    most = max(solids, key=lambda one: one.lengths().max())
    axis, side = most.section_axis(), most.side_to_see()
    at = float(most.place_that_moves_most()[axis])
    shown = [quantity.scale * (one.values if by_cell else one.lengths()) for one in solids]
    norm = Normalize(0.0, max(float(np.quantile(values, 0.995)) for values in shown) or 1.0)
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, 2.7 * len(solids) + 0.6), layout="constrained")
        panels = []
        for row, (name, solid, values) in enumerate(zip(names, solids, shown)):
            section = section_of(solid, axis, at)
            of_section = quantity.scale * (section.values if by_cell else section.lengths)
            body = figure.add_subplot(len(solids), 2, 2 * row + 1, projection="3d")
            draw_body(body, solid, Shown(values, by_cell, norm, quantity.colours), section, side)
            body.set_title(f"Stage: {name}", loc="left", pad=0)
            axes = figure.add_subplot(len(solids), 2, 2 * row + 2)
            draw_section(axes, section, Shown(of_section, by_cell, norm, quantity.colours), solid.members)
            panels += [body, axes]
        member_legend(figure, [line for one in solids for line in one.members])
        draw_bar(figure, panels, quantity, norm, "max", shrink=0.5)
        save_figure(figure, path)


def save_solid_values(path: Path, solid: Solid, quantity: Quantity) -> None:
    """Draw values of cells on the body and in a section.

    Args:
        path: of the picture.
        solid: the body with the values; cells in which they are NaN are left grey.
        quantity: label, unit and colours.
    """
    section = main_section(solid)
    values, colours = quantity.scale * solid.values, plt.get_cmap(quantity.colours).with_extremes(bad="#dddddd")
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    norm = Normalize(low, high if high > low else low + 1.0)
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, 3.6), layout="constrained")
        body = figure.add_subplot(1, 2, 1, projection="3d")
        draw_body(body, solid, Shown(values, True, norm, colours), section, solid.side_to_see())
        axes = figure.add_subplot(1, 2, 2)
        draw_section(axes, section, Shown(quantity.scale * section.values, True, norm, colours))
        draw_bar(figure, [body, axes], quantity, norm, "neither", shrink=0.5)
        save_figure(figure, path)


def main_section(solid: Solid) -> Section:
    """The section through the place that moves most, along the way it moves."""
    axis = solid.section_axis()
    return section_of(solid, axis, float(solid.place_that_moves_most()[axis]))


def draw_body(axes: Any, solid: Solid, shown: Shown, section: Section, side: np.ndarray) -> None:
    """Draw the surface of a body from above.

    Args:
        axes: in three dimensions.
        solid: the body.
        shown: values of its points or cells.
        section: whose line on the surface is drawn.
        side: horizontal direction (2,) to the side from which it is seen.
    """
    triangles, behind = solid.surface()
    corners = solid.points[triangles]
    normal = solid.normals(triangles)
    light = brightness(normal)
    of_face = shown.values[behind] if shown.by_cell else shown.values[triangles].mean(axis=1)
    rgba = plt.get_cmap(shown.colours)(shown.norm(of_face))
    rgba[:, :3] *= light[:, None]
    axes.add_collection3d(Poly3DCollection(corners, facecolors=rgba, edgecolors=rgba, linewidths=0.2, rasterized=True))
    ridges = solid.points[sharp_edges(triangles, normal, picture_axes(side)[2])]
    axes.add_collection3d(Line3DCollection(ridges, colors="#808080", linewidths=0.5, zorder=5))
    set_view(axes, solid.points, side)
    _draw_cut(axes, corners[normal[:, 2] > UPWARD], section)
    draw_members(axes, solid.members, partial(hidden, corners=corners, view=picture_axes(side)), solid.size())


def brightness(normal: np.ndarray) -> np.ndarray:
    """Of surfaces with unit normals (..., 3), between 0 and 1: (...)."""
    found: np.ndarray = AMBIENT + (1 - AMBIENT) * np.clip(normal @ LIGHT, 0.0, 1.0)
    return found


def outline_of(solid: Solid, side: np.ndarray) -> np.ndarray:
    """Edges of a body at which its surface turns, as far as they are on the side that is seen: segments (k, 2, 3) [m]."""
    triangles, _ = solid.surface()
    edges: np.ndarray = solid.points[sharp_edges(triangles, solid.normals(triangles), picture_axes(side)[2])]
    return edges


def sharp_edges(triangles: np.ndarray, normal: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Edges of a surface at which it turns, on the side that is seen: rows of points (k, 2).

    Args:
        triangles: rows of points (m, 3).
        normal: of the triangles, outwards (m, 3) [-].
        towards: direction to the eye (3,).
    """
    edges = np.sort(triangles[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2), axis=1)
    kept, number = np.unique(edges, axis=0, return_inverse=True)
    total, seen = np.zeros((len(kept), 3)), np.zeros(len(kept), dtype=bool)
    np.add.at(total, number.reshape(-1), np.repeat(normal, 3, axis=0))
    np.logical_or.at(seen, number.reshape(-1), np.repeat(normal @ towards > 1e-6, 3))
    found: np.ndarray = kept[seen & (np.linalg.norm(total, axis=1) < 2 * np.cos(0.5 * TURN))]
    return found


def draw_section(axes: Axes, section: Section, shown: Shown, members: Sequence[np.ndarray] = ()) -> None:
    """Draw a section by values of its points or triangles, with its outline; members: lines (k, 3) [m] of structural ones."""
    given: dict[str, Any] = {"facecolors": shown.values} if shown.by_cell else {"shading": "gouraud"}
    axes.tripcolor(*section.points.T, section.triangles, *(() if shown.by_cell else (shown.values,)), cmap=shown.colours, norm=shown.norm,
                   rasterized=True, **given)  # fmt: skip
    outline = section.points[boundary_edges(section.triangles)]
    axes.add_collection(LineCollection(outline, colors="black", linewidths=0.8))
    draw_members_of_section(axes, members, section.axis, section.at, section.cell_size())
    axes.set(aspect="equal", xlabel=AXES[1 - section.axis], ylabel=AXES[2])
    axes.set_title(f"Section at {AXES[section.axis][:3]} = {section.at:.3g} m", loc="left", fontsize=8)
    axes.margins(0.03)
    thin_numbers(axes, section.points)


def thin_numbers(axes: Axes, points: np.ndarray) -> None:
    """Fewer numbers below a section of points (n, 2) [m] that is narrower than it is high, where they would overlap."""
    width, height = np.ptp(points, axis=0)
    if width < height:
        axes.xaxis.set_major_locator(plt.MaxNLocator(max(1, round(MOST_INTERVALS * width / height))))


def _draw_cut(axes: Any, corners: np.ndarray, section: Section) -> None:
    """Draw the line in which a section cuts triangles (k, 3, 3) [m] of a surface."""
    side = corners[:, :, section.axis] - section.at
    side[side == 0] = 1e-12
    ends = np.array([(0, 1), (1, 2), (2, 0)])
    crossed = (side[:, ends[:, 0]] > 0) != (side[:, ends[:, 1]] > 0)
    cut = crossed.any(axis=1)
    low, high = (side[cut][:, ends[:, k]][crossed[cut]] for k in (0, 1))
    first, second = (corners[cut][:, ends[:, k]][crossed[cut]] for k in (0, 1))
    points = first + (low / (low - high))[:, None] * (second - first)
    axes.computed_zorder = False  # else the body hides what is on its surface
    axes.add_collection3d(Line3DCollection(points.reshape(-1, 2, 3), colors="black", linewidths=0.9, zorder=10))


def draw_bar(figure: Any, below: Any, quantity: Quantity, norm: Normalize, extend: str, shrink: float = 0.8) -> None:
    """Draw the scale of colours below one or several axes."""
    bar = figure.colorbar(ScalarMappable(norm, quantity.colours), ax=below, location="bottom", shrink=shrink, aspect=30,
                          extend=extend, pad=0.02)  # fmt: skip
    bar.set_label(quantity.label, labelpad=2, fontsize=8)
