"""Pressure and tractions on a surface that does not follow the mesh."""

from __future__ import annotations

import warnings
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from ._core import Geometry, InputError
from .collective import collectively
from .contact import checked
from .mesh import floats
from .outlines import mesh_box, outline
from .surfaces import Surface, distances

if TYPE_CHECKING:
    from .body import Body

FINENESS = 4
"""Points to a particle's side at which the surface is loaded"""

NEARLY = 1.25
"""Distance from a particle, over its side, within which a part of the surface without load is probably one beside soil"""
MOST_MISSED = 0.1
"""Fraction of the loaded area from which such parts are worth a warning; at ends of the soil there are always some"""

Samples = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""Points, the parts of the surface that they stand for, and its normals towards the soil"""


def load_surface(model: Body, surface: Surface, pressure: float | None, traction: ArrayLike | None) -> float:
    """See `Model.load_surface`."""
    dim, particles = model.mesh.dim, model.particles

    def wanted() -> tuple[float, NDArray[np.float64]]:
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
    near = distances(surface, particles.position) < 2 * size
    numbers = np.flatnonzero(near)
    found, squares = nearest(points, normals, particles.position[near], size[near])
    least = np.empty_like(squares)
    model.comm.Allreduce(squares, least, MPI.MIN)
    rank = np.where(squares == least, model.comm.rank, model.comm.size).astype(np.int32)
    first = np.empty_like(rank)
    model.comm.Allreduce(rank, first, MPI.MIN)
    loaded = np.isfinite(least)
    if not loaded.any():
        raise InputError(f"surface {surface!r} has no soil beside it, expected some to carry the load")
    if model.geometry == Geometry.AXISYMMETRIC:
        parts = parts * points[:, 0]
    own = loaded & (first == model.comm.rank)
    forces = particles.traction.copy() if len(particles.traction) else np.zeros((len(size), dim))
    np.add.at(forces, numbers[found[own]], parts[own, None] * (normal_stress * normals[own] + vector))
    particles._set_tractions(forces, f"surface {surface!r}")
    area = float(parts[loaded].sum())
    _, squares = nearest(points[~loaded], normals[~loaded], particles.position[near], NEARLY * size[near])
    is_near = np.array(model.comm.allgather(np.isfinite(squares))).any(axis=0)
    _warn_of_gaps(model.comm, surface, float(parts[~loaded][is_near].sum()), area)
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


def samples(surface: Surface, lower: NDArray[np.float64], upper: NDArray[np.float64], spacing: float) -> Samples:
    """Points evenly on a surface, not farther apart than a spacing."""
    points, cells = outline(surface, lower, upper)
    corners = points[cells].astype(float)
    dim = points.shape[1]
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


def _middles(n: int, dim: int) -> NDArray[np.float64]:
    """Barycentric coordinates of the middles of n equal parts of a segment, or n^2 of a triangle."""
    if dim == 2:
        t = (np.arange(n) + 0.5) / n
        return np.column_stack([1 - t, t])
    i, j = np.indices((n, n)).reshape(2, -1)
    up, down = i + j < n, i + j < n - 1
    u = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / n
    v = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / n
    return np.column_stack([1 - u - v, u, v])


def _measured(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Length or area of segments or triangles, and a direction at right angles to them."""
    edge = corners[:, 1] - corners[:, 0]
    if corners.shape[2] == 2:
        length = np.linalg.norm(edge, axis=1)
        return length, np.column_stack([-edge[:, 1], edge[:, 0]]) / length[:, None]
    twice = np.cross(edge, corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(twice, axis=1)
    return 0.5 * length, twice / length[:, None]


def nearest(
    points: NDArray[np.float64], normals: NDArray[np.float64], places: NDArray[np.float64], size: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """The particle nearest to each point of a surface, on the soil's side of it, within the particle's side.

    Returns:
        Numbers of the particles, and the squares of the distances; infinite where there is none.
    """
    number, squares = np.zeros(len(points), dtype=np.int64), np.full(len(points), np.inf)
    if len(places) == 0:
        return number, squares
    low, side = places.min(axis=0), float(size.max())
    cell = np.floor((places - low) / side).astype(np.int64)
    shape = cell.max(axis=0) + 3  # a border of empty cells, so that neighbours have numbers of their own
    keys = np.ravel_multi_index((cell + 1).T, shape)
    order = np.argsort(keys, kind="stable")
    ranked = keys[order]
    at = np.floor((points - low) / side).astype(np.int64)
    inside = np.flatnonzero(((at >= -1) & (at < shape - 1)).all(axis=1))
    for step in product((-1, 0, 1), repeat=points.shape[1]):
        moved = at[inside] + step + 1
        valid = ((moved >= 0) & (moved < shape)).all(axis=1)
        rows, key = inside[valid], np.ravel_multi_index(moved[valid].T, shape)
        begin, end = np.searchsorted(ranked, key), np.searchsorted(ranked, key, side="right")
        while (left := begin < end).any():
            rows, begin, end = rows[left], begin[left], end[left]
            p = order[begin]
            arm = places[p] - points[rows]
            distance = np.einsum("ij,ij->i", arm, arm)
            reaches = (distance < size[p] ** 2) & (np.einsum("ij,ij->i", arm, normals[rows]) > 0)
            better = reaches & (distance < squares[rows])
            number[rows[better]], squares[rows[better]] = p[better], distance[better]
            begin = begin + 1
    return number, squares
