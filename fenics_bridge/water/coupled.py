"""Deformation and flow in one system: forms, constraints and loads of displacement and pore pressure.

    div(sigma' - p I) + rho g = 0,    d/dt(div u) + (n / K_w) dp/dt + div q = 0,    q = -(k / gamma_w) (grad p + gamma_w grad z)

with the pressure p positive in compression (Biot 1941; Zienkiewicz and Shiomi 1984). Backward Euler takes the second equation
over a step; times minus the unit of pressure it makes the system symmetric where the law's tangent is.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.fem.fields import assembled, dilation
from fenics_bridge.fem.geometry import weighted
from fenics_bridge.mesh.tagged import cell_corners, owned_cells
from fenics_bridge.types import Law
from fenics_bridge.water.boundary import Reservoir, value_at
from fenics_bridge.water.soils import PorousSoil


class Element(Enum):
    """Elements of displacement and pore pressure; the pressure is linear in both."""

    TAYLOR_HOOD = 2
    """Quadratic displacement"""
    STABILISED = 1
    """Linear displacement, stabilised by a polynomial pressure projection; some four times fewer unknowns in two dimensions, ten
    times in three"""


class WaterTerms:
    """The forms by which pore water enters a step, in the unknowns of a mixed space: u and p over a unit [Pa].

    Args:
        solution: displacement and pressure at the start of the step.
        increment: their change in the step.
        soils: soils, as of `soils_by_tag`.
        measures: measures over their cells, likewise.
        weights: unit weight [N/m3] and bulk modulus [Pa] of water.
        unit: unit of pressure [Pa].
        radius: radius of an axisymmetric body, a UFL expression.
        degree: degree of the quadrature.
    """

    def __init__(
        self,
        solution: fem.Function,
        increment: fem.Function,
        soils: Sequence[PorousSoil],
        measures: Sequence[Any],
        weights: tuple[float, float],
        unit: float,
        radius: Any,
        degree: int,
    ) -> None:
        domain = solution.function_space.mesh
        self._dim, self._increment, self._unit, self._radius = domain.geometry.dim, increment, unit, radius
        self._soils, (self._gamma, self._modulus) = soils, weights
        rule = {"quadrature_degree": degree}
        self._measures = [dx(metadata=rule) for dx in measures]
        self.dt = fem.Constant(domain, 1.0)
        """Length of the step [s], a constant of the forms"""
        self.projection = fem.Function(compat.function_space(domain, "DG", 0, self._dim**2))
        """Function of the pressure projection (D * D,) [m2/Pa], see `PressureProjection`"""
        self._u, self._p = ufl.split(solution)
        self._du, self._dp = ufl.split(increment)
        self.content = fem.form(self._sum(lambda s: s.porosity + self._volume(self._u) + self._storage(s) * self._p))
        """Form of the volume of stored water"""

    def forms(self, applied: Any) -> Callable[[Any, Any], tuple[Any, Any]]:
        """Further internal forces and their tangent as a function of test and trial functions, for `Kinematics`."""

        def further(test, trial):
            v, q = ufl.split(test)
            forces = self._sum(lambda s: (self._p + self._dp) * self._volume(v))
            water = self._sum(lambda s: q * (self._volume(self._du) + self._storage(s) * self._dp))
            pushed = (self._unit / self._gamma) * ufl.grad(self._p + self._dp)
            water += self.dt * (
                self._flow(pushed, q) + self._flow(self._up(), q) - applied.unit * applied.inflow_form(q)
            )
            spread = ufl.as_matrix(
                [[self.projection[i * self._dim + j] for j in range(self._dim)] for i in range(self._dim)]
            )
            water += self._sum(lambda s: self._unit * ufl.inner(spread * ufl.grad(self._dp), ufl.grad(q)))
            residual = -self._unit * (forces + water)
            return residual, ufl.derivative(residual, self._increment, trial)

        return further

    def gravity_flow(self, space: Any) -> NDArray[np.float64]:
        """What the weight of the water makes flow in 1 s, as part of the internal forces: (m,). Collective."""
        q = ufl.TestFunctions(space)[1]
        return self._unit * assembled(fem.form(self._flow(self._up(), q)), space).array

    def _flow(self, gradient, q):
        def density(soil):
            k = ufl.as_matrix(soil.tensor(soil.conductivity, self._dim).tolist())
            return ufl.inner(k * gradient, ufl.grad(q))

        return self._sum(density)

    def _sum(self, density):
        """Integral over the cells of all soils of a density that is a function of the soil."""
        return sum(weighted(density(soil), self._radius) * dx for soil, dx in zip(self._soils, self._measures))

    def _up(self):
        return ufl.as_vector([0.0] * (self._dim - 1) + [1.0])

    def _volume(self, u):
        return dilation(u, self._radius)

    def _storage(self, soil):
        return self._unit * soil.porosity / self._modulus


def pressure_is_free(space: Any, constraints: Any, radius: Any) -> bool:
    """Whether a uniform change of pressure does no work on the displacements that supports leave free. Collective."""
    v = ufl.TestFunctions(space)[0]
    work = assembled(fem.form(weighted(dilation(v, radius), radius) * ufl.dx), space).array.copy()
    largest = np.abs(work).max(initial=0.0)
    work[constraints.dofs] = 0.0
    most = np.max(space.mesh.comm.allgather([largest, np.abs(work).max(initial=0.0)]), axis=0)
    return bool(most[1] <= 1e-10 * most[0])


MARGIN = 4
"""Of the pressure projection over the least factor that does for uniaxial strain"""


class PressureProjection:
    """The term tau int (dp - P dp)(q - P q), P the mean of a cell, that keeps equal-order elements from oscillating.

    (Bochev and Dohrmann 2006; White and Borja 2008.) For a linear pressure it is tau int grad dp . T grad q with the second
    moments T of the cell about its centroid over its volume. With m = 1,
        tau = m (D + 1) max(0, 3/2 (1 / M + S) - 6 k dt / (gamma_w h^2)),
    M the oedometric modulus, S = n / K_w, h the longest edge, is the least factor with which layers of simplices cut from cubes
    have, in uniaxial strain, no positive off-diagonal entry in the system of the pressures, so that these obey a maximum
    principle. But the nodes of a layer do not all move alike, which leaves 1 to 3 %; m is `MARGIN`.

    Args:
        domain: mesh of the body.
        points: the quadrature points.
        laws: the laws, by number.
        soils: soils, as of `soils_by_tag`.
        cells: cells of each of them.
        weights: unit weight [N/m3] and bulk modulus [Pa] of water.
    """

    def __init__(
        self,
        domain: Mesh,
        points: Any,
        laws: Sequence[Law],
        soils: Sequence[PorousSoil],
        cells: Sequence[NDArray[np.int32]],
        weights: tuple[float, float],
    ) -> None:
        (gamma, modulus), corners, n = weights, cell_corners(domain), owned_cells(domain)
        dim = corners.shape[2]
        longest = np.sum((corners[:, :, None] - corners[:, None]) ** 2, axis=3).max(axis=(1, 2))
        from_centroid = corners - corners.mean(axis=1, keepdims=True)
        moments = np.einsum("cki,ckj->cij", from_centroid, from_centroid) / ((dim + 1) * (dim + 2))
        flexibility, mobility = np.empty(n), np.empty(n)
        flexibility[points.cells] = 1 / np.array([law.p_wave_modulus for law in laws])[points.material]
        for soil, own in zip(soils, cells):
            own = own[own < n]
            flexibility[own] += soil.porosity / modulus
            mobility[own] = np.linalg.eigvalsh(soil.tensor(soil.conductivity, dim)).min() / gamma
        self._moments = MARGIN * (dim + 1) * moments.reshape(n, -1)
        self._undrained, self._per_second = 1.5 * flexibility, 6 * mobility / longest

    def write(self, function: fem.Function, dt: float) -> None:
        """Write tau T of a step of dt [s] to a function that is constant in each cell. Collective."""
        values = np.maximum(0.0, self._undrained - self._per_second * dt)[:, None] * self._moments
        rows = compat.cell_dofs(function.function_space)[: len(values), 0]
        function.x.array.reshape(-1, values.shape[1])[rows] = values
        function.x.scatter_forward()


class CoupledConstraints:
    """Supports and prescribed pressures, as `Constraints` has them; `hold` says where pressures are prescribed.

    Pressures, as the unknowns of the mixed space, are over the unit of pressure.

    Args:
        supports: Constraints on the mixed space's displacement.
        space: the mixed space.
        pressure_dofs: dofs of that space for those of the pressure.
    """

    def __init__(self, supports: Any, space: Any, pressure_dofs: NDArray[np.integer]) -> None:
        self._supports, self._space, self._pressure_dofs = supports, space, pressure_dofs
        self.comm = space.mesh.comm
        self.hold(np.zeros(len(pressure_dofs), dtype=bool), np.zeros(len(pressure_dofs)))

    def hold(self, held: NDArray[np.bool_], pressures: NDArray[np.float64]) -> None:
        """Prescribe pressures.

        Args:
            held: which of the pressure's dofs are prescribed, shape (m,).
            pressures: pressures over their unit that they then have [-], shape (m,).
        """
        dofs = self._pressure_dofs[held].astype(np.int32)
        self._pressures = pressures[held]
        self.dofs = np.concatenate([self._supports.dofs, dofs])
        self.bcs = [*self._supports.bcs, fem.dirichletbc(np.float64(0.0), dofs, self._space.sub(1))]

    def at(self, share: float) -> NDArray[np.float64]:
        """Values of the dofs at a fraction of the displacements that the supports prescribe."""
        return np.concatenate([self._supports.at(share), self._pressures])


class ReservoirLoads:
    """Forces of the water that stands against the soil: its pressure, along the normal, wherever a Reservoir is."""

    def __init__(self, space, facet_tags, applied, unit_weight, radius):
        domain, dim = space.mesh, space.mesh.geometry.dim
        v, height = ufl.TestFunctions(space)[0], ufl.SpatialCoordinate(domain)[dim - 1]
        normal, self._space, self._parts = ufl.FacetNormal(domain), space, []
        ds = ufl.Measure("ds", domain=domain, subdomain_data=facet_tags)
        for held in applied.held:
            if isinstance(held.condition, Reservoir):
                level = fem.Constant(domain, 0.0)
                pressure = unit_weight * ufl.max_value(level - height, 0.0)
                form = fem.form(-weighted(pressure * ufl.inner(normal, v), radius) * ds(held.tags))
                self._parts.append((held.condition, level, form))

    def forces(self, time: float) -> Any:
        """Nodal forces at a time [s], ghosts up to date: array over the local dofs, or 0 where there is none. Collective."""
        total = 0.0
        for condition, level, form in self._parts:
            level.value = value_at(condition.level, time)
            total = total + assembled(form, self._space).array
        return total
