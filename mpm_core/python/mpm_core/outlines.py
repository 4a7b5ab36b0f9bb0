"""Rigid surfaces as segments or triangles, for pictures and ParaView."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from .mesh import floats
from .surfaces import Box, Cone, Cylinder, Disc, Plane, Polyline, Sphere, Surface, Wedge
from .triangles import Triangles

if TYPE_CHECKING:
    from .body import Body

Outline = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Points [m], shape (n, D), and the numbers of the points of each segment or triangle, shape (m, D)."""
SEGMENTS = 96
"""Number of segments of the outline of a disc."""
SPHERE_CELLS = 10
"""Squares, each of two triangles, along a quarter of a great circle."""


def mesh_box(model: Body) -> NDArray[np.float64]:
    """Lower and upper corner of the box around a model's mesh [m], shape (2, D). Collective."""
    points = model.mesh.points
    corners = np.array([points.min(axis=0, initial=np.inf), -points.max(axis=0, initial=-np.inf)])
    model.comm.Allreduce(MPI.IN_PLACE, corners, MPI.MIN)
    return np.array([corners[0], -corners[1]])


def outline(surface: Surface, lower: ArrayLike, upper: ArrayLike) -> Outline:
    """The boundary of a rigid surface: segments in two dimensions, triangles in three.

    Discs and spheres are inscribed polygons and polyhedra. The corners of triangles run counterclockwise as seen from the soil.

    Args:
        surface: the rigid surface.
        lower: corner of the box in which planes and the ends of open polylines, which have no end, are shown [m], shape (D,).
        upper: its opposite corner.

    Returns:
        Points [m], shape (n, D), and the numbers of the points of each segment or triangle, shape (m, D). There are none of a
        plane that does not cut the box.

    Raises:
        InputError: a surface of another dimension than the box, or corners of another shape.
    """
    dim = len(np.atleast_1d(np.asarray(lower)))
    low, high = floats("lower", lower, (dim,)), floats("upper", upper, (dim,))
    surface._checked(dim)
    if isinstance(surface, Triangles):
        return surface.vertices, surface.triangles
    if isinstance(surface, Plane):
        return _section(np.asarray(surface.point, dtype=float), np.asarray(surface.normal, dtype=float), low, high)
    if isinstance(surface, Box):
        return _box(np.asarray(surface.lower, dtype=float), np.asarray(surface.upper, dtype=float))
    if isinstance(surface, Polyline):
        return _line(np.asarray(surface.points, dtype=float), surface.closed, low, high)
    if isinstance(surface, Wedge):
        corners = surface.corners(dim)
        return (corners, _loop(3)[:, ::-1]) if dim == 2 else (corners, surface.triangles().triangles)
    if isinstance(surface, Cylinder):
        return _revolved(
            np.asarray(surface.start, dtype=float), np.asarray(surface.end, dtype=float), 1.0, surface.radius
        )
    if isinstance(surface, Cone):
        return _revolved(
            np.asarray(surface.tip, dtype=float), np.asarray(surface.base, dtype=float), 0.0, surface.radius
        )
    return _ball(surface)


def _loop(n: int, closed: bool = True) -> NDArray[np.int32]:
    numbers = np.arange(n, dtype=np.int32)
    return np.column_stack([numbers, np.roll(numbers, -1)])[: n if closed else n - 1]


def _ball(ball: Disc | Sphere) -> Outline:
    if isinstance(ball, Disc):
        angle = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
        return np.asarray(ball.centre) + ball.radius * np.column_stack([np.cos(angle), np.sin(angle)]), _loop(SEGMENTS)
    # The sides of a cube as grids, blown up: triangles of about one size, without poles.
    n = SPHERE_CELLS
    across = np.tan(0.25 * np.pi * np.linspace(-1, 1, n + 1))
    u, v = (grid.ravel() for grid in np.meshgrid(across, across, indexing="ij"))
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    square = np.concatenate([corner[:, None] + (0, n + 1, n + 2), corner[:, None] + (0, n + 2, 1)])
    sides = [
        np.roll(np.column_stack([np.full_like(u, end), u, v]), axis, axis=1) for axis in range(3) for end in (-1, 1)
    ]
    unit = np.concatenate(sides)
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    cells = np.concatenate([square + k * len(u) for k in range(len(sides))])
    return np.asarray(ball.centre) + ball.radius * unit, _outward(unit, cells, unit)


def _revolved(start: NDArray[np.float64], end: NDArray[np.float64], first: float, radius: float) -> Outline:
    """A cylinder, or a cone whose first end has the radius 0."""
    axis = (end - start) / np.linalg.norm(end - start)
    u = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    u /= np.linalg.norm(u)
    angle = 2 * np.pi * np.arange(SEGMENTS) / SEGMENTS
    circle = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * np.cross(axis, u)
    far = 2 + np.arange(SEGMENTS)
    far_next = 2 + (far - 1) % SEGMENTS
    points, fans = [[start, end], end + radius * circle], [(np.ones_like(far), far, far_next)]
    if first > 0:
        points.append(start + first * radius * circle)
        near, near_next = far + SEGMENTS, far_next + SEGMENTS
        fans += [(near, far_next, far), (near, near_next, far_next), (np.zeros_like(near), near_next, near)]
    else:  # one point is the tip of all triangles, so that they close the surface
        fans.append((np.zeros_like(far), far_next, far))
    return np.concatenate(points), np.concatenate([np.stack(fan, axis=1) for fan in fans]).astype(np.int32)


def _outward(points: NDArray[np.float64], cells: NDArray, directions: NDArray[np.float64]) -> NDArray[np.int32]:
    """Triangles whose corners run counterclockwise as seen from the side to which the directions (n, 3) at the points go."""
    a, b, c = (points[cells[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), directions[cells].sum(axis=1)) < 0
    turned = cells.astype(np.int32)
    turned[inward] = turned[inward][:, [0, 2, 1]]
    return turned


def _box(lower: NDArray[np.float64], upper: NDArray[np.float64]) -> Outline:
    if len(lower) == 2:
        (x, y), (u, v) = lower, upper
        return np.array([(x, y), (u, y), (u, v), (x, v)]), _loop(4)
    signs = np.array(list(product((-1.0, 1.0), repeat=3)))
    points = 0.5 * (lower + upper + signs * (upper - lower))
    faces = []
    for axis, side in product(range(3), (-1.0, 1.0)):
        a, b, c, d = np.flatnonzero(signs[:, axis] == side)
        faces += [(a, b, c), (b, d, c)]
    return points, _outward(points, np.array(faces), points - 0.5 * (lower + upper))


def _line(points: NDArray[np.float64], closed: bool, lower: NDArray[np.float64], upper: NDArray[np.float64]) -> Outline:
    if closed:
        return points, _loop(len(points))

    def end(at: NDArray[np.float64], before: NDArray[np.float64]) -> NDArray[np.float64]:
        """Where the straight line beyond an end leaves the box."""
        along = at - before
        with np.errstate(divide="ignore", invalid="ignore"):
            ways = (np.where(along > 0, upper, lower) - at) / along
        return at + max(0.0, float(np.min(ways[along != 0]))) * along

    line = np.vstack([end(points[0], points[1]), points, end(points[-1], points[-2])])
    line = line[np.append(True, (np.diff(line, axis=0) != 0).any(axis=1))]
    return line, _loop(len(line), closed=False)


def _section(
    point: NDArray[np.float64], normal: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> Outline:
    """The part of a plane in a box: where it meets the box's edges, in order."""
    dim = len(point)
    corners = np.array(list(product(*zip(lower, upper, strict=True))))
    height = (corners - point) @ normal
    met = []
    for a, b in product(range(2**dim), repeat=2):
        is_edge = a < b and (corners[a] != corners[b]).sum() == 1
        if is_edge and (height[a] > 0) != (height[b] > 0):
            met.append(corners[a] + height[a] / (height[a] - height[b]) * (corners[b] - corners[a]))
    if not met:
        return np.empty((0, dim)), np.empty((0, dim), np.int32)
    points = np.array(met)
    if dim == 2:
        return points, _loop(2, closed=False)
    arms = points - points.mean(axis=0)
    first = arms[np.argmax(np.linalg.norm(arms, axis=1))]
    order = np.argsort(np.arctan2(arms @ np.cross(normal, first) / np.linalg.norm(normal), arms @ first))
    fan = np.arange(1, len(points) - 1, dtype=np.int32)
    return points[order], np.column_stack([np.zeros_like(fan), fan, fan + 1])
