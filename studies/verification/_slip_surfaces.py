"""Upper bounds of the factor of safety of undrained soil: blocks that slide along a polyline, and slip circles.

The dissipation along slip lines of strength c_u on which the velocity jumps by dv, the sum of c_u l dv, over the power of the
weight of the soil that moves (Chen 1975, Limit Analysis and Soil Plasticity, ch. 3). Undrained soil flows without a change
of volume, so that velocities jump along their lines only.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize

Strength = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""c_u [Pa] at abscissas and heights [m]"""

SAMPLES = 2000
"""Points on a line, or strips of the soil above it"""


def sliding_blocks(
    base: np.ndarray, top: np.ndarray, surface: np.ndarray, strength: Strength, unit_weight: float
) -> float:
    """Factor of safety by three blocks that slide on the legs of a polyline and along the lines between them.

    Args:
        base: (4, 2) [m], the polyline, whose ends are on the surface, from the crest to the toe.
        top: (2,) [m], abscissas at which the lines from its inner points end on the surface.
        surface: (k, 2) [m], ground surface from left to right.
        strength: c_u [Pa].
        unit_weight: [N/m3].

    Returns:
        The factor, infinite where the blocks would not move this way.
    """
    legs = np.diff(base, axis=0)
    velocity = legs / np.linalg.norm(legs, axis=1)[:, None]
    sides = np.column_stack([top, np.interp(top, *surface.T)]) - base[1:3]
    for k, side in enumerate(sides):  # the part normal to a line is the same on both of its sides
        normal = np.array([-side[1], side[0]])
        onward = velocity[k + 1] @ normal
        if not abs(onward) > 1e-9 * np.linalg.norm(side):
            return np.inf
        velocity[k + 1] *= velocity[k] @ normal / onward
    if np.any(np.einsum("kd,kd->k", velocity, legs) <= 0):
        return np.inf
    speeds = np.linalg.norm(velocity, axis=1), np.linalg.norm(np.diff(velocity, axis=0), axis=1)
    dissipation = sum(v * _resistance(base[k], base[k + 1], strength) for k, v in enumerate(speeds[0]))
    dissipation += sum(v * _resistance(base[k + 1], base[k + 1] + sides[k], strength) for k, v in enumerate(speeds[1]))
    ends = np.vstack([base[0], base[1:3] + sides, base[3]])
    power = 0.0
    for k in range(3):
        between = surface[(surface[:, 0] > ends[k, 0]) & (surface[:, 0] < ends[k + 1, 0])]
        power -= unit_weight * _area(np.vstack([base[k : k + 2], ends[k + 1], between[::-1], ends[k]])) * velocity[k, 1]
    return dissipation / power if power > 0 else np.inf


def slip_circle(
    centre: np.ndarray, radius: float, surface: np.ndarray, strength: Strength, unit_weight: float
) -> float:
    """Factor of safety by the soil that rotates on a slip circle; infinite where the circle cuts out no such soil.

    Args:
        centre: (2,) [m]; radius: [m]; surface: (k, 2) [m], from left to right.
        strength: c_u [Pa]; unit_weight: [N/m3].
    """
    x = np.linspace(surface[0, 0], surface[-1, 0], 4 * SAMPLES)
    ground = np.interp(x, *surface.T)
    half = np.sqrt(np.maximum(radius**2 - (x - centre[0]) ** 2, 0.0))
    below = centre[1] - half
    moved = (half > 0) & (below < ground)
    if moved[0] or moved[-1] or not moved.any() or np.any(ground[moved] > centre[1]):
        return np.inf
    moment = unit_weight * np.sum(((ground - below) * (centre[0] - x))[moved]) * (x[1] - x[0])
    first, last = x[moved][[0, -1]]
    angles = np.linspace(*np.arcsin((np.array([first, last]) - centre[0]) / radius), SAMPLES)
    c = strength(centre[0] + radius * np.sin(angles), centre[1] - radius * np.cos(angles))
    return float(np.mean(c) * (angles[-1] - angles[0]) * radius**2 / moment) if moment > 0 else np.inf


def best_circle(surface: np.ndarray, strength: Strength, unit_weight: float, deepest: float) -> float:
    """Least factor of safety of slip circles, over their centre and their depth below the toe.

    Args:
        surface: (4, 2) [m], level ground, crest, toe and level ground from left to right.
        strength: c_u [Pa]; unit_weight: [N/m3].
        deepest: depth below the toe that no circle exceeds [m].
    """
    (crest, top), (toe, bottom) = surface[1:3]
    height = top - bottom

    def factor(values):
        x, above, depth = values
        if not 0 <= depth <= deepest:
            return 1e3
        centre = np.array([x, bottom + above])
        return min(slip_circle(centre, above + depth, surface, strength, unit_weight), 1e3)

    spans = (crest, toe + 0.5 * height, 11), (height, 5 * height, 9), (0.0, deepest, 6)
    trials = itertools.product(*(np.linspace(*span) for span in spans))
    first = np.array(min(trials, key=factor))
    inwards = 1.0 if first[2] < 0.5 * deepest else -1.0
    return least(factor, first, 0.1 * height * np.array([1.0, 1.0, inwards]))


def least(factor: Callable[[np.ndarray], float], first: np.ndarray, sides: np.ndarray) -> float:
    """Least value by Nelder and Mead's simplex, which begins with the given sides."""
    corners = np.vstack([first, first + np.diag(sides)])
    return minimize(factor, first, method="Nelder-Mead", options={"initial_simplex": corners, "fatol": 1e-5}).fun


def _resistance(start: np.ndarray, end: np.ndarray, strength: Strength) -> float:
    """Integral of c_u over a straight line [N/m]."""
    along = (np.arange(SAMPLES) + 0.5) / SAMPLES
    points = start + along[:, None] * (end - start)
    return float(np.mean(strength(*points.T)) * np.linalg.norm(end - start))


def _area(corners: np.ndarray) -> float:
    """Area of a polygon [m2]."""
    x, y = corners.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
