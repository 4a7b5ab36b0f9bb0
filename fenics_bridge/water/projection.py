"""The pressure projection that keeps equal-order elements of displacement and pressure from oscillating."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.mesh.tagged import cell_corners, owned_cells
from fenics_bridge.types import Law
from fenics_bridge.water.soils import PorousSoil, Water

MARGIN = 4
"""Factor of the pressure projection over the least factor that suffices in uniaxial strain, in cells that are not flat"""

REGULAR = 2.5
"""Longest edge over smallest height up to which cells need no more: of squares and cubes cut into cells, 2 and 2.45"""


class PressureProjection:
    """The term tau int (dp - P dp)(q - P q), P the mean of a cell, that keeps equal-order elements from oscillating.

    (Bochev and Dohrmann 2006; White and Borja 2008.) For a linear pressure it is tau int grad dp . T grad q with the second
    moments T of the cell about its centroid over its volume. With m = 1,
        tau = (D + 1) max(0, 3/2 (1 / M + S) - 6 k dt / (gamma_w h^2)),
    M the oedometric modulus, S = n / K_w, h the longest edge, is the least factor with which layers of simplices cut from cubes
    have, in uniaxial strain, no positive off-diagonal entry in the system of the pressures, so that these obey a maximum
    principle. But the nodes of a layer do not all move alike, which leaves 1 to 3 %. The term is therefore `MARGIN` times as
    large, in flat cells more by their slenderness, and has 3 G for M where that is less (Poisson's ratio above 1/4), as
    displacements that alternate from node to node shear the soil.

    Args:
        domain: mesh of the body.
        points: the quadrature points.
        laws: the laws, by number.
        soils: soils, as of `soils_by_tag`.
        cells: cells of each of them.
        water: the water.
    """

    def __init__(
        self,
        domain: Mesh,
        points: Any,
        laws: Sequence[Law],
        soils: Sequence[PorousSoil],
        cells: Sequence[NDArray[np.int32]],
        water: Water,
    ) -> None:
        corners, n = cell_corners(domain), owned_cells(domain)
        dim = corners.shape[2]
        longest = np.sum((corners[:, :, None] - corners[:, None]) ** 2, axis=3).max(axis=(1, 2))
        from_centroid = corners - corners.mean(axis=1, keepdims=True)
        moments = np.einsum("cki,ckj->cij", from_centroid, from_centroid) / ((dim + 1) * (dim + 2))
        storage, mobility, density = (np.zeros(n) for _ in range(3))
        self._points, self._laws = points, laws
        for soil, own in zip(soils, cells):
            own = own[own < n]
            storage[own], density[own] = soil.porosity / water.modulus, soil.density or 0.0
            mobility[own] = np.linalg.eigvalsh(soil.tensor(soil.conductivity, dim)).min() / water.unit_weight
        self._moments = MARGIN * (dim + 1) * (_slenderness(corners, longest)[:, None] * moments.reshape(n, dim * dim))
        self._storage, self._per_second = storage, 6 * mobility / longest
        self._mass = density * longest / (12 * dim)

    def write(self, function: fem.Function, dt: float, beta: float | None = None) -> None:
        """Write tau T of a step to a function that is constant in each cell. Collective.

        Args:
            function: the function.
            dt: length of the step [s].
            beta: Newmark's parameter of steps with inertia. The mass of a cell then resists as stiffness does, rho h^2 / (12 beta
                dt^2) for displacements that alternate from node to node; without it waves would be too slow.
        """
        stiffness = self._resisting() + (0.0 if beta is None else self._mass / (beta * dt**2))
        undrained = 1.5 * (1 / stiffness + self._storage)
        values = np.maximum(0.0, undrained - self._per_second * dt)[:, None] * self._moments
        rows = compat.cell_dofs(function.function_space)[: len(values), 0]
        function.x.array.reshape(-1, values.shape[1])[rows] = values
        function.x.scatter_forward()

    def _resisting(self) -> NDArray[np.float64]:
        """Modulus [Pa] with which each cell resists displacements that alternate from node to node; infinite without soil."""
        p_wave, shear = self._points.wave_moduli(self._laws).T
        of_points = np.minimum(p_wave, 3 * shear).reshape(-1, self._points.per_cell)
        modulus = np.full(len(self._storage), np.inf)
        modulus[self._points.cells] = np.where(of_points.all(axis=1), of_points.mean(axis=1), np.inf)
        return modulus


def _slenderness(corners: NDArray[np.float64], longest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Longest edge over smallest height of each cell, over `REGULAR`, at least 1: (m,) [-]."""
    inner = np.linalg.inv(corners[:, 1:] - corners[:, :1])  # columns: gradients of the shape functions but the first
    largest = np.maximum((inner**2).sum(axis=1).max(axis=1), (inner.sum(axis=2) ** 2).sum(axis=1))
    return np.maximum(1.0, np.sqrt(longest * largest) / REGULAR)
