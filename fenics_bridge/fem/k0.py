"""Initial stress of ground at rest (K0)."""

from __future__ import annotations

import numpy as np

from fenics_bridge.errors import InputError


def k0_elastic(poisson):
    """K0 of an elastic body without lateral strain, nu / (1 - nu)."""
    if not 0 <= poisson < 0.5:
        raise InputError(f"poisson: got {poisson!r}, expected at least 0 and below 0.5")
    return poisson / (1 - poisson)


def k0_jaky(friction_angle):
    """K0 of normally consolidated soil, 1 - sin(phi) (Jaky 1944). friction_angle: [degrees]"""
    if not 0 <= friction_angle < 90:
        raise InputError(f"friction_angle: got {friction_angle!r} degrees, expected at least 0 and below 90")
    return 1 - np.sin(np.radians(friction_angle))


def k0_stress(points, surface, unit_weight, k0):
    """Stress of uniform ground at rest: the weight above a point, and K0 times it on both horizontal axes.

    In an axisymmetric body these are the radius and the hoop.

    Exact for level ground; under a sloping surface it is a first estimate that a solver then brings to equilibrium.
    points: (n, D) [m]; the last axis points up
    surface: height of the ground, as a number [m], as a polyline (k, 2) of points (x, y) with x rising [m]
        (beyond its ends the ground goes on level), or as a function of the horizontal coordinates (n, D - 1)
    unit_weight: [N/m3]; k0: ratio of horizontal to vertical stress
    Returns (n, S) [Pa], tension positive; zero above the surface.
    """
    return k0_layered_stress(points, surface, [(-np.inf, unit_weight, k0)])


def k0_layered_stress(points, surface, layers):
    """The same as `k0_stress` for ground in level layers.

    layers: (bottom [m], unit_weight [N/m3], k0) of each, from the top down; the last one should reach below all points
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"points: got shape {points.shape}, expected (n, 2) or (n, 3)")
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


def _checked_layers(layers):
    table = np.asarray(layers, dtype=float)
    if table.ndim != 2 or table.shape[1] != 3 or len(table) == 0 or np.isnan(table).any():
        raise InputError(f"layers: got {layers!r}, expected rows of (bottom, unit_weight, k0)")
    bottoms, unit_weights, ratios = table.T
    if np.any(np.diff(bottoms) >= 0):
        raise InputError(f"layers: got bottoms {bottoms.tolist()} m, expected them from the top down")
    if not (np.isfinite(ratios).all() and (ratios >= 0).all()):
        raise InputError(f"k0: got {ratios.tolist()}, expected zero or more")
    if not np.isfinite(unit_weights).all():
        raise InputError(f"unit_weight: got {unit_weights.tolist()} N/m3, expected finite numbers")
    return bottoms, unit_weights, ratios


def surface_height(surface, points):
    """Height of the ground above each point: (n,) [m]; `surface` as in `k0_stress`."""
    if callable(surface):
        height = surface(points[:, 0] if points.shape[1] == 2 else points[:, :-1])
        return np.broadcast_to(np.asarray(height, dtype=float), (len(points),))
    line = np.asarray(surface, dtype=float)
    if line.ndim == 0:
        return np.full(len(points), float(line))
    if line.ndim != 2 or line.shape[1] != 2 or np.any(np.diff(line[:, 0]) < 0):
        raise InputError(f"surface: got an array of shape {line.shape}, expected (k, 2) points with x rising")
    return np.interp(points[:, 0], line[:, 0], line[:, 1])
