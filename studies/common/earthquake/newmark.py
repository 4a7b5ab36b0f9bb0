"""Newmark's sliding block: what it moves on shaken ground, and the acceleration at which a slope begins to yield.

Newmark (1965), Effects of earthquakes on dams and embankments, Géotechnique 15, 139-160.
"""

from __future__ import annotations

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
    slope, friction = np.radians([angle, friction_angle])
    box = [np.log([1e-3, 1e4]), (0.02, 1.0)]  # as they turn by less, spirals become planes, with a pole far away
    worst = differential_evolution(
        lambda where: _coefficients(*where, height, slope, cohesion / unit_weight, friction, depth),
        box, popsize=40, tol=1e-8, seed=1, polish=False, updating="deferred", vectorized=True,
    )  # fmt: skip
    if not np.isfinite(depth) and worst.fun > np.tan(friction):
        raise mpm.InputError(
            f"depth is inf, expected the depth of the soil below the toe: soil of unlimited depth slides as a whole at "
            f"g tan(friction_angle) = {gravity * np.tan(friction):.3g} m/s2, before a slope of this strength yields"
        )
    return gravity * float(worst.fun)


def _coefficients(
    behind: np.ndarray, part: np.ndarray, height: float, slope: float, strength: float, friction: float, depth: float
) -> np.ndarray:
    """Horizontal over vertical acceleration by spirals from the crest to the toe: (n,).

    Args:
        behind: where they begin behind the shoulder (n,), as the logarithm of the distance over the height.
        part: of the largest angle by which a spiral may turn (n,), see `_largest_turn`.
        height: [m]; slope, friction: angles [rad]; depth: [m].
        strength: cohesion over unit weight [m].
    """
    growth, back = np.tan(friction) + 1j, height / np.tan(slope)
    begin = (back + height * np.exp(behind) - 1j * height)[:, None]  # from the toe, downwards
    turn = part[:, None] * _largest_turn(begin, friction, depth)
    spiral = _radius(begin, turn, growth) * np.exp(np.linspace(0.0, 1.0, SAMPLES) * turn * growth)
    x, y = spiral.real, -spiral.imag  # from the centre; the slope descends to the left
    surface = np.minimum(y[:, :1], y[:, -1:] + np.tan(slope) * (x - x[:, -1:]))
    is_below = np.all(y <= surface + 1e-9 * height, axis=1)
    dissipation = strength * np.diff(np.abs(spiral[:, [0, -1]]) ** 2)[:, 0] / (2 * growth.real)
    x, y = np.hstack([x, x[:, -1:] + back]), np.hstack([y, y[:, :1]])
    cross = x * np.roll(y, -1, axis=1) - np.roll(x, -1, axis=1) * y  # of the soil, a polygon
    across, up = (np.sum((c + np.roll(c, -1, axis=1)) * cross, axis=1) / 6 for c in (x, y))
    # the mass turns to the left and downwards: its weight acts on the arm x, horizontal inertia to the left on the arm -y
    sign = np.sign(cross.sum(axis=1))
    return np.where(is_below, (dissipation - sign * across) / (-sign * up), IMPOSSIBLE)


def _radius(begin: np.ndarray, turn: np.ndarray, growth: complex) -> np.ndarray:
    """First radii of spirals to the toe, as complex numbers whose arguments are their angles below the horizontal."""
    return -begin / (np.exp(turn * growth) - 1)


def _largest_turn(begin: np.ndarray, friction: float, depth: float) -> np.ndarray:
    """Turn of spirals to the toe that begin and end at the horizontal of their centre at most, or reach a depth below the toe."""
    growth, lowest = np.tan(friction) + 1j, 0.5 * np.pi + friction
    least, most = np.zeros(begin.shape), np.full(begin.shape, np.pi)
    for _ in range(40):
        turn = 0.5 * (least + most)
        radius = _radius(begin, turn, growth)
        start, end = np.angle(radius), radius * np.exp(turn * growth)
        reaches = np.abs(radius) * np.exp((lowest - start) * growth.real) * np.sin(lowest) - end.imag
        fits = (0.0 < start) & (start + turn < np.pi) & ((start + turn < lowest) | (reaches < depth))
        least, most = np.where(fits, turn, least), np.where(fits, most, turn)
    return least
