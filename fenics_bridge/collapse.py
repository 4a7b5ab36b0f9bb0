"""Collapse load and factor of safety: the last equilibrium as the load rises, or as the strength falls."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

import mpm_core as mpm
from fenics_bridge.errors import InputError, agree
from fenics_bridge.load_steps import advance


@dataclass(frozen=True)
class Collapse:
    """The last equilibrium that was found on the way to collapse.

    value: of the load or of the factor of safety there; failed_at: smallest value above it that was tried
    curve: (k, 2), value and largest displacement of a node [m] at every equilibrium on the way
    mechanism: function, displacement increment of the last step, scaled to a largest displacement of 1
    steps: every LoadStep that was tried
    """

    value: float
    failed_at: float
    curve: np.ndarray
    mechanism: fem.Function
    steps: list


def collapse_load(model, load_of, first_step, start=0.0, tolerance=2e-3, progress=None):
    """Raise a load to the last equilibrium: steps double while they are easy, and are bisected once one has failed.

    model: QuasiStatic, in equilibrium under `load_of(start)`, e.g. fresh and unloaded
    load_of: function of a number, the load's value, that returns the Load
    first_step: of the value; tolerance: width of the last step as a share of the value [-]
    Returns a Collapse. Raises InputError when not even the first steps find equilibrium. Collective.
    """
    return _follow(model, lambda value: model.equilibrate(load_of(value)), start, first_step, tolerance, progress)


def factor_of_safety(model, load, start=0.5, first_step=0.1, tolerance=2e-3, progress=None):
    """Factor by which cohesion and tan(friction angle) can be divided before equilibrium under a load is lost.

    model: QuasiStatic with a Mohr-Coulomb law, unloaded or in equilibrium under a load on the way to `load`
    start: factor to begin with; the body must carry the load with its strength divided by it (below 1: raised)
    first_step: of the factor; tolerance: width of the last step as a share of the factor [-]
    Returns a Collapse whose value is the factor. Raises InputError when the load is not carried at the start.
    Collective.
    """
    law = model.law
    model.law = reduced_strength(law, start)
    model.solve(load, progress=progress)
    message = f"start: the load is not carried with the strength divided by {start!r}; take a smaller start"
    agree(model.domain.comm, None if model.converged else message)

    def weaken(factor):
        return model.equilibrate(load, law=reduced_strength(law, factor))

    return _follow(model, weaken, start, first_step, tolerance, progress)


def reduced_strength(law, factor):
    """Mohr-Coulomb law with cohesion and tan(phi) divided by a factor.

    The dilation angle stays where it can, and is limited to the new friction angle: associated flow stays associated.
    law: one, or {cell tag: law}
    """
    if isinstance(law, dict):
        return {tag: reduced_strength(one, factor) for tag, one in law.items()}
    if not isinstance(law, mpm.MohrCoulomb):
        raise InputError(f"law: got {type(law).__name__}, expected MohrCoulomb")
    if not (np.isfinite(factor) and factor > 0):
        raise InputError(f"factor: got {factor!r}, expected a positive number")
    friction = math.degrees(math.atan(math.tan(math.radians(law.friction_angle)) / factor))
    associated = law.dilation_angle == law.friction_angle
    return mpm.MohrCoulomb(
        young=law.young,
        poisson=law.poisson,
        cohesion=law.cohesion / factor,
        friction_angle=friction,
        dilation_angle=friction if associated else min(law.dilation_angle, friction),
        tension_cutoff=law.tension_cutoff,
    )


def _follow(model, equilibrate, start, first_step, tolerance, progress):
    """Go up from `start` until no step succeeds, recording the way."""
    comm, dim = model.domain.comm, model.domain.geometry.dim
    curve = [(start, _largest(model.displacement, comm, dim))]
    mechanism = fem.Function(model.displacement.function_space, name="mechanism")

    def attempt(value):
        report = equilibrate(value)
        if report.converged:
            curve.append((value, _largest(model.displacement, comm, dim)))
            mechanism.x.array[:] = model.increment.x.array
        return report

    steps = advance(attempt, start, math.inf, first_step, tolerance, progress)
    agree(comm, None if len(curve) > 1 else f"first_step: no equilibrium was found above {start!r}; take a smaller one")
    largest = _largest(mechanism, comm, dim)
    mechanism.x.array[:] /= largest if largest > 0 else 1.0
    value = curve[-1][0]
    failed_at = min((step.value for step in steps if step.value > value), default=math.inf)
    return Collapse(value, failed_at, np.array(curve), mechanism, steps)


def _largest(function, comm, dim):
    """Largest displacement of a node [m]."""
    lengths = np.linalg.norm(function.x.array.reshape(-1, dim), axis=1)
    return max(comm.allgather(float(lengths.max(initial=0.0))))
