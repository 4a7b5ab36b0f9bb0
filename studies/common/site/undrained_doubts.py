"""Warnings of undrained soil whose pore water is too soft to be undrained."""

from __future__ import annotations

from typing import Any

import mpm_core as mpm

LEAST_SHARE = 0.9
"""Skempton's B, the part of a load from all sides that the water takes, below which soil is hardly undrained"""


def skempton(law: mpm.Undrained) -> float | None:
    """Skempton's B of a law whose water does not drain, K_w / n over K_w / n + K [-]; None where the skeleton has no Young's modulus.

    Of HardeningSoil it is that of unloading at the reference pressure.
    """
    young = getattr(law.skeleton, "young", getattr(law.skeleton, "unloading_modulus", None))
    poisson = getattr(law.skeleton, "poisson", None)
    if young is None or poisson is None:
        return None
    water = law.water_modulus / law.porosity
    return float(water / (water + young / (3 * (1 - 2 * poisson))))


def soft_water_doubt(law: Any, where: str) -> str:
    """A warning of undrained soil whose skeleton takes much of a load; empty for others.

    Args:
        law: of a soil, or of a stage.
        where: it stands in the file.
    """
    share = skempton(law) if isinstance(law, mpm.Undrained) else None
    if share is None or share >= LEAST_SHARE:
        return ""
    bulk = law.water_modulus / law.porosity * (1 / share - 1)
    return (
        f"{where}: undrained is true, but the water takes only {share:.0%} of a load from all sides (Skempton's B), and the soil settles as if the rest "
        f"had drained: water_modulus is {law.water_modulus:g} Pa, and over porosity, {law.porosity:g}, it should be some 50 times the bulk modulus "
        f"of the soil, {bulk:.3g} Pa, or that of water, 2.2e9 Pa, where there is no air"
    )
