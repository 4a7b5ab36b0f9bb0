"""Triangulated rigid surfaces: bodies and terrain from arrays and files, with their checks."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .mesh import floats


class Triangles:
    """A rigid surface of triangles in three dimensions: a body, a cavity, or ground.

    The corners of each triangle run counterclockwise as seen from the soil. A closed surface bounds a body, or a cavity with the
    soil inside; an open one is ground, with one border, beyond which it goes on straight: let it be larger than the mesh.

    Args:
        vertices: [m], shape (n, 3).
        triangles: numbers of the vertices of each triangle, shape (m, 3); triangles that touch share vertices.

    Raises:
        InputError: arrays of another shape, a number that no vertex has, a triangle without area; holes, a side of three or more
            triangles, or a triangle whose corners run the other way than those of its neighbours, with the number of the
            triangle.
    """

    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None:
        self.vertices = floats("vertices", vertices, (None, 3))
        given = np.asarray(triangles)
        if given.ndim != 2 or given.shape[1] != 3 or not np.issubdtype(given.dtype, np.integer) or len(given) == 0:
            raise InputError(
                f"triangles has shape {given.shape} and dtype {given.dtype}, expected whole numbers (m, 3)"
            )
        self.triangles = np.ascontiguousarray(given, dtype=np.int32)
        _check(self.vertices, given)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Triangles:
        """Triangles of a file that meshio reads: STL, OBJ, PLY, gmsh and others. Vertices at the same place are joined.

        Raises:
            InputError: a file that cannot be read, or has no triangles; what the constructor refuses.
        """
        try:
            import meshio
        except ImportError:
            raise InputError("path cannot be read without the Python package meshio; install python3-meshio") from None
        try:
            mesh = meshio.read(path)
        except (meshio.ReadError, OSError, ValueError, SystemExit) as error:
            raise InputError(f"path is {os.fspath(path)}, expected a mesh that meshio reads: {error}") from None
        blocks = [block.data for block in mesh.cells if block.type == "triangle"]
        if not blocks:
            kinds = ", ".join(block.type for block in mesh.cells) or "nothing"
            raise InputError(f"path is {os.fspath(path)}, expected triangles in it, found {kinds}")
        points, numbers = np.unique(np.asarray(mesh.points, dtype=float), axis=0, return_inverse=True)
        return cls(points, numbers.reshape(-1)[np.concatenate(blocks)])

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write a Wavefront OBJ file, for ParaView and other programs; not collective.

        Raises:
            OSError: the file cannot be written.
        """
        with open(path, "w") as file:
            np.savetxt(file, self.vertices, fmt="v %.12g %.12g %.12g")
            np.savetxt(file, self.triangles + 1, fmt="f %d %d %d")

    def __repr__(self) -> str:
        return f"Triangles({len(self.triangles)} triangles)"

    @cached_property
    def fingerprint(self) -> str:
        """A hash of vertices and triangles, by which checkpoints know the surface."""
        digest = hashlib.blake2b(self.vertices.tobytes(), digest_size=16)
        digest.update(self.triangles.tobytes())
        return digest.hexdigest()

    @cached_property
    def _core(self) -> Any:
        return _core.Triangles3(self.vertices, self.triangles)

    def _checked(self, dim: int) -> Any:
        if dim != 3:
            raise InputError("surface is Triangles, expected a Plane, Disc, Box or Polyline in two dimensions")
        return self._core, 0.5 * (self.vertices.min(axis=0) + self.vertices.max(axis=0))


def _check(vertices: NDArray[np.float64], triangles: NDArray[Any]) -> None:
    outside = (triangles < 0) | (triangles >= len(vertices))
    if outside.any():
        t = int(np.argmax(outside.any(axis=1)))
        raise InputError(
            f"triangle {t} has the vertices {triangles[t].tolist()}, expected numbers below {len(vertices)}"
        )
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    length = np.maximum(np.linalg.norm(b - a, axis=1), np.linalg.norm(c - a, axis=1))
    flat = np.linalg.norm(np.cross(b - a, c - a), axis=1) <= 1e-12 * length**2
    if flat.any():
        t = int(np.argmax(flat))
        raise InputError(f"triangle {t} with corners {vertices[triangles[t]].tolist()} has no area")
    _check_sides(vertices, triangles)


def _check_sides(vertices: NDArray[np.float64], triangles: NDArray[Any]) -> None:
    """Require that each side has one triangle, or two of opposite direction, and that there is at most one border."""
    starts, ends = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    keys = np.minimum(starts, ends).astype(np.int64) * len(vertices) + np.maximum(starts, ends)
    _, group, counts = np.unique(keys, return_inverse=True, return_counts=True)
    many = counts[group] > 2
    if many.any():
        t = int(np.argmax(many)) // 3
        raise InputError(f"triangle {t} has a side that {counts[group][many][0]} triangles share, expected one or two")
    directions = np.bincount(group, weights=np.where(starts < ends, 1, -1))
    alike = (counts[group] == 2) & (directions[group] != 0)
    if alike.any():
        t = int(np.argmax(alike.reshape(-1, 3).sum(axis=1)))  # an inverted one has more such sides than its neighbours
        raise InputError(f"triangle {t} at {_centre(vertices, triangles[t])} m runs the other way than its neighbours")
    border = np.flatnonzero(counts[group] == 1)
    borders = sorted(_loops(starts[border], ends[border], border // 3), key=len)
    if len(borders) > 1 or (borders and _is_nearly_closed(vertices, triangles, len(borders[0]))):
        t = borders[0][0]
        raise InputError(
            f"triangles have a hole beside triangle {t} at {_centre(vertices, triangles[t])} m, with {len(borders[0])} sides; "
            "expected a closed surface, or ground with one border"
        )


def _is_nearly_closed(vertices: NDArray[np.float64], triangles: NDArray[Any], sides: int) -> bool:
    """Whether the only border, with so many sides, is a hole of a body: a missing triangle, or a fiftieth of the surface.

    The sum of the areas as vectors is the area within the border. That of ground is not much smaller than the surface.
    """
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    areas = np.cross(b - a, c - a)
    opening = np.linalg.norm(areas.sum(axis=0)) / np.linalg.norm(areas, axis=1).sum()
    return bool(opening < (0.25 if sides == 3 else 0.02))


def _centre(vertices: NDArray[np.float64], corners: NDArray[Any]) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in vertices[corners].mean(axis=0)) + ")"


def _loops(starts: NDArray[Any], ends: NDArray[Any], triangles: NDArray[Any]) -> Iterator[list[int]]:
    """Borders: for each the triangles along it."""
    following: dict[int, list[tuple[int, int]]] = {}
    for start, end, triangle in zip(starts.tolist(), ends.tolist(), triangles.tolist(), strict=True):
        following.setdefault(start, []).append((end, triangle))
    while following:
        first = vertex = next(iter(following))
        loop: list[int] = []
        while not loop or vertex != first:
            end, triangle = following[vertex].pop()
            if not following[vertex]:
                del following[vertex]
            loop.append(triangle)
            vertex = end
        yield loop
