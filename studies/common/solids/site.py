"""Bodies of tetrahedra for pictures: their surface, and a vertical section through the place that moves most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import fenics_bridge as bridge

from ..field_plots import within_cells

FACES = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])
"""Sides of a tetrahedron, seen from outside against the clock where its corners are ordered by the right hand"""
EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])

INSIDE = 1e-3
"""Distance of a section from the sides of a body at least, over its width"""


@dataclass
class Solid:
    """A displacement and a quantity of cells on tetrahedra, on the first rank.

    points: (n, 3) [m]; cells: (m, 4) rows of points; moved: displacement (n, 3) [m]; values: of the cells (m,), such as a strain [-]
    members: lines (k, 3) [m] of structural members
    """

    points: np.ndarray
    cells: np.ndarray
    moved: np.ndarray
    values: np.ndarray
    members: Sequence[np.ndarray] = ()

    def part(self, there: np.ndarray) -> Solid:
        """The solid of some of its cells; there: whether each of them is one (m,)."""
        kept, number = np.unique(self.cells[there], return_inverse=True)
        return Solid(self.points[kept], number.reshape(-1, 4), self.moved[kept], self.values[there], self.members)

    def size(self) -> float:
        """Length of the diagonal of a box around it [m]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def lengths(self) -> np.ndarray:
        """Length of the displacement of each point: (n,)."""
        found: np.ndarray = np.linalg.norm(self.moved, axis=1)
        return found

    def surface(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles of the surface, as rows of points (k, 3), against the clock seen from outside, and the cell behind each (k,)."""
        corners = self.points[self.cells]
        edges = corners[:, 1:] - corners[:, :1]
        left = np.linalg.det(edges) < 0
        faces = self.cells[:, FACES]
        faces[left] = faces[left][:, :, ::-1]
        triangles = faces.reshape(-1, 3)
        _, first, count = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True, return_counts=True)
        outer = np.sort(first[count == 1])
        return triangles[outer], outer // len(FACES)

    def normals(self, triangles: np.ndarray) -> np.ndarray:
        """Of triangles, rows of points (k, 3): unit vectors, outwards where the corners are against the clock seen from outside (k, 3)."""
        corners = self.points[triangles]
        normal: np.ndarray = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)

    def place_that_moves_most(self) -> np.ndarray:
        """The point with the largest displacement (3,) [m]; of several alike the one in their middle."""
        lengths = self.lengths()
        near = self.points[lengths >= 0.98 * lengths.max()]
        found: np.ndarray = near[np.argmin(np.linalg.norm(near - near.mean(axis=0), axis=1))]
        return found

    def section_axis(self) -> int:
        """The horizontal axis at right angles to a section along which the body moves."""
        along = np.abs(self.moved[:, :2]).max(axis=0)
        return 1 if along[0] >= along[1] else 0

    def side_to_see(self) -> np.ndarray:
        """Horizontal direction (2,) to the side from which the place that moves most is seen best.

        It is the one to which it moves, along an axis; where it moves up or down, that of the nearest corner of the body.
        """
        moved = self.moved[np.argmax(self.lengths())]
        if np.abs(moved[:2]).max() > 0.5 * np.abs(moved[2]):
            along, way = 1 - self.section_axis(), np.zeros(2)
            way[along] = -1.0 if moved[along] < 0 else 1.0
            return way
        middle = 0.5 * (self.points.min(axis=0) + self.points.max(axis=0))
        return np.where(self.place_that_moves_most()[:2] < middle[:2], -1.0, 1.0)


@dataclass
class Section:
    """A plane section through a solid.

    points: (n, 2) [m], horizontal and vertical; triangles: (k, 3) rows of points; lengths: of the displacement at points (n,) [m]
    values: of the triangles (k,), those of the cells in which they are; axis: at right angles to it, 0 or 1; at: where it is on this axis [m]
    """

    points: np.ndarray
    triangles: np.ndarray
    lengths: np.ndarray
    values: np.ndarray
    axis: int
    at: float

    def cell_size(self) -> float:
        """Length of a side of most triangles, about that of the cells [m]."""
        ends = self.points[self.triangles[:, :2]]
        return float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))


def gathered_solid(function: Any, values: np.ndarray, there: np.ndarray) -> tuple[Solid, np.ndarray] | None:
    """A displacement of DOLFINx at the corners of all tetrahedra, and whether each is there; None but on the first rank. Collective.

    Args:
        function: the displacement.
        values: of the cells that this rank owns, in the order of the mesh (m,).
        there: whether each of these cells is there (m,).
    """
    domain = function.function_space.mesh
    mesh, comm = bridge.background_arrays(domain), domain.comm
    own = mesh["cells"][mesh["cell_owners"] == comm.rank]
    corners = mesh["points"][own]
    moved, names = within_cells(function, corners), mesh["global_nodes"][own]
    parts = comm.gather((corners, moved, names, values, there))
    if parts is None:
        return None
    corners, moved, names, values, there = (np.concatenate(arrays) for arrays in zip(*parts))
    _, first, number = np.unique(names, return_index=True, return_inverse=True)
    return Solid(corners.reshape(-1, 3)[first], number.reshape(-1, 4), moved.reshape(-1, 3)[first], values), there


def solid_mechanism(model: bridge.QuasiStatic, mechanism: Any) -> Solid | None:
    """A mechanism of finite elements, on the cells that are there; None but on the first rank. Collective."""
    found = gathered_solid(mechanism, shear_strain_of(mechanism), cells_there(model))
    return None if found is None else replace(found[0].part(found[1]), members=member_lines(model))


def member_lines(model: bridge.QuasiStatic) -> list[np.ndarray]:
    """Lines (n, 3) [m] of the structural members of finite elements as they were installed."""
    return [np.array(member.points, dtype=float) for member in model.members.values()]


def cells_there(model: bridge.QuasiStatic) -> np.ndarray:
    """Whether the cells that this rank owns are there, in the order of the mesh: (m,)."""
    there = np.zeros(len(model.points.cells), dtype=bool)
    there[model.points.cells] = model.points.material >= 0
    return there


def shear_strain_of(function: Any) -> np.ndarray:
    """Deviatoric strain sqrt(2/3 e : e) of a displacement at the corners of the cells that this rank owns: (m,)."""
    domain = function.function_space.mesh
    mesh = bridge.background_arrays(domain)
    corners = mesh["points"][mesh["cells"][mesh["cell_owners"] == domain.comm.rank]]
    moved = within_cells(function, corners)
    gradient = np.linalg.solve(corners[:, 1:] - corners[:, :1], moved[:, 1:] - moved[:, :1])
    strain = 0.5 * (gradient + np.swapaxes(gradient, 1, 2))
    strain -= np.trace(strain, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    found: np.ndarray = np.sqrt(2 / 3 * np.sum(strain**2, axis=(1, 2)))
    return found


def section_of(solid: Solid, axis: int, at: float) -> Section:
    """The section through a solid at right angles to a horizontal axis.

    Args:
        solid: the body.
        axis: 0 or 1.
        at: where it is on this axis [m]; a plane at the side of the body is moved into it.
    """
    low, high = solid.points[:, axis].min(), solid.points[:, axis].max()
    at = float(np.clip(at, low + INSIDE * (high - low), high - INSIDE * (high - low)))
    side = solid.points[:, axis] - at
    side[side == 0] = 1e-12 * (high - low)  # a plane through a point passes beside it
    above = side[solid.cells] > 0
    cut = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    ends = solid.cells[cut][:, EDGES]
    crossed = above[cut][:, EDGES[:, 0]] != above[cut][:, EDGES[:, 1]]
    # Cells beside one another share the points on their edges.
    between, shared = np.unique(np.sort(ends[crossed], axis=1), axis=0, return_inverse=True)
    first, last = between.T
    part = side[first] / (side[first] - side[last])
    points = solid.points[first] + part[:, None] * (solid.points[last] - solid.points[first])
    lengths = solid.lengths()
    lengths = lengths[first] + part * (lengths[last] - lengths[first])
    number = np.zeros(crossed.shape, dtype=np.int64)
    number[crossed] = shared.reshape(-1)
    triangles: list[np.ndarray] = []
    cells: list[np.ndarray] = []
    for count in (3, 4):
        rows = np.flatnonzero(crossed.sum(axis=1) == count)
        corners = number[rows][crossed[rows]].reshape(-1, count)
        triangles.append(corners[:, :3])
        cells.append(cut[rows])
        if count == 4:  # the first and the last of these edges have no corner of the tetrahedron in common
            triangles.append(corners[:, 1:])
            cells.append(cut[rows])
    kept = [k for k in range(3) if k != axis]
    return Section(points[:, kept], np.concatenate(triangles), lengths, solid.values[np.concatenate(cells)], axis, at)
