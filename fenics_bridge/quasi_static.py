"""Elasto-plastic, quasi-static finite elements with the laws of the particles."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.averaged import AveragedKinematics
from fenics_bridge.errors import agree
from fenics_bridge.evaluate import evaluate_at
from fenics_bridge.fields import nodal_average
from fenics_bridge.kinematics import Kinematics
from fenics_bridge.linear_solver import LinearSolver
from fenics_bridge.load_steps import advance
from fenics_bridge.loads import Load, LoadVectors
from fenics_bridge.newton import newton
from fenics_bridge.quadrature import QuadraturePoints
from fenics_bridge.supports import Constraints


class QuasiStatic:
    """Small-strain equilibrium of a body of one material, plane strain or 3D, loaded in stages.

    displacement: function [m], total; load: the Load in equilibrium; law: the law in force
    points: QuadraturePoints with stress and state; converged: whether the last call reached its goal
    Every stage starts from the equilibrium before it; a step that fails leaves that equilibrium untouched.
    """

    def __init__(self, domain, law, facet_tags, supports, degree=2, nmd=False, options_prefix="fem_"):
        """
        law: of `mpm_core`; facet_tags, supports: as for `solve_elastic`; degree: 1 or 2 of the displacement
        nmd: average volumetric strains over nodes (nodal mixed discretisation), for degree 1
        options_prefix: of the PETSc options of the linear solver
        Raises InputError, on all ranks, for bad arguments. Collective.
        """
        agree(domain.comm, None if degree in (1, 2) else f"degree: got {degree!r}, expected 1 or 2")
        agree(domain.comm, f"nmd: averages strains of degree=1, got degree={degree}" if nmd and degree != 1 else None)
        space = compat.function_space(domain, "Lagrange", degree, domain.geometry.dim)
        self.domain, self.law, self.facet_tags, self.degree = domain, law, facet_tags, degree
        self.displacement = fem.Function(space, name="displacement")
        self.increment = fem.Function(space, name="increment")
        self._constraints = Constraints(space, facet_tags, supports)
        self._loads = LoadVectors(space, facet_tags)
        self.points = QuadraturePoints(domain, law.n_state, max(1, 2 * (degree - 1)))
        self.points.reset_state(law)
        self.load, self.converged = Load(), False
        self._kinematics = (AveragedKinematics if nmd else Kinematics)(self.increment, self.points, self._constraints)
        self._solver = LinearSolver(space, options_prefix)

    def set_initial_stress(self, stress, load):
        """Start from a given stress (n, S) [Pa] at `points.coordinates()`, meant for the given load, undeformed.

        Follow it by `equilibrate(load)`, which moves the body as far as the stress is out of balance.
        """
        shape = self.points.stress.shape
        good = np.shape(stress) == shape and np.all(np.isfinite(stress))
        agree(self.domain.comm, None if good else f"stress: got shape {np.shape(stress)}, expected finite {shape}")
        self.points.stress[:] = stress
        self.points.reset_state(self.law)
        self.displacement.x.array[:] = 0.0
        self.load = load

    def reset_displacement(self):
        """Count displacements from here on (the stress stays)."""
        self.displacement.x.array[:] = 0.0
        self.load = Load(self.load.unit_weight, self.load.pressure, 0.0)

    def equilibrate(self, load, law=None, **newton_options):
        """Go to the equilibrium under a load, with a law, in one step. Returns the NewtonReport.

        When it does not converge everything is left as it was. newton_options: as for `newton`. Collective.
        """
        law = law or self.law
        report = newton(_Step(self, load, law), **newton_options)
        self.converged = report.converged
        if report.converged:
            self.points.accept()
            self.displacement.x.array[:] += self.increment.x.array
            self.load, self.law = load, law
        return report

    def solve(self, load, first_step=0.25, tolerance=1e-3, progress=None):
        """Raise the load from the present one to the given one, in steps that adapt. Returns a list of LoadStep.

        first_step: share of the way [-]; tolerance, progress: as for `advance`, e.g. progress=print_step
        `converged` tells whether the load was reached; if not, `load` is the last one in equilibrium. Collective.
        """
        start = self.load
        steps = advance(
            lambda share: self.equilibrate(start.towards(load, share)), 0.0, 1.0, first_step, tolerance, progress
        )
        self.converged = bool(steps) and steps[-1].converged and steps[-1].value == 1.0
        return steps

    def reaction(self, facet_tag):
        """Force of the body on its support at the facets of a tag, summed over them: (D,) [N] ([N/m] in 2D).

        Collective.
        """
        space, dim = self.displacement.function_space, self.domain.geometry.dim
        out_of_balance = self._loads.forces(self.load) - self._kinematics.internal_forces(self.points.stress).array
        facets = self.facet_tags.indices[self.facet_tags.values == facet_tag]
        nodes = fem.locate_dofs_topological(space, dim - 1, facets)
        mine = nodes[nodes < space.dofmap.index_map.size_local]
        return self.domain.comm.allreduce(out_of_balance.reshape(-1, dim)[mine].sum(axis=0))

    def stress_function(self, smooth=False):
        """Stress [Pa] as a function that is constant in each cell: the mean of its points.

        smooth: linear in each cell, through its points (degree 2), or averaged at the nodes (degree 1). Collective.
        """
        if smooth and self.degree == 2:
            return self.points.cell_function(self.points.stress, "stress", 1)
        mean = self.points.cell_function(self.points.stress, "stress", 0)
        return nodal_average(mean) if smooth else mean

    def state_function(self):
        """State variables of the law as a function that is constant in each cell."""
        return self.points.cell_function(self.points.state, "state", 0)

    def evaluate_at(self, points, smooth=False):
        """Dictionary of `displacement` (n, D) [m], `stress` (n, S) [Pa], `state` (n, n_state) at points on any rank.

        The cells' mean stress is admissible; the one with `smooth`, as for `stress_function`, may exceed the strength.
        Raises InputError, on all ranks, naming a point outside the body. Collective.
        """
        return evaluate_at(
            points, displacement=self.displacement, stress=self.stress_function(smooth), state=self.state_function()
        )


class _Step:
    """One step to equilibrium, as `newton` wants it."""

    def __init__(self, fem_model, load, law):
        self._model, self._law = fem_model, law
        self._space = fem_model.displacement.function_space
        self._comm = fem_model.domain.comm
        self._n_owned = self._space.dofmap.index_map.size_local * self._space.dofmap.index_map_bs
        constraints = fem_model._constraints
        self._fixed = constraints.dofs
        self._external = fem_model._loads.forces(load)
        self._scale = None
        self._moved = load.displacement * constraints.values - fem_model.displacement.x.array[self._fixed]
        self._base = np.zeros_like(fem_model.increment.x.array)
        self._correction = fem.Function(self._space)

    def start(self):
        """The residual at no increment but that of the supports, whose effect is taken by the present tangent."""
        points, increment = self._model.points, self._model.increment
        increment.x.array[:] = 0.0
        increment.x.array[self._fixed] = self._moved
        self._base[:] = increment.x.array
        spread = self._model._kinematics.strain_increment()
        points.update(self._law, np.zeros_like(spread))
        return self._residual(points.trial_stress + np.einsum("nij,nj->ni", points.tangent, spread))

    def correction(self):
        matrix = self._model._kinematics.stiffness()
        return self._model._solver.solve(matrix, self._residual_vector, self._correction)

    def move(self, step):
        model, points = self._model, self._model.points
        model.increment.x.array[:] = self._base + step * self._correction.x.array
        report = points.update(self._law, model._kinematics.strain_increment())
        if self._comm.allreduce(report.failed):
            return np.inf
        return self._residual(points.trial_stress)

    def work(self):
        n = self._n_owned
        return self._comm.allreduce(float(np.dot(self._residual_vector.array[:n], self._correction.x.array[:n])))

    def keep(self):
        self._base[:] = self._model.increment.x.array

    def _residual(self, stress):
        """Norm of the out-of-balance forces over that of the forces at work."""
        forces = self._out_of_balance(stress)
        if self._scale is None:
            self._scale = self._forces_at_work(forces.array)
        forces.array[self._fixed] = 0.0
        self._residual_vector = forces
        return self._norm(forces.array) / self._scale if self._scale > 0 else 0.0

    def _out_of_balance(self, stress):
        forces = self._model._kinematics.internal_forces(stress)
        forces.array[:] = self._external - forces.array
        return forces

    def _forces_at_work(self, out_of_balance):
        """Largest norm of the loads before and after the step and of the reactions at its start.

        It is set once: in an iteration that runs away the reactions grow without limit and would hide the residual.
        """
        reactions = np.zeros_like(out_of_balance)
        reactions[self._fixed] = out_of_balance[self._fixed]
        before = self._model._loads.forces(self._model.load)
        return max(self._norm(forces) for forces in (self._external, before, reactions))

    def _norm(self, array):
        return np.sqrt(self._comm.allreduce(float(np.sum(array[: self._n_owned] ** 2))))
