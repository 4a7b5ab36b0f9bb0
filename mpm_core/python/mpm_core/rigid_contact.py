"""A rigid surface that touches particles, as a model returns it: its forces, places and velocities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from .collisions import add_collision
from .contact_strength import strength_text
from .mesh import floats
from .outlines import Outline, mesh_box, outline
from .rigid_body import motion_text
from .surface_description import place_of, surface_of

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
        return place_of(self._number, "rigid surface", self.model._contacts, "model.contacts")

    def __repr__(self) -> str:
        entry = self.model._contacts[self._index]
        how = "tied" if entry["bonded"] else strength_text(entry)
        moves = motion_text(entry["body"], self.model.geometry)
        return f"<RigidContact {self._number}: {surface_of(self.model, entry['surface'])!r}, {how}{moves}>"

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
