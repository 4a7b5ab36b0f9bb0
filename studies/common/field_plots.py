"""Pictures of finite elements: curves over load, convergence over mesh size, mechanisms, fields side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FormatStrFormatter, LogLocator, MaxNLocator

import fenics_bridge as bridge
from particle_player import axis_labels, boundary_edges

from .figures import curve_figure, save_figure
from .plots import CURVES, MEMBER, ROUND_TICKS, WIDTH, Quantity, Scene, colour_limits, discs, paper_style
from .site.outlines import name_places, soil_outlines
from .site.water_table import draw_water_table, top_with_water, water_legend

INCREMENT = Quantity("Displacement increment at collapse, relative", "-", colours="viridis")
INCREMENT_SHEAR = Quantity("Shear strain increment at collapse, relative", "-", colours="inferno")
LINE = "#00a8e8"


@dataclass
class Field:
    """A nodal quantity on triangles, on the first rank.

    points: (n, 2) [m]; cells: (m, 3) rows of points; values: (n, k); half_section: of an axisymmetric body
    soils: segments (k, 2, 2) [m] around each soil, by its name
    """

    points: np.ndarray
    cells: np.ndarray
    values: np.ndarray
    half_section: bool = False
    soils: Mapping[str, np.ndarray] | None = None

    @property
    def outline(self) -> np.ndarray:
        """Segments (k, 2, 2) of the body's boundary."""
        return self.points[boundary_edges(self.cells)]

    def shear(self) -> np.ndarray:
        """Shear strain of a displacement in each triangle, sqrt((exx - eyy)^2 + gxy^2): (m,)."""
        corners, moved = self.points[self.cells], self.values[self.cells]
        edges = corners[:, 1:] - corners[:, :1]
        gradient = np.linalg.solve(edges, moved[:, 1:] - moved[:, :1])  # [cell, along, component]
        shear = gradient[:, 0, 1] + gradient[:, 1, 0]
        return np.hypot(gradient[:, 0, 0] - gradient[:, 1, 1], shear)

    def exceeded_in(self, fraction: float, values: np.ndarray) -> float:
        """Value in triangles that is exceeded in a fraction of the area; above it are single cells at singular corners."""
        corners = self.points[self.cells]
        area = 0.5 * np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
        order = np.argsort(values)
        return values[order][np.searchsorted(np.cumsum(area[order]), (1 - fraction) * area.sum())]


def gathered(function: object, half_section: bool = False, parts: int = 1) -> Field | None:
    """A function of DOLFINx at the corners of triangles; None but on the first rank. Collective.

    It is continuous, but where the mesh has several nodes at one place, as along walls in the flow of water.

    half_section: of an axisymmetric body, which the axes of pictures then say; parts: into which each side of a cell is divided
    """
    comm = function.function_space.mesh.comm
    mesh = bridge.background_arrays(function.function_space.mesh)
    own = mesh["cells"][mesh["cell_owners"] == comm.rank]
    shapes, triangles = _divided(parts)
    nodes = np.einsum("qk,ckd->cqd", shapes, mesh["points"][own])
    values = within_cells(function, nodes)
    at_corner = shapes.argmax(axis=1)  # of each point, where sides are not divided
    names = mesh["global_nodes"][own[:, at_corner]] if parts == 1 else np.zeros(nodes.shape[:2], dtype=np.int64)
    at_triangles = nodes[:, triangles].reshape(-1, 2), values[:, triangles], names[:, triangles].reshape(-1, 1)
    found = comm.gather(at_triangles)
    if found is None:
        return None
    corners, at_corners, names = (np.concatenate(arrays) for arrays in zip(*found))
    at_corners = at_corners.reshape(len(corners), -1)
    alike = np.round(
        corners / np.ptp(corners, axis=0).max(), 9
    )  # both cells at a side have its points, but for rounding
    rows = np.concatenate([alike, names], axis=1)
    _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return Field(corners[first], number.reshape(-1, 3), at_corners[first], half_section)


def within_cells(function: object, points: np.ndarray) -> np.ndarray:
    """Values (m, q, k) of a function at points (m, q, D) [m] of each of the m cells that this rank owns, as seen from within it."""
    m, q, _ = points.shape
    size = int(np.prod(function.ufl_shape, dtype=int))
    if not m:  # DOLFINx 0.5 cannot evaluate at none
        return np.zeros((0, q, size))
    x = np.zeros((m * q, 3))
    x[:, : points.shape[2]] = points.reshape(m * q, -1)
    return function.eval(x, np.repeat(np.arange(m, dtype=np.int32), q)).reshape(m, q, size)


def mechanism_field(
    mechanism: object, half_section: bool = False, soils: object = None, off: Sequence[int] = ()
) -> Field | None:
    """A mechanism at all nodes of its elements, so that elements of higher degree show what moves within them. Collective.

    soils: tags of the cells, by name, whose outlines are shown; off: those of them whose cells are not there
    """
    nodes = mechanism.function_space.dofmap.dof_layout.num_dofs
    parts = round((np.sqrt(8 * nodes + 1) - 3) / 2)
    field = gathered(mechanism, half_section, parts)
    if soils is None:
        return field
    domain = mechanism.function_space.mesh
    outlines, mesh = soil_outlines(domain, soils, off), bridge.background_arrays(domain, soils)
    there = domain.comm.gather(~np.isin(mesh["cell_tags"][mesh["cell_owners"] == domain.comm.rank], off))
    if field is None or there is None:
        return None
    return replace(field, cells=field.cells[np.repeat(np.concatenate(there), parts**2)], soils=outlines)


def _divided(parts: int) -> tuple[np.ndarray, np.ndarray]:
    """A triangle whose sides are divided: barycentric coordinates of the points (q, 3), and triangles of these (parts^2, 3)."""
    places = [(i, j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    number = {place: k for k, place in enumerate(places)}
    upright = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in places if i + j < parts]
    inverted = [[(i + 1, j + 1), (i, j + 1), (i + 1, j)] for i, j in places if i + j < parts - 1]
    shapes = np.array([(parts - i - j, i, j) for i, j in places]) / parts
    return shapes, np.array([[number[place] for place in triangle] for triangle in upright + inverted])


# --- curves ----------------------------------------------------------------------------------------------------------


def save_curves(
    path: Path,
    curves: Mapping[str, tuple[np.ndarray, np.ndarray]],
    labels: tuple[str, str],
    *,
    reference: tuple[float, str] | None = None,
    limits: tuple[tuple[float, float | None], tuple[float, float | None]] = ((0, None), (0, None)),
    per_colour: int = 1,
) -> None:
    """Draw curves, such as a load over displacement, with each computed point.

    Args:
        curves: (horizontal, vertical) values by name, as shown.
        labels: of the axes, with units.
        reference: a level and its name, drawn dashed.
        limits: of the axes; None to fit.
        per_colour: curves that follow one another in one colour, each with a line of its own.
    """
    with curve_figure(path, (4.9, 3.3)) as axes:
        for k, (name, (x, y)) in enumerate(curves.items()):
            axes.plot(x, y, ("o-", "s:")[k % per_colour], color=CURVES[k // per_colour % len(CURVES)], markersize=2.5,
                      linewidth=1.1, label=name)  # fmt: skip
        if reference:
            axes.axhline(reference[0], color="black", linestyle="--", linewidth=0.9, label=reference[1])
        axes.set(xlabel=labels[0], ylabel=labels[1], xlim=limits[0], ylim=limits[1])
        axes.legend(fontsize=8, loc="best")


def save_convergence(
    path: Path,
    sizes: Sequence[float],
    curves: Mapping[str, Sequence[float]],
    label: str,
    reference: tuple[float, str] | None,
) -> None:
    """Draw results over the mesh size.

    Args:
        sizes: of the cells [m].
        curves: one value for each size, by name, as shown; NaN where there is none.
        label: of the vertical axis, with unit.
        reference: a level and its name, drawn dashed.
    """
    every = [value for curve in curves.values() for value in curve] + ([reference[0]] if reference else [])
    low, high = np.nanmin(every), np.nanmax(every)
    margin = 0.12 * (high - low) or 0.05 * abs(high)
    curves = {name: (np.asarray(sizes), np.asarray(values)) for name, values in curves.items()}
    save_curves(path, curves, ("Cell size [m]", label), reference=reference,
                limits=((0, 1.08 * max(sizes)), (low - margin, high + margin)))  # fmt: skip


def save_log_log(
    path: Path,
    sizes: Sequence[float],
    curves: Mapping[str, Sequence[float]],
    label: str,
    slope: float = 2.0,
    axis: str = "Cell size [m]",
) -> None:
    """Draw differences over the mesh size, or what `axis` says, in logarithmic axes, with a line of a slope beside them."""
    sizes = np.asarray(sizes)
    with curve_figure(path, (4.9, 3.6)) as axes:
        for k, (name, values) in enumerate(curves.items()):
            axes.loglog(sizes, values, "os^v"[k % 4] + "-", color=CURVES[k % len(CURVES)], markersize=4, label=name)
        lowest = np.nanmin([value for values in curves.values() for value in values])
        axes.loglog(sizes, 0.8 * lowest * (sizes / sizes.min()) ** slope, "--", color="black", linewidth=0.9,
                    label=f"slope {slope:g}")  # fmt: skip
        axes.set_xticks(sizes, [f"{size:.3g}" for size in sizes])
        axes.minorticks_off()
        axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
        axes.set(xlabel=axis, ylabel=label)
        axes.legend(fontsize=8)


def bend(curves: Sequence[np.ndarray], fraction: float = 0.8) -> float:
    """End of the axis that shows how load-displacement curves bend; what follows at hardly any more load is cut off.

    curves: (k, 2) load and displacement, each with the load rising; fraction: of a curve's last load, where it still is steep
    """
    return 3.0 * max(np.interp(fraction * curve[-1, 0], *curve.T) for curve in curves)


# --- fields ----------------------------------------------------------------------------------------------------------


def save_mechanism(
    path: Path,
    field: Field,
    title: str,
    *,
    line: np.ndarray | None = None,
    line_name: str = "",
    box: tuple[tuple[float, float], tuple[float, float]] | None = None,
    water: np.ndarray | None = None,
    members: Sequence[np.ndarray] = (),
) -> None:
    """Draw a displacement increment: its length with arrows, and beside it its shear strain, with the names of the soils.

    Args:
        field: the increment, in any unit.
        line: (k, 2) [m] drawn over both, such as the slip line of limit analysis.
        line_name: for the legend.
        box: (lower, upper) corner of what is shown; all by default.
        water: segments (k, 2, 2) [m] of the water table, in the soil and over standing water.
        members: lines (n, 2) [m] of structural members.
    """
    water = np.empty((0, 2, 2)) if water is None else water
    lengths, shear = np.linalg.norm(field.values, axis=1), field.shear()
    lower, upper = (np.array(corner) for corner in box or (field.points.min(axis=0), field.points.max(axis=0)))
    if box is None:
        upper[1] = top_with_water(lower[1], upper[1], [water])
    with paper_style():
        figure, panels = _panels(lower, upper, 2, field.half_section)
        for (axes, bar), quantity in zip(panels, (INCREMENT, INCREMENT_SHEAR)):
            axes.add_collection(LineCollection(field.outline, colors="black", linewidths=0.8, zorder=3))
            is_shear = quantity is INCREMENT_SHEAR
            top = field.exceeded_in(0.02, shear) if is_shear else lengths.max()
            shown = {"facecolors": shear / top} if is_shear else {"shading": "gouraud"}
            values = () if is_shear else (lengths / top,)
            axes.tripcolor(*field.points.T, field.cells, *values, cmap=quantity.colours, vmin=0, vmax=1, rasterized=True,
                           **shown)  # fmt: skip
            for outline in (field.soils or {}).values():
                axes.add_collection(LineCollection(outline, colors="#a0a0a0", linewidths=0.6, zorder=2))
            axes.add_collection(LineCollection(members, colors=MEMBER, linewidths=1.6, zorder=4))
            seen = draw_water_table(axes, water)
            if line is not None:
                axes.plot(*line.T, "--", color=LINE, linewidth=1.4, label=line_name)
            _bar(figure, bar, quantity, (0.0, 1.0), "max" if is_shear else "neither")
        _arrows(panels[0][0], field, lower, upper)
        panels[0][0].set_title(title, loc="left", pad=4)
        _soil_names(panels[1][0], field.soils or {})
        if seen:
            water_legend(panels[1][0])
        if line is not None:
            panels[1][0].legend(loc="lower right", bbox_to_anchor=(1.02, 0.98), fontsize=9)
        save_figure(figure, path)


def _soil_names(axes: Axes, soils: Mapping[str, np.ndarray]) -> None:
    """Write the names of soils into them, where there are several."""
    if len(soils) < 2:
        return
    for name, place in name_places(soils).items():
        axes.text(*place, name, color="white", fontsize=7, ha="center", va="center", zorder=7, clip_on=True,
                  path_effects=[withStroke(linewidth=1.6, foreground="#202020")])  # fmt: skip


def near_raster(points: np.ndarray, spacing: float) -> np.ndarray:
    """The rows of the points (n, 2) that are nearest to those of a raster of a spacing [m], one for each of these."""
    raster = np.rint(points / spacing)
    order = np.argsort(np.linalg.norm(points - spacing * raster, axis=1))
    _, first = np.unique(raster[order], axis=0, return_index=True)
    return order[first]


def _arrows(axes: Axes, field: Field, lower: np.ndarray, upper: np.ndarray) -> None:
    """Arrows at about 20 x 20 places, at nodes that are nearest to them."""
    spacing = (upper - lower).max() / 22
    inside = np.flatnonzero(np.all((field.points >= lower) & (field.points <= upper), axis=1))
    nodes = inside[near_raster(field.points[inside], spacing)]
    lengths = np.linalg.norm(field.values, axis=1)
    nodes = nodes[lengths[nodes] > 0.06 * lengths.max()]
    scale = lengths.max() / (1.3 * spacing)
    axes.quiver(*field.points[nodes].T, *field.values[nodes].T, color="white", angles="xy", scale_units="xy", scale=scale,
                width=0.0022, zorder=4)  # fmt: skip


def save_side_by_side(
    path: Path,
    scene: Scene,
    position: np.ndarray,
    volume: np.ndarray,
    panels: Mapping[str, np.ndarray],
    quantity: Quantity,
    title: str,
    own: Sequence[str] = (),
) -> None:
    """Draw several quantities of the same material points side by side, in one colour scale from zero.

    Args:
        position: (n, 2) [m], where the points are drawn; volume: (n,) [m^3 per metre].
        panels: values (n,) in SI units by the name of the panel.
        own: names of panels with a colour scale of their own.
    """
    common = colour_limits(quantity, [values for name, values in panels.items() if name not in own])
    limits = {name: colour_limits(quantity, [values]) if name in own else common for name, values in panels.items()}
    lower, upper = scene.limits([])
    height = (WIDTH / len(panels) - 0.3) * (upper[1] - lower[1]) / (upper[0] - lower[0])
    with paper_style():
        figure = plt.figure(figsize=(WIDTH, height + 1.4), layout="constrained")
        grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axes, (name, values) in zip(grid, panels.items()):
            axes.set_aspect("equal")
            axes.set_xlim(lower[0], upper[0])
            axes.set_ylim(lower[1], upper[1])
            axes.add_collection(LineCollection(scene.initial_outline, colors="black", linewidths=0.6, zorder=3))
            collection = discs(axes, position, volume, cmap=quantity.colours, norm=Normalize(*limits[name]), linewidths=0,
                               rasterized=True)  # fmt: skip
            collection.set_array(quantity.scale * values)
            axes.set_title(
                f"{name}, up to {quantity.scale * values.max():.3g} {quantity.unit}", loc="left", pad=4, fontsize=8.5
            )
            axes.set_xlabel(axis_labels(scene.half_section)[0], labelpad=1)
        grid[0].set_ylabel(axis_labels(scene.half_section)[1], labelpad=1)
        together = [axes for axes, name in zip(grid, panels) if name not in own]
        bars = [(together, common, f"{quantity.label}; {title}")]
        bars += [
            ([axes], limits[name], f"{name} [{quantity.unit}]".capitalize())
            for axes, name in zip(grid, panels)
            if name in own
        ]
        for below, ends, label in bars:
            ticks = copy(ROUND_TICKS) if len(below) > 1 else MaxNLocator(3)
            bar = figure.colorbar(ScalarMappable(Normalize(*ends), quantity.colours), ax=below, location="bottom", ticks=ticks,
                                  shrink=0.8, aspect=20 * len(below), extend="max")  # fmt: skip
            bar.set_label(label)
        save_figure(figure, path)


def _panels(
    lower: np.ndarray, upper: np.ndarray, count: int, half_section: bool = False
) -> tuple[Figure, list[tuple[Axes, Axes]]]:
    """Equal axes side by side, each with space for a horizontal colour bar below: (axes, bar axes) of each."""
    margin = 0.03 * (upper - lower).max()
    each = (WIDTH - 0.25) / count - 0.35
    height = float(np.clip(each * (upper[1] - lower[1] + 2 * margin) / (upper[0] - lower[0] + 2 * margin), 0.8, 6.0))
    figure = plt.figure(figsize=(WIDTH, height + 1.3), layout="constrained")
    grid = figure.subplots(2, count, height_ratios=[1, 0.04], squeeze=False)
    along, up = axis_labels(half_section)
    for axes in grid[0]:
        axes.set_aspect("equal")
        axes.set_xlim(lower[0] - margin, upper[0] + margin)
        axes.set_ylim(lower[1] - margin, upper[1] + margin)
        axes.set_xlabel(along, labelpad=1)
    grid[0][0].set_ylabel(up)
    return figure, list(zip(grid[0], grid[1]))


def _bar(figure: Figure, axes: Axes, quantity: Quantity, limits: tuple[float, float], extend: str) -> None:
    bar = figure.colorbar(ScalarMappable(Normalize(*limits), quantity.colours), cax=axes, orientation="horizontal",
                          extend=extend)  # fmt: skip
    bar.set_label(quantity.label, labelpad=2, fontsize=8)
    bar.outline.set_linewidth(0.5)
