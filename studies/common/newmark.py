"""Newmark's sliding block: what it moves on shaken ground, and the acceleration at which a slope begins to yield.

Newmark (1965), Effects of earthquakes on dams and embankments, Géotechnique 15, 139-160.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import minimize

SAMPLES = 400
"""Points on a slip line"""


def sliding_block(
    time: np.ndarray, ground: np.ndarray, yield_acceleration: float, uphill: float = np.inf
) -> tuple[np.ndarray, np.ndarray]:
    """Motion of a rigid block relative to the ground, exact for a velocity of the ground that is linear between its samples.

    Args:
        time: rising times (n) [s].
        ground: velocity of the ground along the plane, positive downhill (n) [m/s].
        yield_acceleration: at which the block begins to slide downhill, above 0 [m/s2].
        uphill: at which it begins to slide uphill [m/s2].

    Returns:
        Velocity [m/s] and displacement [m] of the block relative to the ground, positive downhill, (n) each.
    """
    velocity, moved = np.zeros(len(time)), np.zeros(len(time))
    for k, dt in enumerate(np.diff(time)):
        pull = -(ground[k + 1] - ground[k]) / dt  # acceleration of a block that the ground does not hold
        v, u, left = velocity[k], moved[k], dt
        while left > 0:
            if v > 0 or (v == 0 and pull > yield_acceleration):
                a = pull - yield_acceleration
            elif v < 0 or (v == 0 and pull < -uphill):
                a = pull + uphill
            else:
                break
            part = min(left, -v / a) if v * a < 0 else left  # until the block sticks
            u += v * part + 0.5 * a * part**2
            v = v + a * part if part == left else 0.0
            left -= part
        velocity[k + 1], moved[k + 1] = v, u
    return velocity, moved


def pulse_slip(speed: float, acceleration: float, yield_acceleration: float) -> float:
    """Slip of a block under a rectangular pulse of acceleration, V^2 / (2 a_y) (1 - a_y / A) (Newmark 1965, eq. 11) [m].

    Args:
        speed: V that the ground has at the end of the pulse [m/s].
        acceleration: A of the pulse [m/s2].
        yield_acceleration: a_y [m/s2].
    """
    return speed**2 / (2 * yield_acceleration) * (1 - yield_acceleration / acceleration)


def yield_acceleration(
    height: float,
    angle: float,
    cohesion: float,
    friction_angle: float,
    unit_weight: float,
    gravity: float = 9.81,
    depth: float = np.inf,
) -> float:
    """Horizontal acceleration at which a uniform slope fails, by limit analysis [m/s2]; below 0 where it does not stand.

    The least over logarithmic spirals through the toe on which the soil above rotates (Chen 1975, Limit Analysis and Soil
    Plasticity, ch. 9, with a horizontal inertia beside the weight; an upper bound for associated flow).

    Args:
        height: [m]; angle: [degrees].
        cohesion: [Pa]; friction_angle: above 0 [degrees].
        unit_weight: [N/m3].
        gravity: [m/s2].
        depth: of the soil below the toe [m], which spirals do not leave; under inertia those in weak soil reach deep.
    """
    slope, friction = np.radians(angle), np.radians(friction_angle)

    def coefficient(ends: np.ndarray) -> float:
        start, end = ends
        if not 0.0 < start < end - 0.05 < np.pi - 0.1:
            return 1e3
        return _coefficient(start, end, height, slope, cohesion, friction, unit_weight, depth)

    trials = [(start, end) for start in np.radians(np.arange(5, 90, 5)) for end in np.radians(np.arange(40, 170, 5))]
    first = min(trials, key=lambda ends: coefficient(np.array(ends)))
    return gravity * float(
        minimize(coefficient, first, method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9}).fun
    )


def _coefficient(
    start: float,
    end: float,
    height: float,
    slope: float,
    cohesion: float,
    friction: float,
    unit_weight: float,
    depth: float,
) -> float:
    """Horizontal over vertical acceleration by the spiral from an angle to another, below the horizontal of its centre."""
    turn = np.linspace(start, end, SAMPLES)
    spiral = np.exp((turn - start) * np.tan(friction))  # radii over the first
    x, y = spiral * np.cos(turn), -spiral * np.sin(turn)  # from the centre; the slope descends to the left
    size = height / (y[0] - y[-1]) if y[0] > y[-1] else np.nan  # the first radius
    if not size > 0:
        return 1e3
    x, y = size * x, size * y
    crest = np.array([x[-1] + height / np.tan(slope), y[0]])
    if crest[0] > x[0] or np.any(y[1:-1] > np.minimum(y[0], y[-1] + np.tan(slope) * (x[1:-1] - x[-1])) + 1e-9 * height):
        return 1e3  # the spiral begins before the crest, or leaves the soil
    if y.min() < y[-1] - depth:
        return 1e3
    area, centroid = _polygon(np.append(x, crest[0]), np.append(y, crest[1]))
    dissipation = cohesion * size**2 * (spiral[-1] ** 2 - 1) / (2 * np.tan(friction))
    # the mass turns to the left and downwards: its weight acts on the arm x, horizontal inertia to the left on the arm -y
    return float((dissipation / (unit_weight * area) - centroid[0]) / -centroid[1])


def _polygon(x: np.ndarray, y: np.ndarray) -> tuple[float, np.ndarray]:
    """Area and centroid of a polygon."""
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = 0.5 * cross.sum()
    centroid = [((c + np.roll(c, -1)) * cross).sum() / (6 * area) for c in (x, y)]
    return abs(float(area)), np.array(centroid)
