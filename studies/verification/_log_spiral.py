"""Passive earth pressure by soil that rotates on a log-spiral: an upper bound for soil that dilates by its friction angle.

The spiral r = r_0 exp(theta tan(phi)) through the foot of the wall opens as the soil turns, so that the soil moves away from
the ground below at the angle phi, as associated flow does. The work of the pressure, which acts on the lower third of the
wall at the angle of wall friction, is that against the weight; the pole with the least pressure gives the bound.
"""

import numpy as np
from scipy.optimize import minimize

POINTS = 2000
STARTS = ((-0.5, 1.4), (-1.2, 1.9), (-3.2, 3.1), (-15.0, 9.0))
"""Poles from which the search begins, over the height of the wall"""


def turning(pole, phi, delta):
    """Coefficient of the horizontal pressure of soil that rotates about a pole; the wall is 1 high, its foot at the origin."""
    a, b = pole
    first, angle = np.arctan2(-b, -a), np.pi
    for _ in range(2):  # the second time with all points between the foot and the ground
        theta = first + np.linspace(0, angle, POINTS)
        r = np.hypot(a, b) * np.exp((theta - first) * np.tan(phi))
        x, y = a + r * np.cos(theta), b + r * np.sin(theta)
        out = int(np.argmax(y >= 1))
        angle = theta[out] - first
    push = b - 1 / 3 + a * np.tan(delta)  # work of a unit of horizontal force
    if b <= 0 or out == 0 or push <= 0 or (x[:out] < -1e-9).any():
        return np.inf
    x = np.r_[x[:out], np.interp(1, y[out - 1 : out + 1], x[out - 1 : out + 1]), 0.0]  # along the ground to the wall
    y = np.r_[y[:out], 1.0, 1.0]
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area, moment = cross.sum() / 2, ((x + np.roll(x, -1)) * cross).sum() / 6
    return 2 * (moment - a * area) / push


def log_spiral(phi, delta):
    """The least coefficient of the horizontal passive pressure [-]; angles in radians."""
    options = {"xatol": 1e-5, "fatol": 1e-8}
    return min(minimize(turning, start, (phi, delta), "Nelder-Mead", options=options).fun for start in STARTS)
