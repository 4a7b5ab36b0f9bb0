"""Inertia forces of an earthquake as a load that stays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

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
        InputError: coefficients that are not finite numbers of shape (D,), D 2 or 3.

    Example:
        >>> load = bridge.pseudo_static(bridge.Load(unit_weight=20e3), (0.15, 0.0))
        >>> bridge.factor_of_safety(slope, load).value
    """
    k = checks.real_numbers("coefficients", coefficients)
    if k.shape not in ((2,), (3,)) or not np.isfinite(k).all():
        raise InputError(
            f"coefficients is {coefficients!r}, expected finite numbers of shape (D,), one along each axis"
        )
    inertia: dict[Any, Any] = {tag: weight * k for tag, weight in weight_by_tag(load.unit_weight).items()}
    own: dict[Any, Any] = {tag: np.asarray(force, dtype=float) for tag, force in load.body_force.items()}
    tags = {*inertia, *own}
    both = {tag: own.get(tag, own.get(None, 0.0)) + inertia.get(tag, inertia.get(None, 0.0)) for tag in tags}
    return replace(load, body_force={tag: tuple(force.tolist()) for tag, force in both.items()})
