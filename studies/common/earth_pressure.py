"""Coefficients of earth pressure on a vertical wall with level ground: of the horizontal pressure, over the vertical one.

Angles are those of the friction of the soil, phi, and between soil and wall, delta, in radians. Without wall friction all are
Rankine's, tan^2(45 degrees -+ phi / 2).
"""

from __future__ import annotations

import numpy as np


def stress_field(phi: float, delta: float, *, passive: bool) -> float:
    """Coefficient by stresses in equilibrium below the strength: the passive coefficient is too low, the active one too high.

    R. Lancellotta, Géotechnique 52 (2002) 617, for the passive pressure; the active one likewise, with the other signs.
    """
    sign = 1.0 if passive else -1.0
    turn = np.arcsin(np.sin(delta) / np.sin(phi)) + sign * delta
    oblique = np.cos(delta) + sign * np.sqrt(np.sin(phi) ** 2 - np.sin(delta) ** 2)
    return float(np.cos(delta) * oblique / (1 - sign * np.sin(phi)) * np.exp(sign * turn * np.tan(phi)))


def coulomb(phi: float, delta: float, *, passive: bool) -> float:
    """Coefficient by a sliding plane wedge: too low for active pressure, too high for passive, more so on rough walls."""
    sign = -1.0 if passive else 1.0
    root = np.sqrt(np.sin(phi + delta) * np.sin(phi) / np.cos(delta))
    return float(np.cos(phi) ** 2 / (1 + sign * root) ** 2)


def wall_acceleration(
    phi: float, delta: float, *, weight: float, cohesion: float, height: float, mass: float, support: float
) -> float:
    """Horizontal acceleration at which a wall of some mass gives way with a plane wedge behind it [m/s2]; 0 where it stands.

    The wedge slides on the plane at which it does so fastest, and goes down by tan(theta) of what the wall goes sideways.

    Args:
        weight: unit weight of the soil [N/m3], under gravity of 9.81 m/s2.
        cohesion: on the plane, not on the wall [Pa].
        height: of the wall [m].
        mass: of the wall, kg per metre.
        support: force that holds the wall, N per metre.
    """
    theta = np.linspace(phi, np.pi / 2, 2002)[1:-1]
    wedge = 0.5 * weight / 9.81 * height**2 / np.tan(theta)
    slope = np.tan(theta - phi)
    hung = 1 + np.tan(delta) * slope  # what a force on the wall takes from the wedge
    driving = (9.81 * wedge - cohesion * height) * slope - support * hung - cohesion * height / np.tan(theta)
    return float(np.maximum(driving / (wedge * (1 + np.tan(theta) * slope) + mass * hung), 0).max())
