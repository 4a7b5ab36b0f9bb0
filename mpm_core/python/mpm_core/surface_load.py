"""Pressure and tractions on a surface that does not follow the mesh."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, product
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from ._core import Geometry, InputError
from .collective import collectively
from .mesh import floats
from .outlines import mesh_box, outline
from .surface_description import checked
from .surfaces import Surface, distances

if TYPE_CHECKING:
    from .body import Body

FINENESS = 4
"""Points to a particle's side at which the surface is loaded"""
REACH = 2.0
"""Distance from a particle, over its side, within which a gap of the surface between loaded parts lies beside soil

Points within a side of a particle lie beside soil. Particles that are spread evenly in cells, not in squares, leave gaps between
them, up to 1.4 sides from any particle where cells are halves of squares or sixths of cubes; farther in flatter cells (`stretch`).
"""
ALIKE = np.cos(np.pi / 4)
"""Cosine of the angle between normals up to which two parts of a surface belong to one face"""
DEPTH = 4.0
"""Length, over a particle's side, of the cylinder beneath a part of the surface in which soil is looked for; its radius is a side"""
ONE_SIDED = 0.4
"""Mean distance from its axis, over a side, from which particles in it are taken for soil that ends there"""
MOST_MISSED = 0.01
"""Fraction of the area from which parts with soil beneath them, but out of reach, are worth a warning"""

Floats = NDArray[np.float64]
Samples = tuple[Floats, Floats, Floats]
"""Points, the parts of the surface that they stand for, and its normals towards the soil"""


def load_surface(model: Body, surface: Surface, pressure: float | None, traction: ArrayLike | None) -> float:
    """See `Model.load_surface`."""
    dim, particles = model.mesh.dim, model.particles

    def wanted() -> tuple[float, Floats]:
        checked(surface, dim)
        if (pressure is None) == (traction is None):
            raise InputError(
                f"pressure is {pressure} and traction {traction!r}, expected one of them and None for the other"
            )
        if traction is not None:
            return 0.0, floats("traction", traction, (dim,))
        return float(floats("pressure", pressure, ())), np.zeros(dim)  # type: ignore[arg-type]

    normal_stress, vector = collectively(model.comm, wanted)
    size = particles._sides()
    finest = model.comm.allreduce(float(size.min(initial=np.inf)), MPI.MIN)
    if finest == np.inf:
        raise InputError("the model has no particles, seed some before a surface is loaded")
    low, high = mesh_box(model)
    points, parts, normals = samples(surface, low, high, finest / FINENESS)
    near = np.flatnonzero(distances(surface, particles.position) < DEPTH * size)
    reach = REACH * size[near] * stretch(model.mesh.points[model.mesh.cells[particles.cell[near]]])
    soil = Soil(model.comm, particles.position[near], size[near], reach)
    loaded, own, found = beside(points, normals, soil)
    if not loaded.any():
        raise InputError(f"surface {surface!r} has no soil beside it, expected some to carry the load")
    if model.geometry == Geometry.AXISYMMETRIC:
        parts = parts * points[:, 0]
    forces = particles.traction.copy() if len(particles.traction) else np.zeros((len(size), dim))
    np.add.at(forces, near[found[own]], parts[own, None] * (normal_stress * normals[own] + vector))
    particles._set_tractions(forces, f"surface {surface!r}")
    area = float(parts[loaded].sum())
    missed = soil.beneath(points[~loaded], normals[~loaded])
    _warn_of_gaps(model.comm, surface, float(parts[~loaded][missed].sum()), area)
    return area


def _warn_of_gaps(comm: MPI.Comm, surface: Surface, missed: float, area: float) -> None:
    """Warn of a surface that the soil does not reach everywhere."""
    if comm.rank == 0 and missed > MOST_MISSED * area:
        warnings.warn(
            f"{missed / (missed + area):.0%} of the area of surface {surface!r} carries no load: the soil beside it has no particle within "
            "a particle's side V^(1/D); place particles along the surface",
            RuntimeWarning,
            stacklevel=4,
        )


def beside(
    points: Floats, normals: Floats, soil: Soil
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.int64]]:
    """Which points of a surface lie beside soil, those of them with a particle of this rank, and its number. Collective."""
    squares, own, found, _ = soil.nearest(points, normals, soil.size)
    far = np.flatnonzero(np.isinf(squares))
    squares[far], own[far], found[far], excess = soil.nearest(points[far], normals[far], soil.reach)
    is_bare = np.isinf(squares)
    loaded, in_reach = ~is_bare, ~is_bare[far]
    gaps = far[in_reach]
    # Within its reach soil seems to end that much farther away, where the surface goes on beyond it.
    loaded[gaps] = ~_is_near(points[gaps], normals[gaps], excess[in_reach], points[is_bare], normals[is_bare])
    return loaded, own & loaded, found


def stretch(corners: Floats) -> Floats:
    """Longest edge over V^(1/D) of simplices (n, D + 1, D), over that of a half of a square or a sixth of a cube; at least 1."""
    dim = corners.shape[2]
    pairs_of_corners = combinations(range(dim + 1), 2)
    longest = np.max([np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in pairs_of_corners], axis=0)
    side = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) ** (1 / dim)  # of a square or cube with D! of them
    return np.maximum(longest / (side * np.sqrt(dim)), 1.0)


def _is_near(points: Floats, normals: Floats, reach: Floats, others: Floats, directions: Floats) -> NDArray[np.bool_]:
    """Whether points have another one of the same face within their reach."""
    near = np.zeros(len(points), dtype=bool)
    for rows, k, arm in pairs(points, others, reach.max(initial=0.0)):
        alike = np.einsum("ij,ij->i", normals[rows], directions[k]) > ALIKE
        near[rows] |= alike & (np.einsum("ij,ij->i", arm, arm) < reach[rows] ** 2)
    return near


@dataclass(frozen=True)
class Soil:
    """The particles of this rank near a surface: positions, sides and reaches [m]; functions are collective."""

    comm: MPI.Comm
    places: Floats
    size: Floats
    reach: Floats

    def nearest(
        self, points: Floats, normals: Floats, limit: Floats
    ) -> tuple[Floats, NDArray[np.bool_], NDArray[np.int64], Floats]:
        """The particle nearest to each point, on the soil's side of the surface, within the particle's limit.

        Returns:
            Squares of the distances over all ranks, infinite where there is no particle; whether it is on this rank, and its
            number there; how much its limit is more than its side.
        """
        number, squares = np.zeros(len(points), dtype=np.int64), np.full(len(points), np.inf)
        for rows, p, arm in pairs(points, self.places, limit.max(initial=0.0)):
            distance = np.einsum("ij,ij->i", arm, arm)
            reaches = (distance < limit[p] ** 2) & (np.einsum("ij,ij->i", arm, normals[rows]) > 0)
            better = reaches & (distance < squares[rows])
            number[rows[better]], squares[rows[better]] = p[better], distance[better]
        least = np.empty_like(squares)
        self.comm.Allreduce(squares, least, MPI.MIN)
        candidate = np.isfinite(least) & (squares == least)
        first = np.where(candidate, self.comm.rank, self.comm.size).astype(np.int32)
        self.comm.Allreduce(MPI.IN_PLACE, first, MPI.MIN)
        own = candidate & (first == self.comm.rank)
        excess = np.zeros(len(points))
        excess[own] = limit[number[own]] - self.size[number[own]]
        self.comm.Allreduce(MPI.IN_PLACE, excess, MPI.SUM)
        return least, own, number, excess

    def beneath(self, points: Floats, normals: Floats) -> NDArray[np.bool_]:
        """Whether there is soil beneath points of a surface, all around their normals, though it may be out of reach."""
        sums = np.zeros((len(points), 1 + points.shape[1]))  # number of particles, and distances from the normals
        for rows, p, arm in pairs(points, self.places, DEPTH * self.size.max(initial=0.0)):
            arm /= self.size[p, None]
            along = np.einsum("ij,ij->i", arm, normals[rows])
            off = arm - along[:, None] * normals[rows]
            inside = (along > 0) & (along < DEPTH) & (np.einsum("ij,ij->i", off, off) < 1)
            sums[rows[inside]] += np.column_stack([np.ones(inside.sum()), off[inside]])
        self.comm.Allreduce(MPI.IN_PLACE, sums, MPI.SUM)
        return np.linalg.norm(sums[:, 1:], axis=1) < ONE_SIDED * sums[:, 0]


def samples(surface: Surface, lower: Floats, upper: Floats, spacing: float) -> Samples:
    """Points evenly on the part of a surface within a box, not farther apart than a spacing; none where it lies outside."""
    points, cells = outline(surface, lower, upper)
    corners = points[cells].astype(float)
    dim = points.shape[1]
    if len(cells) == 0:
        return np.empty((0, dim)), np.empty(0), np.empty((0, dim))
    longest = np.max(
        [np.linalg.norm(corners[:, a] - corners[:, b], axis=1) for a, b in product(range(dim), repeat=2)], axis=0
    )
    divisions = np.maximum(np.ceil(longest / spacing).astype(int), 1)
    x, parts, normals = [], [], []
    for n in np.unique(divisions):
        same = corners[divisions == n]
        weights = _middles(n, dim)
        measure, normal = _measured(same)
        x.append(np.einsum("sk,ckd->csd", weights, same).reshape(-1, dim))
        parts.append(np.repeat(measure / len(weights), len(weights)))
        normals.append(np.repeat(normal, len(weights), axis=0))
    at, n = np.concatenate(x), np.concatenate(normals)
    behind = distances(surface, at + 0.1 * spacing * n) < distances(surface, at - 0.1 * spacing * n)
    n[behind] *= -1
    return at, np.concatenate(parts), n


def _middles(n: int, dim: int) -> Floats:
    """Barycentric coordinates of the middles of n equal parts of a segment, or n^2 of a triangle."""
    if dim == 2:
        t = (np.arange(n) + 0.5) / n
        return np.column_stack([1 - t, t])
    i, j = np.indices((n, n)).reshape(2, -1)
    up, down = i + j < n, i + j < n - 1
    u = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / n
    v = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / n
    return np.column_stack([1 - u - v, u, v])


def _measured(corners: Floats) -> tuple[Floats, Floats]:
    """Length or area of segments or triangles, and a direction at right angles to them."""
    edge = corners[:, 1] - corners[:, 0]
    if corners.shape[2] == 2:
        length = np.linalg.norm(edge, axis=1)
        return length, np.column_stack([-edge[:, 1], edge[:, 0]]) / length[:, None]
    twice = np.cross(edge, corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(twice, axis=1)
    return 0.5 * length, twice / length[:, None]


def pairs(points: Floats, places: Floats, reach: float) -> Iterator[tuple[NDArray, NDArray, Floats]]:
    """Pairs of points and places that are not farther apart than a distance, with others that are.

    Yields:
        Numbers of points, each once, numbers of places, and the arms from the former to the latter.
    """
    if len(points) == 0 or len(places) == 0:
        return
    low = places.min(axis=0)
    cell = np.floor((places - low) / reach).astype(np.int64)
    shape = cell.max(axis=0) + 3  # a border of empty cells, so that neighbours have numbers of their own
    keys = np.ravel_multi_index((cell + 1).T, shape)
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    at = np.floor((points - low) / reach).astype(np.int64)
    inside = np.flatnonzero(((at >= -1) & (at < shape - 1)).all(axis=1))
    for step in product((-1, 0, 1), repeat=points.shape[1]):
        moved = at[inside] + step + 1
        valid = ((moved >= 0) & (moved < shape)).all(axis=1)
        rows, key = inside[valid], np.ravel_multi_index(moved[valid].T, shape)
        begin, end = np.searchsorted(ranked, key), np.searchsorted(ranked, key, side="right")
        while (left := begin < end).any():
            rows, begin, end = rows[left], begin[left], end[left]
            p = order[begin]
            yield rows, p, places[p] - points[rows]
            begin = begin + 1
