"""Warnings of parameters of a law that are probably in other units: here of the creep of Cam-Clay, and those of other laws in a list."""

from __future__ import annotations

import math
from typing import Any

import mpm_core as mpm
from fenics_bridge.fem.overconsolidation import soil_with_history

from .hardening_doubts import secant_doubt, threshold_doubt
from .rock_doubts import rock_doubt
from .undrained_doubts import soft_water_doubt

LARGEST = 0.125
"""Creep over compression, C_alpha over Cc, above which it is probably no creep: peat has 0.05 to 0.1, clay 0.03 to 0.06"""

SHORTEST = 600.0
"""Reference time [s] below which it is probably in days or hours: steps of an oedometer test last until the water is out"""


def creep_doubt(law: Any, where: str) -> str:
    """A warning of creep that hardly any soil has, or of a reference time that is too short; empty for others, and for other laws.

    Args:
        law: any law.
        where: its parameters stand, for the message.
    """
    soil = soil_with_history(law)
    if not isinstance(soil, mpm.CamClay) or soil.creep == 0:
        return ""
    ratio = soil.creep / soil.compression
    if ratio > LARGEST:
        return (
            f"{where}: creep is {soil.creep:g}, {ratio:.2g} times the compression of {soil.compression:g}; clay has 0.03 to 0.06 times, peat up to "
            f"0.1. It is C_alpha / {math.log(10):.3f} of void ratios, not of strains, nor in percent"
        )
    if soil.reference_time < SHORTEST:
        return (
            f"{where}: reference_time is {soil.reference_time:g} s, expected how long the load steps of the oedometer tests lasted in s, such as "
            "86400 for a day"
        )
    return ""


DOUBTS = (secant_doubt, threshold_doubt, creep_doubt, rock_doubt, soft_water_doubt)
"""Functions of a law, and of where its parameters stand, that return a warning, or an empty text"""
