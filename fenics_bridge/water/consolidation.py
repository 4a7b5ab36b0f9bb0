"""Consolidation: deformation of soil, saturated or not, and flow of its pore water, coupled."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpm_core.collective import collectively
from mpm_core.members import Member, of_members
from mpm_core.water_checks import LABORATORY_GRAVITY
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, is_finite, require_mesh
from fenics_bridge.fem.active_cells import cells_there
from fenics_bridge.fem.averaged import AveragedKinematics
from fenics_bridge.fem.equilibrium import Body
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held
from fenics_bridge.fem.kinematics import Kinematics
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.loads import Load, LoadVectors
from fenics_bridge.fem.locking import warn_of_laws
from fenics_bridge.fem.materials import Materials
from fenics_bridge.fem.quadrature import QuadraturePoints
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.fem.solver import Solver, given_solver
from fenics_bridge.fem.supports import Constraints, Support
from fenics_bridge.structures.installed import Members
from fenics_bridge.structures.unknowns import unknowns_of
from fenics_bridge.types import Laws, MeshTags, OfPosition
from fenics_bridge.views import body_text
from fenics_bridge.water.applied import AppliedBoundary
from fenics_bridge.water.boundary import Flux, WaterBoundary, listed
from fenics_bridge.water.consolidation_pace import Pace
from fenics_bridge.water.consolidation_results import ConsolidationResults
from fenics_bridge.water.consolidation_step import (
    ConsolidationReport,
    CoupledStep,
    collapsed,
    solve_step,
    warn_of_large_strains,
)
from fenics_bridge.water.construction import lonely_dofs, reconfigure
from fenics_bridge.water.coupled import (
    CoupledConstraints,
    Element,
    ReservoirLoads,
    WaterTerms,
    pressure_is_free,
)
from fenics_bridge.water.initial_state import set_initial_state
from fenics_bridge.water.motion import Motion, Newmark
from fenics_bridge.water.projection import PressureProjection
from fenics_bridge.water.seepage import Seepage
from fenics_bridge.water.soils import WATER_MODULUS, PorousSoil, given_water, soils_by_tag
from fenics_bridge.water.time_steps import run
from mpm_core import Geometry

RELEASED = 1e-9
"""Part of forces that are held, up to which they count as released"""


class Consolidation(ConsolidationResults):
    """Deformation of soil, quasi-static or with inertia, coupled with the flow of its water: displacement u, pore pressure p.

    Collective.

    Args:
        domain: mesh of the body.
        law: law of `mpm_core` for effective stresses, or laws by cell tag or name.
        soil: soil, or soils by cell tag or name; its compressibility does not count. With a retention curve it is unsaturated
            under suction. None, by cell tag, for soil without pore water, such as a fill that drains at once: its stresses are
            total ones, and its surface on other soil is a boundary of the water.
        facet_tags: tags of the boundary.
        supports: boundary conditions of the displacement, from `fixed`, `roller` and `prescribed`.
        boundary: boundary conditions of the water, as for `Seepage`; a Reservoir also presses on the soil.
        load: load, or function of the time [s] that returns one; unit weights are those of the saturated soil, pressures are
            total stresses.
        element: elements of displacement and pressure.
        nmd: average volumetric strains of the soil over nodes (nodal mixed discretisation), for `Element.STABILISED`; as the
            pore water, the soil then keeps the volume around each node instead of that of each cell. Strains and forces are
            averaged as those of particles (`QuasiStatic` with ``as_particles=True``), by half in soil that dilates little.
        cell_tags: tags of the cells; needed where laws, soils or unit weights are given by cell tag.
        geometry: as for `QuasiStatic`.
        unit_weight: unit weight of water [N/m3], under the gravity of the model; by default that of 1000 kg/m3.
        water_modulus: bulk modulus of water [Pa], may be infinite.
        solver: solver, of which tolerance and iterations count.
        options_prefix: prefix of the PETSc options of the linear solver.
        inertia: Newmark's method for steps with inertia of soil and water, which move together; soils then need a density.
            None for quasi-static steps.
        gravity: of the model [m/s2], which is that of the unit weights; conductivities are those under 9.81 m/s2.

    Raises:
        InputError: an unknown tag, cells without law or soil, or another argument out of range. Raised on all ranks alike.
    """

    def __init__(
        self,
        domain: Mesh,
        law: Laws,
        soil: PorousSoil | dict[int | str, PorousSoil | None],
        facet_tags: MeshTags,
        supports: Sequence[Support],
        boundary: Iterable[WaterBoundary],
        load: Load | Callable[[float], Load] | None = None,
        element: Element = Element.TAYLOR_HOOD,
        nmd: bool = False,
        cell_tags: MeshTags | None = None,
        geometry: Geometry | None = None,
        unit_weight: float | None = None,
        water_modulus: float = WATER_MODULUS,
        solver: Solver | None = None,
        options_prefix: str = "consolidation_",
        inertia: Newmark | None = None,
        gravity: float = LABORATORY_GRAVITY,
    ) -> None:
        require_mesh(domain, connected=True)
        agree(domain.comm, _first_mistake(element, nmd, soil, inertia))
        self.water = given_water(domain.comm, unit_weight, gravity, water_modulus, infinite=True)
        """Unit weight and modulus of the water, and the gravity of the model"""
        self.domain = domain
        """Mesh of the body"""
        self.geometry = geometry_of(domain, geometry)
        """Plane strain, axial symmetry or a solid"""
        self.time = 0.0
        """Time of the consolidation [s]"""
        self.load = load or Load()
        """The load, or a function of the time [s] that returns one; may be changed between steps, and holds at the end of one"""
        self.boundary = listed(domain.comm, boundary)
        """Boundary conditions of the water; they may be changed between steps, and hold at the end of a step"""
        self.solver = given_solver(domain.comm, solver)
        """Tolerances of the solution"""
        self.radius = radius_of(domain, self.geometry)
        """Radius of an axisymmetric body, a UFL expression; None in others"""
        self._facet_tags = facet_tags
        self._space = space = compat.displacement_pressure_space(domain, element.value)
        self._displacements, self._pressures = ((part, np.asarray(dofs)) for part, dofs in _parts(space))
        self._supports = Constraints(space.sub(0), facet_tags, supports)
        require_axis_held(space.sub(0), self.geometry, self._supports)
        self._materials, self._soils = Materials(domain, law, cell_tags), soils_by_tag(
            domain, soil, cell_tags, dry=True, gravity=gravity
        )
        self._laws = self._materials.laws(law)
        degree = max(1, 2 * (element.value - 1))
        self.points = QuadraturePoints(domain, self._laws, self._materials.number, degree, self.radius is not None)
        """Quadrature points, with effective stress and state"""
        self.cell_tags = cell_tags
        """Tags of the cells"""
        self.off: Sequence[int] = ()
        """Tags of the cells that are not there"""
        self._unit = max(one.p_wave_modulus for one in self._laws)
        self._there = cells_there(domain, cell_tags, ())
        self._wet = cells_there(domain, cell_tags, ())
        self._wet.x.array[np.setdiff1d(np.arange(len(self._wet.x.array)), np.concatenate(self._soils[2]))] = 0.0
        self._held, self._holding = 0.0, (0.0, 0.0)
        self._standing: Any = None  # nodal forces of the water that stands in the state, None before a step
        self.degree = element.value
        """Degree of the displacement"""
        self._element, self._nmd = element, nmd
        self.pressure = fem.Function(self._pressures[0], name="pore_pressure")
        """Pore pressure [Pa], a function that is linear in each cell, compression positive"""
        self._active, self._inflow = (np.zeros(len(self.pressure.x.array), dtype=kind) for kind in (bool, float))
        self.motion: Motion | None = None
        """Velocity and acceleration; None in quasi-static steps"""
        self._named_large_strains = False
        self._pace: Pace | None = None  # of the last `run`
        self._named_coarse_cells = False  # whether `run` has warned of cells that are too large for its first step
        self._options_prefix = options_prefix
        self._assemble(inertia)
        self._external = self._loads.forces(Load())
        warn_of_laws(self, "Element.TAYLOR_HOOD hardly locks")

    def __repr__(self) -> str:
        laws = map(repr, self._laws)
        return body_text("Consolidation", self.domain, f"t = {self.time:g} s", geometry=self.geometry, lines=laws)

    def _assemble(self, inertia: Newmark | None) -> None:
        """Put together what does not depend on the water's boundary conditions, then what does. Collective."""
        solution, increment = fem.Function(self._space), fem.Function(self._space)
        self._members = Members(unknowns_of(self._space, *self._displacements), self.radius is not None)
        self._body = Body(solution, increment, self.points, None, None, None, self._members)
        maps = [(part.dofmap, dofs) for part, dofs in (self._displacements, self._pressures)]
        self._owned = [dofs[: m.index_map.size_local * m.index_map_bs] for m, dofs in maps]
        # Stabilised elements take one point for all: FFCx 0.5 mixes up the radii of integrals of degree 1 and others.
        degree = 3 if self.points.degree == 2 and self.radius is not None else self.points.degree
        if inertia is not None:
            self.motion = Motion(inertia, self._displacements[0], ufl.split(increment)[0])
        self._terms = WaterTerms(
            solution,
            increment,
            self._soils[0],
            self._soils[1],
            self.water,
            self._unit,
            self.geometry,
            degree,
            self._wet,
            self.motion,
        )
        self._configure()

    def _configure(self) -> None:
        """Put together what depends on the cells that are there, on the laws and on the supports. Collective."""
        self._renew_solver()
        domain, space, whole = self.domain, self._space, not len(self.off)
        lonely, self._waterless = lonely_dofs(self)
        self._body.constraints = CoupledConstraints(
            self._supports, space, self._pressures[1], lonely, self._body.solution
        )
        self._loads = LoadVectors(
            space, self._facet_tags, self.cell_tags, test=ufl.TestFunctions(space)[0],
            active=None if whole else self._there, radius=self.radius,
        )  # fmt: skip
        self._projection = None
        if self._element == Element.STABILISED:
            self._projection = PressureProjection(
                domain, self.points, self._laws, self._soils[0], self._soils[2], self.water
            )
        unit, dry = _largest_conductivity(self._soils[0]), len(self._waterless)
        self._applied = AppliedBoundary(
            self._pressures[0], self._facet_tags, unit, self.radius, self._wet if dry else None
        )
        self._gravity = self._terms.gravity_flow(space)
        self._take_boundary(first=True)

    def _renew_solver(self) -> None:
        """Solve systems anew whose matrices may have entries at other places, as by members that come or go. Collective."""
        self._body.solver = LinearSolver(self._space, self._options_prefix, newton=True)

    def _take_boundary(self, first: bool = False) -> None:
        """Put together what depends on the water's boundary conditions, where they have changed. Collective."""
        if not (self._applied.take(self.boundary) or first):
            return
        held = any(not isinstance(condition, Flux) for condition in self.boundary)
        free = (
            not held
            and np.isinf(self.water.modulus)
            and pressure_is_free(self._space, self._supports, self.radius, self._wet)
        )
        agree(self.domain.comm, "boundary: no head, reservoir, seepage face or rain, incompressible water and supports all "
              "around; the pressure is undetermined" if free else None)  # fmt: skip
        body = self._body
        parts, further = (body.increment, self.points, body.constraints), self._terms.forms(self._applied)
        if self._nmd:
            body.kinematics = AveragedKinematics(*parts, self._laws, self.geometry, as_particles=True, further=further)
        else:
            body.kinematics = Kinematics(*parts, self.geometry, further)
        there = self._there if len(self.off) else None
        self._reservoirs = ReservoirLoads(
            self._space, self._facet_tags, self._applied, self.water.unit_weight, self.radius, there
        )

    def initialise(
        self, stress: ArrayLike | QuasiStatic | None = None, pore_pressure: OfPosition | Seepage | None = None
    ) -> None:
        """Begin with effective stresses and pore pressures, undeformed; what is out of balance is released in the first step.

        Collective.

        Args:
            stress: effective stress [Pa] at `points.coordinates()`, shape (n, S), or a QuasiStatic on the same mesh with elements
                of the same degree and the same laws, of which the state and the structural members with their forces are taken too;
                None for none. Without a QuasiStatic members have their prestress alone.
            pore_pressure: function of positions (n, D) [m] that returns pressures (n,) [Pa], or a Seepage; None for none.

        Raises:
            InputError: values of another shape or not finite, finite elements that did not converge, or that are without a
                member which is here. Raised on all ranks alike.
        """
        self._pace = None
        set_initial_state(self, stress, pore_pressure)

    def reconfigure(
        self,
        off: Sequence[int | str] | None = None,
        supports: Sequence[Support] | None = None,
        pore_pressure: OfPosition | None = None,
        stress: OfPosition | None = None,
        law: Laws | None = None,
        duration: float = 0.0,
        members: dict[str, Member] | None = None,
    ) -> None:
        """Place and remove soil or structural members, or change laws and supports, between steps. Collective.

        The steps that follow release what is then out of balance, such as the weight of soil that is placed, while the water
        flows: in equal parts per time over `duration`, or in the next step. `load` and `boundary` hold for the soil that is
        there: give the latter its new surfaces. Water that rises or falls beside the soil that comes or goes does so at once.
        With inertia only members may change.

        Args:
            off: cell tags or names of the soils that are not there from now on, as all others are; () for none, None for those that are
                not there now.
            supports: boundary conditions, as for the constructor, from where the nodes are now; None for the present ones.
            pore_pressure: function of positions (n, D) [m] that returns the pressures (n,) [Pa] with which nodes come that have
                had none; None for zero.
            stress: function of positions (n, D) [m] that returns the effective stresses (n, S) [Pa] with which soil comes; None
                for none.
            law: law, or laws by cell tag, from now on; where the law changes, its state is reset.
            duration: time over which what is out of balance is released [s].
            members: the structural members that are there from now on by name, as for `QuasiStatic.reconfigure`; {} for none, None
                for the present ones. A prestress is constant until what is out of balance has been released.

        Raises:
            InputError: an unknown tag, a value out of range, or a member outside of the soil. Raised on all ranks alike.
        """
        given = collectively(self.domain.comm, lambda: None if members is None else of_members(members))
        self._pace = None
        reconfigure(self, off, supports, pore_pressure, stress, law, duration, given)

    # --- steps -------------------------------------------------------------------------------------------------------

    def advance(self, dt: float) -> ConsolidationReport:
        """Make a step of backward Euler. Collective.

        Args:
            dt: length of the step [s].

        Returns:
            Report of the step; a step that fails changes nothing. One in which soil moves by a tenth of the body, or after
            which it has moved so far sideways, has failed: it collapses.

        Raises:
            InputError: dt is not positive, or a load or boundary condition is not possible. Raised on all ranks alike.
        """
        agree(self.domain.comm, None if is_finite(dt) and dt > 0 else f"dt is {dt!r} s, expected a positive number")
        self._take_boundary()
        end, stored = self.time + dt, self.stored_water()
        self._applied.require_values(end)
        load = self.load_at(end)
        external = self._external_at(end)
        self._applied.set_time(end, dt)
        self._terms.dt.value = self.points.duration = dt
        if self._projection is not None:
            self._projection.write(self._terms.projection, dt, None if self.motion is None else self.motion.method.beta)
        if self.motion is not None:
            self.motion.begin(dt)
        report, active, iterations, reason = self._solved(external, load.displacement, end, dt, stored)
        if self.motion is None and not reason:
            step, before = (
                function.x.array[self._displacements[1]] for function in (self._body.increment, self._body.solution)
            )
            reason = collapsed(step, before, self.domain)
        if reason:
            return ConsolidationReport(self.time, dt, iterations, report.residuals, reason=reason)
        self._inflow = self._step_state(dt)[1]
        if self.motion is not None:
            self.motion.accept(self._body.increment.x.array[self._displacements[1]], dt)
        self._body.accept()
        self.points.time = self.time = end
        if self._held_part(end) == 0:
            self._members.lock_off()
        self._external, self._active = external, active
        self._standing = self._reservoirs.forces(end)
        self._read_pressure()
        if self.motion is None and not self._named_large_strains:
            moved = self._body.solution.x.array[self._displacements[1]]
            self._named_large_strains = warn_of_large_strains(moved, self.domain)
        error = self.stored_water() - stored - dt * self.inflow(None)
        return ConsolidationReport(end, dt, iterations, report.residuals, error)

    def run(
        self,
        until: float,
        first_step: float,
        growth: float = 1.2,
        longest: float = np.inf,
        progress: Callable[[ConsolidationReport], Any] | None = None,
        accuracy: float | None = None,
    ) -> list[ConsolidationReport]:
        """Make steps up to a time, each longer than the one before while Newton's method converges quickly. Collective.

        A step that fails is halved. Warns once of cells at a drained boundary that are larger than sqrt(c_v first_step), with
        c_v = k M / gamma_w, where a load or head changes: settlements in the first steps are then too large.

        Args:
            until: time at the end [s].
            first_step: length of the first step [s].
            growth: factor from step to step, 1 or more [-].
            longest: length of the longest step [s].
            progress: function that is called with each report.
            accuracy: estimated error of the displacements by the length of the steps, over the largest displacement [-], up to which steps
                grow, and beyond which they become shorter, down to the first one; None for steps of any length. A run goes on with the
                estimate of the one before, unless the model was changed or its first step is shorter than the last one there.

        Returns:
            Reports of all steps; the run ended early where the last one has not converged.

        Raises:
            InputError: an argument out of range. Raised on all ranks alike.
        """
        return run(self, until, first_step, growth, longest, progress, accuracy)

    def load_at(self, time: float) -> Load:
        """The load at a time [s]."""
        return self.load(time) if callable(self.load) else self.load

    def _external_at(self, time: float) -> Any:
        """Nodal forces at a time [s]: of loads, standing water, and what `reconfigure` holds. Collective."""
        held = self._held_part(time) * self._held
        return self._loads.forces(self.load_at(time)) + self._reservoirs.forces(time) + held

    def _held_part(self, time: float) -> float:
        """Part of what `reconfigure` holds that has not been released at a time [s]; 0 but for round-off counts as 0."""
        start, duration = self._holding
        part = 1 - (time - start) / duration if duration > 0 else 0.0
        return part if part > RELEASED else 0.0

    def _read_pressure(self) -> None:
        self.pressure.x.array[:] = self._unit * self._body.solution.x.array[self._pressures[1]]

    def _solved(self, external: Any, displacement: Any, end: Any, dt: float, stored: float) -> Any:
        """What `solve_step` returns for the step under way."""
        fixed, heads, upper = self._applied.bounds(end)
        fixed[self._waterless], heads[self._waterless] = True, 0.0
        unit = self.water.unit_weight / self._unit

        def step() -> Any:
            return CoupledStep(
                self._body, self._laws, external, self._external, displacement, self._owned, dt * self._gravity,
                self._unit * stored,
            )  # fmt: skip

        bounds = fixed, unit * heads, unit * upper
        state = lambda: self._step_state(dt)
        return solve_step(step, self._body.constraints, bounds, self._active, state, self.solver)

    def _step_state(self, dt: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Pressures and inflows of the step under trial. Collective.

        Returns:
            Pressures over their unit [-], and inflows beside the prescribed rates [m3/s], both of shape (m,).
        """
        body, dofs = self._body, self._pressures[1]
        internal = body.kinematics.internal_forces(self.points.trial_stress).array[dofs]
        return (body.solution.x.array + body.increment.x.array)[dofs], -internal / (self._unit * dt)


def _parts(space: Any) -> Any:
    """Displacement and pressure of a mixed space, each with its dofs there."""
    return [space.sub(i).collapse() for i in (0, 1)]


def _largest_conductivity(soils: Any) -> float:
    return max(np.linalg.eigvalsh(soil.tensor(soil.conductivity, 3)).max() for soil in soils)


def _first_mistake(element: Any, nmd: bool, soil: Any, inertia: Any) -> str | None:
    if not isinstance(element, Element):
        return f"element is {element!r}, expected one of {', '.join(map(str, Element))}"
    if nmd and element != Element.STABILISED:
        return f"nmd is True, expected False with element={element}: it averages strains of linear elements, Element.STABILISED"
    for one in soil.values() if isinstance(soil, dict) else [soil]:
        if inertia is not None and getattr(one, "density", None) is None:
            return f"soil: {one!r} has no density, expected one for steps with inertia"
    if not isinstance(inertia, (Newmark, type(None))):
        return f"inertia is {inertia!r}, expected a Newmark, or None"
    return None
