"""Warnings of single numbers that are probably in other units: weights, angles, rain, friction, drag, water and its flow."""

from __future__ import annotations

import warnings

import numpy as np
from mpi4py import MPI

UNIT_WEIGHTS = (1e3, 150e3)
"""Bounds of the unit weight of a soil [N/m3]: peat has 10 kN/m3, published slopes have up to 80, and 16 kN/m3 taken for a density
gives 157"""

SPUN_UNIT_WEIGHTS = (300e3, 6e6)
"""Bounds of the unit weight of a soil in a centrifuge [N/m3], from some 15 to 250 g; 16 to 25 kN/m3 taken for a density lie below"""

RADIANS = (0.1, 1.57)
"""Friction angles, and those of slopes, [degrees] that are more probably angles in radians, of soils from 6 to 90 degrees"""

STEEPEST_FRICTION = 2.0
"""Coefficient of friction, of an angle of 63 degrees, above which it is more probably an angle"""

LARGEST_DRAG = 1.0
"""Coefficient g / xi of a turbulent resistance, of xi = 10 m/s2, above which it is more probably xi itself, some 100 to 2000 m/s2"""

ODD_WATER = (0.1, 200.0, 5000.0)
"""Densities [kg/m3] between the first two and above the last are probably those of water in other units, or under another gravity"""

SOFTEST_WATER = 1e5
"""Bulk modulus [Pa] of air under atmospheric pressure, below which that of pore water is more probably in other units"""

LARGEST_CONDUCTIVITY = 1.0
"""Conductivity [m/s] above which it is more probably in other units: coarse gravel has some 0.1 m/s"""

HEAVIEST_RAIN = 1e-3
"""Rate [m/s] above which rain is more probably in other units: the heaviest minute on record, 38 mm, had 6.3e-4 m/s"""


def is_unit_weight(weight: float) -> bool:
    """Whether a soil may have a unit weight [N/m3], on earth or in a centrifuge."""
    return any(low <= weight <= high for low, high in (UNIT_WEIGHTS, SPUN_UNIT_WEIGHTS))


def in_radians(name: str, angle: float) -> str:
    """What a warning says of an angle that is probably in radians; empty for others."""
    if not RADIANS[0] <= angle <= RADIANS[1]:
        return ""
    return f"{name} is {angle:g} degrees; angles are in degrees, and {angle:g} rad are {np.degrees(angle):.1f} degrees"


def soft_water(name: str, modulus: float) -> str:
    """What a warning says of a bulk modulus of water [Pa] that is probably in other units; empty for others."""
    if not modulus < SOFTEST_WATER:
        return ""
    return f"{name} is {modulus:g} Pa, less than that of air; moduli are in Pa, 2.2e9 for water"


def fast_flow(name: str, conductivity: float) -> str:
    """What a warning says of a hydraulic conductivity [m/s] that is probably in other units; empty for others."""
    if not conductivity > LARGEST_CONDUCTIVITY:
        return ""
    return (
        f"{name} is {conductivity:g} m/s, more than that of gravel; conductivities are in m/s, such as 1e-5 for fine sand, and "
        f"{conductivity:g} m/day are {conductivity / 86400.0:.3g} m/s"
    )


def warn_of_pores(comm: MPI.Comm, modulus: float, conductivity: float, stacklevel: int = 3) -> None:
    """Warn of a modulus of water [Pa] and a conductivity [m/s] that are probably in other units. Not collective."""
    for text in (soft_water("modulus", modulus), fast_flow("conductivity", conductivity)):
        if comm.rank == 0 and text:
            warnings.warn(text, RuntimeWarning, stacklevel=stacklevel)


def warn_of_radians(**angles: float) -> None:
    """Warn of angles [degrees], by the names of their arguments, that are probably in radians. Not collective."""
    for name, angle in angles.items():
        text = in_radians(name, angle)
        if text:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def warn_of_rain(comm: MPI.Comm, rate: float, stacklevel: int = 3) -> None:
    """Warn of a rate of rain [m/s] that is probably in other units. Not collective."""
    if comm.rank == 0 and rate > HEAVIEST_RAIN:
        warnings.warn(
            f"the rate of the rain is {rate:g} m/s, more than has ever fallen; rates are in m/s, and {rate:g} mm/h are "
            f"{rate / 3.6e6:.3g} m/s",
            RuntimeWarning,
            stacklevel=stacklevel,
        )


def warn_of_friction(comm: MPI.Comm, friction: float) -> None:
    """Warn of a coefficient of friction that is probably an angle. Not collective."""
    if comm.rank == 0 and friction > STEEPEST_FRICTION:
        warnings.warn(
            f"friction is {friction:g}, a coefficient of Coulomb friction, which is the tangent of the angle of friction: for an angle "
            f"of {friction:g} degrees give {np.tan(np.radians(friction)):.4g}",
            RuntimeWarning,
            stacklevel=4,
        )


def warn_of_drag(comm: MPI.Comm, drag: float) -> None:
    """Warn of a coefficient of turbulent resistance that is probably Voellmy's xi. Not collective."""
    if comm.rank == 0 and drag > LARGEST_DRAG:
        warnings.warn(
            f"drag is {drag:g}, a coefficient C = g / xi of Voellmy's resistance C rho v^2: for his xi of {drag:g} m/s2 give "
            f"{9.81 / drag:.4g}",
            RuntimeWarning,
            stacklevel=4,
        )


def warn_of_water_weight(comm: MPI.Comm, unit_weight: float) -> None:
    """Warn of a unit weight of water that is probably in kN/m3; one of nearly zero is fine. Not collective."""
    if comm.rank == 0 and 1.0 <= unit_weight <= 100.0:
        warnings.warn(
            f"the unit weight of water is {unit_weight:g} N/m3; unit weights are in N/m3, 9810 for water",
            RuntimeWarning,
            stacklevel=3,
        )


def warn_of_water_density(comm: MPI.Comm, density: float, stacklevel: int = 3) -> None:
    """Warn of a density of water in other units, or found by another gravity; one of nearly zero is fine. Not collective."""
    if comm.rank == 0 and not (density < ODD_WATER[0] or ODD_WATER[1] < density < ODD_WATER[2]):
        warnings.warn(
            f"the density of water is {density:g} kg/m3, expected some 1000; densities are in kg/m3, unit weights in N/m3 under the "
            "gravity of the model",
            RuntimeWarning,
            stacklevel=stacklevel,
        )
