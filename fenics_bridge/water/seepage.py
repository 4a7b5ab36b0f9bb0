"""Seepage: steady and transient flow of water through saturated and unsaturated soil (Richards' equation).

    d(theta)/dt + div q = 0,    q = -k_r k grad h,    h = p / gamma_w + z

with the water content theta = S (n + (n / K_w + m_v) p). It is discretised by Lagrange elements and backward Euler; the water
content is lumped and its change, not its derivative, is taken over a step, so that water is conserved whatever the step
(Celia, Bouloutas and Zarba 1990). Seepage faces and rain are a complementarity problem: p is at most zero, outflow at least
zero, and one of the two is zero. PETSc solves it together with the flow, so that no exit point is guessed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from mpi4py import MPI

from fenics_bridge import compat
from fenics_bridge.errors import InputError, agree
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.mesh.names import by_number, label, tag_numbers
from fenics_bridge.mesh.tagged import owned_cells, tag_values
from fenics_bridge.water.boundary import Flux, Head, Rain, Reservoir, SeepageFace, mistake_in, value_at
from fenics_bridge.water.complementarity import BoundedProblem
from fenics_bridge.water.retention import AlwaysSaturated

WATER_WEIGHT = 9810.0
"""Unit weight of water [N/m3]."""

WATER_MODULUS = 2.2e9
"""Bulk modulus of water [Pa]."""

QUADRATURE = {1: 3, 2: 5}
"""Degree of the quadrature by the degree of the elements; permeabilities that vary within a cell have no exact one."""

MOST_CONTINUATION_STEPS = 60
"""Steps of the continuation to a steady flow."""


@dataclass(frozen=True)
class PorousSoil:
    """How soil holds water and lets it through.

    conductivity: saturated hydraulic conductivity k [m/s]: a number, (D,) along the axes, or a symmetric (D, D) tensor
    porosity: n [-], in (0, 1); for transient flow only
    compressibility: of the skeleton, m_v [1/Pa], the inverse of the oedometric modulus; for transient flow only
    retention: curve of `fenics_bridge.water.retention`; without one the soil stays saturated
    Raises InputError for values outside these ranges.
    """

    conductivity: Any
    porosity: float = 0.4
    compressibility: float = 0.0
    retention: Any = field(default_factory=AlwaysSaturated)

    def __post_init__(self):
        k = np.asarray(self.conductivity, dtype=float)
        square = k.ndim == 2 and k.shape[0] == k.shape[1] and np.allclose(k, k.T)
        if not (
            np.all(np.isfinite(k)) and (k.ndim < 2 or square) and np.all(np.linalg.eigvalsh(self.tensor(k, 3)) > 0)
        ):
            raise InputError(f"conductivity: got {self.conductivity!r} m/s, expected positive numbers, or a "
                             "symmetric tensor with positive principal values")  # fmt: skip
        if not 0 < self.porosity < 1:
            raise InputError(f"porosity: got {self.porosity!r}, expected more than 0 and less than 1")
        if not (np.isfinite(self.compressibility) and self.compressibility >= 0):
            raise InputError(f"compressibility: got {self.compressibility!r} 1/Pa, expected 0 or more")

    @staticmethod
    def tensor(conductivity, dim):
        """Conductivity as a tensor (D, D) [m/s]."""
        k = np.asarray(conductivity, dtype=float)
        return k if k.ndim == 2 else np.diag(np.broadcast_to(k, k.shape or (dim,)))


class _Held(NamedTuple):
    """A boundary condition where it holds.

    tags: numbers of its facets; dofs: of this rank; rate: prescribed inflow over k [-] as a constant, None where there is none
    density, ds: of that inflow over the facets, UFL; total: compiled form of its integral
    """

    condition: Any
    tags: tuple
    dofs: np.ndarray
    rate: Any = None
    density: Any = None
    ds: Any = None
    total: Any = None


class Seepage:
    """Flow of water through a body of soil.

    pressure_head: function p / gamma_w [m], continuous; negative above the water table. It is where `solve` and `advance` begin.
    time: of the flow [s]; iterations: of Newton's method in the last solution
    boundary: the boundary conditions, which may be changed between steps
    """

    def __init__(self, domain, soil, facet_tags, boundary, cell_tags=None, degree=1, unit_weight=WATER_WEIGHT,
                 water_modulus=WATER_MODULUS, options_prefix="seepage_"):  # fmt: skip
        """
        soil: PorousSoil, or {cell tag or name: PorousSoil}; facet_tags, cell_tags: of DOLFINx
        boundary: list of Head, Reservoir, SeepageFace, Flux and Rain; where none is given the boundary is impervious. Where
            conditions meet at a node, a prescribed head holds before the others.
        degree: of the elements, 1 or 2; unit_weight: of water [N/m3]; water_modulus: bulk modulus of water [Pa]
        options_prefix: of the PETSc options of the solver
        Raises InputError, on all ranks. Collective.
        """
        comm = domain.comm
        problem = None if degree in (1, 2) else f"degree: got {degree!r}, expected 1 or 2"
        for name, value in (("unit_weight", unit_weight), ("water_modulus", water_modulus)):
            if not (np.isfinite(value) and value > 0):
                problem = f"{name}: got {value!r}, expected a positive number"
        agree(comm, problem)
        self.domain, self.unit_weight, self.water_modulus, self.time = domain, unit_weight, water_modulus, 0.0
        self._facet_tags, self._dim, self._degree = facet_tags, domain.geometry.dim, degree
        space = compat.function_space(domain, "Lagrange", degree)
        self.pressure_head = fem.Function(space, name="pressure_head")
        self._old = fem.Function(space)
        self._up = ufl.as_vector([0.0] * (self._dim - 1) + [1.0])
        self._dt, self._sharpness = fem.Constant(domain, 1.0), fem.Constant(domain, 1.0)
        self._soils, self._measures, self._cells = self._soils_by_tag(soil, cell_tags)
        self._largest = max(np.linalg.eigvalsh(s.tensor(s.conductivity, self._dim)).max() for s in self._soils)
        self._height = space.tabulate_dof_coordinates()[:, self._dim - 1]
        self._steady, self._transient, self._prefix = None, None, options_prefix
        self._stored, self._held = None, []
        self.boundary = list(boundary)
        self._take_boundary()
        self.iterations = 0
        self._reaction = np.zeros(len(self._height))

    # --- solving -----------------------------------------------------------------------------------------------------

    def solve(self):
        """Steady flow under the boundary conditions at the present time. Raises RuntimeError where none is found. Collective."""
        heads = any(isinstance(c, (Head, Reservoir, SeepageFace, Rain)) for c in self.boundary)
        missing = "boundary: no head, reservoir, seepage face or rain; without one the steady pressure is undetermined"
        agree(self.domain.comm, None if heads else missing)
        self._take_boundary()
        if self._steady is None:
            self._steady = self._problem(transient=False)
        failure = self._solve(self._steady)
        if failure:
            failure = self._sharpen()
        if failure:
            raise RuntimeError(f"steady seepage was not found: {failure}; try a retention curve that falls more gently, or a "
                               "finer mesh")  # fmt: skip

    def _sharpen(self):
        """Steady flow by continuation: retention curves are stretched over a suction 1000 times as large, which makes the
        problem nearly linear, and are brought back in steps as large as Newton's method takes them.
        """
        start, done, step, failure = self.pressure_head.x.array.copy(), -3.0, 1.0, None
        try:
            for _ in range(MOST_CONTINUATION_STEPS):
                self._sharpness.value = 10 ** min(done + step, 0.0)
                failure = self._solve(self._steady)
                if not failure and self._sharpness.value == 1.0:
                    return None
                done, step = (done, 0.3 * step) if failure else (done + step, 1.5 * step)
        finally:
            self._sharpness.value = 1.0
        self.pressure_head.x.array[:] = start
        return f"{failure or 'the continuation was too slow'}, with retention curves stretched {10**-done:.3g} times"

    def advance(self, dt):
        """One step of dt [s] by backward Euler. Returns whether it converged; the state is as before where not. Collective."""
        agree(self.domain.comm, None if np.isfinite(dt) and dt > 0 else f"dt: got {dt!r} s, expected a positive number")
        self._take_boundary()
        if self._transient is None:
            self._transient = self._problem(transient=True)
        self._dt.value = dt
        self._old.x.array[:] = self.pressure_head.x.array
        self.time += dt
        failure = self._solve(self._transient)
        if failure:
            self.time -= dt
        return not failure

    def _solve(self, problem):
        for held in self._held:
            if held.rate is not None:
                held.rate.value = value_at(held.condition.rate, self.time) / self._largest
        fixed, values, upper = self._bounds()
        heads = np.concatenate([values[fixed] + self._height[fixed], self._height])
        low, high = heads.min(initial=np.inf), heads.max(initial=-np.inf)
        comm = self.domain.comm
        size = comm.allreduce(float(high), MPI.MAX) - comm.allreduce(float(low), MPI.MIN)
        if problem is self._transient:  # so that the water of a long step, too, is conserved to round-off
            size = min(size, self.stored_water() / (self._largest * float(self._dt.value)))
        failure = problem.solve(fixed, values, upper, size)
        self.iterations = problem.iterations
        if not failure:
            self._reaction = self._largest * problem.residual()
        return failure

    def _problem(self, transient):
        psi, test = self.pressure_head, ufl.TestFunction(self.pressure_head.function_space)
        trial = ufl.TrialFunction(self.pressure_head.function_space)
        form, lagged = 0, 0
        for soil, dx in zip(self._soils, self._measures):
            k = ufl.as_matrix((soil.tensor(soil.conductivity, self._dim) / self._largest).tolist())
            permeability = soil.retention.relative_permeability(-self._sharpness * self.unit_weight * psi)
            flow = dx(metadata={"quadrature_degree": QUADRATURE[self._degree]})
            form += permeability * ufl.inner(k * (ufl.grad(psi) + self._up), ufl.grad(test)) * flow
            lagged += permeability * ufl.inner(k * ufl.grad(trial), ufl.grad(test)) * flow
            if transient:
                now, before = (self._water_content(soil, p) for p in (psi, self._old))
                form += (now - before) / (self._largest * self._dt) * test * self._lumped(dx)
                slope = ufl.derivative(now, psi, trial)
                lagged += slope / (self._largest * self._dt) * test * self._lumped(dx)
        for held in self._held:
            if held.rate is not None:
                form -= held.density * test * held.ds
        return BoundedProblem(form, [ufl.derivative(form, psi, trial), lagged], psi, self._prefix)

    def _lumped(self, dx):
        """The measure for what is lumped: linear elements integrate it at their vertices."""
        rule = {"quadrature_rule": "vertex", "quadrature_degree": 1}
        return dx(metadata=rule if self._degree == 1 else {"quadrature_degree": QUADRATURE[self._degree]})

    def _water_content(self, soil, psi):
        pressure = self.unit_weight * psi
        storage = soil.porosity / self.water_modulus + soil.compressibility
        return soil.retention.saturation(-pressure) * (soil.porosity + storage * pressure)

    # --- boundary conditions and soils -------------------------------------------------------------------------------

    def _take_boundary(self):
        """Check the boundary conditions and find where they hold, unless they are those of the last time. Collective."""
        held = [one.condition for one in self._held]
        if held and len(held) == len(self.boundary) and all(a is b for a, b in zip(held, self.boundary)):
            return
        comm = self.domain.comm
        for condition in self.boundary:
            known = isinstance(condition, (Head, Reservoir, SeepageFace, Flux, Rain))
            problem = mistake_in(condition) if known else "expected Head, Reservoir, SeepageFace, Flux or Rain"
            agree(comm, f"boundary: {condition!r}: {problem}" if problem else None)
        self._held = [self._where(condition) for condition in self.boundary]
        self._steady = self._transient = None

    def _where(self, condition):
        """Where a boundary condition holds."""
        space, dim, domain = self.pressure_head.function_space, self._dim, self.domain
        tags = tag_numbers(domain.comm, self._facet_tags, condition.facet_tag, "boundary")
        domain.topology.create_connectivity(dim - 1, dim)
        facets = tagged_facets(domain.comm, self._facet_tags, condition.facet_tag, "boundary")
        dofs = fem.locate_dofs_topological(space, dim - 1, facets)
        if not isinstance(condition, (Flux, Rain)):
            return _Held(condition, tags, dofs)
        rate = fem.Constant(domain, 0.0)
        level = abs(ufl.FacetNormal(domain)[dim - 1]) if isinstance(condition, Rain) else 1.0
        ds = ufl.Measure("ds", domain=domain, subdomain_data=self._facet_tags)(tags)
        return _Held(condition, tags, dofs, rate, rate * level, ds, fem.form(rate * level * ds))

    def _bounds(self):
        """Which dofs have a prescribed pressure head, these heads, and upper bounds of the others [m], at the present time."""
        n = len(self._height)
        fixed, values, upper = np.zeros(n, dtype=bool), np.zeros(n), np.full(n, np.inf)
        for condition, dofs in ((held.condition, held.dofs) for held in self._held):
            if isinstance(condition, (Head, Reservoir)):
                level = value_at(condition.level, self.time)
                below = dofs if isinstance(condition, Head) else dofs[self._height[dofs] <= level]
                free = dofs[~fixed[dofs]] if isinstance(condition, Reservoir) else dofs[:0]
                upper[free] = np.minimum(upper[free], 0.0)
                below = below[~fixed[below]]
                fixed[below], values[below] = True, level - self._height[below]
            elif isinstance(condition, (SeepageFace, Rain)):
                upper[dofs] = np.minimum(upper[dofs], getattr(condition, "ponding", 0.0))
        return fixed, values, upper

    def _soils_by_tag(self, soil, cell_tags):
        """The soils, and the measure over the cells of each."""
        comm, dim = self.domain.comm, self._dim
        by_tag = soil if isinstance(soil, dict) else {None: soil}
        for key, one in by_tag.items():
            agree(
                comm, None if isinstance(one, PorousSoil) else f"soil: got {one!r} for {key!r}, expected a PorousSoil"
            )
            shape = np.shape(one.conductivity)
            agree(comm, None if not shape or shape[0] == dim else f"conductivity: has shape {shape}, expected ({dim},) or "
                  f"({dim}, {dim}) in {dim}D")  # fmt: skip
        if not isinstance(soil, dict):
            every = np.arange(owned_cells(self.domain) + self.domain.topology.index_map(dim).num_ghosts, dtype=np.int32)
            return [soil], [ufl.Measure("dx", domain=self.domain)], [every]
        agree(
            comm, "cell_tags: got None, expected the tags that the soils are given for" if cell_tags is None else None
        )
        by_tag = by_number(comm, cell_tags, by_tag, "soil", "cell")
        values = tag_values(self.domain, cell_tags, dim)
        known = set().union(*comm.allgather(set(values.tolist())))
        without = sorted(known - set(by_tag))
        agree(comm, f"soil: none for cells with tag {label(cell_tags, without[0])} (0: untagged)" if without else None)
        dx = ufl.Measure("dx", domain=self.domain, subdomain_data=cell_tags)
        cells = [np.flatnonzero(values == tag).astype(np.int32) for tag in by_tag]
        return list(by_tag.values()), [dx(tag) for tag in by_tag], cells

    # --- results -----------------------------------------------------------------------------------------------------

    def inflow(self, facet_tag):
        """Water that enters through the facets of a tag [m3/s], per metre [m2/s] in plane flow; negative where it leaves.

        It follows from the equilibrium of the nodes, so that the inflows of all tags balance to the tolerance of the solution.
        A node where several conditions meet counts for the first of them. Collective; raises InputError for an unknown tag.
        """
        numbers = tag_numbers(self.domain.comm, self._facet_tags, facet_tag, "facet_tag")
        counted = np.zeros(len(self._height), dtype=bool)
        n, total = self.pressure_head.function_space.dofmap.index_map.size_local, 0.0
        for held in self._held:
            new = held.dofs[~counted[held.dofs] & (held.dofs < n)]
            counted[held.dofs] = True
            if set(held.tags).isdisjoint(numbers):
                continue
            total += self._reaction[new].sum()
            if held.rate is not None:
                total += self._largest * fem.assemble_scalar(held.total)
        return self.domain.comm.allreduce(float(total))

    def stored_water(self):
        """Volume of water in the body [m3], [m2] in plane flow, at atmospheric pressure. Collective."""
        if self._stored is None:
            content = [self._water_content(soil, self.pressure_head) for soil in self._soils]
            self._stored = fem.form(sum(water * self._lumped(dx) for water, dx in zip(content, self._measures)))
        return self.domain.comm.allreduce(fem.assemble_scalar(self._stored))

    def velocity(self):
        """Darcy velocity q [m/s] as a function that is polynomial in each cell."""
        psi = self.pressure_head
        space = compat.function_space(self.domain, "DG", self._degree - 1, self._dim)
        result = fem.Function(space, name="velocity")
        for soil, own in zip(self._soils, self._cells):
            k = ufl.as_matrix(soil.tensor(soil.conductivity, self._dim).tolist())
            flow = -soil.retention.relative_permeability(-self.unit_weight * psi) * k * (ufl.grad(psi) + self._up)
            result.interpolate(fem.Expression(flow, compat.interpolation_points(space)), own)
        return result

    def pore_pressure(self, suction=False, outside=None):
        """The pore pressure as a function of positions (n, D) [m] that returns pressures (n,) [Pa], for stages and particles.

        suction: False for zero above the water table; True for the suction times the effective saturation there (Bishop's
            effective stress); every rank must call the function
        outside: function of positions for points outside the body, e.g. `hydrostatic(level)`; zero where there is none
        """
        effective = (
            [s.retention.effective(-self.unit_weight * self.pressure_head) for s in self._soils] if suction else None
        )
        pressure = self._pressure(effective)

        def at(points):
            points = np.ascontiguousarray(points, dtype=float)
            search = PointSearch(self.domain, points)
            values = search.values(pressure)[:, 0]
            elsewhere = np.zeros(len(points)) if outside is None else np.broadcast_to(outside(points), len(points))
            return np.where(search.found, values, elsewhere)

        return at

    def _pressure(self, effective):
        """Pore pressure [Pa]: continuous and cut off at zero or, with effective saturations, with that part of the suction."""
        psi = self.pressure_head
        result = fem.Function(psi.function_space, name="pore_pressure")
        result.x.array[:] = self.unit_weight * np.maximum(psi.x.array, 0.0)
        if effective is None:
            return result
        for soil_effective, cells in zip(effective, self._cells):
            own = fem.Expression(
                self.unit_weight * psi * soil_effective, compat.interpolation_points(psi.function_space)
            )
            result.interpolate(own, cells)
        return result
