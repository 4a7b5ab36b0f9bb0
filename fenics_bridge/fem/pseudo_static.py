"""Inertia forces of an earthquake as a load that stays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.errors import InputError
from fenics_bridge.fem.loads import Load, weight_by_tag
from mpm_core import checks


def pseudo_static(load: Load, coefficients: ArrayLike) -> Load:
    """A load with the inertia forces of an earthquake, as if they acted for good (pseudo-static analysis).

    Args:
        load: load whose unit weights are those of the soil with its water.
        coefficients: seismic coefficients, the inertia forces over the weight along each axis [-], shape (D,): (0.2, 0.0) pushes the
            soil along the first axis with a fifth of its weight; a positive vertical one makes it lighter.

    Returns:
        The load with these body forces besides its own.

    Raises:
        InputError: coefficients that are not finite numbers of shape (D,), D 2 or 3, or a load whose weight or body force is no
            such number.

    Example:
        >>> load = bridge.pseudo_static(bridge.Load(unit_weight=20e3), (0.15, 0.0))
        >>> bridge.factor_of_safety(slope, load).value
    """
    if not isinstance(load, Load):
        raise InputError(f"load is {load!r}, expected a Load")
    k = checks.real_numbers("coefficients", coefficients)
    if k.shape not in ((2,), (3,)) or not np.isfinite(k).all():
        raise InputError(
            f"coefficients is {coefficients!r}, expected finite numbers of shape (D,), one along each axis"
        )
    inertia = {tag: weight * k for tag, weight in _weights(load).items()}
    return replace(load, body_force={tag: tuple(force.tolist()) for tag, force in _sum(load, inertia).items()})


def forces_per_volume(load: Load, dim: int) -> list[NDArray[np.float64]]:
    """Weight and body force of a load together [N/m3], (D,), in the cells of each tag that either names.

    Args:
        load: the load.
        dim: dimension D.
    """
    down = -np.eye(dim)[-1]
    return list(_sum(load, {tag: weight * down for tag, weight in _weights(load).items()}).values())


def _weights(load: Load) -> dict[Any, float]:
    """Unit weights by cell tag [N/m3].

    Raises:
        InputError: weights that are no numbers.
    """
    weights = weight_by_tag(load.unit_weight)
    numbers = {tag: checks.real_numbers("unit_weight", weight) for tag, weight in weights.items()}
    wrong = next((weights[tag] for tag, number in numbers.items() if number.ndim), None)
    if wrong is not None:
        raise InputError(f"unit_weight is {wrong!r}, expected a number, or numbers by cell tag or name")
    return {tag: float(number) for tag, number in numbers.items()}


def _sum(load: Load, forces: dict[Any, NDArray[np.float64]]) -> dict[Any, NDArray[np.float64]]:
    """The body force of a load and other forces by cell tag, (D,).

    Raises:
        InputError: a body force that is none, or has not D components.
    """
    if not isinstance(load.body_force, dict):
        raise InputError(f"body_force is {load.body_force!r}, expected a dictionary by cell tag or name")
    own = {tag: checks.real_numbers("body_force", force) for tag, force in load.body_force.items()}
    dim = len(next(iter(forces.values()), next(iter(own.values()), ())))
    wrong = next((load.body_force[tag] for tag, force in own.items() if force.shape != (dim,)), None)
    if wrong is not None:
        raise InputError(f"body_force is {wrong!r}, expected {dim} finite numbers")
    none = np.zeros(dim)
    return {tag: own.get(tag, own.get(None, none)) + forces.get(tag, forces.get(None, none)) for tag in {*forces, *own}}
