"""The methods of a model for contact: of its particles with rigid surfaces, and of the bodies of soil with each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from numpy.typing import ArrayLike

from .contact import add_contact, smallest_gap
from .field_contact import FieldContact, add_field_contact
from .rigid_body import FreeBody, Servo, Velocity
from .rigid_contact import RigidContact
from .surfaces import Surface

if TYPE_CHECKING:
    from .model import Model


class ContactMethods:
    """The methods of a model that add contacts, and that return them."""

    _contacts: list[dict[str, Any]]
    _field_contacts: list[dict[str, Any]]

    def add_contact(
        self,
        surface: Surface,
        *,
        friction: ArrayLike = 0.0,
        adhesion: ArrayLike = 0.0,
        drag: ArrayLike = 0.0,
        velocity: Velocity = None,
        spin: Velocity = None,
        body: FreeBody | Servo | None = None,
        centre: ArrayLike | None = None,
        penalty: float = 0.2,
        bonded: bool = False,
    ) -> RigidContact:
        """Add contact of the particles with a rigid surface, which does not depend on the mesh.

        The surface pushes on particles that are nearer to it than their radius V^(1/D)/2, without tension, and resists
        sliding with Coulomb friction and adhesion (docs/contact.md). It is at rest, moves as prescribed, or moves as a
        rigid body under the forces on it. With ``bonded`` the soil beside it is tied to it instead: a
        prescribed displacement on a boundary that cuts cells.

        Args:
            surface: a `Plane`, `Box`, `Disc`, `Sphere`, `Cylinder`, `Cone`, `Wedge`, `Polyline` or `Triangles` at its present
                position, outside all particles.
            friction: coefficient mu of Coulomb friction [-], the tangent of the angle of friction; 0 is smooth. In soil with pore
                water it acts by the effective stress.
            adhesion: shear strength of the contact without pressure [Pa], for instance that of the soil on a rough footing;
                it acts only where the soil touches the surface, and does not resist tension.
            drag: coefficient C of a resistance C rho v^2 that grows with the velocity v of sliding [-]: the turbulent resistance of
                Voellmy (1955), C = g / xi with his coefficient xi, some 100 to 2000 m/s2. In explicit steps only. Friction, adhesion
                and drag may each be given by part, one number for each segment of a `Polyline` or each of the `Triangles`.
            velocity: of the centre [m/s], shape (D,); or (times [s], velocities (n, D)), linear in between and constant
                before and after; at rest by default. Along axes in which a body is free, its initial velocity.
            spin: angular velocity about the centre [rad/s], counterclockwise in two dimensions and shape (3,) in three; or
                (times [s], spins (n,) or (n, 3)). Of a body that rotates freely, its initial spin.
            body: a `FreeBody`, which forces move, or a `Servo`, which keeps a load; by default all motion is prescribed.
            centre: centre of mass of a free body; the point about which the surface rotates and moments count [m], shape
                (D,). By default the centre of a Disc, Sphere, Box, Cylinder, Cone or Wedge, the middle of the extent of
                Triangles, and the first point of the other surfaces.
            penalty: stiffness beta of the contact in (0, 1], relative to the largest one that the time step allows; with a
                larger one particles penetrate less. In explicit steps the default yields like some two cells of soil,
                which is too soft for earth pressure at rest (docs/contact.md). In implicit steps its stiffness is 50 beta
                times that of the particles, ten times with 0.2.
            bonded: tie the particles that are now within 1.5 of their radii of the surface to it, in tension too.

        Returns:
            Motion of the surface and forces on it, which follow the model.

        Raises:
            InputError: an argument out of its range, a surface of another dimension, or one that overlaps the soil, with the
                depth; a model without particles; a free body without inertia, or one that rotates in axial symmetry.

        Example:
            >>> ground = model.add_contact(mpm.Plane((0, 0), normal=(0, 1)), friction=0.3)
            >>> *_, report = model.explicit(until=1.0)
            >>> ground.force
        """
        return add_contact(
            cast("Model", self), surface, friction, adhesion, drag, penalty, centre, velocity, spin, body, bonded
        )

    def gap(self, surface: Surface) -> float:
        """Smallest distance of the particles from a surface less their radius V^(1/D)/2 [m]; negative where they overlap.

        The particles that resting cells stand for count too.
        """
        return smallest_gap(cast("Model", self), surface)

    @property
    def contacts(self) -> list[RigidContact]:
        """The rigid surfaces in the order in which they were added. Not collective."""
        return [RigidContact(cast("Model", self), number) for number in range(len(self._contacts))]

    def add_field_contact(
        self,
        interface: Surface | ArrayLike,
        *,
        first: int = 0,
        second: int = 1,
        friction: float = 0.0,
        adhesion: float = 0.0,
    ) -> FieldContact:
        """Define contact of the bodies of two velocity fields along an interface, with friction and adhesion; explicit only.

        Without this, bodies in different velocity fields pass through one another. Where both have mass at a node and their
        particles, each as wide as the side of a square or cube of its volume, touch, they do not approach any further, slide
        against Coulomb friction, and separate without tension (Bardenhagen et al. 2000; docs/contact.md).

        Args:
            interface: direction from the first body to the second, shape (D,), where they touch along a plane; else a `Plane`,
                `Polyline`, `Triangles` or other surface that does not move, with the second body on the side where soil
                would be that touches it. Only its normals count.
            first: number of a velocity field; the constructor's `velocity_fields` has that of each law.
            second: number of another one.
            friction: coefficient mu of Coulomb friction [-], the tangent of the angle of friction; 0 is smooth.
            adhesion: shear strength of the interface without pressure [Pa]; it acts only where the bodies touch, and does
                not resist tension.

        Returns:
            Forces between the bodies, which follow the model.

        Raises:
            InputError: an argument out of its range, or fields that are in contact already.

        Example:
            >>> model = mpm.Model(mesh, [bedrock, soil], velocity_fields=[0, 1])
            >>> weak = model.add_field_contact(interface=(0.0, 1.0), friction=np.tan(np.radians(12.0)))
        """
        return add_field_contact(cast("Model", self), interface, first, second, friction, adhesion)

    @property
    def field_contacts(self) -> list[FieldContact]:
        """The contacts between velocity fields in the order in which they were added. Not collective."""
        return [FieldContact(cast("Model", self), number) for number in range(len(self._field_contacts))]
