"""Factor of safety by particles, as a check of that of the finite elements.

For each factor the soil, with its strength divided by it, is loaded by its weight at once and followed by the explicit scheme
with local damping until it rests or flows, as Griffiths and Lane (1999, Geotechnique 49, 387-403) do with their viscoplastic
iteration. No system of equations is solved, so that there is nothing that may not converge: soil that is out of balance moves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.checks import of_kind
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge.errors import InputError, agree
from fenics_bridge.fem.equilibration import EquilibriumReport
from fenics_bridge.fem.load_steps import LoadStep, advance

FIRST_LOOK, LAST_LOOK = 6, 120
"""Times that a shear wave takes through the body, after which it is first asked whether it flows, and when a trial ends"""

GROWTH = 3.0
"""Displacement over the elastic settlement under the weight that a body must exceed before it counts as flowing"""


@dataclass(frozen=True)
class ParticleSafety:
    """The last factor at which the particles came to rest, and the evidence of failure above it."""

    value: float
    """Factor of safety"""
    failed_at: float
    """Smallest factor above it at which the particles did not come to rest"""
    failed: bool
    """Whether they were shown to flow there, in motion that does not slow down; if not, `value` is a lower bound only"""
    reason: str
    """Why they do not rest there, in words"""
    residual: float
    """Largest out-of-balance over external force that counted as rest [-]"""
    curve: NDArray[np.float64]
    """Factor and largest displacement of a particle [m] of every trial that came to rest, shape (k, 2)"""
    model: mpm.Model
    """Particles of the trial at `failed_at`, as they flow"""
    steps: list[LoadStep]
    """Every step of the factor that was tried"""

    def __repr__(self) -> str:
        above = "the particles flow" if self.failed else "the particles did not come to rest, flow not shown,"
        return (
            f"<ParticleSafety: factor {self.value:.6g} at rest, {above} at {self.failed_at:.6g}; {len(self.steps)} trials, "
            f"out-of-balance ratio up to {self.residual:.2g}>"
        )


def particle_safety(
    model_of: Callable[[float], mpm.Model],
    start: float = 0.5,
    first_step: float = 0.2,
    tolerance: float = 5e-3,
    *,
    damping: float = 0.7,
    rest: float = 1e-3,
    nmd: bool = False,
    progress: Callable[[LoadStep], Any] | None = None,
) -> ParticleSafety:
    """Factor by which the strength of the particles can be divided before they no longer come to rest under their weight.

    The particles move as far as they settle: for the factor of the undeformed body Young's moduli must be large enough for
    settlements to be small against the cells. Strength, not stiffness, decides on the factor. Collective.

    Args:
        model_of: function of the factor that returns a new `mpm_core.Model` with its particles, supports and gravity, whose laws
            have their strength divided by the factor, e.g. by `reduced_strength`; with initial stresses or without.
        start: factor to begin with, at which the soil must rest.
        first_step: first increment of the factor.
        tolerance: fraction of the factor below which steps end [-]; `failed_at` is above the result by twice this fraction at most
            where failure was shown.
        damping: local damping [-], in (0, 1).
        rest: out-of-balance over external force at which the soil counts as at rest [-].
        nmd: average volumetric strains over nodes; without it the factor is that of linear finite elements on the same cells. In soil
            that dilates less than by its friction angle strains are averaged in part, and factors on coarse cells are higher than
            those of finite elements with `nmd` (docs/factor_of_safety.md).
        progress: function that is called with each step of the factor, e.g. `print_step`.

    Returns:
        The factor and the evidence of failure above it.

    Raises:
        InputError: an argument out of range, a model without gravity, soil that does not rest at `start`, or that rests at every
            factor. Raised on all ranks alike.
    """
    _check(start=start, first_step=first_step, tolerance=tolerance, damping=damping, rest=rest)
    models, curve = {}, []

    def attempt(factor: float) -> Any:
        models[factor] = model = of_kind("what model_of returns", model_of(factor), mpm.Model)
        agree(
            model.comm,
            None
            if np.any(model.gravity)
            else "model_of returns a model without gravity, expected one that may fail under its weight",
        )
        report, moved = _follow(model, damping, rest, nmd)
        if report.converged:
            curve.append((factor, moved))
            del models[factor]
        return report

    first = attempt(start)
    if not first.converged:
        raise InputError(
            f"start: with the strength divided by {start!r} the particles do not come to rest: {first.reason}; take a smaller one"
        )
    steps = advance(attempt, start, math.inf, first_step, tolerance, progress)
    above = [step for step in steps if step.value > curve[-1][0]]
    if not above:
        raise InputError(
            f"model_of: the particles come to rest at every factor up to {curve[-1][0]:.6g}; the body may not be able to fail, such as "
            "level ground between rollers"
        )
    failures = [step for step in above if step.report.outcome == "failure"]
    end = min(failures or above, key=lambda step: step.value)
    return ParticleSafety(
        value=curve[-1][0],
        failed_at=end.value,
        failed=end.report.outcome == "failure",
        reason=end.report.reason,
        residual=max([first.residuals[-1], *(step.report.residuals[-1] for step in steps if step.converged)]),
        curve=np.array(curve),
        model=models[end.value],
        steps=steps,
    )


def _check(**values: float) -> None:
    """Raise InputError for a value that is not positive, or not below 1 where that is required."""
    for name, value in values.items():
        below = {"tolerance": 1.0, "damping": 1.0, "rest": 1.0}.get(name, math.inf)
        if not 0 < value < below:
            expected = "a positive number" if below == math.inf else "a number between 0 and 1"
            raise InputError(f"{name} is {value!r}, expected {expected}")


def _follow(model: Any, damping: float, rest: float, nmd: bool) -> Any:
    """Run a model until it rests or flows; returns EquilibriumReport and the largest displacement of a particle [m]."""
    period, settlement = _scales(model)
    residuals, moved = [1.0], [0.0]
    steps_before = model.steps

    def ended(outcome: str, reason: str = "") -> Any:
        return EquilibriumReport(outcome, residuals, reason, model.steps - steps_before, explicit=True), moved[-1]

    for look in range(1, LAST_LOOK + 1):
        try:
            report = model.explicit(model.time + period, damping=damping, nmd=nmd).last()
        except mpm.RunError as error:
            return ended("undecided", str(error))
        residuals.append(report.unbalanced_ratio)
        moved.append(_largest_displacement(model))
        if report.is_quasi_static(rest):
            return ended("equilibrium")
        if look >= FIRST_LOOK and moved[-1] > GROWTH * settlement and _flows(moved):
            reason = (
                f"the particles flow: after {model.time:.3g} s one has moved by {moved[-1]:.3g} m, ever faster, under an "
                f"out-of-balance force of {residuals[-1]:.1e}"
            )
            return ended("failure", reason)
    reason = f"the particles neither rest nor flow after {model.time:.3g} s: out of balance by {residuals[-1]:.1e}"
    return ended("undecided", reason)


def _flows(moved: list[float]) -> bool:
    """Whether the displacements of equal times grew as much in the last quarter of them as in the one before, or more."""
    quarter = len(moved) // 4
    return moved[-1] - moved[-1 - quarter] >= moved[-1 - quarter] - moved[-1 - 2 * quarter]


def _scales(model: mpm.Model) -> tuple[float, float]:
    """Time that a shear wave takes through the body [s], and its elastic settlement under its weight [m]. Collective."""
    p, comm = model.particles, model.comm
    low = np.min(comm.allgather(p.position.min(axis=0, initial=np.inf)), axis=0)
    high = np.max(comm.allgather(p.position.max(axis=0, initial=-np.inf)), axis=0)
    density = comm.allreduce(float((p.mass / p.volume).max(initial=0.0)), MPI.MAX)
    softest = model.wave_moduli().min(axis=0, initial=np.inf)
    wave, shear = (comm.allreduce(float(modulus), MPI.MIN) for modulus in softest)
    gravity = float(np.linalg.norm(model.gravity))
    return (
        float(np.linalg.norm(high - low)) * math.sqrt(density / shear),
        density * gravity * (high - low)[-1] ** 2 / wave,
    )


def _largest_displacement(model: mpm.Model) -> float:
    """Largest displacement of a particle [m]. Collective."""
    lengths = np.linalg.norm(model.particles.displacement, axis=1)
    return model.comm.allreduce(float(lengths.max(initial=0.0)), MPI.MAX)
