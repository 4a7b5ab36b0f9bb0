"""Deformation and flow in one system: forms, constraints and loads of displacement and pore pressure.

    div(sigma' - p I) + rho g = 0,    d/dt(div u) + (n / K_w) dp/dt + div q = 0,    q = -(k / gamma_w) (grad p + gamma_w grad z)

with the pressure p positive in compression (Biot 1941; Zienkiewicz and Shiomi 1984). Backward Euler takes the second equation
over a step; times minus the unit of pressure it makes the system symmetric where the law's tangent is. Where soil and water are
accelerated together by a, g becomes g - a in both.

Soil with a retention curve is unsaturated under suction -p, its air at atmospheric pressure: with the degree of saturation S,
the effective one S_e and the relative permeability k_r,

    div(sigma' - S_e p I) + (rho - n (1 - S) rho_w) g = 0,    d/dt(S (n + div u + n p / K_w)) + div q = 0,    k -> k_r k .
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.fem.fields import assembled, dilation
from fenics_bridge.fem.geometry import lumped_radius, nodal_radius, weighted
from fenics_bridge.fem.loads import pressing
from fenics_bridge.mesh.tagged import cell_volumes
from fenics_bridge.types import MeshTags
from fenics_bridge.water.boundary import Reservoir, value_at
from fenics_bridge.water.motion import Motion
from fenics_bridge.water.retention import AlwaysSaturated
from fenics_bridge.water.soils import PorousSoil, Water, as_constants
from mpm_core import Geometry


class Element(Enum):
    """Elements of displacement and pore pressure; the pressure is linear in both."""

    TAYLOR_HOOD = 2
    """Quadratic displacement"""
    STABILISED = 1
    """Linear displacement, stabilised by a polynomial pressure projection; some four times fewer unknowns in two dimensions, ten
    times in three"""


UNSATURATED, LUMPED = {"quadrature_degree": 4}, {"quadrature_rule": "vertex", "quadrature_degree": 1}
"""Integrals of soil that may dry: forces; flow, and water that it stores, at the vertices, so that fronts enter dry cells and pressures do
not oscillate. What the hoop strain u / r presses out is of the first kind: on the axis it has no value of its own."""


def _may_dry(soil: PorousSoil) -> bool:
    return not isinstance(soil.retention, AlwaysSaturated)


class WaterTerms:
    """The forms by which pore water enters a step, in the unknowns of a mixed space: u and p over a unit [Pa].

    Args:
        solution: displacement and pressure at the start of the step.
        increment: their change in the step.
        soils: soils, as of `soils_by_tag`.
        measures: measures over their cells, likewise.
        water: the water.
        unit: unit of pressure [Pa].
        geometry: plane strain, axial symmetry or a solid.
        degree: degree of the quadrature.
        there: function that is 1 in cells that are there and 0 in those that are not.
        motion: Motion of the body; None without inertia.
    """

    def __init__(
        self,
        solution: fem.Function,
        increment: fem.Function,
        soils: Sequence[PorousSoil],
        measures: Sequence[Any],
        water: Water,
        unit: float,
        geometry: Geometry,
        degree: int,
        there: fem.Function,
        motion: Motion | None = None,
    ) -> None:
        self._domain = domain = solution.function_space.mesh
        self._up = ufl.as_vector([0.0] * (domain.geometry.dim - 1) + [1.0])
        self._dim, self._increment = domain.geometry.dim, increment
        self._radius, self._lumped_radius = nodal_radius(domain, geometry), lumped_radius(domain, geometry)
        self._there, self._motion, self._soils, self._water = there, motion, as_constants(domain, soils), water
        self._unit, self._gamma, gravity = (fem.Constant(domain, v) for v in (unit, water.unit_weight, water.gravity))
        self._driving = self._up + motion.at_end / gravity if motion else self._up
        rule = {"quadrature_degree": degree}
        self._measures = [dx(metadata=UNSATURATED if _may_dry(soil) else rule) for dx, soil in zip(measures, soils)]
        self.dt = fem.Constant(domain, 1.0)
        """Length of the step [s], a constant of the forms"""
        self.projection = fem.Function(compat.function_space(domain, "DG", 0, self._dim**2))
        """Function of the pressure projection (D * D,) [m2/Pa], see `PressureProjection`"""
        moved = compat.degree_of(solution.function_space.sub(0))
        self.placed = fem.Function(compat.function_space(domain, "DG", moved, self._dim))
        """Displacement at which soil was placed [m], from which its strain counts"""
        self._u, self._p = ufl.split(solution)
        self._du, self._dp = ufl.split(increment)
        content = lambda s: [(self._saturation(s, self._p), self._u - self.placed, self._pores(s))]
        self.content = fem.form(self._held(content))
        """Form of the volume of stored water"""

    @property
    def may_dry(self) -> bool:
        """Whether some soil has a retention curve."""
        return any(_may_dry(soil) for soil in self._soils)

    def dried(self) -> tuple[fem.Function, fem.Function]:
        """What soil that may dry has in each cell, by the integrals of the forces.

        Returns:
            Part of the pressure that the total stress has [Pa], constant in each cell, and weight of the water that pores have no
            more [N/m3], linear in it.

        Note:
            Collective.
        """
        dim, volume = self._dim, cell_volumes(self._domain)[:, None]
        acting, lost = (fem.Function(compat.function_space(self._domain, "DG", degree)) for degree in (0, 1))
        for function, density in ((acting, self._pressing), (lost, self._lost)):
            space = function.function_space
            test = ufl.TestFunction(space)
            form = fem.form(self._sum(lambda soil: density(soil, self._p) * test))
            moments = self._unit.value * assembled(form, space).array
            dofs = compat.cell_dofs(space)[: len(volume)]
            of_cells = moments[dofs]
            if function is lost:  # the inverse of the integrals of N_k N_l
                of_cells = (dim + 1) * (dim + 2) * (of_cells - of_cells.sum(axis=1, keepdims=True) / (dim + 2))
            function.x.array[dofs] = of_cells / volume
        return acting, lost

    def forms(self, applied: Any) -> Callable[[Any, Any], tuple[Any, Any]]:
        """Further internal forces and their tangent as a function of test and trial functions, for `Kinematics`."""

        def further(test: Any, trial: Any) -> Any:
            v, q = ufl.split(test)
            end = self._p + self._dp
            forces = self._sum(lambda s: self._pressing(s, end) * self._volume(v) + self._missing(s, end, v))
            if self._motion is not None:
                acceleration = self._motion.at_end
                forces -= self._sum(lambda s: (s.density / self._unit) * ufl.inner(acceleration, v))
            water = self._held(self._stored, q)
            pushed = (self._unit / self._gamma) * ufl.grad(end)
            inflow = fem.Constant(self._domain, applied.unit) * applied.inflow_form(q)
            water += self.dt * (self._flow(pushed + self._driving, q, end) - inflow)
            spread = ufl.as_matrix(
                [[self.projection[i * self._dim + j] for j in range(self._dim)] for i in range(self._dim)]
            )
            water += self._sum(lambda s: self._unit * ufl.inner(spread * ufl.grad(self._dp), ufl.grad(q)))
            residual = -self._unit * (forces + water)
            return residual, ufl.derivative(residual, self._increment, trial)

        return further

    def gravity_flow(self, space: Any) -> NDArray[np.float64]:
        """Flow of the water in 1 s by its own weight, as part of the internal forces: (m,). Collective."""
        q = ufl.TestFunctions(space)[1]
        return self._unit.value * assembled(fem.form(self._flow(self._up, q, 0.0)), space).array

    def _flow(self, gradient: Any, q: Any, pressure: Any) -> Any:
        total = 0
        for soil, dx in zip(self._soils, self._measures):
            density = weighted(self._there * ufl.inner(soil.conductivity * gradient, ufl.grad(q)), self._radius)
            if _may_dry(soil):
                total += soil.retention.relative_permeability(-self._unit * pressure) * density * dx(metadata=LUMPED)
            else:
                total += density * dx
        return total

    def _sum(self, density: Callable[[PorousSoil], Any]) -> Any:
        """Integral over the cells of all soils of a density that is a function of the soil."""
        pairs = zip(self._soils, self._measures)
        return sum(weighted(self._there * density(soil), self._radius) * dx for soil, dx in pairs)

    def _held(self, parts: Callable[[PorousSoil], list[tuple[Any, Any, Any]]], test: Any = 1) -> Any:
        """Integral over the cells of all soils of water: the sum of s (volume(u) + c) over parts (s, u, c) of each soil."""
        total = 0
        for soil, dx in zip(self._soils, self._measures):
            for part, moved, volume in parts(soil):
                part = self._there * test * part
                if not _may_dry(soil):
                    total += weighted(part * (self._volume(moved) + volume), self._radius) * dx
                    continue
                total += weighted(part * (ufl.div(moved) + volume), self._lumped_radius) * dx(metadata=LUMPED)
                if self._radius is not None:
                    total += part * moved[0] * dx
        return total

    def _saturation(self, soil: PorousSoil, pressure: Any) -> Any:
        return soil.retention.saturation(-self._unit * pressure) if _may_dry(soil) else 1.0

    def _pressing(self, soil: PorousSoil, pressure: Any) -> Any:
        """Part of the pressure that the total stress has, over its unit."""
        return soil.retention.effective(-self._unit * pressure) * pressure if _may_dry(soil) else pressure

    def _missing(self, soil: PorousSoil, pressure: Any, v: Any) -> Any:
        """Weight of the water that pores have no more, times a test function, over the unit of pressure."""
        return self._lost(soil, pressure) * ufl.inner(self._driving, v) if _may_dry(soil) else 0.0

    def _lost(self, soil: PorousSoil, pressure: Any) -> Any:
        """Weight of the water that a volume of soil has no more, over the unit of pressure."""
        return soil.porosity * (1 - self._saturation(soil, pressure)) * self._gamma / self._unit

    def _pores(self, soil: PorousSoil) -> Any:
        """Volume of the pores before soil was strained and of what its pressure presses into them, in a volume of soil."""
        return soil.porosity + self._storage(soil) * self._p

    def _stored(self, soil: PorousSoil) -> list[tuple[Any, Any, Any]]:
        """Parts of the water that soil takes up in the step; small differences are taken first, for the sake of round-off."""
        now, before = (self._saturation(soil, p) for p in (self._p + self._dp, self._p))
        gained = [(now, self._du, self._storage(soil) * self._dp)]
        return [*gained, (now - before, self._u - self.placed, self._pores(soil))] if _may_dry(soil) else gained

    def _volume(self, u: Any) -> Any:
        return dilation(u, self._radius)

    def _storage(self, soil: PorousSoil) -> Any:
        return self._unit * soil.porosity * (1 / self._water.modulus)


def pressure_is_free(space: Any, constraints: Any, radius: Any, there: Any) -> bool:
    """Whether a uniform change of pressure does no work on the displacements that supports leave free. Collective."""
    v = ufl.TestFunctions(space)[0]
    work = assembled(fem.form(weighted(there * dilation(v, radius), radius) * ufl.dx), space).array.copy()
    largest = np.abs(work).max(initial=0.0)
    work[constraints.dofs] = 0.0
    most = np.max(space.mesh.comm.allgather([largest, np.abs(work).max(initial=0.0)]), axis=0)
    return bool(most[1] <= 1e-10 * most[0])


class CoupledConstraints:
    """Supports and prescribed pressures, as `Constraints` has them; `hold` says where pressures are prescribed.

    Pressures, as the unknowns of the mixed space, are over the unit of pressure.

    Args:
        supports: Constraints on the mixed space's displacement.
        space: the mixed space.
        pressure_dofs: dofs of that space for those of the pressure.
        lonely: dofs of that space for displacements of nodes without soil, shape (m, D), which stay where they are.
        solution: displacement and pressure, whose values these dofs keep.
    """

    def __init__(
        self,
        supports: Any,
        space: Any,
        pressure_dofs: NDArray[np.integer],
        lonely: NDArray[np.integer],
        solution: fem.Function,
    ) -> None:
        self._supports, self._space, self._pressure_dofs = supports, space, pressure_dofs
        self.comm = space.mesh.comm
        displacement, columns = space.sub(0), lonely.astype(np.int32).T
        self._lonely = np.setdiff1d(lonely.ravel(), supports.dofs).astype(np.int32)
        self._resting = solution.x.array[self._lonely]
        self._bcs = list(supports.bcs)
        self._bcs += [
            fem.dirichletbc(np.float64(0.0), dofs.copy(), displacement.sub(c)) for c, dofs in enumerate(columns)
        ]
        self.hold(np.zeros(len(pressure_dofs), dtype=bool), np.zeros(len(pressure_dofs)))

    def hold(self, held: NDArray[np.bool_], pressures: NDArray[np.float64]) -> None:
        """Prescribe pressures.

        Args:
            held: which of the pressure's dofs are prescribed, shape (m,).
            pressures: pressures over their unit that they then have [-], shape (m,).
        """
        dofs = self._pressure_dofs[held].astype(np.int32)
        self._pressures = pressures[held]
        self.dofs = np.concatenate([self._supports.dofs, dofs, self._lonely])
        self.bcs = [*self._bcs, fem.dirichletbc(np.float64(0.0), dofs, self._space.sub(1))]

    def at(self, fraction: float) -> NDArray[np.float64]:
        """Values of the dofs at a fraction of the displacements that the supports prescribe."""
        return np.concatenate([self._supports.at(fraction), self._pressures, self._resting])


class ReservoirLoads:
    """Forces of the water that stands against the soil that is there: its pressure, along the normal, at each Reservoir."""

    def __init__(
        self, space: Any, facet_tags: MeshTags, applied: Any, unit_weight: Any, radius: Any, there: Any
    ) -> None:
        domain, dim = space.mesh, space.mesh.geometry.dim
        v, height = ufl.TestFunctions(space)[0], ufl.SpatialCoordinate(domain)[dim - 1]
        self._space, self._parts = space, []
        for held in applied.held:
            if isinstance(held.condition, Reservoir):
                level = fem.Constant(domain, 0.0)
                pressure = unit_weight * ufl.max_value(level - height, 0.0)
                form = pressing(domain, weighted(pressure, radius), v, facet_tags, held.tags, there)
                self._parts.append((held.condition, level, fem.form(form)))

    def forces(self, time: float) -> Any:
        """Nodal forces at a time [s], ghosts up to date: array over the local dofs, or 0 where there is none. Collective."""
        total = 0.0
        for condition, level, form in self._parts:
            level.value = value_at(condition.level, time)
            total = total + assembled(form, self._space).array
        return total
