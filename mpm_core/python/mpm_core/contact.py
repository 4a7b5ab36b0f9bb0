"""Rigid surfaces that touch the particles of a model, with Coulomb friction; explicit scheme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import positive, within
from .collective import collectively
from .mesh import floats

if TYPE_CHECKING:
    from .model import Model


@dataclass(frozen=True)
class Plane:
    """A rigid half space.

    Args:
        point: any point on its surface [m], shape (D,).
        normal: direction out of it, towards the soil, of any length, shape (D,).
    """

    point: ArrayLike
    normal: ArrayLike

    def _checked(self, dim: int) -> Any:
        point, normal = floats("point", self.point, (dim,)), floats("normal", self.normal, (dim,))
        length = float(np.linalg.norm(normal))
        if length == 0:
            raise InputError(f"normal is {normal.tolist()}, expected a direction, not zero")
        return getattr(_core, f"Plane{dim}")(point.tolist(), (normal / length).tolist()), point


@dataclass(frozen=True)
class Disc:
    """A rigid cylinder whose axis is at right angles to the plane; in axial symmetry a torus, or a sphere on the axis.

    Args:
        centre: [m], shape (2,).
        radius: [m].
    """

    centre: ArrayLike
    radius: float

    def _checked(self, dim: int) -> Any:
        if dim != 2:
            raise InputError("surface is a Disc, expected a Sphere, Box or Plane in three dimensions")
        return _ball(self.centre, self.radius, dim)


@dataclass(frozen=True)
class Sphere:
    """A rigid sphere in three dimensions.

    Args:
        centre: [m], shape (3,).
        radius: [m].
    """

    centre: ArrayLike
    radius: float

    def _checked(self, dim: int) -> Any:
        if dim != 3:
            raise InputError("surface is a Sphere, expected a Disc, Box, Plane or Polyline in two dimensions")
        return _ball(self.centre, self.radius, dim)


def _ball(centre: ArrayLike, radius: float, dim: int) -> Any:
    at = floats("centre", centre, (dim,))
    return getattr(_core, f"Ball{dim}")(at.tolist(), positive("radius", radius, "m")), at


@dataclass(frozen=True)
class Box:
    """A rigid box along the axes, with sharp edges.

    Args:
        lower, upper: its corners with the smallest and with the largest coordinates [m], shape (D,).
    """

    lower: ArrayLike
    upper: ArrayLike

    def _checked(self, dim: int) -> Any:
        lower, upper = floats("lower", self.lower, (dim,)), floats("upper", self.upper, (dim,))
        if (lower >= upper).any():
            raise InputError(
                f"lower is {lower.tolist()} m and upper {upper.tolist()} m, expected lower < upper along each axis"
            )
        return getattr(_core, f"Box{dim}")(lower.tolist(), upper.tolist()), 0.5 * (lower + upper)


@dataclass(frozen=True)
class Polyline:
    """Rigid ground or a rigid body bounded by segments, in two dimensions.

    The soil is on the left as one walks from point to point: a terrain has its points from left to right. An open line goes on
    straight beyond both ends; a closed one holds the soil inside when its points go round counterclockwise, else outside.

    Args:
        points: [m], shape (n, 2), without repetition.
        closed: whether the last point is joined to the first.
    """

    points: ArrayLike
    closed: bool = False

    def _checked(self, dim: int) -> Any:
        if dim != 2:
            raise InputError("surface is a Polyline, expected a Plane, Sphere or Box in three dimensions")
        points = floats("points", self.points, (None, 2))
        least = 3 if self.closed else 2
        if len(points) < least:
            raise InputError(f"points has {len(points)} points, expected {least} or more")
        ends = np.roll(points, -1, axis=0) if self.closed else points[1:]
        starts = points if self.closed else points[:-1]
        short = np.flatnonzero((starts == ends).all(axis=1))
        if len(short):
            raise InputError(
                f"points has {points[short[0]].tolist()} twice in a row, at rows {short[0]} and "
                f"{(short[0] + 1) % len(points)}, expected segments of some length; close a line by closed=True"
            )
        if crossing := _crossing(starts, ends):
            raise InputError(
                f"points makes segments {crossing[0]} and {crossing[1]} cross, expected a line that does not"
            )
        return _core.Polyline2(points.tolist(), bool(self.closed)), points[0]


def _crossing(starts: NDArray, ends: NDArray) -> tuple[int, int] | None:
    """Two segments that cross in their insides."""

    def side(a: NDArray, b: NDArray, c: NDArray) -> NDArray:
        return (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])

    for k in range(len(starts) - 1):
        a, b, c, d = starts[k : k + 1], ends[k : k + 1], starts[k + 1 :], ends[k + 1 :]
        across = (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
        if across.any():
            return k, k + 1 + int(np.argmax(across))
    return None


Surface: TypeAlias = Plane | Disc | Sphere | Box | Polyline
KINDS: dict[str, type] = {kind.__name__: kind for kind in (Plane, Disc, Sphere, Box, Polyline)}


class RigidContact:
    """What a rigid surface feels and where it is, as `Model.add_contact` returns it; all is collective.

    It is a probe: ``mpm_core.probes.ProbeFile("wall.csv", wall)`` records its histories.
    """

    def __init__(self, model: Model, number: int) -> None:
        self.model = model
        self._number = number

    def _state(self, entry: int) -> NDArray[np.float64]:
        return np.array(_core.contact_state(self.model._core, self._number)[entry])

    @property
    def force(self) -> NDArray[np.float64]:
        """Force of the soil on the surface in the last step [N], shape (D,); per metre or per radian in two dimensions."""
        return self._state(0)

    @property
    def impulse(self) -> NDArray[np.float64]:
        """Integral of ``force`` over time since the surface was added [N s], shape (D,); its difference between two times over
        their distance is the mean force, without the noise of single steps."""
        return self._state(1)

    @property
    def moment(self) -> NDArray[np.float64]:
        """Moment of these forces in the last step [N m], shape (1,) in two dimensions, counterclockwise, and (3,) in three; about
        the surface's ``point``, ``centre``, first point, or the centre of the box, as it has moved."""
        return self._state(2)

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of the surface since it was added [m], shape (D,)."""
        return self._state(3)

    def values(self) -> dict[str, float]:
        """Numbers by name of column, as a probe gives them: time, force, impulse, moment, displacement."""
        axes = "xyz"[: self.model.mesh.dim]
        state = _core.contact_state(self.model._core, self._number)
        columns = [("force", "N", axes), ("impulse", "N.s", axes), ("moment", "N.m", "xyz"[3 - len(state[2]) :])]
        columns.append(("displacement", "m", axes))
        names = [f"{name}_{axis}_{unit}" for name, unit, along in columns for axis in along]
        return {"time_s": self.model.time, **dict(zip(names, np.concatenate(state).tolist(), strict=True))}


Velocity: TypeAlias = ArrayLike | tuple[Sequence[float], ArrayLike] | None


def _motion(velocity: Velocity, dim: int) -> tuple[list[float], list[list[float]]]:
    """Times and velocities of a translation."""
    if velocity is None:
        return [0.0], [[0.0] * dim]
    if isinstance(velocity, tuple) and len(velocity) == 2 and np.ndim(velocity[0]) == 1:
        times = floats("times of the velocity", velocity[0], (None,))
        if len(times) == 0 or (np.diff(times) <= 0).any():
            raise InputError(f"times of the velocity are {times.tolist()} s, expected rising ones")
        return times.tolist(), floats("velocities", velocity[1], (len(times), dim)).tolist()
    constant: Any = velocity
    return [0.0], [floats("velocity", constant, (dim,)).tolist()]


def smallest_gap(model: Model, surface: Surface) -> float:
    """See `Model.gap`."""

    def own() -> float:
        return float(_core.smallest_gap(model._core, _checked(surface, model.mesh.dim)[0]))

    return model.comm.allreduce(collectively(model.comm, own), MPI.MIN)


def _checked(surface: Surface, dim: int) -> Any:
    if not isinstance(surface, tuple(KINDS.values())):
        raise InputError(f"surface is {surface!r}, expected a {', '.join(KINDS)}")
    return surface._checked(dim)


def add_contact(model: Model, surface: Surface, friction: float, velocity: Velocity, penalty: float) -> RigidContact:
    """See `Model.add_contact`."""

    def entry() -> dict[str, Any]:
        dim = model.mesh.dim
        _checked(surface, dim)
        positive("friction", friction, "(a coefficient)", zero=True)
        within("penalty", penalty, 0, 1)
        positive("penalty", penalty, "(a ratio)")
        times, velocities = _motion(velocity, dim)
        shape = {field.name: _plain(getattr(surface, field.name)) for field in fields(surface)}
        return {
            "surface": {"kind": type(surface).__name__, **shape}, "friction": float(friction), "penalty": float(penalty),
            "times": times, "velocities": velocities, "start": model.time,
        }  # fmt: skip

    new = collectively(model.comm, entry)
    gap = smallest_gap(model, surface)
    if gap == np.inf:
        raise InputError("the model has no particles, seed some before surfaces are added")
    if gap < 0:
        raise InputError(
            f"surface {surface!r} overlaps the soil by {-gap:.6g} m, expected it outside of all particles, which have the radius "
            "V^(1/D)/2; see Model.gap, and for planes and polylines the side on which the soil is"
        )
    set_contacts(model, [*model._contacts, new])
    return RigidContact(model, len(model._contacts) - 1)


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool) else np.asarray(value, dtype=float).tolist()


def set_contacts(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give the model these contacts; those that it has already, at the beginning of the list, keep their state."""
    dim, known = model.mesh.dim, len(model._contacts)
    for number, entry in list(enumerate(entries))[known:]:
        shape = dict(entry["surface"])
        surface, reference = KINDS[shape.pop("kind")](**shape)._checked(dim)
        slip = f"contact_slip_{number}" if entry["friction"] > 0 else ""
        if slip and slip not in {field["name"] for field in model.particles.schedule()}:
            model.add_field(slip, unit="m", meaning=f"Elastic slip on rigid surface {number}", components=dim)
        _core.add_contact(
            model._core, surface, entry["friction"], entry["penalty"], entry["times"], entry["velocities"], entry["start"],
            reference.tolist(), slip,
        )  # fmt: skip
    model._contacts = entries


def refuse_contacts(model: Model, scheme: str) -> None:
    """Raises InputError where a scheme would leave rigid surfaces out."""
    if model._contacts:
        kinds = ", ".join(entry["surface"]["kind"] for entry in model._contacts)
        raise InputError(
            f"the model has contact with rigid surfaces ({kinds}), which {scheme} does not know; use explicit()"
        )
