"""Warnings of input that is probably missing, of the wrong magnitude, or not what the motion of the soil asks for."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from . import _core

if TYPE_CHECKING:
    from .model import Model
    from .report import Report

UNIT_WEIGHTS = (1e3, 150e3)
"""Bounds of the unit weight of a soil [N/m3]: peat has 10 kN/m3, published slopes have up to 80, and 16 kN/m3 taken for a density
gives 157"""

YIELDS_ABOVE = 0.2
"""Plastic work over the energy at work above which a body counts as one that fails"""

NEARLY_INCOMPRESSIBLE = 0.45
"""Poisson's ratio above which linear cells lock"""


def warn_of_setup(model: Model, nmd: bool) -> None:
    """Warn of probable mistakes in the input. Collective."""
    locks = "" if nmd else locking(model.laws)
    found = [text for text in (_nothing_acts(model), _nothing_holds(model), _weight(model), locks) if text]
    if model.comm.rank == 0:
        for text in found:
            warnings.warn(text, RuntimeWarning, stacklevel=3)


def _nothing_acts(model: Model) -> str:
    p = model.particles
    acts = bool(np.any(model.gravity)) or bool(model._prescribed) or bool(model._water_conditions)
    acts = acts or model._incoming is not None
    acts = acts or any(bool(np.any(values)) for values in (p.traction, p.velocity, p.stress))
    bodies = [entry["body"] for entry in model._contacts]
    acts = acts or any(np.any(body[name][1]) for body in bodies for name in ("velocity", "spin", "force"))
    if model.comm.allreduce(int(acts)):
        return ""
    return (
        "nothing acts on the particles: gravity is zero, and so are tractions, velocities of supports and of rigid surfaces, and "
        "the particles' own velocities and stresses; gravity is given by model.set_gravity"
    )


def _nothing_holds(model: Model) -> str:
    held = model._conditions or model._contacts or model._absorbing or model._border is not None
    if held or not np.any(model.gravity):
        return ""
    return "nothing holds the particles, which fall freely: there is gravity and no boundary condition (model.fix, model.roller)"


def _weight(model: Model) -> str:
    p, gravity = model.particles, float(np.linalg.norm(model.gravity))
    densities = p.mass / p.volume
    low = model.comm.allreduce(float(densities.min(initial=np.inf)), MPI.MIN) * gravity
    high = model.comm.allreduce(float(densities.max(initial=0.0)), MPI.MAX) * gravity
    odd = low if low < UNIT_WEIGHTS[0] else high
    if gravity == 0 or (low >= UNIT_WEIGHTS[0] and high <= UNIT_WEIGHTS[1]):
        return ""
    return (
        f"the unit weight of particles is {odd:.4g} N/m3, density times gravity, expected from {UNIT_WEIGHTS[0]:g} to "
        f"{UNIT_WEIGHTS[1]:g} N/m3 for a soil: densities are in kg/m3, 2000 for most soils"
    )


def keeps_volume(laws: Iterable[Any]) -> bool:
    """Whether a law hardly lets its soil change its volume, so that linear cells lock without averaged strains."""
    return bool(locking(laws))


def locking(laws: Iterable[Any]) -> str:
    """What a warning says of linear cells or elements without averaged strains; empty where no law keeps the volume of its soil."""
    reasons = sorted({reason for law in laws for reason in _reasons_to_lock(law)})
    if not reasons:
        return ""
    return (
        f"linear cells lock in soil whose volume hardly changes ({', '.join(reasons)}): it is too stiff and too strong, the more the "
        "coarser the mesh; use nmd=True, which averages volumetric strains (docs/locking.md)"
    )


def locks_at_failure(laws: Iterable[Any]) -> bool:
    """Whether a law keeps the volume of its soil only as it fails: its dilation angle is below its friction angle."""
    laws = list(laws)
    return not keeps_volume(laws) and any(_core.associated_fraction(law) < 1 for law in laws)


def dilates(laws: Iterable[Any]) -> bool:
    """Whether soil of a law with friction dilates as it fails."""
    yields = [law for law in laws if not isinstance(law, _core.LinearElastic) and not keeps_volume([law])]
    return any(_core.associated_fraction(law) > 0 for law in yields)


class FailureWatch:
    """Warns once where frictional soil fails that locks only then: its dilation angle is below its friction angle.

    Args:
        model: the model.
        nmd: whether its strains are averaged.
    """

    def __init__(self, model: Model, nmd: bool) -> None:
        self._speaks = not nmd and model.comm.rank == 0 and locks_at_failure(model.laws)

    def look(self, report: Report) -> None:
        """Warn if the soil has failed.

        Args:
            report: the state of the run.
        """
        if self._speaks and report.plastic_work > YIELDS_ABOVE * report.energy_scale > 0:
            self._speaks = False
            warnings.warn(
                "the soil fails, and its dilation angle is below its friction angle, so that its volume hardly changes; linear cells "
                "then overestimate the strength (volumetric locking), the more the coarser the mesh. Use nmd=True, which averages "
                "volumetric strains, best together with integration=MIXED (docs/howto/switches.md)",
                RuntimeWarning,
                stacklevel=5,
            )


def _reasons_to_lock(law: Any) -> Iterator[str]:
    """Reasons for which a law, or the law within it, keeps the volume of the soil."""
    for inner in ("skeleton", "law", "peak"):
        if isinstance(getattr(law, inner, None), tuple(_core.law_types)):
            yield from _reasons_to_lock(getattr(law, inner))
    if hasattr(law, "water_modulus"):
        yield "undrained"
    poisson, friction = getattr(law, "poisson", None), getattr(law, "friction_angle", None)
    if isinstance(poisson, (int, float)) and poisson > NEARLY_INCOMPRESSIBLE:
        yield f"Poisson's ratio {poisson:g}"
    if isinstance(friction, (int, float)) and friction == 0:
        yield "friction angle 0"
