"""Seepage: steady and transient flow of water through saturated and unsaturated soil (Richards' equation).

    d(theta)/dt + div q = 0,    q = -k_r k grad h,    h = p / gamma_w + z

with the water content theta = S (n + n p / K_w + m_v (p - w)), w being the total vertical stress that standing water adds: so
soil that cannot drain transfers a change of that load to its water (van der Kamp and Gale 1983). It is discretised by Lagrange
elements and backward Euler; the water content is lumped and its change, not its derivative, is taken over a step, so that water
is conserved whatever the step (Celia, Bouloutas and Zarba 1990). Seepage faces and rain are a complementarity problem: p is at
most zero, outflow at least zero, and one of the two is zero. PETSc solves it together with the flow, so that no exit point is
guessed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.water_checks import LABORATORY_GRAVITY
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, is_finite, require_mesh
from fenics_bridge.fem.geometry import geometry_of, largest_radius, lumped_radius, radius_of, weighted
from fenics_bridge.fem.pore_water import pressures_at
from fenics_bridge.types import MeshTags, OfPosition
from fenics_bridge.views import body_text
from fenics_bridge.water.applied import AppliedBoundary
from fenics_bridge.water.boundary import WaterBoundary, listed
from fenics_bridge.water.complementarity import BoundedProblem
from fenics_bridge.water.positions import at_positions
from fenics_bridge.water.soils import (
    WATER_MODULUS,
    PorousSoil,
    acting_pressure,
    as_constants,
    given_water,
    set_by_soil,
    soils_by_tag,
)
from mpm_core import Geometry, RunError

RULES = {1: {"quadrature_rule": "vertex", "quadrature_degree": 1}, 2: {"quadrature_degree": 5}}
"""Quadrature by the degree of the elements; permeabilities that vary within a cell have no exact one.

Linear elements integrate at the vertices, so that the permeability of a cell is the mean of those of its nodes, as usual in finite differences
(Celia, Bouloutas and Zarba 1990). Between a wet node and a dry one the suction is linear, so that a sharp curve would leave the cell as good as
impervious: rain that ponds on dry sand would wet half of a cell and no more.
"""

MOST_CONTINUATION_STEPS = 60
"""Steps of the continuation to a steady flow."""

_SHORTER = (
    "take steps shorter than {:.3g} s, and let heads that jump change over some time, as a table of times and values"
)


class Seepage:
    """Flow of water through a body of soil. Collective.

    Args:
        domain: mesh of the body.
        soil: soil, or soils by cell tag or name.
        facet_tags: tags of the boundary.
        boundary: boundary conditions; where none is given the boundary is impervious. Where conditions meet at a node, a
            prescribed head holds before the others.
        cell_tags: tags of the cells; needed where soils are given by cell tag.
        degree: degree of the elements, 1 or 2.
        unit_weight: unit weight of water [N/m3], under the gravity of the model; by default that of 1000 kg/m3.
        water_modulus: bulk modulus of water [Pa].
        options_prefix: prefix of the PETSc options of the solver.
        loading: function of positions (n, D) [m] and time [s] that returns the vertical total stress (n,) [Pa, compression
            positive] that changes in time, such as `standing_water(...)`; it acts through the compressibility of the soils.
        gravity: of the model [m/s2], which is that of the unit weights; conductivities are those under 9.81 m/s2.
        geometry: Geometry.AXISYMMETRIC for the half section of an axisymmetric body, whose inflows and stored water are those of
            one radian; by default a plane section in two dimensions.

    Raises:
        InputError: an unknown tag, cells without a soil, a boundary condition on the axis, or another argument out of range. Raised on all ranks alike.
    """

    def __init__(
        self,
        domain: Mesh,
        soil: PorousSoil | dict[int | str, PorousSoil],
        facet_tags: MeshTags,
        boundary: Iterable[WaterBoundary],
        cell_tags: MeshTags | None = None,
        degree: int = 1,
        unit_weight: float | None = None,
        water_modulus: float = WATER_MODULUS,
        options_prefix: str = "seepage_",
        loading: Callable[[NDArray[np.float64], float], ArrayLike] | None = None,
        gravity: float = LABORATORY_GRAVITY,
        geometry: Geometry | None = None,
    ) -> None:
        require_mesh(domain)
        comm = domain.comm
        agree(comm, None if degree in (1, 2) else f"degree is {degree!r}, expected 1 or 2")
        given = given_water(comm, unit_weight, gravity, water_modulus)
        self.domain = domain
        """Mesh of the body"""
        self.geometry = geometry_of(domain, geometry)
        """Plane section, axial symmetry or a solid"""
        self.unit_weight = given.unit_weight
        """Unit weight of water [N/m3]"""
        self.facet_tags = facet_tags
        """Tags of the boundary"""
        self.water_modulus = given.modulus
        """Bulk modulus of water [Pa]"""
        self.time = 0.0
        """Time of the flow [s]"""
        self._dim, self._degree = domain.geometry.dim, degree
        space = compat.function_space(domain, "Lagrange", degree)
        self.pressure_head = fem.Function(space, name="pressure_head")
        """Pressure head p / gamma_w [m], continuous, negative above the water table; `solve` and `advance` begin with it"""
        self._old = fem.Function(space)
        self._loading, self._load, self._old_load = loading, fem.Function(space), fem.Function(space)
        self._up = ufl.as_vector([0.0] * (self._dim - 1) + [1.0])
        self._dt, self._sharpness = fem.Constant(domain, 1.0), fem.Constant(domain, 1.0)
        self._soils, self._measures, self._cells = soils_by_tag(domain, soil, cell_tags, gravity=gravity)
        self._of_forms = as_constants(domain, self._soils)
        self._largest = max(np.linalg.eigvalsh(s.tensor(s.conductivity, self._dim)).max() for s in self._soils)
        self._radius, self._lumped_radius = radius_of(domain, self.geometry), lumped_radius(domain, self.geometry)
        self._outermost = largest_radius(domain, self.geometry)
        self._applied = AppliedBoundary(space, facet_tags, self._largest, self._radius)
        self._steady, self._transient, self._stored, self._prefix = None, None, None, options_prefix
        self.boundary = listed(comm, boundary)
        """The boundary conditions, which may be changed between steps"""
        self._take_boundary()
        self._set_load()
        self.iterations = 0
        """Iterations of Newton's method in the last solution"""
        self.reason = ""
        """Why the last step was not made, and what helps; empty where it was"""
        self._reaction = np.zeros(len(self._applied.height))

    def __repr__(self) -> str:
        facts = f"elements of degree {self._degree}", f"t = {self.time:g} s"
        shown = None if self._radius is None else self.geometry
        return body_text("Seepage", self.domain, *facts, geometry=shown, lines=map(repr, self.boundary))

    def _take_boundary(self) -> None:
        if self._applied.take(self.boundary):
            self._steady = self._transient = None

    def _set_load(self) -> None:
        """The loading at the present time."""
        if self._loading is None:
            return
        points = self._load.function_space.tabulate_dof_coordinates()[:, : self._dim]
        loading, time = self._loading, self.time
        self._load.x.array[:] = pressures_at(self.domain.comm, lambda x: loading(x, time), points, "loading")

    # --- solving -----------------------------------------------------------------------------------------------------

    def solve(self) -> None:
        """Find the steady flow under the boundary conditions at the present time. Collective.

        Raises:
            InputError: no boundary condition determines the pressure, or one is not possible. Raised on all ranks alike.
            RunError: no steady flow was found.
        """
        self._take_boundary()
        self._applied.require_values(self.time)
        outlet = self._applied.lowest_outlet(self.time)
        self._set_load()
        if self._steady is None:
            self._steady = self._problem(transient=False)
        failure = self._solve(self._steady)
        if failure and outlet is not None:  # nothing may hold the pressure yet where Newton's method began
            self.pressure_head.x.array[:] = outlet - self._applied.height
            failure = self._solve(self._steady)
        if failure:
            failure = self._sharpen()
        if failure:
            raise RunError(f"steady seepage was not found: {failure}; try a retention curve that falls more gently, or a "
                           "finer mesh, or less water that a Flux brings into the soil")  # fmt: skip

    def _sharpen(self) -> Any:
        """Find the steady flow by continuation.

        Retention curves are stretched over a suction 1000 times as large, which makes the problem nearly linear, and are
        brought back in steps as large as Newton's method takes them. Returns why that failed; None where it did not.
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

    def advance(self, dt: float) -> bool:
        """Make a step of backward Euler. Collective.

        Args:
            dt: length of the step [s].

        Returns:
            Whether it converged; where not, the state is as before, and `reason` says why.

        Raises:
            InputError: dt is not positive, a boundary condition is not possible, or compressible soil would hold less than no water.
                Raised on all ranks alike.
        """
        agree(self.domain.comm, None if is_finite(dt) and dt > 0 else f"dt is {dt!r} s, expected a positive number")
        self._take_boundary()
        self._applied.require_values(self.time + dt)
        if self._transient is None:
            self._transient = self._problem(transient=True)
        water = self._water_in_pores()
        self._dt.value = dt
        self._old.x.array[:], self._old_load.x.array[:] = self.pressure_head.x.array, self._load.x.array
        self.time += dt
        self._set_load()
        failure = self._solve(self._transient, water / (self._largest * dt))
        if failure:
            self.time -= dt
            self._load.x.array[:] = self._old_load.x.array
        self.reason = f"{failure}; {_SHORTER.format(dt)}" if failure else ""
        return not failure

    def _water_in_pores(self) -> float:
        """The stored water, which pores of a compressibility in other units would have less than none of. Collective."""
        water, largest = self.stored_water(), max(soil.compressibility for soil in self._soils)
        agree(self.domain.comm, None if water > 0 else f"soil: the largest compressibility is {largest:g} 1/Pa, with which the pores would hold less "
              "than no water; expected the inverse of the oedometric modulus, such as 1e-7 for 10 MPa")  # fmt: skip
        return water

    def _solve(self, problem: Any, water: float = 0.0) -> Any:
        """Solve a problem under the conditions at the present time; water: all that there is, over a time step."""
        self._applied.set_time(self.time, float(self._dt.value) if problem is self._transient else 0.0)
        height, (fixed, values, upper) = self._applied.height, self._applied.bounds(self.time)
        heads = np.concatenate([values[fixed] + height[fixed], height])
        low, high = heads.min(initial=np.inf), heads.max(initial=-np.inf)
        comm = self.domain.comm
        size = self._outermost * (comm.allreduce(float(high), MPI.MAX) - comm.allreduce(float(low), MPI.MIN))
        if (
            problem is self._transient
        ):  # all water, over the step: long steps, too, are to conserve it, short ones have its round-off
            size = max(min(size, water), 1e-3 * water)
        failure = problem.solve(fixed, values, upper, size)
        self.iterations = problem.iterations
        if not failure:
            self._reaction = self._largest * problem.residual()
        return failure

    def _problem(self, transient: bool) -> Any:
        psi, test = self.pressure_head, ufl.TestFunction(self.pressure_head.function_space)
        trial = ufl.TrialFunction(self.pressure_head.function_space)
        form, lagged, largest = 0, 0, fem.Constant(self.domain, self._largest)
        for soil, dx in zip(self._of_forms, self._measures):
            k = soil.conductivity / largest
            permeability = soil.retention.relative_permeability(-self._sharpness * self.unit_weight * psi)
            flow = dx(metadata=RULES[self._degree])
            permeability = weighted(permeability, self._radius)
            form += permeability * ufl.inner(k * (ufl.grad(psi) + self._up), ufl.grad(test)) * flow
            lagged += permeability * ufl.inner(k * ufl.grad(trial), ufl.grad(test)) * flow
            if transient:
                change = self._change_of_water(soil)
                form += self._lumped(change / (largest * self._dt) * test, dx)
                slope = ufl.derivative(change, psi, trial)
                lagged += self._lumped(slope / (largest * self._dt) * test, dx)
        form -= self._applied.inflow_form(test)
        return BoundedProblem(form, [ufl.derivative(form, psi, trial), lagged], psi, self._prefix)

    def _lumped(self, density: Any, dx: Any) -> Any:
        """The integral of what is lumped: linear elements integrate it at their vertices."""
        radius = self._lumped_radius if self._degree == 1 else self._radius
        return weighted(density, radius) * dx(metadata=RULES[self._degree])

    def _water_content(self, soil: PorousSoil, psi: Any, load: Any) -> Any:
        return soil.retention.saturation(-self.unit_weight * psi) * (soil.porosity + self._held(soil, psi, load))

    def _held(self, soil: PorousSoil, psi: Any, load: Any) -> Any:
        """Water [-] by which saturated soil has more than its porosity."""
        storage = soil.porosity * (1 / self.water_modulus) + soil.compressibility
        held = storage * self.unit_weight * psi
        return held if self._loading is None else held - soil.compressibility * load

    def _change_of_water(self, soil: PorousSoil) -> Any:
        """Change of the water content since the step began; small differences are taken first, for the sake of round-off."""
        psi, old = self.pressure_head, self._old
        now, before = (soil.retention.saturation(-self.unit_weight * p) for p in (psi, old))
        gained = self._held(soil, psi - old, self._load - self._old_load)
        return now * gained + (now - before) * (soil.porosity + self._held(soil, old, self._old_load))

    # --- results -----------------------------------------------------------------------------------------------------

    def inflow(self, facet_tag: int | str | None) -> float:
        """Water that enters through the facets of a tag. Collective.

        It follows from the equilibrium of the nodes, so that the inflows of all tags balance to the tolerance of the solution.
        A node where several conditions meet counts for a head or reservoir before a seepage face or rain, otherwise for the first of them; a flux
        has what it prescribes.

        Args:
            facet_tag: number or name of the tag; None for all boundary conditions together.

        Returns:
            Inflow [m3/s], per metre [m2/s] in plane flow and per radian in axial symmetry (that of the whole body is 2 pi times
            as much); negative where water leaves.

        Raises:
            InputError: no facet has the tag. Raised on all ranks alike.
        """
        return self._applied.inflow(facet_tag, self._reaction)

    def stored_water(self) -> float:
        """Volume of water in the body [m3], [m2] in plane flow, per radian in axial symmetry, at atmospheric pressure. Collective."""
        if self._stored is None:
            content = [self._water_content(soil, self.pressure_head, self._load) for soil in self._of_forms]
            self._stored = fem.form(sum(self._lumped(water, dx) for water, dx in zip(content, self._measures)))
        return self.domain.comm.allreduce(fem.assemble_scalar(self._stored))

    def velocity(self) -> fem.Function:
        """Darcy velocity q [m/s] as a function that is polynomial in each cell."""
        psi, dim = self.pressure_head, self._dim
        space = compat.function_space(self.domain, "DG", self._degree - 1, dim)
        result = fem.Function(space, name="velocity")
        velocities, dofs = result.x.array.reshape(-1, dim), compat.cell_dofs(space)
        places = compat.interpolation_points(space)
        head = fem.Expression(ufl.as_vector([psi, *(ufl.grad(psi) + self._up)]), places)
        for soil, own in zip(self._soils, self._cells):
            there = compat.expression_values(head, self.domain, own).reshape(len(own), len(places), 1 + dim)
            permeability = soil.retention.relative_permeability(-self.unit_weight * there[..., :1])
            if self._degree == 1:  # as in the flow itself
                corners = psi.x.array[compat.cell_dofs(psi.function_space)[own]]
                permeability = soil.retention.relative_permeability(-self.unit_weight * corners).mean(axis=1)[
                    :, None, None
                ]
            velocities[dofs[own]] = -permeability * (there[..., 1:] @ soil.tensor(soil.conductivity, dim).T)
        return result

    def saturation(self) -> fem.Function:
        """Degree of saturation [-] at the nodes; where soils meet, that of the last of them."""
        psi = self.pressure_head
        result = fem.Function(psi.function_space, name="saturation")
        degree = lambda soil, nodes: soil.retention.saturation(-self.unit_weight * psi.x.array[nodes])
        set_by_soil(result, self._soils, self._cells, degree)
        return result

    def pore_pressure(self, suction: bool = False, outside: OfPosition | None = None) -> OfPosition:
        """The pore pressure as a function of positions, for stages and particles.

        Args:
            suction: False for zero above the water table; True for the suction times the effective saturation there (Bishop's
                effective stress).
            outside: function of positions (n, D) [m] for points outside the body, e.g. `hydrostatic(level)`; None for zero there.

        Returns:
            Function of positions (n, D) [m] that returns pressures (n,) [Pa]; every rank must call it.
        """
        pressure = fem.Function(self.pressure_head.function_space)
        pressure.x.array[:] = self.unit_weight * self.pressure_head.x.array
        return at_positions(acting_pressure(pressure, self._soils, self._cells, suction), outside)
