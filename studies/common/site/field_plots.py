"""Pictures of the strengths of a site that differ from point to point: random fields, and strengths that follow the vertical stress."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import fenics_bridge as bridge
from fenics_bridge import compat
from fenics_bridge.fem.strength_ratio import STRENGTH
from particle_player import axis_labels

from ..figures import Pictures, save_figure
from ..plots import WIDTH, Quantity, paper_style
from ..solids.plots import save_solid_values
from ..solids.site import cells_there, gathered_solid
from .file import Site

KINDS = {
    "random_cohesion": Quantity("Cohesion", "kPa", 1e-3),
    "random_friction_angle": Quantity("Friction angle", "degrees"),
    "undrained_strength": Quantity("Undrained shear strength", "kPa", 1e-3),
}
"""What each picture shows"""
CAPTIONS = {
    **dict.fromkeys(("random_cohesion", "random_friction_angle"), "Strength of the soils that is a random field"),
    "undrained_strength": "Undrained strength of the soils in which it follows the vertical effective stress",
}
"""Captions of the pictures"""


def strength_pictures(site: Site, fem: bridge.QuasiStatic, folder: Path) -> Pictures:
    """Pictures of the strengths of a site that differ from point to point, one for each parameter and kind; none without any. Collective."""
    comm, nodes = fem.domain.comm, compat.cell_nodes(fem.domain)[fem.points.cells]
    corners, pictures = fem.domain.geometry.x[nodes, : site.dimension], {}
    tags = np.array([*fem.soils, 0])[fem.points.material]  # 0, the last one, where no soil is
    soils_of: dict[tuple[str, str], list[str]] = {}
    for field in site.random:
        soils_of.setdefault((f"random_{field.parameter}", field.parameter), []).append(field.soil)
    if follow := site.soils_with_strength_ratio:
        soils_of["undrained_strength", STRENGTH] = follow
    for (kind, name), soils in soils_of.items():
        if name not in fem.points.parameters:  # no stage came as far as this
            continue
        values = fem.points.parameters[name].reshape(len(corners), -1).mean(axis=1)
        shown = np.where(np.isin(tags, site.tags_of(soils)), values, np.nan)
        if site.dimension == 3:
            pictures |= _of_body(fem, shown, folder / f"{kind}.png")
            continue
        found = comm.gather((corners, shown))
        if found is not None:
            cells, shown = (np.concatenate(parts) for parts in zip(*found))
            path = folder / f"{kind}.png"
            pictures[kind] = partial(_save, path, cells, shown, site.axisymmetric)
    return pictures


def _of_body(fem: bridge.QuasiStatic, values: np.ndarray, path: Path) -> Pictures:
    """The picture of values of the cells of a body (m,), in the order of the points of its elements. Collective."""
    there = cells_there(fem)
    of_cell = np.full(len(there), np.nan)
    of_cell[fem.points.cells] = values
    found = gathered_solid(fem.displacement, of_cell, there)
    if found is None:
        return {}
    return {path.stem: partial(save_solid_values, path, found[0].part(found[1]), KINDS[path.stem])}


def _save(path: Path, cells: np.ndarray, values: np.ndarray, half_section: bool) -> None:
    """Draw the values of cells (m, 3, 2) [m]; those that are NaN are left grey."""
    quantity = KINDS[path.stem]
    lower, upper = cells.min(axis=(0, 1)), cells.max(axis=(0, 1))
    height = float(np.clip(0.9 * WIDTH * (upper[1] - lower[1]) / (upper[0] - lower[0]), 0.8, 6.0))
    with paper_style():
        figure = Figure(figsize=(WIDTH, height + 1.1), layout="constrained")
        axes = figure.subplots()
        there = np.isfinite(values)
        axes.add_collection(PolyCollection(cells[~there], facecolors="#dddddd", edgecolors="face", linewidths=0.2))
        drawn = PolyCollection(
            cells[there], array=quantity.scale * values[there], cmap=quantity.colours, edgecolors="face", linewidths=0.2
        )
        axes.add_collection(drawn)
        axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), aspect="equal")
        axes.set_xlabel(axis_labels(half_section)[0])
        axes.set_ylabel(axis_labels(half_section)[1])
        figure.colorbar(drawn, ax=axes, location="bottom", label=quantity.label, shrink=0.7, aspect=40)
        save_figure(figure, path)
