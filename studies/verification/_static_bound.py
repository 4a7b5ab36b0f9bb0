"""Lower bound of the factor of safety of undrained soil: the largest one with stresses in equilibrium within the strength.

The static theorem of limit analysis by linear programming (Sloan 1988, Int. J. Numer. Anal. Methods Geomech. 12, 61-77). Stresses
are linear in each triangle and may jump between triangles, but for the tractions on their common side. They are in equilibrium
with the weight everywhere and carry no traction on the free surface, so that their factor is a bound, however coarse the mesh.
The circle of Tresca's strength in plane strain is replaced by a polygon inside it.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_matrix

import fenics_bridge as bridge
from fenics_bridge import compat

SIDES = 24
"""Number of sides of the polygon, whose inscribed radius is 0.9914 of the circle's"""


@dataclass
class _Equations:
    """Rows of a sparse matrix that grows; the unknowns are m, s and t at each corner of each triangle, and the factor last.

    s_xx = m + s, s_yy = m - s and s_xy = t, over the strength that stresses are measured in.
    """

    rows: list[np.ndarray] = field(default_factory=list)
    columns: list[np.ndarray] = field(default_factory=list)
    values: list[np.ndarray] = field(default_factory=list)
    number: int = 0

    def add(self, terms: list[tuple[Any, Any]]) -> None:
        """Add rows, each the sum of values times unknowns: (columns, values) of all rows at once."""
        n = len(np.atleast_1d(terms[0][0]))
        for columns, values in terms:
            self.rows.append(self.number + np.arange(n))
            self.columns.append(np.atleast_1d(columns))
            self.values.append(np.broadcast_to(values, n))
        self.number += n

    def matrix(self, unknowns: int) -> Any:
        """The matrix, compressed by rows."""
        entries = (np.concatenate(self.rows), np.concatenate(self.columns))
        return coo_matrix((np.concatenate(self.values), entries), shape=(self.number, unknowns)).tocsr()


def static_bound(
    mesh: tuple[Any, Any, Any], strength: dict[str, float], unit_weight: float, free: list[str], smooth: list[str]
) -> float:
    """The largest factor of safety that stresses in equilibrium within the strength show. On one rank.

    Args:
        mesh: triangles of DOLFINx, tags of cells and facets, with names.
        strength: c_u by soil [Pa]; unit_weight: [N/m3].
        free: boundaries without traction; smooth: vertical ones without shear. All others are rough and rigid.
    """
    domain, cell_tags, facet_tags = mesh
    triangles, points = compat.cell_nodes(domain), domain.geometry.x[:, :2]
    soil = np.empty(len(triangles), np.int32)
    soil[cell_tags.indices] = cell_tags.values
    unit = max(strength.values())
    radius = np.empty(len(triangles))
    for name, c in strength.items():
        radius[np.isin(soil, bridge.names_of(cell_tags)[name])] = c / unit
    unknowns = 9 * len(triangles) + 1
    equations = _Equations()
    _add_equilibrium(equations, points[triangles], unit_weight / unit)
    _add_sides(equations, points, triangles, _edges(domain, facet_tags, free), _edges(domain, facet_tags, smooth))
    corner = np.arange(3 * len(triangles))
    limits = _Equations()
    for angle in 2 * np.pi * np.arange(SIDES) / SIDES:
        limits.add([(3 * corner + 1, np.cos(angle)), (3 * corner + 2, np.sin(angle))])
    greatest = np.zeros(unknowns)
    greatest[-1] = -1.0
    found = linprog(
        greatest, A_ub=limits.matrix(unknowns), b_ub=np.tile(np.cos(np.pi / SIDES) * np.repeat(radius, 3), SIDES),
        A_eq=equations.matrix(unknowns), b_eq=np.zeros(equations.number), bounds=(None, None), method="highs-ipm",
    )  # fmt: skip
    return float(found.x[-1])


def _add_equilibrium(equations, corners, unit_weight):
    """Equilibrium with the weight times the factor, which is the last unknown, in triangles of corners (n, 3, 2)."""
    n = len(corners)
    gradients = np.linalg.inv(np.concatenate([np.ones((n, 3, 1)), corners], axis=2))[:, 1:, :]  # (n, 2, 3)
    first = 9 * np.arange(n)
    along, up = [], [(np.full(n, 9 * n), -unit_weight)]
    for k in range(3):
        m, s, t = (first + 3 * k + j for j in range(3))
        dx, dy = gradients[:, 0, k], gradients[:, 1, k]
        along += [(m, dx), (s, dx), (t, dy)]
        up += [(t, dx), (m, dy), (s, -dy)]
    equations.add(along)
    equations.add(up)


def _add_sides(equations, points, triangles, free, smooth):
    """Equal tractions on both triangles of a side, none on a free one, no shear on a vertical smooth one; at both ends."""
    sides = defaultdict(list)
    for number, triangle in enumerate(triangles):
        for one, other in ((0, 1), (1, 2), (2, 0)):
            sides[tuple(sorted((triangle[one], triangle[other])))].append(number)
    for ends, neighbours in sides.items():
        along = np.subtract(*points[list(ends)])
        nx, ny = np.array([along[1], -along[0]]) / np.linalg.norm(along)
        for node in ends:
            m = [9 * number + 3 * int(np.flatnonzero(triangles[number] == node)[0]) for number in neighbours]
            if len(m) == 2 or ends in free:
                signs = (1.0, -1.0)[: len(m)]
                equations.add(
                    [(first + j, sign * v) for first, sign in zip(m, signs) for j, v in enumerate((nx, nx, ny))]
                )
                equations.add(
                    [(first + j, sign * v) for first, sign in zip(m, signs) for j, v in enumerate((ny, -ny, nx))]
                )
            elif ends in smooth:
                equations.add([(m[0] + 2, 1.0)])


def _edges(domain, facet_tags, names):
    """Sides of boundaries as pairs of nodes in order."""
    numbers = [number for name in names for number in bridge.names_of(facet_tags)[name]]
    nodes = compat.facet_nodes(domain, facet_tags.indices[np.isin(facet_tags.values, numbers)])
    return {tuple(pair) for pair in np.sort(nodes, axis=1)}
