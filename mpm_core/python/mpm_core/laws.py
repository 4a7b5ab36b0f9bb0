"""Laws that are special cases of others, under their usual names."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import (
    CamClay,
    ConeMatch,
    DruckerPrager,
    HardeningSoil,
    InputError,
    MohrCoulomb,
    NorSand,
    Sanisand,
    cone_slope,
    cone_strength,
    hardened_to,
)
from .checks import member, positive, real_numbers
from .mesh import floats


def tresca(*, young: float, poisson: float, shear_strength: float) -> MohrCoulomb:
    """The criterion of Tresca: half the difference of the extreme principal stresses does not exceed the shear strength.

    With the undrained shear strength of a clay and a Poisson's ratio near 0.5 this is a total stress analysis.

    Args:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        shear_strength: strength in shear, s_u [Pa].
    """
    strength = positive("shear_strength", shear_strength, "Pa")
    return MohrCoulomb(young=young, poisson=poisson, cohesion=strength, friction_angle=0.0)


def von_mises(*, young: float, poisson: float, yield_stress: float) -> DruckerPrager:
    """The criterion of von Mises: sqrt(3 J2) does not exceed the yield stress.

    Args:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        yield_stress: strength in uniaxial tension or compression [Pa]; in pure shear it is 1/sqrt(3) of that.
    """
    return DruckerPrager(young=young, poisson=poisson, strength=positive("yield_stress", yield_stress, "Pa") / 3**0.5)


def matched_drucker_prager(
    *,
    young: float,
    poisson: float,
    cohesion: float,
    friction_angle: float,
    dilation_angle: float = 0.0,
    match: ConeMatch = ConeMatch.OUTER,
    tension_cutoff: float | None = None,
) -> DruckerPrager:
    """Drucker-Prager law with the strength of a Mohr-Coulomb soil on one of its meridians.

    Args:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        cohesion: cohesion of the soil [Pa].
        friction_angle: friction angle of the soil [degrees].
        dilation_angle: dilation angle of the soil [degrees].
        match: OUTER: same strength in triaxial compression; INNER: in triaxial extension; PLANE_STRAIN: same collapse load
            in plane strain, exact with associated flow.
        tension_cutoff: largest mean stress [Pa]; by default the apex.

    Source:
        de Souza Neto, Peric, Owen (2008), Computational Methods for Plasticity, section 6.4.4.
    """
    soil = MohrCoulomb(
        young=young, poisson=poisson, cohesion=cohesion, friction_angle=friction_angle, dilation_angle=dilation_angle
    )  # names what is wrong with the parameters
    member("match", match, ConeMatch)
    return DruckerPrager(
        young=young,
        poisson=poisson,
        strength=cone_strength(soil.cohesion, soil.friction_angle, match),
        friction=cone_slope(soil.friction_angle, match),
        dilation=cone_slope(soil.dilation_angle, match),
        tension_cutoff=tension_cutoff,
    )


def log_preconsolidation(law: CamClay, stress: ArrayLike, overconsolidation: float = 1.0) -> NDArray[np.float64]:
    """The state `log_preconsolidation` of points that begin with a stress and an overconsolidation ratio.

    Args:
        law: the clay.
        stress: effective stress [Pa], tension positive, shape (n, 4) or (n, 6); its mean must be below the attraction.
        overconsolidation: size of the yield surface over that of the one through the stress [-], at least 1.

    Returns:
        Shape (n,), for ``Model.set_state("log_preconsolidation", ...)``.
    """
    _check_overconsolidation(overconsolidation)
    pressure, q = _pressure_and_q(law, stress)
    through = pressure + q**2 / (law.critical_slope**2 * pressure)
    return np.log(overconsolidation * through / (law.preconsolidation + law.attraction))


def nor_sand_state(
    law: NorSand, stress: ArrayLike, state_parameter: ArrayLike, overconsolidation: float = 1.0
) -> dict[str, NDArray[np.float64]]:
    """The states of points of NorSand that begin with a stress and a state parameter.

    The image pressure is that of the yield surface through the stress, times the overconsolidation; the void ratio is the
    critical one at the pressure of the stress plus the state parameter.

    Args:
        law: the sand.
        stress: effective stress [Pa], tension positive, shape (n, 4) or (n, 6); its mean must be below the attraction.
        state_parameter: psi, void ratio less that of the critical state line at the same pressure [-], a number or shape (n,):
            positive for loose soil, negative for dense.
        overconsolidation: image pressure over that of the yield surface through the stress [-], at least 1.

    Returns:
        `log_image_pressure` and `log_specific_volume`, shape (n,) each, for ``Model.set_state(name, values)``.

    Raises:
        InputError: overconsolidation below 1, a stress without pressure, or a state parameter without a positive void ratio.
    """
    _check_overconsolidation(overconsolidation)
    pressure, q = _pressure_and_q(law, stress)
    critical = law.critical_void_ratio - law.critical_compression * np.log(pressure / 1e3)
    psi, log_volume = _volume_beside(law, critical, state_parameter, pressure)
    fall, log_image = law.coupling * law.dilatancy, np.zeros_like(pressure)
    q *= _direction_factor(law, floats("stress", stress, (None, None)), q)
    for _ in range(100):  # g q = M_i p (1 + ln(p_i / p)), where M_i depends a little on p_i
        slope = law.critical_slope - fall * np.abs(psi + law.critical_compression * log_image)
        log_image = q / (pressure * np.maximum(slope, law.critical_slope / 2)) - 1
    image = overconsolidation * pressure * np.exp(log_image)
    return {
        "log_image_pressure": np.log(image / (law.image_pressure + law.attraction)),
        "log_specific_volume": log_volume,
    }


def sanisand_state(law: Sanisand, stress: ArrayLike, state_parameter: ArrayLike) -> dict[str, NDArray[np.float64]]:
    """The states of points of Sanisand that begin with a stress and a state parameter.

    Soil that has never been loaded begins with the back stress ratio of its stress by itself, so that the void ratio is all that
    is given here: the critical one at the pressure of the stress plus the state parameter.

    Args:
        law: the sand.
        stress: effective stress [Pa], tension positive, shape (n, 4) or (n, 6); its mean must be below the attraction.
        state_parameter: psi, void ratio less that of the critical state line at the same pressure [-], a number or shape (n,):
            positive for loose soil, negative for dense.

    Returns:
        `log_specific_volume`, shape (n,), for ``Model.set_state(name, values)``.

    Raises:
        InputError: a stress without pressure, or a state parameter without a positive void ratio.
    """
    pressure, _ = _pressure_and_q(law, stress)
    relative = pressure / Sanisand.atmospheric_pressure
    critical = law.critical_void_ratio - law.critical_compression * relative**law.critical_exponent
    return {"log_specific_volume": _volume_beside(law, critical, state_parameter, pressure)[1]}


def hardening_soil_state(
    law: HardeningSoil, stress: ArrayLike, overconsolidation: float = 1.0
) -> dict[str, NDArray[np.float64]]:
    """The states of points of Hardening Soil that begin with a stress and an overconsolidation ratio.

    Their hardening is what the stress itself and `vertical_preconsolidation` of the law need, and for a ratio above 1 at least that
    of level ground which has been normally consolidated to the largest principal stress times the ratio.

    Args:
        law: the soil.
        stress: effective stress [Pa], tension positive, shape (n, 4) or (n, 6).
        overconsolidation: largest vertical stress before over that of the start, OCR [-], at least 1.

    Returns:
        `shear_hardening` and `log_preconsolidation`, shape (n,) each, for ``Model.set_state(name, values)``.

    Raises:
        InputError: overconsolidation below 1, or stress of another shape.
    """
    _check_overconsolidation(overconsolidation)
    rows = floats("stress", stress, (None, None))
    if rows.shape[1] not in (4, 6):
        raise InputError(f"stress has shape {rows.shape}, expected (n, 4) or (n, 6)")
    shear, cap = hardened_to(law, rows, overconsolidation).T
    return {"shear_hardening": shear.copy(), "log_preconsolidation": cap.copy()}


SMALL_STRAINS = ("largest_small_strain", "brick_")
"""What the names of the state variables begin with in which HardeningSoil remembers small strains"""


def small_strain_columns(law: Any) -> list[int]:
    """The state variables of a law, by number, that remember small strains; none of laws without a small-strain stiffness."""
    return [number for number, name in enumerate(law.state_names) if name.startswith(SMALL_STRAINS)]


def _volume_beside(
    law: NorSand | Sanisand, critical: NDArray[np.float64], state_parameter: ArrayLike, pressure: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """State parameters, and the logarithms of the specific volumes beside the critical ones over that of the law's start."""
    psi = np.broadcast_to(real_numbers("state_parameter", state_parameter), pressure.shape)
    void_ratio = critical + psi
    wrong = ~(void_ratio > 0)
    if wrong.any():
        raise InputError(
            f"state_parameter is {psi[wrong][0]:g} at {pressure[wrong][0]:g} Pa, where the void ratio would be "
            f"{void_ratio[wrong][0]:g}, expected a positive one"
        )
    return psi, np.log((1 + void_ratio) / (1 + law.void_ratio))


def _check_overconsolidation(ratio: float) -> None:
    if not ratio >= 1:
        raise InputError(f"overconsolidation is {ratio}, expected at least 1")


def _pressure_and_q(
    law: CamClay | NorSand | Sanisand, stress: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pressure from the attraction on and sqrt(3 J2) [Pa] of stresses that must have pressure."""
    s = floats("stress", stress, (None, None))
    mean = s[:, :3].mean(axis=1)
    pressure = law.attraction - mean
    if (pressure <= 0).any():
        raise InputError(f"stress has the mean {mean.max():g} Pa, expected below the attraction, {law.attraction:g} Pa")
    squares = ((s[:, :3] - mean[:, None]) ** 2).sum(axis=1) + 2 * (s[:, 3:] ** 2).sum(axis=1)
    return pressure, np.sqrt(1.5 * squares)


def _direction_factor(law: NorSand, stress: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """G of NorSand in the direction of stresses [-], shape (n,), by which q counts more than in triaxial compression."""
    s = np.zeros((len(stress), 6))
    s[:, : stress.shape[1]] = stress
    s[:, :3] -= s[:, :3].mean(axis=1, keepdims=True)
    s /= np.where(q > 0, q, 1.0)[:, None]
    determinant = np.linalg.det(s[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2]]])
    cosine = np.where(q > 0, np.clip(-13.5 * determinant, -1.0, 1.0), 1.0)  # cos(3 theta)
    extension = (1 + law.critical_slope / 3) ** 4
    return np.asarray((0.5 * (1 + extension - (extension - 1) * cosine)) ** 0.25)
