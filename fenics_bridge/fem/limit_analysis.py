"""Collapse of a slope by limit analysis: the reference for finite elements."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from mpm_core.input_warnings import warn_of_radians
from numpy.typing import NDArray
from scipy import optimize

from fenics_bridge.errors import InputError
from mpm_core import checks

_Array = NDArray[np.float64]

FAR = 3.0
"""Logarithm of the collapse load over the load beyond which it does not matter how large it is"""
ALIKE = 1e-10
"""Relative difference of loads below which a finer search finds no other"""


@dataclass(frozen=True)
class LogSpiral:
    """Rotational mechanism of a slope: the soil above a logarithmic spiral rotates about its pole.

    Coordinates are those of `slope_mesh`, with the shoulder of the slope at (crest, height).
    """

    unit_weight: float
    """Unit weight at collapse [N/m3]"""
    pole: _Array
    """Pole of the rotation [m], shape (2,)"""
    curve: _Array
    """Slip surface from the crest to the toe, to the slope above it or to the ground before it [m], shape (k, 2)"""

    def __repr__(self) -> str:
        (x0, y0), (x1, y1) = self.curve[0], self.curve[-1]
        return (
            f"<LogSpiral: collapse at {self.unit_weight:.6g} N/m3, from ({x0:.4g}, {y0:.4g}) to ({x1:.4g}, {y1:.4g}) m about "
            f"({self.pole[0]:.4g}, {self.pole[1]:.4g}) m>"
        )


def log_spiral(
    height: float,
    angle: float,
    cohesion: float,
    friction_angle: float,
    crest: float = 0.0,
    *,
    depth: float | None = None,
    seismic: float = 0.0,
) -> LogSpiral:
    """Least upper bound of the collapse load over all spirals, with associated flow.

    Equates the work of the weight, and of horizontal inertia forces beside it, with the dissipation along the spiral (Chen 1975,
    Limit Analysis and Soil Plasticity, ch. 9). Without friction the spirals are circles, and those that end before the toe are the base failures of Taylor (1937,
    Stability of earth slopes).

    Args:
        height: height of the slope [m].
        angle: angle of the slope [degrees], above the friction angle less atan(seismic).
        cohesion: cohesion of the soil [Pa].
        friction_angle: friction angle of the soil [degrees].
        crest: horizontal coordinate of the shoulder [m].
        depth: of the ground of the same soil below the toe [m], into which spirals may reach: they end before the toe, at the
            toe, or on the slope. None: they end at the toe, however deep they dip below its level before; `curve` of the
            result shows it.
        seismic: horizontal seismic coefficient, the inertia force out of the slope over the weight [-], from 0 on. Above
            tan(friction_angle) ground of any strength slides on a level that is deep enough, so that `depth` is needed.

    Raises:
        InputError: angles or lengths out of range, or a slope so little steeper than the friction angle that it always stands.
    """
    slope = _checked(height, angle, cohesion, friction_angle, depth, seismic)
    if _slides_on_a_level(friction_angle, depth, seismic):
        raise InputError(_without_depth(f"seismic={seismic:g} above tan(friction_angle={friction_angle!r})"))
    warn_of_radians(angle=angle, friction_angle=friction_angle)
    best = _best(slope)
    if not np.isfinite(best.load):
        raise InputError(
            f"angle is {angle!r} degrees, expected one further above friction_angle={friction_angle!r} degrees: there is no "
            "mechanism"
        )
    size = height / best.height
    pole = np.array([crest, height]) - size * best.shoulder
    return LogSpiral(float(best.load) * cohesion / height, pole, pole + size * best.spiral)


def log_spiral_safety(
    height: float,
    angle: float,
    cohesion: float,
    friction_angle: float,
    unit_weight: float,
    *,
    depth: float | None = None,
    seismic: float = 0.0,
) -> float:
    """Factor of safety of a slope by the mechanism of `log_spiral`: the strength divided by it just fails at the unit weight.

    Args:
        height: height of the slope [m].
        angle: angle of the slope [degrees].
        cohesion: cohesion of the soil [Pa].
        friction_angle: friction angle of the soil [degrees].
        unit_weight: unit weight of the soil [N/m3].
        depth, seismic: see `log_spiral`. Without `depth` the factor is at most tan(friction_angle) / seismic.

    Raises:
        InputError: angles or lengths out of range.
    """
    _require_weight(unit_weight)
    _require_seismic(seismic)
    if friction_angle == 0 and _slides_on_a_level(friction_angle, depth, seismic):
        raise InputError(_without_depth(f"seismic={seismic:g} without friction"))
    warn_of_radians(angle=angle, friction_angle=friction_angle)

    @cache  # the search asks for those of the ends several times
    def margin(logarithm: float) -> float:
        factor = math.exp(logarithm)
        reduced = math.degrees(math.atan(math.tan(math.radians(friction_angle)) / factor))
        return _margin(height, angle, cohesion / factor, reduced, unit_weight, depth, seismic)

    most = 1e2
    if depth is None and seismic > 0:  # a level that is deep enough slides with any more
        most = min(most, (1 - ALIKE) * math.tan(math.radians(friction_angle)) / seismic)
    return math.exp(_root(margin, math.log(1e-2), math.log(most)))


def log_spiral_seismic(
    height: float,
    angle: float,
    cohesion: float,
    friction_angle: float,
    unit_weight: float,
    *,
    depth: float | None = None,
) -> float:
    """Critical seismic coefficient of a slope: the horizontal inertia force over the weight at which `log_spiral` fails [-].

    Args:
        height, angle, cohesion, friction_angle, unit_weight, depth: see `log_spiral_safety`. Without `depth` the coefficient is
            at most tan(friction_angle).

    Raises:
        InputError: angles or lengths out of range, a slope that does not stand without inertia, or soil without friction and depth.
    """
    _require_weight(unit_weight)
    if friction_angle == 0 and depth is None:
        raise InputError(_without_depth("friction_angle=0"))
    warn_of_radians(angle=angle, friction_angle=friction_angle)

    @cache  # the search asks for those of the ends several times
    def margin(seismic: float) -> float:
        return _margin(height, angle, cohesion, friction_angle, unit_weight, depth, seismic)

    if margin(0.0) <= 0:
        raise InputError(f"unit_weight is {unit_weight!r} N/m3, expected a slope that stands without inertia")
    low, high = 0.0, 0.5
    if depth is None:  # a level that is deep enough slides under any more
        high = (1 - ALIKE) * math.tan(math.radians(friction_angle))
    else:
        while margin(high) > 0:
            low, high = high, 2 * high
    return _root(margin, low, high)


def _root(margin: Callable[[float], float], low: float, high: float) -> float:
    """Where a margin that falls is zero, to 5e-7; an end where it is not zero between them."""
    if margin(low) <= 0:
        return low
    if margin(high) >= 0:
        return high
    return float(optimize.brentq(margin, low, high, xtol=5e-7))


def _margin(
    height: float,
    angle: float,
    cohesion: float,
    friction_angle: float,
    unit_weight: float,
    depth: float | None,
    seismic: float,
) -> float:
    """Logarithm of the collapse load of a slope over its unit weight, between -FAR and FAR; positive where no mechanism moves it."""
    if _slides_on_a_level(friction_angle, depth, seismic):
        return -FAR
    if friction_angle >= angle + _tilt(seismic):
        return FAR
    slope = _checked(height, angle, cohesion, friction_angle, depth, seismic)
    return float(np.clip(np.log(_best(slope).load * cohesion / (unit_weight * height)), -FAR, FAR))


class _Slope(NamedTuple):
    """What decides about the best spiral."""

    angle: float
    """Angle of the slope [rad]"""
    tangent: float
    """Tangent of the friction angle"""
    depth: float | None
    """Of the ground below the toe over the height of the slope"""
    seismic: float
    """Horizontal inertia force over the weight"""


class _Mechanisms(NamedTuple):
    """Spirals of any array of angles, with radius 1 at their starts, and coordinates about the pole."""

    load: Any
    """Dimensionless collapse loads, gamma H / c; infinite where the angles make no mechanism"""
    height: Any
    """Height of the slope"""
    shoulder: _Array
    """Shoulder of the slope, shape (..., 2)"""
    spiral: _Array
    """Shape (..., k, 2)"""


def _slides_on_a_level(friction_angle: float, depth: float | None, seismic: float) -> bool:
    """Whether inertia moves ground without end: its part beyond friction grows with the depth of a level, cohesion does not."""
    return depth is None and seismic > math.tan(math.radians(friction_angle))


def _without_depth(given: str) -> str:
    return (
        f"depth is None with {given}, expected the depth of the ground below the toe [m]: inertia moves ground that is deep enough, "
        "however strong it is"
    )


def _require_weight(unit_weight: float) -> None:
    if not 0 < unit_weight < math.inf:
        raise InputError(f"unit_weight is {unit_weight!r} N/m3, expected a positive number")


def _require_seismic(seismic: Any) -> None:
    if checks.real_numbers("seismic", seismic).ndim or not 0 <= seismic < math.inf:
        raise InputError(f"seismic is {seismic!r}, expected a number of at least 0")


def _tilt(seismic: float) -> float:
    """Angle by which horizontal inertia tilts the weight [degrees]."""
    return math.degrees(math.atan(seismic))


def _checked(
    height: float, angle: float, cohesion: float, friction_angle: float, depth: float | None, seismic: float
) -> _Slope:
    _require_seismic(seismic)
    if not (0 <= friction_angle < angle + _tilt(seismic) and 0 < angle <= 90):
        less = " < angle" if seismic == 0 else f" < angle + atan({seismic:g})"
        raise InputError(
            f"angle is {angle!r} degrees with friction_angle={friction_angle!r}; expected "
            f"0 <= friction_angle{less}, and angle <= 90"
        )
    if not (height > 0 and cohesion > 0):
        raise InputError(f"height and cohesion are {height!r} m, {cohesion!r} Pa, expected positive numbers")
    if depth is not None and not 0 <= depth < math.inf:
        raise InputError(f"depth is {depth!r} m, expected a number of at least 0, or None")
    return _Slope(
        math.radians(angle), math.tan(math.radians(friction_angle)), None if depth is None else depth / height, seismic
    )


def _best(slope: _Slope) -> _Mechanisms:
    """The mechanism with the least load."""
    kinds = (_through_slope,) if slope.depth is None else (_through_slope, _before_toe)
    return min((_searched(kind, slope) for kind in kinds), key=lambda found: float(found.load))


def _searched(mechanisms: Any, slope: _Slope) -> _Mechanisms:
    """The best of the mechanisms that two fractions between 0 and 1 describe: a grid search, refined around its best point.

    It ends where all loads of the grid are alike. In a corner of the possible ones they never are.
    """
    centre, half, points = np.full(2, 0.5), 0.5, 25
    for _ in range(20):
        start, end = np.clip(centre[:, None] + half * np.linspace(-1, 1, points), 1e-6, 1 - 1e-6)
        loads = mechanisms(slope, start[:, None], end).load
        i, j = np.unravel_index(np.argmin(loads), loads.shape)
        centre, half, points = np.array([start[i], end[j]]), 0.4 * half, 13
        if loads.max() < (1 + ALIKE) * loads[i, j]:
            break
    return mechanisms(slope, *centre)


def _through_slope(slope: _Slope, start_fraction: Any, end_fraction: Any) -> _Mechanisms:
    """Spirals that end at the toe, or so far above it, on the slope, that they reach no deeper than the ground.

    Below the pole they are inclined by the friction angle, as much as slopes that fail by their weight are at least. Inertia lets
    flatter slopes fail as well, by spirals that start further, where they are level at most.
    """
    start = start_fraction * (np.pi / 2 + (math.atan(slope.tangent) if slope.seismic > 0 else 0.0))
    end = start + end_fraction * (np.pi - start)
    x, y = _points(slope, start, end)
    rise = y[..., 0] - y[..., -1]
    depth = math.inf if slope.depth is None else slope.depth
    height = np.maximum(rise, (y[..., 0] - y.min(axis=-1)) / (1 + depth))
    return _mechanisms(slope, end - start, (x, y), x[..., -1], height)


def _before_toe(slope: _Slope, start_fraction: Any, end_fraction: Any) -> _Mechanisms:
    """Spirals that rise to the ground before the toe, and reach no deeper than the ground.

    Without inertia the pole is above the middle of the slope, as far as the toe is above the spiral: a slope further to the left
    has lost soil that drives, one further to the right has soil that resists. With it the same holds of the line from the pole
    along the tilted weight.
    """
    assert slope.depth is not None
    start = start_fraction * np.pi / 2
    lowest = np.pi / 2 + np.arctan(slope.tangent)
    (top, bottom), level = (_level(slope, start, angle) for angle in (start, lowest)), slope.depth / (1 + slope.depth)
    below, above = np.broadcast_arrays(lowest + 0 * start, np.pi)
    for _ in range(50):  # the end that is as high above the lowest point as the ground is deep
        middle = 0.5 * (below + above)
        is_above = _level(slope, start, middle) > bottom + level * (top - bottom)
        below, above = np.where(is_above, below, middle), np.where(is_above, middle, above)
    end = lowest + end_fraction * (above - lowest)
    x, y = _points(slope, start, end)
    height = y[..., 0] - y[..., -1]
    back = height / math.tan(slope.angle)
    middle = 0.5 * back - slope.seismic * 0.5 * (y[..., 0] + y[..., -1])
    toe = np.minimum(np.maximum(middle, x[..., 0] + back), x[..., -1])
    return _mechanisms(slope, end - start, (x, y), toe, height)


def _level(slope: _Slope, start: Any, angle: Any) -> Any:
    return -np.exp((angle - start) * slope.tangent) * np.sin(angle)


def _points(slope: _Slope, start: Any, end: Any) -> tuple[_Array, _Array]:
    """Coordinates of 101 points of spirals, of shape (..., 101)."""
    swept = np.asarray(end - start)[..., None] * np.linspace(0, 1, 101)
    angles, radius = np.asarray(start)[..., None] + swept, np.exp(swept * slope.tangent)
    return -radius * np.cos(angles), -radius * np.sin(angles)


def _mechanisms(slope: _Slope, swept: Any, spiral: tuple[_Array, _Array], toe: Any, height: Any) -> _Mechanisms:
    """Loads from the spirals, where the slope meets the level of their ends, and its height."""
    x, y = spiral
    rise = y[..., 0] - y[..., -1]
    shoulder = toe - rise / math.tan(slope.angle)
    corners = np.stack([x[..., 0], shoulder, toe, x[..., -1]], axis=-1)
    with np.errstate(all="ignore"):
        surface = y[..., -1:] + np.clip((corners[..., 2:3] - x) * math.tan(slope.angle), 0, rise[..., None])
        is_below = (y <= surface + 1e-9).all(axis=-1)
        around = np.concatenate([x, corners[..., 2:0:-1]], axis=-1), np.concatenate([y, y[..., [-1, 0]]], axis=-1)
        moment = _moment(*around)
        if slope.seismic > 0:
            moment += slope.seismic * _moment(around[1], -around[0])
        ratio = np.exp(2 * swept * slope.tangent)
        dissipation = (ratio - 1) / (2 * slope.tangent) if slope.tangent > 0 else swept
        is_possible = is_below & (moment > 0) & (rise > 0) & (shoulder >= x[..., 0])
        load = np.where(is_possible, dissipation * height / moment, np.inf)
    return _Mechanisms(load, height, np.stack([shoulder, y[..., 0]], axis=-1), np.stack([x, y], axis=-1))


def _moment(x: _Array, y: _Array) -> Any:
    """Moment of the weight about the pole, over the unit weight; the soil to the left of the pole goes down.

    Where the pole is far away from the soil, compared with its size, hardly a digit would be left: the moment is then taken about
    the first point at first.
    """
    u, v = x - x[..., :1], y - y[..., :1]
    size, distance = np.hypot(u, v).max(axis=-1), np.hypot(x[..., 0], y[..., 0])
    origin = np.where(size < 0.1 * distance, 1.0, 0.0)[..., None]
    x0, y0 = origin * x[..., :1], origin * y[..., :1]
    u, v = (np.concatenate([a, a[..., :1]], axis=-1) for a in (x - x0, y - y0))  # back to the first point
    cross = u[..., :-1] * v[..., 1:] - u[..., 1:] * v[..., :-1]
    return -np.sum((u[..., :-1] + u[..., 1:]) * cross, axis=-1) / 6 - x0[..., 0] * np.sum(cross, axis=-1) / 2
