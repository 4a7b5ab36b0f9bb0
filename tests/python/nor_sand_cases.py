"""What the tests of NorSand share: a sand, its states, elements of it, and its equations."""

import numpy as np
from law_cases import mean_and_radius, principal, triaxial

import mpm_core as mpm

GAMMA, LAMBDA, M, CHI, N, H, RIGIDITY, NU = 0.9, 0.03, 1.25, 4.0, 0.2, 100.0, 200.0, 0.2
PARAMETERS = {"critical_void_ratio": GAMMA, "critical_compression": LAMBDA, "critical_slope": M, "dilatancy": CHI,
              "coupling": N, "hardening": H, "rigidity": RIGIDITY, "poisson": NU, "void_ratio": 0.8}  # fmt: skip
SAND = mpm.NorSand(**PARAMETERS, image_pressure=100e3)
BULK = RIGIDITY * 2 * (1 + NU) / (3 * (1 - 2 * NU))
"""K / p"""
LOOSE, DENSE = 0.08, -0.15
"""State parameters"""


def sand(**changes):
    return mpm.NorSand(**{**PARAMETERS, "image_pressure": 100e3, **changes})


def isotropic(pressure):
    return [-pressure] * 3 + [0.0] * 3


def states_of(law, stress, psi, overconsolidation=1.0):
    """The states at the start, shape (n, 3)."""
    states = np.zeros((len(stress), law.n_state))
    for name, values in mpm.nor_sand_state(law, stress, psi, overconsolidation).items():
        states[:, law.state_names.index(name)] = values
    return states


def element(law, pressure, psi, overconsolidation=1.0):
    stress = np.array(isotropic(pressure))
    return mpm.ElementTest(law, stress, states_of(law, stress[None], psi, overconsolidation)[0])


def p_and_q(stress):
    p, radius = mean_and_radius(np.atleast_2d(stress))
    return -p, np.sqrt(3) * radius


def void_ratio(law, state):
    return (1 + law.void_ratio) * np.exp(np.atleast_2d(state)[:, 2]) - 1


def image_pressure(law, state):
    return (law.image_pressure + law.attraction) * np.exp(np.atleast_2d(state)[:, 1])


def critical(p, law=SAND):
    return law.critical_void_ratio - law.critical_compression * np.log(p / 1e3)


def direction_factor(stress, slope=M):
    """g: the fourth power of M / M(theta) is linear in cos(3 theta), from 1 in compression to that of 1 + M / 3 in extension."""
    minor, middle, major = -principal(np.atleast_2d(stress)).T  # positive in compression
    theta = np.arctan2(np.sqrt(3) * (middle - minor), 2 * major - middle - minor)
    return np.interp(np.cos(3 * theta), [-1, 1], [(1 + slope / 3) ** 4, 1]) ** 0.25


def excess(law, stress, state):
    """The yield function over the pressure."""
    p, q = p_and_q(stress)
    p = p + law.attraction
    image = image_pressure(law, state)
    psi = void_ratio(law, state) - critical(image, law)
    slope = np.maximum(M - law.coupling * law.dilatancy * np.abs(psi), M / 2)
    return direction_factor(stress) * q / p - slope * (1 + np.log(image / p))


def drained(law, psi, axial, steps, pressure=100e3):
    """Triaxial compression: strain, p, q, e and p_i of all steps."""
    test, rows = element(law, pressure, psi), []
    for _ in range(steps):
        test.step([axial / steps, None, None, 0.0, 0.0, 0.0])
        rows.append((*test.strain, *test.stress, *test.state))
    rows = np.array(rows)
    p, q = p_and_q(rows[:, 6:12])
    return rows[:, :6], p, q, void_ratio(law, rows[:, 12:]), image_pressure(law, rows[:, 12:])


def undrained(law, psi, axial, steps, pressure=100e3):
    """p' and q of triaxial compression at constant volume."""
    _, stress = triaxial(element(law, pressure, psi), axial, steps, drained=False)
    return p_and_q(stress)


def residual_pressure(psi, pressure=100e3):
    """p_c(e) = exp((gamma - e) / lambda) kPa at the void ratio of the start."""
    return 1e3 * np.exp((GAMMA - critical(pressure) - psi) / LAMBDA)
