"""Newmark's sliding block: what it moves on shaken ground, and the acceleration at which a slope begins to yield.

Newmark (1965), Effects of earthquakes on dams and embankments, Géotechnique 15, 139-160.
"""

from __future__ import annotations

import cmath
import math

import numpy as np
from scipy.optimize import differential_evolution

import mpm_core as mpm

SAMPLES = 400
"""Points on a slip line"""

IMPOSSIBLE = 1e3
"""Coefficient of acceleration of a spiral that leaves the soil"""


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
        depth: of the soil below the toe [m], which spirals do not leave; inf where the worst spiral is known to be a shallow one.

    Raises:
        InputError: depth is inf, and the slope would yield at more than g tan(friction_angle). At that acceleration soil of unlimited
            depth slides as a whole, so that there is no worst spiral: those that reach deeper are always worse.
    """
    slope, friction = np.radians(angle), np.radians(friction_angle)

    def begin(start: float) -> np.ndarray:
        return np.array([height / np.tan(slope) + height * np.exp(start), height])

    def coefficient(start: float, turn: float) -> float:
        return _coefficient(begin(start), turn, slope, cohesion, friction, unit_weight)

    # Deep and shallow spirals have a minimum each, deep ones where they touch the bottom, at the end of the range of turns.
    starts, parts = np.linspace(*np.log([1e-3, 1e3]), 70), np.linspace(0.0, 1.0, 41)[1:]
    largest = [_largest_turn(begin(start), friction, depth) for start in starts]
    trials = [(start, part, most) for start, most in zip(starts, largest) for part in parts]
    best = np.array(min(trials, key=lambda trial: coefficient(trial[0], trial[1] * trial[2]))[:2])
    around = np.array([starts[1] - starts[0], parts[1] - parts[0]])
    box = np.transpose([best - around, np.minimum(best + around, (np.inf, 1.0))])
    worst = differential_evolution(
        lambda where: coefficient(where[0], where[1] * _largest_turn(begin(where[0]), friction, depth)),
        box,
        tol=1e-8,
        seed=1,
        polish=False,
    )
    if not np.isfinite(depth) and worst.fun > np.tan(friction):
        raise mpm.InputError(
            f"depth is inf, expected the depth of the soil below the toe: soil of unlimited depth slides as a whole at "
            f"g tan(friction_angle) = {gravity * np.tan(friction):.3g} m/s2, before a slope of this strength yields"
        )
    return gravity * float(worst.fun)


def _spiral(begin: np.ndarray, turn: float, friction: float) -> tuple[complex, float]:
    """First radius, as a complex number whose argument is its angle below the horizontal, and last angle of the spiral that turns by
    an angle from a point to the toe, which is the origin."""
    ray = -complex(begin[0], -begin[1]) / (cmath.exp(turn * (math.tan(friction) + 1j)) - 1)
    return ray, cmath.phase(ray) + turn


def _largest_turn(begin: np.ndarray, friction: float, depth: float) -> float:
    """Turn of the spiral to the toe that begins and ends at the horizontal of its centre at most, or reaches a depth below the toe."""
    lowest = 0.5 * math.pi + friction
    least, most = 0.0, math.pi
    for _ in range(40):
        turn = 0.5 * (least + most)
        ray, end = _spiral(begin, turn, friction)
        start = end - turn
        reaches = abs(ray) * (
            math.exp((lowest - start) * math.tan(friction)) * math.sin(lowest)
            - math.exp(turn * math.tan(friction)) * math.sin(end)
        )
        fits = 0.0 < start and end < math.pi and (end < lowest or reaches < depth)
        least, most = (turn, most) if fits else (least, turn)
    return least


def _coefficient(
    begin: np.ndarray, turn: float, slope: float, cohesion: float, friction: float, unit_weight: float
) -> float:
    """Horizontal over vertical acceleration by the spiral that turns by an angle from a point on the crest to the toe, the origin."""
    ray, end = _spiral(begin, turn, friction)
    spiral = ray * np.exp(np.linspace(0.0, turn, SAMPLES) * (np.tan(friction) + 1j))
    x, y = spiral.real, -spiral.imag  # from the centre; the slope descends to the left
    height = begin[1]
    if np.any(y[1:-1] > np.minimum(y[0], y[-1] + np.tan(slope) * (x[1:-1] - x[-1])) + 1e-9 * height):
        return IMPOSSIBLE
    area, centroid = _polygon(np.append(x, x[-1] + height / np.tan(slope)), np.append(y, y[0]))
    dissipation = cohesion * (abs(spiral[-1]) ** 2 - abs(ray) ** 2) / (2 * np.tan(friction))
    # the mass turns to the left and downwards: its weight acts on the arm x, horizontal inertia to the left on the arm -y
    return float((dissipation / (unit_weight * area) - centroid[0]) / -centroid[1])


def _polygon(x: np.ndarray, y: np.ndarray) -> tuple[float, np.ndarray]:
    """Area and centroid of a polygon."""
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = 0.5 * cross.sum()
    centroid = [((c + np.roll(c, -1)) * cross).sum() / (6 * area) for c in (x, y)]
    return abs(float(area)), np.array(centroid)
