"""Closed forms of consolidation, of incompressible water and grains; pressures are excess pore pressures.

Times are factors T = c t / L^2, with the coefficient of consolidation c = k M / gamma_w of the oedometric modulus M.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
TERMS = 200
"""Terms of the series"""


def layer_pressure(height: ArrayLike, factor: float) -> Array:
    """Pressure over the load of a layer on an impervious base, drained on top (Terzaghi 1923); height over the layer's: (n,)."""
    m = np.pi * (np.arange(TERMS) + 0.5)
    return np.sum(2 / m * np.sin(m) * np.cos(np.outer(height, m)) * np.exp(-(m**2) * factor), axis=1)


def layer_settlement(factor: float) -> float:
    """Settlement of that layer over the final one."""
    m = np.pi * (np.arange(TERMS) + 0.5)
    return float(1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor)))


def mandel_pressure(x: ArrayLike, factor: float, poisson: float) -> Array:
    """Pressure over F / 2a between rigid plates that a force 2F per metre presses on a body of width 2a (Mandel 1953).

    Args:
        x: distance from the middle over a, (n,).
        factor: c t / a^2.
    """
    a = mandel_roots(poisson)
    weights = 2 * np.sin(a) / (a - np.sin(a) * np.cos(a)) * np.exp(-(a**2) * factor)
    return (np.cos(np.outer(x, a)) - np.cos(a)) @ weights


def mandel_settlement(factor: float, poisson: float) -> float:
    """Settlement of a plate at a height b over F b / (2 G a) (Cheng and Detournay 1988, eq. 36)."""
    a = mandel_roots(poisson)
    series = np.sum(np.sin(a) * np.cos(a) / (a - np.sin(a) * np.cos(a)) * np.exp(-(a**2) * factor))
    return float(1 - poisson - series)


def mandel_roots(poisson: float) -> Array:
    """Roots of tan(a) / a = (1 - nu) / (1/2 - nu), one in each half turn."""
    ratio, k = (1 - poisson) / (0.5 - poisson), np.pi * np.arange(TERMS)
    return roots(lambda a: np.sin(a) - ratio * a * np.cos(a), k + 1e-3, k + np.pi / 2)


def ball_pressure(factor: float, poisson: float) -> float:
    """Pressure over the load at the centre of a ball with a drained surface under an all-round load (Cryer 1963)."""
    eta, k = (1 - poisson) / (1 - 2 * poisson), np.pi * np.arange(1, TERMS + 1)
    x = roots(lambda x: (1 - eta * x**2 / 2) * np.sin(x) - x * np.cos(x), k - np.pi / 2, k)
    weights = eta * (np.sin(x) - x) / (eta * x * np.cos(x) / 2 + (eta - 1) * np.sin(x))
    return float(np.sum(weights * np.exp(-(x**2) * factor)))


def strip_pressure(depth: ArrayLike, half_width: float) -> Array:
    """Pressure over the load under the middle of a strip on a half-plane at once: (sigma_1 + sigma_3) / 2 = q alpha / pi."""
    return 2 * np.arctan(half_width / np.asarray(depth, dtype=float)) / np.pi


def roots(function: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """A root of a function in each interval, at whose ends it has different signs, by bisection: (n,)."""
    sign = np.sign(function(low))
    for _ in range(60):
        middle = 0.5 * (low + high)
        same = np.sign(function(middle)) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return 0.5 * (low + high)
