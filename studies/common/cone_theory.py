"""Cone resistance and the limit pressure of spherical cavities, as factors of the strength; penetration with partial drainage."""

from __future__ import annotations

import numpy as np

import mpm_core as mpm

STEEPNESS = np.sqrt(3.0)
"""Height of a cone over its radius: 60 degrees at its tip"""


STIFFEST, SOFTEST = 500.0, 50.0
"""Rigidity indices between which `teh_houlsby` and `lu` were fitted"""


def beyond_factors(rigidity: float) -> str:
    """What a warning says of a rigidity index for which there are no cone factors; empty for others."""
    if SOFTEST <= rigidity <= STIFFEST:
        return ""
    return f"the rigidity index is {rigidity:.3g}, beyond the {SOFTEST:g} to {STIFFEST:g} for which the cone factors of the literature hold"


def teh_houlsby(rigidity: float, roughness: float) -> float:
    """Cone factor of a 60 degree cone in Tresca soil under an isotropic stress, with a smooth shaft.

    C. I. Teh, G. T. Houlsby, Géotechnique 41 (1991) 17: strain paths, with a correction by finite elements.

    Args:
        rigidity: shear modulus over the shear strength, 50 to 500.
        roughness: shear strength of the face of the cone over that of the soil, 0 to 1.
    """
    return (1.25 + rigidity / 2000) * 4 / 3 * (1 + np.log(rigidity)) + 2.4 * roughness


def lu(rigidity: float, roughness: float) -> float:
    """Resistance fitted to large-strain finite elements by Q. Lu, M. F. Randolph, Y. Hu and I. C. Bugarski, Proc. ICOF (2004).

    Args:
        rigidity, roughness: as for `teh_houlsby`.
    """
    return 3.4 + 1.6 * np.log(rigidity) + 1.3 * roughness


def clay_factors(rigidity: float, roughness: float) -> dict[str, float]:
    """Both cone factors of clay by their source; rigidity, roughness as for `teh_houlsby`."""
    return {"Teh & Houlsby 1991": teh_houlsby(rigidity, roughness), "Lu et al. 2004": lu(rigidity, roughness)}


def spherical_limit_pressure(
    *, young: float, poisson: float, cohesion: float, friction_angle: float, dilation_angle: float
) -> float:
    """Limit pressure of a spherical cavity in Mohr-Coulomb soil without initial stress, in the unit of the cohesion.

    H. S. Yu, G. T. Houlsby, Géotechnique 41 (1991) 173, with k = 2 and p0 = 0, small elastic and large plastic strains.

    Args:
        friction_angle, dilation_angle: [degrees]; the former positive.
    """
    phi, psi = np.sin(np.radians([friction_angle, dilation_angle]))
    alpha, beta = (1 + phi) / (1 - phi), (1 + psi) / (1 - psi)
    yield_stress = 2 * cohesion * np.sqrt(1 - phi**2) / (1 - phi)
    shear = young / (2 * (1 + poisson))
    gamma = alpha * (beta + 2) / (2 * (alpha - 1) * beta)
    delta = yield_stress / (2 * (2 + alpha) * shear)
    bracket = alpha * beta + 2 * (1 - 2 * poisson) + 2 * poisson - 2 * poisson * (alpha + beta)
    xi = 3 * delta / ((1 + poisson) * (alpha - 1) * beta) * bracket
    eta = np.exp((beta + 2) * (1 - 2 * poisson) * yield_stress / (young * (alpha - 1) * beta))
    goal = eta / gamma * (1 - delta) ** ((beta + 2) / beta)

    def series(ratio: float) -> float:
        """Lambda_1 of the paper: the integral from 1 to the ratio of exp(xi x) x^(-gamma - 1)."""
        x, weights = np.polynomial.legendre.leggauss(200)
        t = 0.5 * np.log(ratio) * (x + 1)  # x = e^t
        return float(0.5 * np.log(ratio) * weights @ np.exp(xi * np.exp(t) - gamma * t))

    low, high = 1.0, 2.0
    while series(high) < goal:
        low, high = high, 2 * high
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if series(middle) < goal else (low, middle)
    return float((3 * alpha * low / (2 + alpha) - 1) * yield_stress / (alpha - 1))


def undrained_strength(law: mpm.CamClay, pressure: float) -> float:
    """Undrained shear strength of Modified Cam-Clay in triaxial compression from an isotropic effective stress [Pa].

    The specific volume stays, so that p ends at p0 (p_c / 2 p0)^(1 - kappa / lambda) with the attraction in both (Wood 1990, Soil
    Behaviour and Critical State Soil Mechanics, 7.2).

    Args:
        pressure: initial effective stress [Pa].
    """
    start, yields = pressure + law.attraction, law.preconsolidation + law.attraction
    end = start * (0.5 * yields / start) ** (1 - law.swelling / law.compression)
    return float(0.5 * law.critical_slope * end)


def drained_part(velocity: float) -> float:
    """How far the net resistance of a cone has risen from that without drainage to that of drained clay, 0 to 1.

    J. T. DeJong, M. Randolph, J. Geotech. Geoenviron. Eng. 138 (2012) 788: a fit to experiments in normally consolidated clay.

    Args:
        velocity: normalised, v d / c_v.
    """
    return 1 / (1 + velocity / 3)
