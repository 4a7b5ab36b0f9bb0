"""Elasto-plastic, quasi-static finite elements with the laws of the particles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.active_cells import reconfigure
from fenics_bridge.fem.averaged import AveragedKinematics
from fenics_bridge.fem.equilibration import Solver, find_equilibrium
from fenics_bridge.fem.equilibrium import Body
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.failure import explained
from fenics_bridge.fem.fields import force_on, nodal_average
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held
from fenics_bridge.fem.kinematics import Kinematics
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.load_steps import raise_load
from fenics_bridge.fem.loads import Load, LoadVectors
from fenics_bridge.fem.materials import Materials
from fenics_bridge.fem.parameters import set_parameter
from fenics_bridge.fem.quadrature import QuadraturePoints
from fenics_bridge.fem.supports import Constraints, tagged_facets
from fenics_bridge.mesh.names import known_tags


class QuasiStatic:
    """Small-strain equilibrium of a body of one or several materials, plane strain or 3D, loaded in stages.

    displacement: function [m], total; load: the Load in equilibrium; law: the law, or laws, in force
    points: QuadraturePoints with stress and state; converged: whether the last call reached its load
    Every stage starts from the equilibrium before it; a step that fails does not change that equilibrium.
    """

    def __init__(
        self,
        domain,
        law,
        facet_tags,
        supports,
        degree=2,
        nmd=False,
        options_prefix="fem_",
        cell_tags=None,
        solver=None,
        geometry=None,
    ):
        """
        law: of `mpm_core`, or {cell tag: law}; facet_tags, supports: as for `solve_elastic`
        degree: 1 or 2 of the displacement
        nmd: average volumetric strains over nodes (nodal mixed discretisation), for degree 1
        options_prefix: of the PETSc options of the linear solver
        cell_tags: of the domain; needed where laws or unit weights are given by cell tag
        solver: the Solver, with tolerances; by default `Solver()`, and `PRACTICE` is the usual level of practice
        geometry: Geometry.AXISYMMETRIC for the half section of an axisymmetric body, whose nodes on the axis need a roller
        Raises InputError, on all ranks, for bad arguments. Collective.
        """
        self.geometry = geometry_of(domain, geometry)
        self.radius = radius_of(domain, self.geometry)
        agree(domain.comm, None if degree in (1, 2) else f"degree: got {degree!r}, expected 1 or 2")
        agree(domain.comm, f"nmd: averages strains of degree=1, got degree={degree}" if nmd and degree != 1 else None)
        space = compat.function_space(domain, "Lagrange", degree, domain.geometry.dim)
        self.domain, self.law, self.facet_tags, self.degree = domain, law, facet_tags, degree
        self.displacement = fem.Function(space, name="displacement")
        self.increment = fem.Function(space, name="increment")
        self.cell_tags, self.supports, self.off = cell_tags, tuple(supports), ()
        self._nmd, self._options_prefix = nmd, options_prefix
        constraints = Constraints(space, facet_tags, supports)
        self._loads = LoadVectors(space, facet_tags, cell_tags, radius=self.radius)
        self._materials = Materials(domain, law, cell_tags)
        quadrature = max(1, 2 * (degree - 1))
        axisymmetric = self.radius is not None
        self.points = QuadraturePoints(domain, self.laws, self._materials.number, quadrature, axisymmetric)
        self.load, self.converged, self.solver = Load(), False, solver or Solver()
        self._assemble(constraints)

    def _assemble(self, constraints):
        """The Body that a step changes, with the present points and the given constraints. Collective."""
        require_axis_held(self.displacement.function_space, self.geometry, constraints)
        kinematics: type = AveragedKinematics if self._nmd else Kinematics
        self._kinematics = kinematics(self.increment, self.points, constraints, self.geometry)
        linear = LinearSolver(self.displacement.function_space, self._options_prefix, newton=True)
        self._body = Body(self.displacement, self.increment, self.points, self._kinematics, constraints, linear)

    def reconfigure(self, off=(), supports=None, pore_pressure=None, stress=None, law=None):
        """Change soils, laws, supports or pore pressures; `solve` then releases the resulting out-of-balance forces.

        For stages, see `Stage`: cells of the soils in `off` carry no stress, stiffness or weight; cells that become
        active start without stress and state, or with the given stress. Afterwards `load.held` is 1, and the body is
        in equilibrium; `solve` to a load with `held` 0, as every new Load has, releases the forces in steps.

        off: cell tags or names; supports: as for the constructor, None for the present ones, where they are now
        pore_pressure: function of positions (n, D) that returns pore pressures (n,) [Pa], or None for none
        stress: function of positions that returns stresses (n, S) [Pa] of the cells that become active
        law: law, or laws by cell tag, from now on; where the law changes, its state is reset
        Collective.
        """
        reconfigure(self, off, supports, pore_pressure, stress, law)

    @property
    def laws(self):
        """The laws in force as a list, in the order in which they were given. Collective."""
        return self._materials.laws(self.law)

    @property
    def soils(self):
        """The cell tags that the laws are given for, in the order of `laws`; (None,) for one law of the whole body."""
        return self._materials.tags

    def law_by_tag(self):
        """The laws in force as {cell tag: law}; where one law holds for the whole body, for each tag of its cells. Collective."""
        laws, tags = self.laws, self.soils
        if tags == (None,):
            tags = tuple(known_tags(self.domain.comm, self.cell_tags))
            laws = laws * len(tags)
        return dict(zip(tags, laws))

    @property
    def linear_iterations(self):
        """Krylov iterations of each linear system so far, a list; a direct solver takes one."""
        return self._body.solver.iterations

    def set_initial_stress(self, stress, load):
        """Start from a given stress (n, S) [Pa] at `points.coordinates()`, meant for the given load, undeformed.

        Call `equilibrate(load)` afterwards, which moves the body by the out-of-balance part of the stress.
        """
        shape = self.points.stress.shape
        good = np.shape(stress) == shape and np.all(np.isfinite(stress))
        agree(self.domain.comm, None if good else f"stress: got shape {np.shape(stress)}, expected finite {shape}")
        self.points.stress[:] = stress
        self.points.reset_state(self.laws)
        self.displacement.x.array[:] = 0.0
        self.load = load

    def set_parameter(self, name, values):
        """Give the points their values of a law's parameter that varies, in all laws that are `Heterogeneous` in it.

        name: such as "cohesion"; values: a number, (n,) at `points.coordinates()`, a function of positions (n, D) that
        returns (n,), e.g. `mpm_core.RandomField`, or {cell tag or name: number}
        Where the law of a point changes, the point keeps its values. They go to the particles at the
        hand-over. Raises InputError, on all ranks, for a parameter that varies in no law or values out of its range.
        Collective.
        """
        set_parameter(self, name, values)

    def reset_displacement(self):
        """Reset displacements to zero; the stress stays."""
        self.displacement.x.array[:] = 0.0
        self._body.constraints.origin[:] = 0.0
        self.load = replace(self.load, displacement=0.0)

    def equilibrate(self, load, law=None, duration=np.inf, **options):
        """Find the equilibrium under a load, with a law (or laws by cell tag), in one step. Returns EquilibriumReport.

        Newton's method is tried first. If it does not converge, the body relaxes with a viscosity until it rests or
        flows (`relaxation`).
        duration: of the step [s], for laws that depend on rate; by default infinitely slow
        Without equilibrium nothing changes. options: of `Solver`, in place of those of `solver`. Collective.
        """
        law = law or self.law
        forces = self._loads.forces(load), self._loads.forces(self.load)
        solver = replace(self.solver, **options)
        self.points.duration = duration
        report = find_equilibrium(self._body, self._materials.laws(law), *forces, load.displacement, solver)
        self.points.duration = np.inf
        self.converged = report.converged
        if report.converged:
            self.points.time += duration if np.isfinite(duration) else 0.0
            self.load, self.law = self._loads.resolved(load), law
            return report
        return replace(report, reason=explained(self, report.reason, load))

    def solve(self, load, first_step=0.25, tolerance=1e-3, progress=None):
        """Raise the load from the present one to the given one, in steps that adapt. Returns a list of LoadStep.

        first_step: fraction of the way [-]; tolerance, progress: as for `advance`, e.g. progress=print_step
        `converged` says whether the load was reached; if not, `load` is the last one in equilibrium. Collective.
        """
        return raise_load(self, self._loads.resolved(load), first_step, tolerance, progress)

    def reaction(self, facet_tag):
        """Force of the body on its support at the facets of a tag, summed over them: (D,) [N] ([N/m] in plane strain, [N] per radian in
        an axisymmetric body).

        Collective.
        """
        out_of_balance = self._loads.forces(self.load) - self._kinematics.internal_forces(self.points.stress).array
        facets = tagged_facets(self.domain.comm, self.facet_tags, facet_tag, "facet_tag")
        return force_on(self.displacement.function_space, out_of_balance, facets)

    def stress_function(self, smooth=False):
        """Stress [Pa] as a function that is constant in each cell: the mean of its points.

        smooth: linear in each cell, through its points (degree 2), or averaged at the nodes (degree 1). Collective.
        """
        if smooth and self.degree == 2:
            return self.points.cell_function(self.points.stress, "stress", 1)
        mean = self.points.cell_function(self.points.stress, "stress", 0)
        return nodal_average(mean, self.radius) if smooth else mean

    def state_function(self):
        """State variables of the law as a function that is constant in each cell."""
        return self.points.cell_function(self.points.state, "state", 0)

    def deviatoric_strain_function(self):
        """Accumulated deviatoric strain [-], as the particles have it, as a function that is constant in each cell."""
        return self.points.cell_function(self.points.deviatoric_strain, "deviatoric_strain", 0)

    def material_function(self):
        """Position in `laws` of the law of each cell, as a function that is constant in each cell."""
        return self.points.cell_function(np.repeat(self.points.material, self.points.per_cell), "material", 0)

    def evaluate_at(self, points, smooth=False):
        """Dictionary of `displacement` (n, D) [m], `stress` (n, S) [Pa], `state` (n, n_state) at points on any rank.

        The cells' mean stress is admissible; the one with `smooth`, as for `stress_function`, may exceed the strength.
        Raises InputError, on all ranks, naming a point outside the body. Collective.
        """
        return evaluate_at(
            points, displacement=self.displacement, stress=self.stress_function(smooth), state=self.state_function()
        )
