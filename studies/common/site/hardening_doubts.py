"""Warnings of what parameters of Hardening Soil probably do not mean: a secant modulus that compression takes away, strains in percent, K0 without history."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import mpm_core as mpm
from fenics_bridge.fem.overconsolidation import hardening_soil_in, normal_k0

SOFTEST = 2 / 3
"""Secant modulus at half of the strength over the one that is given, below which it is probably another one than was meant"""

LARGEST_THRESHOLD = 2e-3
"""Threshold strain above which it is probably in percent: plastic clay has up to 5e-4, peat some 1e-3"""

INCREMENTS = 20
"""Increments of a triaxial test, which give its secant modulus to 1 %"""


def secant_at_half(law: Any) -> float:
    """Secant modulus [Pa] at half of the strength in a drained triaxial test under the reference pressure, by the law itself.

    Args:
        law: HardeningSoil.

    Raises:
        RunError: the soil cannot bear the test.
    """
    pressure, sine = law.reference_pressure, math.sin(math.radians(law.friction_angle))
    half = sine / (1 - sine) * (pressure + law.cohesion / math.tan(math.radians(law.friction_angle)))
    test = mpm.ElementTest(law, [-pressure] * 3 + [0.0] * 3)
    for number in range(1, INCREMENTS + 1):
        axial = -pressure - half * number / INCREMENTS
        test.step([None] * 3 + [0.0] * 3, stress=[axial, -pressure, -pressure, 0.0, 0.0, 0.0])
    return half / -float(test.strain[0])


def secant_doubt(law: Any, where: str) -> str:
    """A warning of a soil that is far softer in a triaxial test than its secant modulus says; empty for others, and for other laws.

    Args:
        law: any law.
        where: its parameters stand, for the message.
    """
    soil = hardening_soil_in(law)
    if soil is None:
        return ""
    with suppress(mpm.RunError):
        found = secant_at_half(soil)
        if found < SOFTEST * soil.secant_modulus:
            return (
                f"{where}: secant_modulus is {soil.secant_modulus:.3g} Pa, but a drained triaxial test under {soil.reference_pressure:.3g} Pa gives "
                f"{found:.3g} Pa at half of the strength, since compression by the cap adds to the shear: oedometer_modulus is "
                f"{soil.oedometer_modulus:.3g} Pa. Raise secant_modulus where it is that of such a test (docs/howto/soils/hardening_soil.md)"
            )
    return ""


def threshold_doubt(law: Any, where: str) -> str:
    """A warning of a threshold of small strains that is probably in percent; empty for others, and for other laws.

    Args:
        law: any law.
        where: its parameters stand, for the message.
    """
    soil = hardening_soil_in(law)
    if soil is None or soil.small_strain_modulus == 0 or soil.threshold_strain <= LARGEST_THRESHOLD:
        return ""
    return (
        f"{where}: threshold_strain is {soil.threshold_strain:g}, a fraction: {soil.threshold_strain:g} % are {soil.threshold_strain / 100:g}; sand "
        "has 1e-4 to 2e-4, plastic clay up to 5e-4"
    )


def k0_doubt(law: Any, overconsolidation: float, where: str) -> str:
    """A warning of overconsolidated soil without K0, with that of Mayne and Kulhawy (1982); empty where there is no doubt.

    Args:
        law: HardeningSoil, or what is made of it.
        overconsolidation: ratio [-].
        where: the soil stands, for the message.
    """
    soil = hardening_soil_in(law)
    if soil is None or overconsolidation <= 1:
        return ""
    normal = normal_k0(soil)
    larger = normal * overconsolidation ** math.sin(math.radians(soil.friction_angle))
    return (
        f"{where}: overconsolidation is {overconsolidation:g} without k0, so that the soil begins with the horizontal stress of its first loading, "
        f"K0 = {normal:.3g}; in overconsolidated ground it is larger, about {larger:.3g} times the vertical one by K0nc OCR^sin(phi) "
        f"(Mayne and Kulhawy 1982): give k0 = {larger:.3g}, or what has been measured"
    )
