"""What the tests of Hardening Soil share: a sand, a clay, and the equations of the published law."""

import numpy as np
from law_cases import principal

import mpm_core as mpm

SAND = {"secant_modulus": 30e6, "oedometer_modulus": 30e6, "unloading_modulus": 90e6, "cohesion": 0.0,
        "friction_angle": 35.0, "dilation_angle": 5.0}  # fmt: skip
CLAY = {"secant_modulus": 5e6, "oedometer_modulus": 4e6, "unloading_modulus": 20e6, "cohesion": 8e3,
        "friction_angle": 24.0, "exponent": 0.9}  # fmt: skip
REFERENCE, FAILURE_RATIO = 100e3, 0.9


def sand(**changes):
    return mpm.HardeningSoil(**{**SAND, **changes})


def clay(**changes):
    return mpm.HardeningSoil(**{**CLAY, **changes})


def small_strain_sand(**changes):
    return sand(**{"small_strain_modulus": 150e6, "threshold_strain": 2e-4, **changes})


def isotropic(pressure):
    return np.array([-pressure] * 3 + [0.0] * 3)


def preloaded(law, pressure):
    """A point under an isotropic pressure whose cap is a hundred times as large as it needs to be: it hardens by shear only."""
    state = np.zeros(law.n_state)
    state[2] = mpm.hardening_soil_state(law, 100 * isotropic(pressure)[None])["log_preconsolidation"][0]
    return mpm.ElementTest(law, isotropic(pressure), state)


def attraction(law):
    return law.cohesion / np.tan(np.radians(law.friction_angle))


def stiffness_factor(law, smallest):
    """T^m at a smallest principal stress, positive in compression."""
    a = attraction(law)
    return ((smallest + a) / (law.reference_pressure + a)) ** law.exponent


def strength(law, smallest):
    """The largest difference of the principal stresses at a smallest one."""
    sine = np.sin(np.radians(law.friction_angle))
    return 2 * sine / (1 - sine) * (smallest + attraction(law))


def differences(stress):
    """Smallest principal stresses and s1 - s3, positive in compression, shape (n,) each."""
    p = -principal(np.atleast_2d(stress))
    return p[:, 0], p[:, 2] - p[:, 0]


def hyperbola(law, q, smallest):
    """Axial strain of a drained triaxial test without dilation."""
    factor = stiffness_factor(law, smallest)
    initial = 2 * law.secant_modulus * factor / (2 - law.failure_ratio)
    return q / (initial * (1 - law.failure_ratio * q / strength(law, smallest)))
