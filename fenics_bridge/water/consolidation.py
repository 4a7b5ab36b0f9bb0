"""Consolidation: deformation of saturated soil and flow of its pore water, coupled."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.equilibration import Solver
from fenics_bridge.fem.equilibrium import Body
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.fields import assembled, force_on, nodal_average, part_of
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held
from fenics_bridge.fem.kinematics import Kinematics
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.loads import Load, LoadVectors
from fenics_bridge.fem.materials import Materials
from fenics_bridge.fem.quadrature import QuadraturePoints
from fenics_bridge.fem.supports import Constraints, tagged_facets
from fenics_bridge.water.applied import AppliedBoundary
from fenics_bridge.water.boundary import Flux
from fenics_bridge.water.consolidation_step import ConsolidationReport, CoupledStep, solve_step
from fenics_bridge.water.coupled import (
    CoupledConstraints,
    Element,
    PressureProjection,
    ReservoirLoads,
    WaterTerms,
    pressure_is_free,
)
from fenics_bridge.water.retention import AlwaysSaturated
from fenics_bridge.water.initial_state import set_initial_state
from fenics_bridge.water.soils import WATER_MODULUS, WATER_WEIGHT, soils_by_tag
from fenics_bridge.water.time_steps import run


class Consolidation:
    """Quasi-static deformation of saturated soil coupled with the flow of its water: displacement u and pore pressure p.

    pressure: pore pressure [Pa], a function, linear in each cell, compression positive; time: [s]
    load: the Load, or a function of the time [s] that returns one; boundary: conditions of the water. Both may be changed
        between steps, and hold at the end of a step.
    points: QuadraturePoints, with effective stress and state; domain, geometry: mesh and Geometry
    """

    def __init__(self, domain, law, soil, facet_tags, supports, boundary, load=None, element=Element.TAYLOR_HOOD,
                 cell_tags=None, geometry=None, unit_weight=WATER_WEIGHT, water_modulus=WATER_MODULUS, solver=None,
                 options_prefix="consolidation_"):  # fmt: skip
        """
        law: of `mpm_core`, for effective stresses, or {cell tag or name: law}; soil: PorousSoil, or one by cell tag or name;
            its compressibility does not count, and its retention curve must be AlwaysSaturated
        facet_tags, supports: as for `QuasiStatic`
        boundary: list of Head, Reservoir, SeepageFace, Flux and Rain, as for `Seepage`; a Reservoir also presses on the soil
        load: as the attribute; unit weights are those of the saturated soil, pressures are total stresses
        element: Element; geometry: as for `QuasiStatic`; solver: Solver, of which tolerance and iterations count
        unit_weight: of water [N/m3]; water_modulus: bulk modulus of water [Pa], may be infinite
        Raises InputError, on all ranks, for bad arguments. Collective.
        """
        agree(domain.comm, _first_mistake(element, soil, unit_weight, water_modulus))
        self.domain, self.geometry, self.time = domain, geometry_of(domain, geometry), 0.0
        self.load, self.boundary, self.solver = load or Load(), list(boundary), solver or Solver()
        self.radius = radius_of(domain, self.geometry)
        self._weights, self._facet_tags = (unit_weight, water_modulus), facet_tags
        self._space = space = compat.displacement_pressure_space(domain, element.value)
        self._displacements, self._pressures = ((part, np.asarray(dofs)) for part, dofs in _parts(space))
        self._supports = Constraints(space.sub(0), facet_tags, supports)
        require_axis_held(space.sub(0), self.geometry, self._supports)
        materials, self._soils = Materials(domain, law, cell_tags), soils_by_tag(domain, soil, cell_tags)
        self._laws = materials.laws(law)
        degree = max(1, 2 * (element.value - 1))
        self.points = QuadraturePoints(domain, self._laws, materials.number, degree, self.radius is not None)
        self._unit = max(one.p_wave_modulus for one in self._laws)
        self._loads = LoadVectors(space, facet_tags, cell_tags, test=ufl.TestFunctions(space)[0], radius=self.radius)
        self._external = self._loads.forces(Load())
        self._projection = None
        if element == Element.STABILISED:
            self._projection = PressureProjection(
                domain, self.points, self._laws, self._soils[0], self._soils[2], self._weights
            )
        self._applied = AppliedBoundary(
            self._pressures[0], facet_tags, _largest_conductivity(self._soils[0]), self.radius
        )
        self.pressure = fem.Function(self._pressures[0], name="pore_pressure")
        self._active, self._inflow = (np.zeros(len(self.pressure.x.array), dtype=kind) for kind in (bool, float))
        self._assemble(options_prefix)

    def _assemble(self, options_prefix):
        """Put together what does not depend on the water's boundary conditions, then what does. Collective."""
        solution, increment = fem.Function(self._space), fem.Function(self._space)
        constraints = CoupledConstraints(self._supports, self._space, self._pressures[1])
        linear = LinearSolver(self._space, options_prefix, newton=True)
        self._body = Body(solution, increment, self.points, None, constraints, linear)
        maps = [(part.dofmap, dofs) for part, dofs in (self._displacements, self._pressures)]
        self._owned = [dofs[: m.index_map.size_local * m.index_map_bs] for m, dofs in maps]
        # Stabilised elements take one point for all: FFCx 0.5 mixes up the radii of integrals of degree 1 and others.
        degree = 3 if self.points.degree == 2 and self.radius is not None else self.points.degree
        self._terms = WaterTerms(
            solution, increment, self._soils[0], self._soils[1], self._weights, self._unit, self.radius, degree
        )
        self._gravity = self._terms.gravity_flow(self._space)
        self._take_boundary(first=True)

    def _take_boundary(self, first=False):
        """Put together what depends on the water's boundary conditions, where they have changed. Collective."""
        if not (self._applied.take(self.boundary) or first):
            return
        held = any(not isinstance(condition, Flux) for condition in self.boundary)
        free = not held and np.isinf(self._weights[1]) and pressure_is_free(self._space, self._supports, self.radius)
        agree(self.domain.comm, "boundary: no head, reservoir, seepage face or rain, incompressible water and supports all "
              "around; the pressure is undetermined" if free else None)  # fmt: skip
        body = self._body
        body.kinematics = Kinematics(
            body.increment, self.points, body.constraints, self.geometry, self._terms.forms(self._applied)
        )
        self._reservoirs = ReservoirLoads(self._space, self._facet_tags, self._applied, self._weights[0], self.radius)

    def initialise(self, stress=None, pore_pressure=None):
        """Begin with effective stresses and pore pressures, undeformed; what is out of balance is released in the first step.

        stress: (n, S) [Pa] at `points.coordinates()`, or a QuasiStatic on the same mesh with elements of the same degree and
            the same laws, of which the state is taken too; None for none
        pore_pressure: function of positions (n, D) that returns pressures (n,) [Pa], or a Seepage; None for none
        Raises InputError, on all ranks, for other shapes and values that are not finite. Collective.
        """
        set_initial_state(self, stress, pore_pressure)

    # --- steps -------------------------------------------------------------------------------------------------------

    def advance(self, dt):
        """One step of dt [s] by backward Euler. Returns a ConsolidationReport; a step that fails changes nothing. Collective."""
        agree(self.domain.comm, None if np.isfinite(dt) and dt > 0 else f"dt: got {dt!r} s, expected a positive number")
        self._take_boundary()
        end, stored = self.time + dt, self.stored_water()
        load = self.load(end) if callable(self.load) else self.load
        external = self._loads.forces(load) + self._reservoirs.forces(end)
        self._applied.set_time(end)
        self._terms.dt.value = self.points.duration = dt
        if self._projection is not None:
            self._projection.write(self._terms.projection, dt)
        report, active, iterations, reason = self._solved(external, load.displacement, end, dt)
        if reason:
            return ConsolidationReport(self.time, dt, iterations, report.residuals, reason=reason)
        self._inflow = self._step_state(dt)[1]
        self._body.accept()
        self.points.time = self.time = end
        self._external, self._active = external, active
        self._read_pressure()
        error = self.stored_water() - stored - dt * self.inflow(None)
        return ConsolidationReport(end, dt, iterations, report.residuals, error)

    def run(self, until, first_step, growth=1.2, longest=np.inf, progress=None):
        """Steps up to a time [s], each longer than the one before, as long as Newton's method takes them easily.

        first_step: [s]; growth: factor from step to step, 1 or more; longest: [s]; progress: called with each report, or None
        A step that fails is halved. Returns the list of ConsolidationReport; the run ended early where the last one has not
        converged. Raises InputError, on all ranks, for values out of range. Collective.
        """
        return run(self, until, first_step, growth, longest, progress)

    def _read_pressure(self):
        self.pressure.x.array[:] = self._unit * self._body.solution.x.array[self._pressures[1]]

    def _solved(self, external, displacement, end, dt):
        """What `solve_step` returns for the step under way."""
        fixed, heads, upper = self._applied.bounds(end)
        unit = self._weights[0] / self._unit

        def step():
            return CoupledStep(
                self._body, self._laws, external, self._external, displacement, self._owned, dt * self._gravity
            )

        bounds = fixed, unit * heads, unit * upper
        state = lambda: self._step_state(dt)
        return solve_step(step, self._body.constraints, bounds, self._active, state, self.solver)

    def _step_state(self, dt):
        """Pressures over their unit and inflows [m3/s] beside the prescribed rates, of the step under trial, both (m,). Collective."""
        body, dofs = self._body, self._pressures[1]
        internal = body.kinematics.internal_forces(self.points.trial_stress).array[dofs]
        return (body.solution.x.array + body.increment.x.array)[dofs], -internal / (self._unit * dt)

    # --- results -----------------------------------------------------------------------------------------------------

    @property
    def displacement(self):
        """Displacement as a function of its own [m]."""
        return part_of(self._body.solution, self._displacements, "displacement")

    def stress_function(self, smooth=False):
        """Effective stress [Pa] as a function that is constant in each cell, the mean of its points; smooth: averaged at nodes."""
        mean = self.points.cell_function(self.points.stress, "effective_stress", 0)
        return nodal_average(mean, self.radius) if smooth else mean

    def state_function(self):
        """State variables of the law as a function that is constant in each cell."""
        return self.points.cell_function(self.points.state, "state", 0)

    def evaluate_at(self, points):
        """Dictionary of `displacement` (n, D) [m], `pressure` (n, 1) [Pa] and effective `stress` (n, S) [Pa] at points (n, D).

        Raises InputError, on all ranks, naming a point outside the body. Collective.
        """
        return evaluate_at(
            points, displacement=self.displacement, pressure=self.pressure, stress=self.stress_function()
        )

    def stored_water(self):
        """Volume of water in the body [m3], [m2] in plane strain, at atmospheric pressure. Collective."""
        return self.domain.comm.allreduce(fem.assemble_scalar(self._terms.content))

    def inflow(self, facet_tag):
        """Water that entered through the facets of a tag in the last step [m3/s], [m2/s] in plane strain; as for `Seepage`.

        facet_tag: None for all boundary conditions together. Collective.
        """
        return self._applied.inflow(facet_tag, self._inflow)

    def reaction(self, facet_tag):
        """Force of the body, soil and water, on its support at the facets of a tag: (D,) [N], as for `QuasiStatic`. Collective."""
        self._body.increment.x.array[:] = 0.0
        forces = self._external - self._body.kinematics.internal_forces(self.points.stress).array
        facets = tagged_facets(self.domain.comm, self._facet_tags, facet_tag, "facet_tag")
        space, dofs = self._displacements
        return force_on(space, forces[dofs], facets)


def _parts(space):
    """Displacement and pressure of a mixed space, each with its dofs there."""
    return [space.sub(i).collapse() for i in (0, 1)]


def _largest_conductivity(soils):
    return max(np.linalg.eigvalsh(soil.tensor(soil.conductivity, 3)).max() for soil in soils)


def _first_mistake(element, soil, unit_weight, water_modulus):
    if not isinstance(element, Element):
        return f"element: got {element!r}, expected one of {', '.join(map(str, Element))}"
    for one in soil.values() if isinstance(soil, dict) else [soil]:
        retention = getattr(one, "retention", None)
        if retention is not None and not isinstance(retention, AlwaysSaturated):
            return f"soil: it has the retention curve {retention!r}, expected AlwaysSaturated: consolidation is of saturated soil"
    if not (np.isfinite(unit_weight) and unit_weight > 0):
        return f"unit_weight: got {unit_weight!r} N/m3, expected a positive number"
    if not water_modulus > 0:
        return f"water_modulus: got {water_modulus!r} Pa, expected a positive number, or infinity"
    return None
