"""The bearing capacities that the verification case of the circular footing compares with, by the method of characteristics.

Cox, Eason and Hopkins (1961) for a smooth footing, Eason and Shield (1960) for a rough one: weightless Tresca soil, the hoop
stress equal to the smaller principal stress (Haar and von Karman). Compression is positive here, z points down, lengths are in
radii of the footing and stresses in shear strengths. With the mean stress p in the half section and the angle psi from the
radius to the major principal stress,

    sigma_r = p + cos 2 psi,   sigma_z = p - cos 2 psi,   tau = sin 2 psi,   sigma_hoop = p - 1,

equilibrium reads

    alpha lines, dz/dr = tan(psi - pi/4):  dp - 2 dpsi = -(dr - dz) / r
    beta lines,  dz/dr = tan(psi + pi/4):  dp + 2 dpsi = -(dr + dz) / r

The ground beside the footing bears nothing: psi = 0 and p = 1. At the edge a fan of beta lines leaves from one point,
p = 1 + 2 psi.
"""

import importlib
from pathlib import Path

import numpy as np
import pytest

VERIFICATION = Path(__file__).parents[3] / "studies" / "verification"
STEP = 1 / 32  # between the points on the ground, and between beta lines of the fan, in its opening


@pytest.fixture
def exact(monkeypatch):
    """By roughness, the bearing capacity and its source."""
    monkeypatch.syspath_prepend(VERIFICATION)
    return importlib.import_module("circular_footing").EXACT


def meet(a, b):
    """The point (r, z, p, psi) where the alpha line through `a` meets the beta line through `b`; chords with mean angles."""
    point = (a + b) / 2
    for _ in range(50):
        alpha, beta = (a[3] + point[3]) / 2 - np.pi / 4, (b[3] + point[3]) / 2 + np.pi / 4
        normals = np.array([[np.sin(alpha), -np.cos(alpha)], [np.sin(beta), -np.cos(beta)]])
        r, z = np.linalg.solve(normals, [normals[0] @ a[:2], normals[1] @ b[:2]])
        along_alpha = a[2] - 2 * a[3] - 2 * (r - a[0] - z + a[1]) / (r + a[0])
        along_beta = b[2] + 2 * b[3] - 2 * (r - b[0] + z - b[1]) / (r + b[0])
        last, point = point, np.array([r, z, (along_alpha + along_beta) / 2, (along_beta - along_alpha) / 4])
        if np.abs(point - last).max() < 1e-12:
            break
    return point


def under_footing(a):
    """The point of a smooth footing that the alpha line through `a` reaches: psi = 90 degrees, no shear stress."""
    point = np.array([a[0] - a[1], 0.0, a[2], np.pi / 2])
    for _ in range(50):
        r = a[0] - a[1] / np.tan((a[3] + point[3]) / 2 - np.pi / 4)
        point = np.array([r, 0.0, a[2] - 2 * a[3] + np.pi - 2 * (r - a[0] + a[1]) / (r + a[0]), np.pi / 2])
    return point


def slip_lines(opening, smooth):
    """Last points of alpha lines, from the edge to the axis: under a smooth footing, or on the last slip line of the edge."""
    line = [np.array([1.0, 0.0, 1 + 2 * psi, psi]) for psi in opening * np.arange(0, 1 + STEP / 2, STEP)]
    last = [line[-1]]
    while last[-1][0] > 0:
        start, line = line, [np.array([1 + len(last) * STEP, 0.0, 1.0, 0.0])]
        for point in start:
            line.append(meet(line[-1], point))
        if smooth:
            line.append(under_footing(line[-1]))
        last.append(line[-1])
    beyond, before = last[-1], last[-2]
    return np.array([*last[:-1], before + (beyond - before) * before[0] / (before[0] - beyond[0])])


def mean_pressure(points):
    """The vertical force on a surface of revolution through the points, over the area of the footing."""
    r, _, p, psi = (points[1:] + points[:-1]).T / 2
    dr, dz = -np.diff(points[:, 0]), np.diff(points[:, 1])
    return 2 * np.sum(r * ((p - np.cos(2 * psi)) * dr + np.sin(2 * psi) * dz))


def test_a_smooth_footing_bears_what_the_source_says(exact):
    assert mean_pressure(slip_lines(np.pi / 2, smooth=True)) == pytest.approx(exact["smooth"][0], abs=0.005)


@pytest.mark.parametrize("opening", [116, 117, 118])
def test_a_rough_footing_bears_what_the_source_says(exact, opening):
    # The soil between the footing and the last slip line moves with the footing. That line ends on the axis, by symmetry under
    # 45 degrees, for an opening of the fan of 116 to 117 degrees; what it bears varies by 0.001 from 116 to 118 degrees.
    points = slip_lines(np.radians(opening), smooth=False)
    assert mean_pressure(points) == pytest.approx(exact["rough"][0], abs=0.005)
