"""Linear elastic equilibrium of a body under its own weight."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.evaluate import evaluate_at
from fenics_bridge.fields import assembled, cell_function, elastic_stress, nodal_average, strain
from fenics_bridge.linear_solver import LinearSolver
from fenics_bridge.supports import Constraints


class ElasticSolution:
    """Displacement and stress of an elastic body.

    displacement: function (Lagrange) [m]; stress: function, polynomial in each cell (constant for degree 1),
    components as in `mpm_core` [Pa], tension positive
    """

    def __init__(self, displacement, stress):
        self.displacement, self.stress = displacement, stress

    def stress_function(self, smooth=False):
        """The cells' own stress or, `smooth`, its average at the nodes as a continuous function. Collective."""
        return nodal_average(self.stress) if smooth else self.stress

    def evaluate_at(self, points, smooth=False):
        """Dictionary with `displacement` (n, D) [m] and `stress` (n, S) [Pa] at points, on any rank.

        smooth: as for `stress_function`.
        Raises InputError, on all ranks, naming a point outside the body. Collective.
        """
        return evaluate_at(points, displacement=self.displacement, stress=self.stress_function(smooth))


def solve_elastic(domain, facet_tags, supports, young, poisson, unit_weight, degree=1, options_prefix="elastic_"):
    """Small-strain equilibrium of a linear elastic body (plane strain or 3D) under its weight and its supports.

    supports: from `fixed`, `roller`, `prescribed`; at least enough of them to hold the body
    young: [Pa], poisson: [-], unit_weight: [N/m3], acting against the last axis; degree: 1 or 2 of the displacement
    options_prefix: of the PETSc options of the linear solver
    Returns an ElasticSolution. Raises InputError for bad arguments, RuntimeError when the linear solver fails.
    Collective.
    """
    agree(domain.comm, _first_mistake(young, poisson, unit_weight, degree))
    dim = domain.geometry.dim
    space = compat.function_space(domain, "Lagrange", degree, dim)
    constraints = Constraints(space, facet_tags, supports)
    u, v, du = fem.Function(space, name="displacement"), ufl.TestFunction(space), ufl.TrialFunction(space)
    weight = fem.Constant(domain, np.array([0.0] * (dim - 1) + [-float(unit_weight)]))
    stiffness = [fem.Constant(domain, float(value)) for value in (young, poisson)]
    residual = ufl.inner(weight, v) * ufl.dx - _internal(u, v, stiffness)

    u.x.array[constraints.dofs] = constraints.values
    r = assembled(fem.form(residual), space)
    r.array[constraints.dofs] = 0.0
    matrix = fem.petsc.assemble_matrix(fem.form(_internal(du, v, stiffness)), bcs=constraints.bcs)
    matrix.assemble()
    matrix.setBlockSize(dim)
    increment = fem.Function(space)
    if not LinearSolver(space, options_prefix).solve(matrix, r, increment):
        raise RuntimeError("solve_elastic: the linear solver failed; do the supports hold the body?")
    u.x.array[:] += increment.x.array
    stress = cell_function(domain, elastic_stress(strain(u), *stiffness), degree - 1, "stress")
    return ElasticSolution(u, stress)


def _internal(u, v, stiffness):
    return ufl.inner(elastic_stress(strain(u), *stiffness), strain(v)) * ufl.dx


def _first_mistake(young, poisson, unit_weight, degree):
    if not (np.isfinite(young) and young > 0):
        return f"young: got {young!r} Pa, expected a positive number"
    if not -1 < poisson < 0.5:
        return f"poisson: got {poisson!r}, expected more than -1 and below 0.5"
    if not np.isfinite(unit_weight):
        return f"unit_weight: got {unit_weight!r} N/m3, expected a finite number"
    if degree not in (1, 2):
        return f"degree: got {degree!r}, expected 1 or 2"
    return None
