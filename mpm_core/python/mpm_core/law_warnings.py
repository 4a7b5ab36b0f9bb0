"""Warnings of laws that do not suit a model, or states that do not suit their laws; what laws have in common."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from . import _core
from .input_warnings import in_radians
from .mesh import cell_sizes

if TYPE_CHECKING:
    from .model import Model

RETURNED = 0.01
"""Fraction of a stress by which an update without strain changes it, above which it is probably beyond the yield surface by mistake"""

STIFFER = 2.0
"""Stiffness of an external law over the modulus that it states, above which the time step is far from the critical one"""

NEARLY_INCOMPRESSIBLE = 0.45
"""Poisson's ratio above which linear cells lock"""


SURFACES = {
    _core.CamClay: (
        "lie beyond their preconsolidation pressure; the first step reduces them to it. Set it by "
        'model.set_state("log_preconsolidation", mpm.log_preconsolidation(law, stress, overconsolidation))'
    ),
    _core.NorSand: (
        "lie outside of the yield surface of their image pressure; the first step returns them to it. Set it, and the void ratio, by "
        "model.set_state(name, values) for name, values in mpm.nor_sand_state(law, stress, state_parameter).items()"
    ),
}
"""What a warning says of stresses outside of the yield surface that a law has at the start, and how to set it"""


def doubts_of_laws(model: Model, nmd: bool) -> Iterator[str]:
    """What is probably wrong with the laws of a model, and with the states of its particles. Collective."""
    yield angles_in_radians(model.laws)
    yield from _stiffer_than_said(model)
    yield from (_outside_of_surface(model, kind) for kind in SURFACES)
    yield "" if nmd else locking(model.laws)


def _outside_of_surface(model: Model, kind: Any) -> str:
    """Of soil that has never been loaded as the stresses say that it is, before the first step, which would change them."""
    if model.steps > 0:
        return ""
    p, outside, total = model.particles, 0, 0
    for number, law in enumerate(model.laws):
        rows = p.material == number
        if not (rows.any() and any(isinstance(each, kind) for each in with_inner_laws(law))):
            continue
        stress = p.stress[rows]
        returned = stress.copy()
        law.update(np.zeros_like(stress), returned, np.ascontiguousarray(p.state[rows, : law.n_state]))
        change = np.linalg.norm(returned - stress, axis=1)
        outside += int(np.count_nonzero(change > RETURNED * np.linalg.norm(stress, axis=1)))
        total += len(stress)
    outside, total = model.comm.allreduce(np.array([outside, total]))
    if not outside:
        return ""
    return f"stresses of {outside / total:.1%} of the particles of {kind.__name__} {SURFACES[kind]}"


def _stiffer_than_said(model: Model) -> Iterator[str]:
    """Of laws in Python and UMATs whose modulus for the critical time step is too small, before the first step."""
    for number, law in enumerate(model.laws):
        if model.steps > 0 or not isinstance(list(with_inner_laws(law))[-1], (_core.PythonLaw, _core.Umat)):
            continue
        rows = np.flatnonzero(model.particles.material == number)[:100]
        modulus = model.comm.allreduce(_compression_modulus(model, law, rows) if len(rows) else 0.0, MPI.MAX)
        if modulus > STIFFER * law.p_wave_modulus:
            yield (
                f"the modulus of compression of {law.name} is {modulus:.3g} Pa in some particles, above its p_wave_modulus of "
                f"{law.p_wave_modulus:.3g} Pa, which limits the time step: explicit steps may be unstable"
            )


def _compression_modulus(model: Model, law: Any, rows: NDArray[np.intp]) -> float:
    """Largest modulus [Pa] of particles of a law that are compressed a little along the first axis, as they are now."""
    p, strain, dim = model.particles, 1e-7, model.mesh.dim
    size = cell_sizes(model.cell_volumes, dim)[p.cell[rows]]
    stresses = []
    for compression in (0.0, strain):  # without strain, stresses beyond the yield surface return to it
        increment, deformation = np.zeros_like(p.stress[rows]), np.tile(np.eye(dim), (len(rows), 1, 1))
        increment[:, 0] -= compression
        deformation[:, 0, 0] -= compression
        stress, state = p.stress[rows], np.ascontiguousarray(p.state[rows, : law.n_state])
        law.update(increment, stress, state, time=model.time, cell_size=size, deformation=deformation)
        stresses.append(stress[:, 0])
    return float(((stresses[0] - stresses[1]) / strain).max())


def angles_in_radians(laws: Iterable[Any]) -> str:
    """What a warning says of a friction angle that is probably in radians; empty where there is none."""
    angles = {getattr(law, "friction_angle", 0.0) for each in laws for law in with_inner_laws(each)}
    numbers = sorted(angle for angle in angles if isinstance(angle, (int, float)))
    found = (in_radians("the friction angle", angle) for angle in numbers)
    return next((text for text in found if text), "")


def with_inner_laws(law: Any) -> Iterator[Any]:
    """A law and the laws that it is made of."""
    yield law
    for inner in ("skeleton", "law", "peak"):
        if isinstance(getattr(law, inner, None), tuple(_core.law_types)):
            yield from with_inner_laws(getattr(law, inner))


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


def _reasons_to_lock(law: Any) -> Iterator[str]:
    """Reasons for which a law, or the law within it, keeps the volume of the soil."""
    for each in with_inner_laws(law):
        if hasattr(each, "water_modulus"):
            yield "undrained"
        poisson, friction = getattr(each, "poisson", None), getattr(each, "friction_angle", None)
        if isinstance(poisson, (int, float)) and poisson > NEARLY_INCOMPRESSIBLE:
            yield f"Poisson's ratio {poisson:g}"
        if isinstance(friction, (int, float)) and friction == 0:
            yield "friction angle 0"
