"""Laws with their strength divided by a factor, for strength reduction."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import mpm_core as mpm
from fenics_bridge.errors import InputError, is_finite
from fenics_bridge.types import Laws
from mpm_core import _core


def reduced_strength(law: Laws, factor: float, unreduced: Collection[int | str] = ()) -> Laws:
    """The law with its strength divided by a factor: cohesion and tan(friction angle), or what stands for them.

    - MohrCoulomb (and `tresca`): c / F and tan(phi) / F. The dilation angle stays where it can, and is limited to the new
      friction angle: associated flow stays associated.
    - HardeningSoil: as MohrCoulomb; stiffness and cap stay.
    - HoekBrown: the shear strengths under all normal stresses; the dilation angle stays the same fraction of the friction angle.
    - SofteningMohrCoulomb: peak and residual strength alike.
    - DruckerPrager: strength and slope of the cone. Of one that matches a soil of Mohr and Coulomb this is more than c / F and
      tan(phi) / F: factors of safety are smaller than those of the soil, by a twentieth for 25 degrees and by a sixth for 38
      (docs/factor_of_safety.md).
    - CamClay, NorSand and Sanisand: the friction angle of the critical state, sin(phi) = 3M / (6 + M); attraction as it is.
    - ViscoplasticMohrCoulomb: the strength in the limit of slow loading; the viscosity stays.
    - Heterogeneous: the strength of all points.
    - Hencky and Undrained: the law that they are made of.
    - LinearElastic beside other laws: it has no strength to reduce and stays as it is.
    - Umat and PythonLaw: the parameters that they name as their strength, see there.
    - Any other: give `factor_of_safety` a function of law and factor.

    Args:
        law: law of `mpm_core`, or laws by cell tag.
        factor: factor F by which the strength is divided [-].
        unreduced: cell tags of laws that stay as they are.

    Returns:
        The reduced law, or laws by cell tag.

    Raises:
        InputError: the factor is not positive, what is given is no law, a tag has no law, no law is left to reduce, or the
            strength of a law is not known.
    """
    if not (is_finite(factor) and factor > 0):
        raise InputError(f"factor is {factor!r}, expected a positive number")
    if isinstance(unreduced, (str, int)) or not isinstance(unreduced, Collection):
        raise InputError(f"unreduced is {unreduced!r}, expected a list of cell tags or names, such as ['rock']")
    if isinstance(law, dict):
        unknown = [tag for tag in unreduced if tag not in law]
        if unknown:
            raise InputError(f"unreduced: there is no law for {unknown[0]!r}; laws are given for {list(law)}")
        kept = [tag for tag, one in law.items() if tag in unreduced or isinstance(one, mpm.LinearElastic)]
        if len(kept) == len(law):
            raise InputError(f"unreduced is {list(unreduced)}; no law is left whose strength could be reduced")
        return {tag: one if tag in kept else reduced_strength(one, factor) for tag, one in law.items()}
    if len(unreduced):
        raise InputError(
            f"unreduced is {list(unreduced)} with one law for the whole body, expected laws by cell tag, of which some stay"
        )
    if not isinstance(law, tuple(_core.law_types)):
        raise InputError(f"law is {law!r}, expected a constitutive law such as MohrCoulomb(...), or laws by cell tag")
    return _core.reduced_strength(law, factor)


def davis_strength(law: Laws) -> Laws:
    """Mohr-Coulomb law with associated flow, and the reduced strength of Davis (1968) for soil with a smaller dilation angle.

    c* = b c and tan(phi*) = b tan(phi) with b = cos(psi) cos(phi) / (1 - sin(psi) sin(phi)): collapse loads of the
    associated soil with that strength estimate, mostly from below, those of the soil itself (Tschuchnigg, Schweiger,
    Sloan 2015, Comput. Geotech. 70, 178-189).

    Args:
        law: MohrCoulomb, or one that is Heterogeneous in anything but its angles; or laws by cell tag, of which others stay as they are.

    Raises:
        InputError: law is another one, or its angles vary from point to point.
    """
    if isinstance(law, dict):
        return {tag: davis_strength(one) if _is_mohr_coulomb(one) else one for tag, one in law.items()}
    if not _is_mohr_coulomb(law):
        raise InputError(f"law is {type(law).__name__}, expected MohrCoulomb")
    if not isinstance(law, mpm.Heterogeneous):
        factor = _davis_factor(law.friction_angle, law.dilation_angle)
        friction = _divided(law.friction_angle, factor)
        return _mohr_coulomb(law, law.cohesion / factor, friction, friction)
    angle = next((name for name in law.varying if name.endswith("_angle")), None)
    if angle is not None:
        raise InputError(
            f"law is Heterogeneous in {angle}, expected the same angles at all points for the strength of Davis"
        )
    one, reduced = law.law, law.strength_factor
    friction = _divided(one.friction_angle, reduced)
    factor = _davis_factor(friction, min(one.dilation_angle, friction))
    associated = _mohr_coulomb(one, one.cohesion, one.friction_angle, one.friction_angle)
    return reduced_strength(mpm.Heterogeneous(associated, law.varying), reduced * factor)


def _davis_factor(friction_angle: float, dilation_angle: float) -> float:
    """What cohesion and tan(friction angle) are divided by, for angles [degrees]."""
    phi, psi = math.radians(friction_angle), math.radians(dilation_angle)
    return (1 - math.sin(psi) * math.sin(phi)) / (math.cos(psi) * math.cos(phi))


def davis_reduced_strength(law: Laws, factor: float, unreduced: Collection[int | str] = ()) -> Laws:
    """The law with its strength divided by a factor, and then reduced for its dilation angle by Davis (1968) ("Davis B").

    For `factor_of_safety(..., reduce=davis_reduced_strength)`: associated flow, so a factor that is quick to find and does
    not depend on the mesh.

    Args:
        law: law of `mpm_core`, or laws by cell tag.
        factor: factor by which the strength is divided [-].
        unreduced: cell tags of laws that keep their strength; their flow, too, becomes associated by `davis_strength`.

    Returns:
        The reduced law, or laws by cell tag.

    Raises:
        InputError: as for `reduced_strength` and `davis_strength`.
    """
    return davis_strength(reduced_strength(law, factor, unreduced))


def _is_mohr_coulomb(law: Any) -> bool:
    return isinstance(law.law if isinstance(law, mpm.Heterogeneous) else law, mpm.MohrCoulomb)


def _divided(angle: Any, factor: float) -> Any:
    """The angle [degrees] whose tangent is that of another one over a factor."""
    return math.degrees(math.atan(math.tan(math.radians(angle)) / factor))


def _mohr_coulomb(law: Any, cohesion: Any, friction_angle: Any, dilation_angle: Any) -> Any:
    return mpm.MohrCoulomb(
        young=law.young,
        poisson=law.poisson,
        cohesion=cohesion,
        friction_angle=friction_angle,
        dilation_angle=dilation_angle,
        tension_cutoff=law.tension_cutoff,
    )
