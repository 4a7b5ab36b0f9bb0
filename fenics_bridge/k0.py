"""Initial stress of ground at rest (K0)."""

from __future__ import annotations

import numpy as np

from fenics_bridge.errors import InputError


def k0_elastic(poisson):
    """K0 of an elastic body that cannot widen, nu / (1 - nu)."""
    if not 0 <= poisson < 0.5:
        raise InputError(f"poisson: got {poisson!r}, expected at least 0 and below 0.5")
    return poisson / (1 - poisson)


def k0_jaky(friction_angle):
    """K0 of normally consolidated soil, 1 - sin(phi) (Jaky 1944). friction_angle: [degrees]"""
    if not 0 <= friction_angle < 90:
        raise InputError(f"friction_angle: got {friction_angle!r} degrees, expected at least 0 and below 90")
    return 1 - np.sin(np.radians(friction_angle))


def k0_stress(points, surface, unit_weight, k0):
    """Stress of ground at rest: the weight above a point, and K0 times it on both horizontal axes.

    Exact for level ground; under a sloping surface it is a start that a solver then brings into equilibrium.
    points: (n, D) [m]; the last axis points up
    surface: height of the ground, as a number [m], as a polyline (k, 2) of points (x, y) with x rising [m]
        (beyond its ends the ground goes on level), or as a function of the horizontal coordinates (n, D - 1)
    unit_weight: [N/m3]; k0: ratio of horizontal to vertical stress
    Returns (n, S) [Pa], tension positive; zero above the surface.
    """
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"points: got shape {points.shape}, expected (n, 2) or (n, 3)")
    if not (np.isfinite(k0) and k0 >= 0):
        raise InputError(f"k0: got {k0!r}, expected zero or more")
    dim = points.shape[1]
    depth = np.maximum(surface_height(surface, points) - points[:, -1], 0.0)
    stress = np.zeros((len(points), 4 if dim == 2 else 6))
    stress[:, :3] = -(k0 * unit_weight * depth)[:, None]
    stress[:, dim - 1] = -unit_weight * depth
    return stress


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
