"""Rigid surfaces that touch the particles of a model, or are tied to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import flag, positive, within
from .collective import collectively
from .contact_strength import (
    checked_strength,
    described_strength,
    is_rough,
    largest,
    remember_strength,
    strength_of,
    strength_text,
)
from .input_warnings import warn_of_drag, warn_of_friction
from .mesh import floats
from .outlines import mesh_box
from .rigid_body import FreeBody, Servo, Velocity, describe, rigid_body
from .rigid_contact import RigidContact
from .surface_description import checked, described, surface_of
from .surfaces import Surface, distances
from .triangles import Triangles

if TYPE_CHECKING:
    from .model import Model


def smallest_gap(model: Model, surface: Surface) -> float:
    """See `Model.gap`."""

    def own() -> float:
        return float(_core.smallest_gap(model._core, checked(surface, model.mesh.dim)[0]))

    return model.comm.allreduce(collectively(model.comm, own), MPI.MIN)


ROUND_OFF = 1e-12
"""Overlap of soil and a surface that counts as touching, over the largest coordinate of the mesh"""

DEEPEST = 0.1
"""Overlap that is a mistake where soil was placed after the surface, over the radius of the largest particle"""


def add_contact(
    model: Model, surface: Surface, friction: ArrayLike, adhesion: ArrayLike, drag: ArrayLike, penalty: float, centre: ArrayLike | None,
    velocity: Velocity, spin: Velocity, body: FreeBody | Servo | None, bonded: bool,
) -> RigidContact:  # fmt: skip
    """See `Model.add_contact`."""

    def entry() -> dict[str, Any]:
        dim = model.mesh.dim
        about = checked(surface, dim)[1] if centre is None else floats("centre", centre, (dim,))
        strength = checked_strength(surface, friction=friction, adhesion=adhesion, drag=drag)
        described_as = described_strength(surface, strength)
        within("penalty", penalty, 0, 1)
        positive("penalty", penalty, "(a ratio)")
        if flag("bonded", bonded) and is_rough(described_as):
            raise InputError(
                f"the surface has {strength_text(described_as)}, expected 0 where bonded is True: nothing slides"
            )
        remember_strength(model, strength)
        return {
            "surface": described(surface), **described_as, "penalty": float(penalty), "bonded": bool(bonded),
            "body": describe(surface, about, velocity, spin, body, geometry=model.geometry, time=model.time),
        }  # fmt: skip

    new = collectively(model.comm, entry)
    warn_of_friction(model.comm, largest(new["friction"]))
    warn_of_drag(model.comm, largest(new["drag"]))
    if smallest_gap(model, surface) == np.inf:
        raise InputError("the model has no particles, seed some before surfaces are added")
    if not bonded:
        require_outside(model, surface)
    if isinstance(surface, Triangles):
        model._triangulated[surface.fingerprint] = surface
    tied = None
    if bonded:
        convert_beside(model, surface)
        tied = bonds_of(model, surface)
    set_contacts(model, [*model._contacts, new])
    if tied is not None:
        model.particles.set(bond_name(len(model._contacts) - 1), tied)
    return RigidContact(model, len(model._contacts) - 1)


def require_outside(model: Model, surface: Surface) -> None:
    """Raise an InputError where soil is inside of a surface. Collective."""
    gap = smallest_gap(model, surface)
    if gap < -ROUND_OFF * np.abs(mesh_box(model)).max():
        raise InputError(_overlap(repr(surface), -gap))


def _overlap(surface: str, depth: float) -> str:
    """Text of the error of soil inside of a surface."""
    return (
        f"surface {surface} overlaps the soil by {depth:.6g} m, expected it outside of all particles, which have the radius "
        "V^(1/D)/2; see Model.gap, and for planes and polylines the side on which the soil is"
    )


def require_new_soil_outside(model: Model) -> None:
    """Raise an InputError where soil was placed inside of a surface since that was added, before a run with it. Collective."""
    if model._late is None:
        return
    p, comm = model.particles, model.comm
    radius = 0.5 * p._sides()
    largest = comm.allreduce(float(radius.max(initial=0.0)), MPI.MAX)
    new = (p.id >= model._late) & ~p.is_resting
    for contact, entry in zip(model.contacts, model._contacts, strict=True):
        if entry["bonded"]:
            continue
        surface = surface_of(model, entry["surface"])
        gap = distances(surface, contact._at_start(p.position[new])) - radius[new]
        if (depth := -comm.allreduce(float(gap.min(initial=np.inf)), MPI.MIN)) > DEEPEST * largest:
            moved = f", which has moved by {contact.displacement} m," if model.steps else ""
            raise InputError(_overlap(f"{surface!r}{moved}", depth))
    model._late = None


BOND_REACH = 1.5
"""Distance from a surface up to which particles are tied to it, over their radius: the layer beside it"""


OF_SURFACES = _SLIP, _BOND = "contact_slip_", "contact_bond_"
"""Beginnings of the names of the particles' fields that rigid surfaces have"""


def bond_name(number: int) -> str:
    """The particles' field that says which of them are tied to a surface."""
    return f"{_BOND}{number}"


def convert_beside(model: Model, surface: Surface) -> None:
    """Turn resting cells into particles as far from a surface as the beginning of a run does."""
    corners = model.mesh.points[model.mesh.cells[: model.mesh.owned_cells]]
    centres = corners.mean(axis=1)
    reach = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1, initial=0.0)
    model.convert(where=distances(surface, centres) <= _core.near_reaches * reach)


def bonds_of(model: Model, surface: Surface) -> NDArray[np.float64]:
    """What ties the layer of particles beside a surface to it: 1 for them, 0 for others, and their places; shape (n, 1 + D).

    Raises:
        InputError: there are none on any rank, or soil is inside.
    """
    particles = model.particles
    apart, radius = distances(surface, particles.position), 0.5 * particles._sides()
    depth = model.comm.allreduce(float(-apart.min(initial=0.0)), MPI.MAX)
    if depth > 0:
        raise InputError(f"surface {surface!r} has soil as deep as {depth:.6g} m inside, expected it outside")
    near = apart < BOND_REACH * radius
    if not model.comm.allreduce(int(near.sum())):
        raise InputError(
            f"no particle is beside surface {surface!r}, expected some within {BOND_REACH} of their radii V^(1/D)/2"
        )
    return np.column_stack([near, particles.position])


def set_contacts(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give the model these contacts; those that it has already, at the beginning of the list, keep their state."""
    dim, known = model.mesh.dim, len(model._contacts)
    for number, entry in list(enumerate(entries))[known:]:
        surface, _ = surface_of(model, entry["surface"])._checked(dim)
        bonded = entry["bonded"]
        slip = f"{_SLIP}{number}" if is_rough(entry) else ""
        bond = bond_name(number) if bonded else ""
        known_fields = {field["name"] for field in model.particles.schedule()}
        if slip and slip not in known_fields:
            model.add_field(slip, unit="m", meaning=f"Elastic slip on rigid surface {number}", components=dim)
        if bond and bond not in known_fields:
            meaning = f"1 where the particle is tied to rigid surface {number}, and the place where it was tied"
            model.add_field(bond, unit="m", meaning=meaning, components=dim + 1)
        body = rigid_body(entry["body"])
        _core.add_contact(model._core, surface, strength_of(model, entry), entry["penalty"], body, slip, bond)
    model._contacts = entries


def refuse_contacts(model: Model, scheme: str) -> None:
    """Raises InputError where a scheme would leave rigid surfaces out."""
    if model._contacts:
        kinds = ", ".join(entry["surface"]["kind"] for entry in model._contacts)
        raise InputError(f"the model has contact with rigid surfaces ({kinds}), which {scheme} does not support")


def refuse_drag(model: Model, scheme: str) -> None:
    """Raises InputError where a scheme would leave out the resistance that grows with velocity."""
    for entry in model._contacts:
        if largest(entry["drag"]) > 0:
            raise InputError(f"drag of the {entry['surface']['kind']} is above 0, which {scheme} does not support")


def refuse_driven_bodies(model: Model, scheme: str, *, second_order: bool) -> None:
    """Raises InputError where an implicit step would leave out what moves a rigid body."""
    for number, entry in enumerate(model._contacts):
        body, kind = entry["body"], entry["surface"]["kind"]
        driven = any(body["drive"]) or body["rotates"]
        if driven and second_order:
            raise InputError(f"second_order is True, expected False with a {kind} that is a FreeBody or a Servo")
        if driven and any(number in (one["ball"], one["other"]) for one in model._collisions):
            raise InputError(f"the model has a {kind} that collides with other bodies, which {scheme} does not support")
