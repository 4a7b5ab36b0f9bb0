"""Mortar projection between two meshes along a border where their nodes do not match."""

from __future__ import annotations

import math
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fenics_bridge.transfer.border import CLOSE, Facets, barycentric, distances, measure

ROUND_OFF = 1e-14
"""Part of the size of a facet below which a common part of two facets is none"""


class Polynomials:
    """The Lagrange polynomials of a facet.

    Args:
        corners: of the facet [m], shape (D, D).
        points: their nodes [m], shape (k, D).
    """

    def __init__(self, corners: NDArray[np.float64], points: NDArray[np.float64]) -> None:
        dim, k = corners.shape[1], len(points)
        self.degree = next(p for p in range(k) if math.comb(p + dim - 1, dim - 1) == k)
        self._corners = corners
        self._weights = np.linalg.inv(self._monomials(points))

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Their values (n, k) at points (n, D)."""
        return self._monomials(points) @ self._weights

    def _monomials(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        coordinates = barycentric(self._corners, points)
        powers = combinations_with_replacement(range(coordinates.shape[1]), self.degree)
        return np.stack([np.prod(coordinates[:, list(each)], axis=1) for each in powers], axis=1)


def intersection(first: NDArray[np.float64], second: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """The common part of two facets (D, D) as simplices of their dimension; empty where they do not overlap."""
    size = np.linalg.norm(first[1:] - first[0], axis=1).max()
    if distances(first[None], second[None])[0].max() > CLOSE * size:
        return []
    polygon = first
    for k in range(len(second)):  # Sutherland & Hodgman (1974): one side of the second facet after the other
        polygon = _clipped(polygon, barycentric(second, polygon)[:, k])
        if len(polygon) == 0:
            return []
    simplices = [polygon] if len(first) == 2 else [polygon[[0, k, k + 1]] for k in range(1, len(polygon) - 1)]
    return [simplex for simplex in simplices if measure(simplex) > ROUND_OFF * size ** (len(first) - 1)]


def _clipped(polygon: NDArray[np.float64], height: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part of a polygon, or of a line of two points, where heights at its corners are not below zero."""
    kept = []
    n = len(polygon)
    for i in range(n):
        j = (i + 1) % n
        if height[i] >= 0:
            kept.append(polygon[i])
        if (height[i] < 0) != (height[j] < 0) and (n > 2 or i == 0):
            kept.append(polygon[i] + height[i] / (height[i] - height[j]) * (polygon[j] - polygon[i]))
    return np.array(kept) if len(kept) >= polygon.shape[1] else polygon[:0]


def quadrature(corners: NDArray[np.float64], degree: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (q, D) and weights (q,) that integrate polynomials of a degree over a facet (D, D): Gauss's, collapsed in 3D."""
    x, w = np.polynomial.legendre.leggauss(degree // 2 + 2)
    x, w = (x + 1) / 2, w / 2
    if len(corners) == 2:
        coordinates, weights = x[:, None], w
    else:
        s, t = (each.ravel() for each in np.meshgrid(x, x, indexing="ij"))
        coordinates, weights = np.column_stack([s, t * (1 - s)]), np.outer(w * (1 - x), w).ravel()
    points = corners[0] + coordinates @ (corners[1:] - corners[0])
    return points, weights / weights.sum() * measure(corners)


class Overlap(NamedTuple):
    """Integrals over a border between the nodes of two meshes."""

    own: NDArray[np.float64]
    """Integrals of products of the first mesh's shape functions, shape (n, n) [m^(D-1)]; times the radius in axial symmetry"""
    other: NDArray[np.float64]
    """Integrals of products with the shape functions of the second mesh, shape (n, m)"""
    area: float
    """Area of the common part [m^(D-1)]"""


def overlap(
    first: Facets, second: Facets, nodes: NDArray[np.int64], other_nodes: NDArray[np.int64], by_radius: bool = False
) -> Overlap:
    """Integrals over the common part of two borders, exact for polynomials: over each intersection of two facets.

    Args:
        first: facets of the first mesh.
        second: facets of the second one.
        nodes: numbers of the first one's nodes, rising, shape (n,).
        other_nodes: numbers of the second one's nodes, rising, shape (m,).
        by_radius: whether to multiply by the first coordinate, the radius in axial symmetry.
    """
    own, other, area = np.zeros((len(nodes),) * 2), np.zeros((len(nodes), len(other_nodes))), 0.0
    seconds = [Polynomials(*each) for each in zip(second.corners, second.points, strict=True)]
    low, high = second.corners.min(axis=1), second.corners.max(axis=1)
    for corners, numbers, points in zip(*first, strict=True):
        shapes, rows = Polynomials(corners, points), np.searchsorted(nodes, numbers)
        margin = CLOSE * np.ptp(corners, axis=0).max()
        near = ((low <= corners.max(axis=0) + margin) & (high >= corners.min(axis=0) - margin)).all(axis=1)
        for f in np.flatnonzero(near):
            columns = np.searchsorted(other_nodes, second.nodes[f])
            for part in intersection(corners, second.corners[f]):
                at, weights = quadrature(part, 2 * max(shapes.degree, seconds[f].degree) + by_radius)
                values = shapes(at)
                area += weights.sum()
                weights = weights * at[:, 0] if by_radius else weights
                own[np.ix_(rows, rows)] += (values.T * weights) @ values
                other[np.ix_(rows, columns)] += (values.T * weights) @ seconds[f](at)
    return Overlap(own, other, area)


def interpolated(facets: Facets, nodes: NDArray[np.int64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values at points (n, D) on a border by those of its nodes, (n, m), with the nodes' numbers, rising (m,)."""
    found = np.zeros((len(points), len(nodes)))
    sizes = np.linalg.norm(facets.corners[:, 1] - facets.corners[:, 0], axis=1)
    off = np.array([distances(facets.corners, np.broadcast_to(p, (len(sizes), 1, len(p))))[:, 0] for p in points])
    for k, point in enumerate(points):
        lowest = [
            barycentric(facets.corners[f], point[None]).min() if off[k, f] < CLOSE * sizes[f] else -np.inf
            for f in range(len(sizes))
        ]
        f = int(np.argmax(lowest))  # a point outside by round-off belongs to the nearest one
        shapes = Polynomials(facets.corners[f], facets.points[f])
        found[k, np.searchsorted(nodes, facets.nodes[f])] = shapes(point[None])[0]
    return found


def projection(
    sides: list[Overlap], free: NDArray[np.bool_], interpolation: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Displacement of the first mesh's nodes on a border by that of the second mesh's, (n, m): the same mean against all tests.

    The test functions are the shape functions of the first mesh. A node where two sides meet takes the displacement of the second
    mesh there, and one that a support holds keeps still; their shape functions go to the nearest other node on each side, so that
    each side has the constants among its test functions (Bernardi, Maday & Patera 1994). Then constant stresses pass, also around
    corners.

    Args:
        sides: integrals over each plane, or line.
        free: whether the node moves, shape (n,).
        interpolation: displacement of the second mesh at the nodes, shape (n, m).
        points: positions of the nodes [m], shape (n, D).
    """
    on_side = np.array([np.diag(side.own) > 0 for side in sides])
    solved = free & (on_side.sum(axis=0) == 1)
    corner = free & ~solved
    left, right = np.zeros((len(free),) * 2), np.zeros_like(interpolation)
    for side, here in zip(sides, on_side, strict=True):
        candidates = np.flatnonzero(solved & here)
        if len(candidates) == 0:
            continue
        tests = np.diag((solved & here).astype(float))
        for node in np.flatnonzero(here & ~solved):
            nearest = np.argmin(np.linalg.norm(points[candidates] - points[node], axis=1))
            tests[candidates[nearest], node] = 1.0
        left += tests @ side.own
        right += tests @ side.other
    found = np.zeros_like(interpolation)
    found[corner] = interpolation[corner]
    rest = right[solved] - left[np.ix_(solved, corner)] @ interpolation[corner]
    found[solved] = np.linalg.solve(left[np.ix_(solved, solved)], rest)
    return found
