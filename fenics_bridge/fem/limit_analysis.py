"""Collapse of a slope by limit analysis: the reference for finite elements."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fenics_bridge.errors import InputError


@dataclass(frozen=True)
class LogSpiral:
    """Rotational mechanism through the toe of a slope: the soil above a logarithmic spiral rotates about its pole.

    Coordinates are those of `slope_mesh`, with the shoulder of the slope at (crest, height).
    """

    unit_weight: float
    """Unit weight at collapse [N/m3]"""
    pole: NDArray[np.float64]
    """Pole of the rotation [m], shape (2,)"""
    curve: NDArray[np.float64]
    """Slip surface from the crest to the toe [m], shape (k, 2)"""


def log_spiral(height: float, angle: float, cohesion: float, friction_angle: float, crest: float = 0.0) -> LogSpiral:
    """Least upper bound of the collapse load over all spirals through the toe, with associated flow.

    Equates the work of the weight with the dissipation along the spiral (Chen 1975, Limit Analysis and Soil Plasticity,
    ch. 9). On flat slopes with little friction the best spiral dips below the level of the toe before it rises to it: the
    ground there is taken as the same soil. `curve` of the result shows its depth.

    Args:
        height: height of the slope [m].
        angle: angle of the slope [degrees], above the friction angle.
        cohesion: cohesion of the soil [Pa].
        friction_angle: friction angle of the soil [degrees].
        crest: horizontal coordinate of the shoulder [m].

    Raises:
        InputError: angles or lengths out of range.
    """
    if not 0 <= friction_angle < angle <= 90:
        raise InputError(
            f"angle: got {angle!r} degrees with friction_angle={friction_angle!r}; expected "
            "0 <= friction_angle < angle <= 90"
        )
    if not (height > 0 and cohesion > 0):
        raise InputError(f"height, cohesion: got {height!r} m, {cohesion!r} Pa, expected positive numbers")
    shape = (math.radians(angle), math.tan(math.radians(friction_angle)))
    start, end = _best_angles(*shape)
    spiral, moment, dissipation = _mechanism(start, end, *shape)
    size = height / (spiral[0, 1] - spiral[-1, 1])
    toe = np.array([crest + height / math.tan(shape[0]) if angle < 90 else crest, 0.0])
    pole = toe - size * spiral[-1]
    return LogSpiral(cohesion * dissipation / (moment * size), pole, pole + size * spiral)


def log_spiral_safety(height: float, angle: float, cohesion: float, friction_angle: float, unit_weight: float) -> float:
    """Factor of safety of a slope by the mechanism of `log_spiral`: the strength divided by it just fails at the unit weight.

    Args:
        height: height of the slope [m].
        angle: angle of the slope [degrees].
        cohesion: cohesion of the soil [Pa].
        friction_angle: friction angle of the soil [degrees].
        unit_weight: unit weight of the soil [N/m3].

    Raises:
        InputError: angles or lengths out of range.
    """
    low, high = 1e-2, 1e2
    for _ in range(24):
        factor = math.sqrt(low * high)
        reduced = math.degrees(math.atan(math.tan(math.radians(friction_angle)) / factor))
        stands = reduced >= angle or log_spiral(height, angle, cohesion / factor, reduced).unit_weight > unit_weight
        low, high = (factor, high) if stands else (low, factor)
    return factor


def _best_angles(slope: float, tangent: float) -> NDArray[np.float64]:
    """Start and end angle of the spiral with the least collapse load: a grid search, refined around its best point."""
    centre, half = np.array([0.5 * np.pi / 2, 0.6 * np.pi]), np.array([0.5 * np.pi / 2, 0.4 * np.pi])
    for _ in range(16):
        grid = [np.linspace(c - h, c + h, 7) for c, h in zip(centre, half)]
        loads = [[_load(start, end, slope, tangent) for end in grid[1]] for start in grid[0]]
        i, j = np.unravel_index(np.argmin(loads), (7, 7))
        centre, half = np.array([grid[0][i], grid[1][j]]), half * 0.5
    return centre


def _load(start: Any, end: Any, slope: float, tangent: float) -> Any:
    """Dimensionless collapse load, gamma H / c; infinite where the angles make no mechanism."""
    if not 0 < start < end < np.pi:
        return np.inf
    spiral, moment, dissipation = _mechanism(start, end, slope, tangent)
    height = spiral[0, 1] - spiral[-1, 1]
    behind = _shoulder(spiral, slope)[0] - spiral[0, 0]
    return dissipation * height / moment if moment > 0 and height > 0 and behind >= 0 else np.inf


def _mechanism(start: float, end: float, slope: float, tangent: float) -> tuple[Any, ...]:
    """Spiral (k, 2) about the pole, with radius 1 at its start; first moment of the soil's area; dissipation over c."""
    angles = np.linspace(start, end, 101)
    radius = np.exp((angles - start) * tangent)
    spiral = -radius[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
    x, y = np.vstack([spiral, _shoulder(spiral, slope)]).T
    x_next, y_next = np.roll(x, -1), np.roll(y, -1)
    moment = -np.sum((x + x_next) * (x * y_next - x_next * y)) / 6  # the soil to the left of the pole goes down
    swept = end - start
    dissipation = (radius[-1] ** 2 - 1) / (2 * tangent) if tangent > 0 else swept
    return spiral, moment, dissipation


def _shoulder(spiral: NDArray[np.float64], slope: float) -> Any:
    """Where the slope from the spiral's end, the toe, meets the level of its start."""
    height = spiral[0, 1] - spiral[-1, 1]
    back = height / math.tan(slope) if slope < math.pi / 2 else 0.0
    return np.array([spiral[-1, 0] - back, spiral[0, 1]])
