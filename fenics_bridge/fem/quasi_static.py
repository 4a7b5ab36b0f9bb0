"""Elasto-plastic, quasi-static finite elements with the laws of the particles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpm_core.checks import within
from mpm_core.collective import collectively
from mpm_core.members import Member, of_members
from mpm_core.parameter_fields import Field
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, require_mesh
from fenics_bridge.fem.active_cells import reconfigure
from fenics_bridge.fem.averaged import AveragedKinematics
from fenics_bridge.fem.equilibration import EquilibriumReport, find_equilibrium
from fenics_bridge.fem.equilibrium import Body
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.failure import explained, warn_of_motion
from fenics_bridge.fem.fields import SupportedBody, nodal_average
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held
from fenics_bridge.fem.kinematics import Kinematics
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.load_steps import LoadStep, raise_load
from fenics_bridge.fem.loads import Load, LoadVectors, warn_of_weight
from fenics_bridge.fem.locking import warn_of_laws
from fenics_bridge.fem.materials import Materials
from fenics_bridge.fem.parameters import set_parameter
from fenics_bridge.fem.point_functions import PointFunctions
from fenics_bridge.fem.pore_water import PrescribedWater, WetBody, water_on_supports
from fenics_bridge.fem.quadrature import QuadraturePoints
from fenics_bridge.fem.solver import Solver, given_solver
from fenics_bridge.fem.supports import Constraints, Support
from fenics_bridge.mesh.names import known_tags
from fenics_bridge.structures.installed import Members
from fenics_bridge.structures.reinforced import ReinforcedBody
from fenics_bridge.structures.unknowns import unknowns_of
from fenics_bridge.types import Law, Laws, MeshTags, OfPosition
from fenics_bridge.views import body_text, law_lines
from mpm_core import Geometry


class QuasiStatic(ReinforcedBody, WetBody, SupportedBody, PointFunctions):
    """Small-strain equilibrium of a body of one or several materials, plane strain, axisymmetric or 3D, loaded in stages.

    Every stage starts from the equilibrium before it; a step that fails does not change that equilibrium. Collective.

    Args:
        domain: mesh of the body.
        law: law of `mpm_core`, or laws by cell tag or name.
        facet_tags: tags of the boundary.
        supports: boundary conditions from `fixed`, `roller` and `prescribed`; enough of them to prevent rigid-body motion.
        degree: degree of the displacement: 1, 2 or, for triangles, 4. Collapse loads by triangles of degree 4 are the most
            accurate for their number of nodes, above all of undrained and axisymmetric bodies (Sloan and Randolph 1982, IJNAMG
            6, 47-76).
        nmd: average volumetric strains over nodes (nodal mixed discretisation), for degree 1; see `averaged`.
        options_prefix: prefix of the PETSc options of the linear solver.
        cell_tags: tags of the cells; needed where laws or unit weights are given by cell tag.
        solver: tolerances; by default `Solver()`, and `PRACTICE` is the usual level of practice.
        as_particles: average strains and forces as explicit steps of particles do, in frictional soil by half, for a hand-over.
        geometry: Geometry.AXISYMMETRIC for the half section of an axisymmetric body, whose nodes on the axis need a roller; by
            default plane strain in two dimensions.

    Raises:
        InputError: an unknown tag, cells without a law, or another argument out of range. Raised on all ranks alike.
    """

    def __init__(
        self,
        domain: Mesh,
        law: Laws,
        facet_tags: MeshTags,
        supports: Sequence[Support],
        degree: int = 2,
        nmd: bool = False,
        options_prefix: str = "fem_",
        cell_tags: MeshTags | None = None,
        solver: Solver | None = None,
        geometry: Geometry | None = None,
        as_particles: bool = False,
    ) -> None:
        require_mesh(domain, connected=True)
        self.geometry = geometry_of(domain, geometry)
        """Plane strain, axial symmetry or a solid"""
        self.radius = radius_of(domain, self.geometry)
        """Radius of an axisymmetric body, a UFL expression; None in others"""
        known = (1, 2) if domain.geometry.dim == 3 else (1, 2, 4)
        agree(domain.comm, None if degree in known else f"degree is {degree!r}, expected one of {known}")
        agree(
            domain.comm,
            f"nmd is True, expected False with degree={degree}: it averages strains of linear elements"
            if nmd and degree != 1
            else None,
        )
        space = compat.function_space(domain, "Lagrange", degree, domain.geometry.dim)
        self.domain = domain
        """Mesh of the body"""
        self.law = law
        """The law, or laws by cell tag, in force"""
        self.facet_tags = facet_tags
        """Tags of the boundary"""
        self.degree = degree
        """Degree of the displacement"""
        self.displacement = fem.Function(space, name="displacement")
        """Total displacement [m]"""
        self.increment = fem.Function(space, name="increment")
        """Displacement of the last step [m]"""
        self.cell_tags = cell_tags
        """Tags of the cells"""
        self.off: Sequence[int] = ()
        """Tags of the cells that are inactive"""
        agree(
            domain.comm, "as_particles is True, expected False without nmd=True" if as_particles and not nmd else None
        )
        self._nmd, self._as_particles, self._options_prefix = nmd, as_particles, options_prefix
        constraints = Constraints(space, facet_tags, supports)
        self.supports: tuple[Support, ...] = tuple(supports)
        """The boundary conditions in force"""
        self._loads = LoadVectors(space, facet_tags, cell_tags, radius=self.radius)
        self._water: PrescribedWater | None = None
        self._members = Members(unknowns_of(space), self.radius is not None)
        self._materials = Materials(domain, law, cell_tags)
        quadrature = max(1, 2 * (degree - 1))
        axisymmetric = self.radius is not None
        self.points = QuadraturePoints(domain, self.laws, self._materials.number, quadrature, axisymmetric)
        """Quadrature points, with stress and state"""
        self.load = Load()
        """The load in equilibrium"""
        self.converged = False
        """Whether the last call reached its load"""
        self.solver = given_solver(domain.comm, solver)
        """Tolerances of the solution"""
        self._assemble(constraints)
        warn_of_laws(self)

    def __repr__(self) -> str:
        return body_text(
            "QuasiStatic", self.domain, f"displacement of degree {self.degree}", repr(self.load),
            "in equilibrium" if self.converged else "not in equilibrium", geometry=self.geometry, lines=law_lines(self.law),
        )  # fmt: skip

    def _assemble(self, constraints: Constraints, reinforced: bool = False) -> None:
        """The Body that a step changes, with the given constraints; reinforced: whether it has members. Collective."""
        space = self.displacement.function_space
        require_axis_held(space, self.geometry, constraints)
        parts = self.increment, self.points, constraints
        linear = LinearSolver(space, self._options_prefix, newton=True, averaged=self._nmd, reinforced=reinforced)
        self._kinematics: Any = (
            AveragedKinematics(*parts, self.laws, self.geometry, self._as_particles, linear.direct)
            if self._nmd
            else Kinematics(*parts, self.geometry)
        )
        operators = self._kinematics, constraints, linear, self._members
        self._body = Body(self.displacement, self.increment, self.points, *operators)

    def reconfigure(
        self,
        off: Sequence[int | str] | None = None,
        supports: Sequence[Support] | None = None,
        pore_pressure: OfPosition | None = None,
        stress: OfPosition | NDArray[np.float64] | None = None,
        law: Laws | None = None,
        members: dict[str, Member] | None = None,
    ) -> None:
        """Change soils, laws, supports, members or pore pressures; `solve` then releases the resulting out-of-balance forces.

        Collective.

        What is not given stays as it is. For stages, see `Stage`: cells of the soils in `off` carry no stress, stiffness or
        weight; cells that become active start without stress and state, or with the given stress. Afterwards `load.held` is 1,
        and the body is in equilibrium; `solve` to a load with `held` 0, as every new Load has, releases the forces in steps.

        Args:
            off: cell tags or names of the soils that are not there; () for none, None for those that are not there now.
            supports: boundary conditions, as for the constructor; None for the present ones, where they are now.
            pore_pressure: function of positions (n, D) [m] that returns pore pressures (n,) [Pa], zero where there is no water; None
                for the present ones.
            stress: function of positions (n, D) [m] that returns the stresses (n, S) [Pa] of the cells that become active, or an array (n, S) at
                `points.coordinates()`, of which they take theirs.
            law: law, or laws by cell tag, from now on; where the law changes, its state is reset.
            members: the structural members that are there from now on by name, from `mpm_core.bar`, `strut` and `beam`; {} for
                none, None for the present ones. A new one is installed without strain, as the soil is deformed now, and with its
                prestress, which is constant until the out-of-balance forces are released.

        Raises:
            InputError: an unknown tag, values of another shape or not finite, or a member outside of the soil. Raised on all ranks
                alike.
        """
        given = collectively(self.domain.comm, lambda: None if members is None else of_members(members))
        reconfigure(self, off, supports, pore_pressure, stress, law, given)

    @property
    def laws(self) -> list[Law]:
        """The laws in force, in the order in which they were given. Collective."""
        return self._materials.laws(self.law)

    @property
    def soils(self) -> tuple[int | None, ...]:
        """The cell tags that the laws are given for, in the order of `laws`; (None,) for one law of the whole body."""
        return self._materials.tags

    def law_by_tag(self) -> dict[Any, Law]:
        """The laws in force by cell tag; where one law holds for the whole body, it is given for each tag of its cells.

        Collective.
        """
        laws, tags = self.laws, self.soils
        if tags == (None,):
            tags = tuple(known_tags(self.domain.comm, self.cell_tags))
            laws = laws * len(tags)
        return dict(zip(tags, laws))

    def give_laws_by_tag(self) -> None:
        """Make one law for the whole body the law of each cell tag, so that a stage may change that of one soil. Collective.

        Raises:
            InputError: cells without a tag. Raised on all ranks alike.
        """
        if self.soils == (None,):
            self.law = self.law_by_tag()
            self._materials = Materials(self.domain, self.law, self.cell_tags)

    @property
    def linear_iterations(self) -> list[int]:
        """Krylov iterations of each linear system so far; a direct solver takes one."""
        return self._body.solver.iterations

    def set_initial_stress(self, stress: ArrayLike, load: Load) -> None:
        """Start from a given stress, meant for the given load, undeformed, members with their prestress alone. Collective.

        Call `equilibrate(load)` afterwards, which moves the body by the out-of-balance part of the stress.

        Args:
            stress: stress [Pa] at `points.coordinates()`, shape (n, S), tension positive.
            load: load that the stress is meant for.

        Raises:
            InputError: stress has another shape or a value that is not finite. Raised on all ranks alike.
        """
        shape = self.points.stress.shape
        good = np.shape(stress) == shape and np.all(np.isfinite(stress))
        agree(self.domain.comm, None if good else f"stress has shape {np.shape(stress)}, expected finite {shape}")
        self.points.stress[:] = stress
        self.points.reset_state(self.laws)
        self.displacement.x.array[:] = 0.0
        self._members.reset()
        self.load = load

    def set_parameter(self, name: str, values: Field | dict[int | str, float]) -> None:
        """Give the points their values of a law's parameter that varies, in laws `Heterogeneous` in it; see `mpm.Model.set_parameter`. Collective.

        Where the law of a point changes, the point keeps its values. They go to the particles at the hand-over.

        Args:
            name: name of the parameter, such as "cohesion".
            values: a number, an array (n,) at `points.coordinates()`, a function of positions (n, D) [m] that returns (n,), e.g.
                `mpm_core.RandomField`, or numbers by cell tag or name; in the unit of the parameter.

        Raises:
            InputError: a parameter that varies in no law, or values out of its range. Raised on all ranks alike.
        """
        set_parameter(self, name, values)

    def reset_displacement(self) -> None:
        """Reset displacements to zero; the stress stays."""
        self.displacement.x.array[:] = 0.0
        self._body.constraints.origin[:] = 0.0
        self._members.reset_displacement()
        self.load = replace(self.load, displacement=0.0)

    def equilibrate(
        self, load: Load, law: Laws | None = None, duration: float = np.inf, **options: Any
    ) -> EquilibriumReport:
        """Find the equilibrium under a load, with a law or laws, in one step; without equilibrium nothing changes. Collective.

        Newton's method is tried first. If it does not converge, the body relaxes with a viscosity until it rests or
        flows (`relaxation`).

        Args:
            load: load at the end of the step.
            law: law, or laws by cell tag, from now on; by default those in force.
            duration: duration of the step [s], for laws that depend on rate; by default infinitely slow.
            **options: attributes of `Solver`, in place of those of `solver`.

        Returns:
            Report of the solution.

        Raises:
            InputError: a load, laws or a duration that are not possible, or an unknown tag. Raised on all ranks alike.
        """
        law = law or self.law
        duration = collectively(self.domain.comm, lambda: within("duration", duration, 0, np.inf))
        self._loads.require_acting(load, self.load)
        forces = self._loads.forces(load), self._loads.forces(self.load)
        solver = replace(self.solver, **options)
        self.points.duration = duration
        laws = self._materials.laws(law)
        self._follow(laws)
        report = find_equilibrium(self._body, laws, *forces, load.displacement, solver)
        self.points.duration = np.inf
        self.converged = report.converged
        if report.converged:
            self.points.time += duration if np.isfinite(duration) else 0.0
            self.load, self.law = self._loads.resolved(load), law
            if load.held == 0:
                self._members.lock_off()
            return report
        self._follow(self.laws)
        return replace(report, reason=explained(self, report.reason, load), cause=report.reason)

    def _follow(self, laws: Sequence[Any]) -> Any:
        """Let averaged forces follow the laws. Collective."""
        if self._nmd:
            self._kinematics.follow(laws)

    def solve(
        self,
        load: Load,
        first_step: float | None = None,
        tolerance: float = 1e-3,
        progress: Callable[[LoadStep], Any] | None = None,
    ) -> list[LoadStep]:
        """Raise the load from the present one to the given one, in steps that adapt. Collective.

        Two easy steps in a row double the step, a step without equilibrium halves it.

        Args:
            load: load at the end.
            first_step: first step as a fraction of the way [-]; by default 0.25, and 0.05 where soil has a small-strain stiffness.
            tolerance: fraction of the way below which steps end [-].
            progress: function that is called with each load step, e.g. `print_step`.

        Returns:
            All steps. `converged` says whether the load was reached; if not, there is a warning, and `load` is the last one in
            equilibrium.

        Raises:
            InputError: an unknown tag, or a load that is not finite. Raised on all ranks alike.
        """
        load = self._loads.resolved(load)
        warn_of_weight(self.domain.comm, load, self.cell_tags)
        steps = raise_load(self, load, first_step, tolerance, progress)
        warn_of_motion(self)
        return steps

    def _internal_forces(self) -> NDArray[np.float64]:
        """Nodal forces of the present stresses, and of the members. Collective."""
        self._members.back()
        return self._body.internal_forces(self.points.stress).array

    def _nodal_reactions(self) -> tuple[Any, NDArray[np.float64], MeshTags, Sequence[Support]]:
        # Forces that hold the body since a stage include the reactions from before it.
        out_of_balance = self._loads.forces(replace(self.load, held=0.0)) - self._internal_forces()
        return self.displacement.function_space, out_of_balance, self.facet_tags, self.supports

    def reaction(self, facet_tag: int | str) -> NDArray[np.float64]:
        """Force of the soil and its pore water on the support at the facets of a tag, (D,) [N], [N/m] in plane strain. Collective.

        See `SupportedBody.reaction`; the water acts in the components that are held.
        """
        return super().reaction(facet_tag) + water_on_supports(self, facet_tag)

    def stress_function(self, smooth: bool = False) -> fem.Function:
        """The stress as a function. Collective.

        Args:
            smooth: linear in each cell, through or near its points, or averaged over the active cells at the nodes (degree 1).

        Returns:
            Stress [Pa], constant in each cell, the mean of its points, unless `smooth`.
        """
        if smooth and self.degree > 1:
            return self.points.cell_function(self.points.stress, "stress", 1)
        mean = self.points.cell_function(self.points.stress, "stress", 0)
        return nodal_average(mean, self.radius, self._loads.active) if smooth else mean

    def evaluate_at(self, points: ArrayLike, smooth: bool = False) -> dict[str, NDArray[np.float64]]:
        """Values at points; the points and their cells may be on different ranks. Collective.

        The cells' mean stress is admissible; the smooth one may exceed the strength. On the border of soil that has been removed
        the values are those of the soil that is there.

        Args:
            points: positions [m], shape (n, D).
            smooth: as for `stress_function`.

        Returns:
            `displacement` [m], shape (n, D), `stress` [Pa], shape (n, S), and `state`, shape (n, n_state).

        Raises:
            InputError: a point is outside the body; the message names it. Raised on all ranks alike.
        """
        values = {"stress": self.stress_function(smooth), "state": self.state_function()}
        return evaluate_at(points, self._loads.active, displacement=self.displacement, **values)
