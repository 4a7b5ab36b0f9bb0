"""Soil that has carried more than its present stress: the hardening of an overconsolidation ratio, for soils that a stage places."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import with_inner_laws
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.types import Law

LARGEST = 100.0
"""Overconsolidation ratio above which it is one in percent, or a stress: desiccated crusts reach some 50"""

EXCESS = "excess_pore_pressure"
"""State variable of laws whose stress is the total one"""


def soil_with_history(law: Law) -> mpm.HardeningSoil | mpm.CamClay | None:
    """The HardeningSoil or CamClay that a law is, or that `Undrained` and `Hencky` are made of; None of others, and where its parameters vary."""
    each = list(with_inner_laws(law))
    varies = any(isinstance(one, mpm.Heterogeneous) for one in each)
    return each[-1] if isinstance(each[-1], mpm.HardeningSoil | mpm.CamClay) and not varies else None


def hardening_soil_in(law: Law) -> mpm.HardeningSoil | None:
    """The HardeningSoil of `soil_with_history`; None of other laws."""
    soil = soil_with_history(law)
    return soil if isinstance(soil, mpm.HardeningSoil) else None


def require_history(
    comm: MPI.Comm,
    where: str,
    laws: Mapping[int, Law],
    ratios: Mapping[int, float],
    name_of: Any,
    stressed: Collection[int],
) -> None:
    """Require laws that an overconsolidation ratio has an effect on, and stresses of CamClay that it multiplies. Collective.

    Args:
        comm: the ranks.
        where: stage, for messages.
        laws: by cell tag.
        ratios: overconsolidation ratios [-], by cell tag.
        name_of: function of a tag that gives the name of its soil.
        stressed: tags of the soils that come with stresses.

    Raises:
        InputError: the law of a soil is another one, or soil of CamClay comes without stress. Raised on all ranks alike.
    """
    problems = (
        f"{where}overconsolidation is {ratio:g} for the soil {name_of(tag)}, whose law is {laws[tag].name}, expected HardeningSoil or CamClay with "
        "the same parameters at all points"
        for tag, ratio in ratios.items()
        if soil_with_history(laws[tag]) is None
    )
    agree(comm, next(problems, None))
    free = (tag for tag in before_equilibrium(ratios, laws) if tag not in stressed)
    agree(comm, next((_without_stress(where, laws[tag], ratios[tag], name_of(tag)) for tag in free), None))


def _without_stress(where: str, law: Law, ratio: float, name: str) -> str:
    """What is wrong with an overconsolidation ratio of CamClay that comes free of stress, with the K0 of Mayne and Kulhawy (1982)."""
    normal = normal_k0(soil_with_history(law))
    return (
        f"{where}overconsolidation is {ratio:g} for the soil {name}, which comes free of stress, expected k0 with it (or stress, in a Stage): the "
        f"preconsolidation pressure of CamClay is that of so many times the stress with which the soil comes. By K0nc OCR^sin(phi) k0 is about "
        f"{normal * ratio ** (1 - normal):.2g}"
    )


def hardened(law: Law, stress: NDArray[np.float64], state: NDArray[np.float64], ratio: float) -> NDArray[np.float64]:
    """The states of points of soil after a larger vertical stress than the present one.

    Hardening is that of level ground which has been normally consolidated to the vertical effective stress times the ratio, and at least that
    which the stress itself needs; of HardeningSoil also at least the present one.

    Args:
        law: HardeningSoil or CamClay, or what is made of it.
        stress: present stress [Pa], tension positive, shape (n, S); the last axis of the space points up.
        state: state variables, shape (n, n_state).
        ratio: largest vertical effective stress before over the present one, OCR [-].

    Returns:
        State variables, shape (n, n_state).
    """
    soil, names, result = soil_with_history(law), law.state_names, state.copy()
    effective, up = effective_stress(law, stress, state), upward(stress.shape[1])
    level = np.zeros_like(stress)  # its largest principal stress is the vertical one, whatever K0 of the ground
    level[:, :3] = normal_k0(soil) * np.minimum(effective[:, up], 0.0)[:, None]
    level[:, up] = np.minimum(effective[:, up], 0.0)
    if isinstance(soil, mpm.CamClay):
        sizes = [mpm.log_preconsolidation(soil, under_pressure(soil, each)) for each in (ratio * level, effective)]
        result[:, names.index("log_preconsolidation")] = np.maximum(*sizes)
        return result
    for found in (mpm.hardening_soil_state(soil, level, ratio), mpm.hardening_soil_state(soil, effective)):
        for name, values in found.items():
            column = names.index(name)
            result[:, column] = np.maximum(result[:, column], values)
    return result


def before_equilibrium(ratios: Mapping[int, float], laws: Mapping[int, Law]) -> dict[int, float]:
    """The overconsolidation ratios [-] of CamClay, by tag: with less history its points could not keep the stress that they are placed with.

    Args:
        ratios: by tag.
        laws: by tag.
    """
    return {tag: ratio for tag, ratio in ratios.items() if isinstance(soil_with_history(laws[tag]), mpm.CamClay)}


LEAST_PRESSURE = 1.0
"""Pressure [Pa], attraction included, that the yield surface of a point of CamClay has at least"""


def under_pressure(soil: mpm.CamClay, stress: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stresses (n, S) [Pa], tension positive, with at least `LEAST_PRESSURE`: without pressure no yield surface passes through them."""
    mean, pressed = stress[:, :3].mean(axis=1), stress.copy()
    pressed[:, :3] -= np.maximum(mean - (soil.attraction - LEAST_PRESSURE), 0.0)[:, None]
    return pressed


def effective_stress(law: Law, stress: NDArray[np.float64], state: NDArray[np.float64]) -> NDArray[np.float64]:
    """The effective stress of points [Pa], tension positive, shape (n, S): that of the skeleton, where the stress of a law is the total one.

    Args:
        law: law of the points.
        stress: stress [Pa], tension positive, shape (n, S).
        state: state variables, shape (n, n_state).
    """
    effective = stress.copy()
    if EXCESS in law.state_names:
        effective[:, :3] += state[:, law.state_names.index(EXCESS), None]
    return effective


def upward(size: int) -> int:
    """The vertical component of stresses with a number of components, 4 in two dimensions and 6 in three; the last axis of the space points up."""
    return 1 if size == 4 else 2


def normal_k0(law: Any) -> float:
    """K0 of normally consolidated soil [-]: of a HardeningSoil its own, of a CamClay 1 - sin(phi) of the critical state (Jaky 1944)."""
    if isinstance(law, mpm.CamClay):
        return 1 - 3 * law.critical_slope / (6 + law.critical_slope)
    return float(law.normal_k0) or 1 - math.sin(math.radians(law.friction_angle))
