"""The soil between two surfaces of ground, as particles: before a slide, and where it breaks loose."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpm_core.collective import on_first_rank
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import InputError, is_finite
from fenics_bridge.terrain.raster import Raster

THINNEST = 0.1
"""Thickness of the soil, over the spacing of particles, from which on it is filled"""


def seed_slide(
    model: mpm.Model,
    before: Raster,
    rupture: Raster,
    *,
    spacing: float,
    density: float,
    friction: float | Raster = 0.0,
    adhesion: float | Raster = 0.0,
    drag: float | Raster = 0.0,
    material: int = 0,
) -> tuple[Any, float]:
    """Fill the space between two rasters with particles, and let them touch the ground that is left. Collective.

    The particles of a column stand at equal distances, with the volume of the soil there; where it is thinner than a tenth of the
    spacing it is left out. Where the ground is steep or hollow
    they are lifted until none is nearer to it than its radius: by a fraction of the spacing, the largest of which is returned.

    Args:
        model: model without particles, on a mesh over the ground (see `terrain_mesh`).
        before: ground before the slide; the body is where it is higher than the ground that remains.
        rupture: ground that remains.
        spacing: distance between particles [m].
        density: density of the soil [kg/m3].
        friction: friction coefficient of the ground [-], see `mpm_core.Model.add_contact`; a raster where it differs from place to
            place, which covers the ground and counts at the centres of its triangles.
        adhesion: adhesion of the ground [Pa], likewise.
        drag: coefficient of its resistance that grows with the square of the velocity [-], likewise.
        material: number of the soil's law in the model.

    Returns:
        The contact with the ground, and the largest lift of a particle [m].

    Raises:
        InputError: the rasters have other coordinate references, no soil is between them, or one of the ground's strength
            does not cover it. Raised on all ranks alike.
    """
    surface = rupture.triangles()
    strength = {
        name: _by_triangle(name, value, rupture, surface)
        for name, value in (("friction", friction), ("adhesion", adhesion), ("drag", drag))
    }
    found = on_first_rank(model.comm, lambda: _points(before, rupture, surface, spacing))
    points, volumes, lift = model.comm.bcast(found)
    model.seed_points(points, volumes, density=density, material=material)
    return model.add_contact(surface, **strength), lift


def _by_triangle(name: str, value: float | Raster, ground: Raster, surface: mpm.Triangles) -> Any:
    """A number, or the values of a raster at the centres of the triangles of the ground."""
    if not isinstance(value, Raster):
        return value
    require_cover(name, value, ground)
    return value.at(surface.vertices[surface.triangles].mean(axis=1))


def require_cover(name: str, value: Raster, ground: Raster) -> None:
    """Raises InputError where a raster has another coordinate reference than the ground, or does not cover it."""
    if value.crs != ground.crs:
        raise InputError(f"{name} is in {value.crs!r}, expected {ground.crs!r} as the ground")
    for axis in "xy":
        there, needed = getattr(value, axis), getattr(ground, axis)
        if there[0] > needed[0] + value.spacing or there[-1] < needed[-1] - value.spacing:
            raise InputError(
                f"{name} covers {axis} {there[0]:.10g} to {there[-1]:.10g} m, expected {needed[0]:.10g} to {needed[-1]:.10g} m as the ground"
            )


def _points(before: Any, rupture: Any, surface: Any, spacing: float) -> tuple[Any, ...]:
    """Places and volumes of the particles, and how far they were lifted at most."""
    if before.crs != rupture.crs:
        raise InputError(f"rupture is in {rupture.crs!r}, expected {before.crs!r} as the ground before the slide")
    if not (is_finite(spacing) and spacing > 0):
        raise InputError(f"spacing is {spacing!r} m, expected a positive length")
    low = np.maximum((before.x[0], before.y[0]), (rupture.x[0], rupture.y[0]))
    high = np.minimum((before.x[-1], before.y[-1]), (rupture.x[-1], rupture.y[-1]))
    along = [a + spacing * (np.arange(int((b - a) / spacing + 1e-9)) + 0.5) for a, b in zip(low, high)]
    plan = np.stack(np.meshgrid(*along), axis=-1).reshape(-1, 2)
    thickness = before.at(plan) - rupture.at(plan)
    numbers = np.maximum(np.round(thickness / spacing).astype(int), thickness > THINNEST * spacing)  # in a column
    plan, thickness, numbers = plan[numbers > 0], thickness[numbers > 0], numbers[numbers > 0]
    if len(plan) == 0:
        raise InputError(
            f"before is nowhere higher than rupture by more than {THINNEST:g} of a spacing of {spacing:g} m, expected a body"
        )
    column = np.repeat(np.arange(len(plan)), numbers)
    first = np.repeat(np.cumsum(numbers) - numbers, numbers)
    height = (np.arange(len(column)) - first + 0.5) * (thickness / numbers)[column]
    volumes = (spacing**2 * thickness / numbers)[column]
    points = np.column_stack([plan[column], rupture.at(plan)[column] + height])
    lift = _lift(points, 0.5 * np.cbrt(volumes), column, surface)
    return points + np.outer(lift[column], (0, 0, 1)), volumes, float(lift.max())


def _lift(points: NDArray[np.float64], radii: NDArray[np.float64], column: Any, surface: Any) -> NDArray[np.float64]:
    """Height by which each column is raised so that no particle is nearer to the ground than its radius [m]."""
    lift = np.zeros(column.max() + 1)
    below = np.arange(len(points))  # those that may still be too near
    while len(below):
        raised = points[below] + np.outer(lift[column[below]], (0, 0, 1))
        overlap = radii[below] - mpm.distances(surface, raised)
        near = overlap > 0
        below, overlap = below[near], overlap[near]
        np.maximum.at(lift, column[below], lift[column[below]] + 1.001 * overlap + 1e-9 * radii[below])
    return lift
