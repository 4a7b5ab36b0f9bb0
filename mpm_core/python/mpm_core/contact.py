"""Rigid surfaces that touch the particles of a model, or are tied to them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import flag, positive, within
from .collective import collectively
from .collisions import add_collision
from .input_warnings import warn_of_friction
from .mesh import floats
from .outlines import Outline, mesh_box, outline
from .rigid_body import FreeBody, Servo, Velocity, describe, rigid_body
from .surfaces import KINDS, Surface, distances
from .triangles import Triangles

if TYPE_CHECKING:
    from .model import Model


class RigidContact:
    """Forces on a rigid surface, its position and its motion, as `Model.add_contact` returns them; all methods are collective.

    It is a probe: ``mpm_core.probes.ProbeFile("wall.csv", wall)`` records its histories.
    """

    def __init__(self, model: Model, number: int) -> None:
        self.model = model
        self._number = number
        self._outline: Outline | None = None  # at the start

    @property
    def _index(self) -> int:
        """Its place among the contacts of the model, which `Model.restore` replaces."""
        there = len(self.model._contacts)
        if self._number >= there:
            raise InputError(
                f"rigid surface {self._number} is not in the model, which has {there} since it was restored; expected one of "
                "model.contacts"
            )
        return self._number

    def __repr__(self) -> str:
        entry = self.model._contacts[self._index]
        how = "tied" if entry["bonded"] else f"friction {entry['friction']:g}, adhesion {entry['adhesion']:g} Pa"
        return f"<RigidContact {self._number}: {surface_of(self.model, entry['surface'])!r}, {how}>"

    def _state(self) -> dict[str, Any]:
        return _core.contact_state(self.model._core, self._index)  # type: ignore[no-any-return]

    def _vector(self, name: str) -> NDArray[np.float64]:
        return np.array(self._state()[name])

    def _about_axes(self, name: str) -> NDArray[np.float64]:
        return self._vector(name)[2 if self.model.mesh.dim == 2 else 0 :]

    @property
    def force(self) -> NDArray[np.float64]:
        """Force of the soil on the surface in the last step [N], shape (D,); per metre or per radian in two dimensions."""
        return self._vector("force")

    @property
    def impulse(self) -> NDArray[np.float64]:
        """Integral of ``force`` over time since the surface was added [N s], shape (D,).

        Its difference between two times over their distance is the mean force, without the noise of single steps.
        """
        return self._vector("impulse")

    @property
    def collision_impulse(self) -> NDArray[np.float64]:
        """Impulse of other bodies on this one since the first collision of the model was declared [N s], shape (D,)."""
        return self._vector("collision_impulse")

    @property
    def moment(self) -> NDArray[np.float64]:
        """Moment of these forces in the last step [N m] about the surface's ``centre``, as it has moved.

        Shape (1,) in two dimensions, counterclockwise, and (3,) in three.
        """
        return self._about_axes("moment")

    @property
    def area(self) -> float:
        """Area of the soil in contact in the last step [m2]; per metre or per radian in two dimensions."""
        return float(self._state()["area"])

    @property
    def pressure(self) -> float:
        """Mean normal pressure on that area [Pa]; 0 without contact."""
        return _ratio(self._state(), "normal")

    @property
    def sticking_fraction(self) -> float:
        """Fraction of that area that does not slide; 0 without contact, and on a smooth surface."""
        return _ratio(self._state(), "sticking")

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of the centre since the surface was added [m], shape (D,)."""
        return self._vector("displacement")

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity of the centre in the last step [m/s], shape (D,)."""
        return self._vector("velocity")

    @property
    def angle(self) -> NDArray[np.float64]:
        """Integral of ``spin`` since the surface was added [rad], shape (1,) or (3,).

        It is the angle of a rotation about a fixed axis.
        """
        return self._about_axes("angle")

    @property
    def spin(self) -> NDArray[np.float64]:
        """Angular velocity in the last step [rad/s], shape (1,) in two dimensions, counterclockwise, and (3,) in three."""
        return self._about_axes("spin")

    @property
    def rotation(self) -> NDArray[np.float64]:
        """Matrix that rotates directions in the surface at its start to where they are now, shape (D, D)."""
        dim = self.model.mesh.dim
        return self._vector("rotation")[:dim, :dim]

    def outline(self) -> Outline:
        """The boundary of the surface where it is now: segments in two dimensions, triangles in three.

        Planes and open polylines are shown as far as the mesh went where the surface was at its start.

        Returns:
            Points [m], shape (n, D), and the numbers of the points of each segment or triangle, shape (m, D).
        """
        if self._outline is None:
            self._outline = outline(
                surface_of(self.model, self.model._contacts[self._index]["surface"]), *mesh_box(self.model)
            )
        points, cells = self._outline
        return self._centre + (points - self._start) @ self.rotation.T, cells

    @property
    def _start(self) -> NDArray[np.float64]:
        """The centre at the start [m]."""
        return np.array(self.model._contacts[self._index]["body"]["centre"])

    @property
    def _centre(self) -> NDArray[np.float64]:
        """The centre now [m]."""
        return self._start + self.displacement

    def _at_start(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where points of the body were at its start [m], shape (n, D)."""
        return self._start + (points - self._centre) @ self.rotation

    def velocity_at(self, points: ArrayLike) -> NDArray[np.float64]:
        """Velocity of points of the body in the last step [m/s], shape (n, D).

        Args:
            points: where they are now [m], shape (n, D).

        Raises:
            InputError: points of another shape.
        """
        dim = self.model.mesh.dim
        arms = np.zeros((len(np.atleast_1d(np.asarray(points))), 3))
        arms[:, :dim] = floats("points", points, (None, dim)) - self._centre
        return self.velocity + np.cross(self._vector("spin"), arms)[:, :dim]

    def add_collision(self, other: RigidContact, *, friction: float = 0.0, restitution: float = 0.0) -> None:
        """Define collisions of this body with another rigid surface of the model; without them the body passes through it.

        One of them is a `Disc` or a `Sphere`, the other any surface; one of them at least is a `FreeBody`. Where they touch,
        impulses keep them apart: with friction bodies roll or slide, with restitution they bounce until they rest. Momentum is
        kept to round-off, and no impulse adds energy (docs/contact.md). Other bodies count as prescribed. Collective.

        Args:
            other: another surface of the model, apart from this one.
            friction: coefficient mu of Coulomb friction [-]; 0 is smooth.
            restitution: velocity of separation over that of approach, from 0, no bounce, to 1, elastic.

        Raises:
            InputError: an argument out of its range, bodies that overlap, with the depth, that collide already, of which none is
                round or none moves freely, or of another model.

        Example:
            >>> boulder.add_collision(ground, friction=0.5, restitution=0.3)
        """
        add_collision(self, other, friction, restitution)

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of the motion along free axes and of free rotation [J]; 0 for other bodies."""
        return float(self._state()["kinetic_energy"])

    @property
    def stored_energy(self) -> float:
        """Elastic energy of the penalty springs at the start of the last explicit step, or at the end of an implicit one [J]."""
        return float(self._state()["energy"])

    def values(self) -> dict[str, float]:
        """Numbers by name of column, as a probe gives them.

        They are time, force, impulse, moment, displacement, velocity, angle, spin, area, pressure and sticking fraction.
        """
        axes, state = "xyz"[: self.model.mesh.dim], self._state()
        first = 2 if len(axes) == 2 else 0
        columns = [("force", "N"), ("impulse", "N.s"), ("displacement", "m"), ("velocity", "m/s")]
        turns = [("moment", "N.m"), ("angle", "rad"), ("spin", "rad/s")]
        values = {"time_s": self.model.time}
        values |= {f"{name}_{axes[k]}_{unit}": state[name][k] for name, unit in columns for k in range(len(axes))}
        values |= {f"{name}_{'xyz'[k]}_{unit}": state[name][k] for name, unit in turns for k in range(first, 3)}
        fractions = {"pressure_Pa": _ratio(state, "normal"), "sticking_fraction": _ratio(state, "sticking")}
        return values | {"area_m2": state["area"], **fractions}


def _ratio(state: dict[str, Any], name: str) -> float:
    return float(state[name] / state["area"]) if state["area"] > 0 else 0.0


def smallest_gap(model: Model, surface: Surface) -> float:
    """See `Model.gap`."""

    def own() -> float:
        return float(_core.smallest_gap(model._core, checked(surface, model.mesh.dim)[0]))

    return model.comm.allreduce(collectively(model.comm, own), MPI.MIN)


def checked(surface: Surface, dim: int) -> Any:
    """The surface in the core, and the point about which it rotates.

    Raises:
        InputError: no surface, or one of another dimension.
    """
    if not isinstance(surface, tuple(KINDS.values())):
        raise InputError(f"surface is {surface!r}, expected a {', '.join(KINDS)}")
    return surface._checked(dim)


ROUND_OFF = 1e-12
"""Overlap of soil and a surface that counts as touching, over the largest coordinate of the mesh"""

DEEPEST = 0.1
"""Overlap that is a mistake where soil was placed after the surface, over the radius of the largest particle"""


def add_contact(
    model: Model, surface: Surface, friction: float, adhesion: float, penalty: float, centre: ArrayLike | None,
    velocity: Velocity, spin: Velocity, body: FreeBody | Servo | None, bonded: bool,
) -> RigidContact:  # fmt: skip
    """See `Model.add_contact`."""

    def entry() -> dict[str, Any]:
        dim = model.mesh.dim
        about = checked(surface, dim)[1] if centre is None else floats("centre", centre, (dim,))
        positive("friction", friction, "(a coefficient)", zero=True)
        positive("adhesion", adhesion, "Pa", zero=True)
        within("penalty", penalty, 0, 1)
        positive("penalty", penalty, "(a ratio)")
        if flag("bonded", bonded) and (friction or adhesion):
            raise InputError(
                f"friction is {friction} and adhesion {adhesion} Pa, expected 0 where bonded is True: nothing slides"
            )
        return {
            "surface": described(surface), "friction": float(friction), "adhesion": float(adhesion),
            "penalty": float(penalty), "bonded": bool(bonded),
            "body": describe(surface, about, velocity, spin, body, geometry=model.geometry, time=model.time),
        }  # fmt: skip

    new = collectively(model.comm, entry)
    warn_of_friction(model.comm, friction)
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


def described(surface: Surface) -> dict[str, Any]:
    """A surface as checkpoints have it; triangles by their fingerprint."""
    if isinstance(surface, Triangles):
        return {"kind": "Triangles", "fingerprint": surface.fingerprint, "triangles": len(surface.triangles)}
    shape = {field.name: _plain(getattr(surface, field.name)) for field in fields(surface)}
    return {"kind": type(surface).__name__, **shape}


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool) or value is None else np.asarray(value, dtype=float).tolist()


def require_surfaces(model: Model, surfaces: list[dict[str, Any]]) -> None:
    """Raises InputError where the model does not have the triangles of a surface in a checkpoint."""
    for surface in surfaces:
        if surface["kind"] == "Triangles" and surface["fingerprint"] not in model._triangulated:
            raise InputError(
                f"the checkpoint has contact with a surface of {surface['triangles']} triangles that the model does not have; "
                "add it by model.add_contact or add_field_contact before model.restore"
            )


def surface_of(model: Model, described: dict[str, Any]) -> Surface:
    """The surface that a checkpoint describes."""
    if described["kind"] == "Triangles":
        return model._triangulated[described["fingerprint"]]
    surface: Surface = KINDS[described["kind"]](**{key: value for key, value in described.items() if key != "kind"})
    return surface


def set_contacts(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give the model these contacts; those that it has already, at the beginning of the list, keep their state."""
    dim, known = model.mesh.dim, len(model._contacts)
    for number, entry in list(enumerate(entries))[known:]:
        surface, _ = surface_of(model, entry["surface"])._checked(dim)
        bonded = entry["bonded"]
        slip = f"{_SLIP}{number}" if entry["friction"] > 0 or entry["adhesion"] > 0 else ""
        bond = bond_name(number) if bonded else ""
        known_fields = {field["name"] for field in model.particles.schedule()}
        if slip and slip not in known_fields:
            model.add_field(slip, unit="m", meaning=f"Elastic slip on rigid surface {number}", components=dim)
        if bond and bond not in known_fields:
            meaning = f"1 where the particle is tied to rigid surface {number}, and the place where it was tied"
            model.add_field(bond, unit="m", meaning=meaning, components=dim + 1)
        body = rigid_body(entry["body"])
        _core.add_contact(
            model._core, surface, entry["friction"], entry["adhesion"], entry["penalty"], body, slip, bond
        )
    model._contacts = entries


def refuse_contacts(model: Model, scheme: str) -> None:
    """Raises InputError where a scheme would leave rigid surfaces out."""
    if model._contacts:
        kinds = ", ".join(entry["surface"]["kind"] for entry in model._contacts)
        raise InputError(f"the model has contact with rigid surfaces ({kinds}), which {scheme} does not support")


def refuse_driven_bodies(model: Model, scheme: str, *, second_order: bool) -> None:
    """Raises InputError where an implicit step would leave out what moves a rigid body."""
    for number, entry in enumerate(model._contacts):
        body, kind = entry["body"], entry["surface"]["kind"]
        driven = any(body["drive"]) or body["rotates"]
        if driven and second_order:
            raise InputError(f"second_order is True, expected False with a {kind} that is a FreeBody or a Servo")
        if driven and any(number in (one["ball"], one["other"]) for one in model._collisions):
            raise InputError(f"the model has a {kind} that collides with other bodies, which {scheme} does not support")
