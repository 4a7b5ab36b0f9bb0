"""Rigid surfaces, as a caller describes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import flag, positive
from .mesh import floats
from .triangles import Triangles


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
        points, closed = floats("points", self.points, (None, 2)), flag("closed", self.closed)
        least = 3 if closed else 2
        if len(points) < least:
            raise InputError(f"points has {len(points)} points, expected {least} or more")
        ends = np.roll(points, -1, axis=0) if closed else points[1:]
        starts = points if closed else points[:-1]
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
        return _core.Polyline2(points.tolist(), closed), points[0]


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


@dataclass(frozen=True)
class Cylinder:
    """A rigid cylinder in three dimensions, with flat ends and sharp edges: a pile, a shaft, a roller.

    Args:
        start, end: centres of its two ends [m], shape (3,).
        radius: [m].
    """

    start: ArrayLike
    end: ArrayLike
    radius: float

    def _checked(self, dim: int) -> Any:
        radius = positive("radius", self.radius, "m")
        start, axis, length = _axis("Cylinder", "start", self.start, "end", self.end, dim)
        section = [(-radius, 0.0), (-radius, length), (radius, length), (radius, 0.0)]
        return _core.Revolved3(start.tolist(), axis.tolist(), section), start + 0.5 * length * axis


@dataclass(frozen=True)
class Cone:
    """A rigid cone in three dimensions with a flat base: the tip of a pile or of a penetrometer.

    Args:
        tip: [m], shape (3,).
        base: centre of its base [m], shape (3,).
        radius: of its base [m].
    """

    tip: ArrayLike
    base: ArrayLike
    radius: float

    def _checked(self, dim: int) -> Any:
        radius = positive("radius", self.radius, "m")
        tip, axis, length = _axis("Cone", "tip", self.tip, "base", self.base, dim)
        section = [(0.0, 0.0), (-radius, length), (radius, length)]
        return _core.Revolved3(tip.tolist(), axis.tolist(), section), tip + 0.75 * length * axis


def _axis(
    kind: str, first: str, start: ArrayLike, second: str, end: ArrayLike, dim: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """A point on an axis, its direction, and the distance to the other point."""
    if dim != 3:
        raise InputError(f"surface is a {kind}, expected a Plane, Disc, Box, Polyline or Wedge in two dimensions")
    a, b = floats(first, start, (3,)), floats(second, end, (3,))
    length = float(np.linalg.norm(b - a))
    if length == 0:
        raise InputError(f"{second} is {b.tolist()} m, expected another point than {first}")
    return a, (b - a) / length, length


@dataclass(frozen=True)
class Wedge:
    """A rigid wedge: a triangle in two dimensions, a prism over it in three.

    Args:
        tip: its sharp corner, or the middle of its sharp edge [m], shape (D,).
        base: middle of the side opposite to it [m], shape (D,).
        half_width: half the width of that side [m].
        half_edge: in three dimensions, from the middle of the sharp edge to its end, at right angles to ``base - tip`` [m].
    """

    tip: ArrayLike
    base: ArrayLike
    half_width: float
    half_edge: ArrayLike | None = None

    def corners(self, dim: int) -> NDArray[np.float64]:
        """The three corners, clockwise; in three dimensions those at either end, shape (3, 2) or (6, 3) [m].

        Raises:
            InputError: points that make no wedge.
        """
        tip, base = floats("tip", self.tip, (dim,)), floats("base", self.base, (dim,))
        height, width = base - tip, positive("half_width", self.half_width, "m")
        length = float(np.linalg.norm(height))
        if length == 0:
            raise InputError(f"base is {base.tolist()} m, expected another point than tip")
        if dim == 2:
            if self.half_edge is not None:
                raise InputError(f"half_edge is {self.half_edge!r}, expected None in two dimensions")
            side = width / length * np.array([-height[1], height[0]])
            return np.array([tip, base + side, base - side])
        if self.half_edge is None:
            raise InputError("half_edge is None, expected the direction and half the length of the sharp edge")
        edge = floats("half_edge", self.half_edge, (3,))
        reach = float(np.linalg.norm(edge))
        if reach == 0 or abs(float(edge @ height)) > 1e-9 * reach * length:
            raise InputError(f"half_edge is {edge.tolist()} m, expected a vector at right angles to base - tip")
        side = width / (length * reach) * np.cross(height, edge)
        section = np.array([tip, base + side, base - side])
        return np.concatenate([section - edge, section + edge])

    def _checked(self, dim: int) -> Any:
        corners = self.corners(dim)
        centre = corners.mean(axis=0)
        if dim == 2:
            return _core.Polyline2(corners.tolist(), True), centre
        return self.triangles()._checked(3)[0], centre

    def triangles(self) -> Triangles:
        """The sides of the prism, in three dimensions."""
        return Triangles(self.corners(3), _PRISM)


_PRISM = np.array([(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)])

Surface: TypeAlias = Plane | Disc | Sphere | Box | Cylinder | Cone | Wedge | Polyline | Triangles
KINDS: dict[str, type] = {
    kind.__name__: kind for kind in (Plane, Disc, Sphere, Box, Cylinder, Cone, Wedge, Polyline, Triangles)
}


def distances(surface: Surface, points: ArrayLike) -> NDArray[np.float64]:
    """Distances of points from a rigid surface [m], shape (n,): positive where the soil is to be, negative within the body.

    Args:
        surface: the rigid surface.
        points: positions [m], shape (n, D).

    Raises:
        InputError: a surface of another dimension, or points of another shape.
    """
    shape = np.shape(points)
    dim = shape[1] if len(shape) == 2 and shape[1] in (2, 3) else 3
    x = floats("points", points, (None, dim))
    return np.asarray(_core.distances(surface._checked(dim)[0], x))
