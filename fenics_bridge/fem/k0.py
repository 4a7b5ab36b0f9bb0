"""Initial stress of ground at rest (K0)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpm_core.checks import real_numbers
from mpm_core.input_warnings import warn_of_radians
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.errors import InputError
from fenics_bridge.types import OfPosition

Surface = ArrayLike | OfPosition
"""Height of the ground: a number [m], a polyline (k, 2) of points (x, y) [m], or a function of horizontal coordinates."""

LARGEST_K0 = 10.0
"""Ratio of horizontal to vertical stress above which it is one in percent: passive earth pressure reaches 7.5 in sand of 50 degrees"""


def k0_elastic(poisson: float) -> float:
    """K0 of an elastic body without lateral strain, nu / (1 - nu).

    Args:
        poisson: Poisson's ratio [-].

    Raises:
        InputError: poisson is not in [0, 0.5).
    """
    if not 0 <= poisson < 0.5:
        raise InputError(f"poisson is {poisson!r}, expected at least 0 and below 0.5")
    return poisson / (1 - poisson)


def k0_jaky(friction_angle: float) -> float:
    """K0 of normally consolidated soil, 1 - sin(phi) (Jaky 1944).

    Args:
        friction_angle: friction angle [degrees].

    Raises:
        InputError: friction_angle is not in [0, 90).
    """
    if not 0 <= friction_angle < 90:
        raise InputError(f"friction_angle is {friction_angle!r} degrees, expected at least 0 and below 90")
    warn_of_radians(friction_angle=friction_angle)
    return 1 - np.sin(np.radians(friction_angle))


def k0_stress(points: ArrayLike, surface: Surface, unit_weight: float, k0: float) -> NDArray[np.float64]:
    """Stress of uniform ground at rest: the weight above a point, and K0 times it on both horizontal axes.

    In an axisymmetric body these are the radius and the hoop. Exact for level ground; under a sloping surface it is a first
    estimate that a solver then brings to equilibrium.

    Args:
        points: positions [m], shape (n, D); the last axis points up.
        surface: height of the ground, as a number [m], as a polyline (k, 2) of points (x, y) with x rising [m] (beyond its ends
            the ground goes on level), or as a function of the horizontal coordinates [m], of shape (n,) in two dimensions and
            (n, 2) in three.
        unit_weight: unit weight of the soil [N/m3].
        k0: ratio of horizontal to vertical stress [-].

    Returns:
        Stress [Pa], shape (n, S), tension positive; zero above the surface.

    Raises:
        InputError: points or surface of another shape, or values out of range.
    """
    return k0_layered_stress(points, surface, [(-np.inf, unit_weight, k0)])


def k0_layered_stress(
    points: ArrayLike, surface: Surface, layers: Sequence[tuple[float, float, float]]
) -> NDArray[np.float64]:
    """Stress of ground at rest in level layers; see `k0_stress`.

    Args:
        points: positions [m], shape (n, D); the last axis points up.
        surface: height of the ground, as for `k0_stress`.
        layers: bottom [m], unit weight [N/m3] and K0 of each, from the top down; the last one should reach below all points.

    Returns:
        Stress [Pa], shape (n, S), tension positive; zero above the surface.

    Raises:
        InputError: points, surface or layers of another shape, layers in another order, or values out of range.
    """
    points = real_numbers("points", points)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"points has shape {points.shape}, expected (n, 2) or (n, 3)")
    bottoms, unit_weights, ratios = _checked_layers(layers)
    dim, y = points.shape[1], points[:, -1]
    number = np.sum(y[:, None] < bottoms[:-1], axis=1)  # of the layer around each point
    tops = np.concatenate([[np.inf], bottoms[:-1]])
    above = np.minimum(surface_height(surface, points)[:, None], tops) - np.maximum(y[:, None], bottoms)
    weight = np.maximum(above, 0.0) @ unit_weights
    stress = np.zeros((len(points), 4 if dim == 2 else 6))
    stress[:, :3] = -(ratios[number] * weight)[:, None]
    stress[:, dim - 1] = -weight
    return stress


def _checked_layers(layers: Any) -> Any:
    table = real_numbers("layers", layers)
    if table.ndim != 2 or table.shape[1] != 3 or len(table) == 0 or np.isnan(table).any():
        raise InputError(f"layers is {layers!r}, expected rows of (bottom, unit_weight, k0)")
    bottoms, unit_weights, ratios = table.T
    if np.any(np.diff(bottoms) >= 0):
        raise InputError(f"layers has the bottoms {bottoms.tolist()} m, expected them from the top down")
    if not (np.isfinite(ratios).all() and (ratios >= 0).all() and (ratios <= LARGEST_K0).all()):
        raise InputError(
            f"k0 is {ratios.tolist()}, expected zero or more, and at most {LARGEST_K0:g}: a ratio such as 0.5, not percent"
        )
    if not np.isfinite(unit_weights).all():
        raise InputError(f"unit_weight is {unit_weights.tolist()} N/m3, expected finite numbers")
    return bottoms, unit_weights, ratios


def surface_height(surface: Surface, points: NDArray[np.float64], name: str = "surface") -> NDArray[np.float64]:
    """Height of the ground above each point: (n,) [m]; `surface` as in `k0_stress`, called `name` in messages."""
    if callable(surface):
        height = surface(points[:, 0] if points.shape[1] == 2 else points[:, :-1])
        heights = _finite_heights(name, height)
        if heights.shape not in ((), (len(points),)):
            raise InputError(f"{name} gives heights of shape {heights.shape}, expected ({len(points)},)")
        return np.broadcast_to(heights, (len(points),))
    line = _finite_heights(name, surface)
    if line.ndim == 0:
        return np.full(len(points), float(line))
    if line.ndim != 2 or line.shape[1] != 2 or len(line) == 0:
        raise InputError(f"{name} has shape {line.shape}, expected (k, 2) points (x, y) with x rising")
    if np.any(np.diff(line[:, 0]) < 0):
        raise InputError(f"{name} has points at x = {line[:, 0].tolist()} m, expected x that rises")
    return np.interp(points[:, 0], line[:, 0], line[:, 1])


def _finite_heights(name: str, heights: Any) -> NDArray[np.float64]:
    line = real_numbers(name, heights)
    if not np.isfinite(line).all():
        raise InputError(f"{name} has heights of {line[~np.isfinite(line)][0]} m, expected finite numbers")
    return line
