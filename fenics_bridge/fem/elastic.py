"""Linear elastic equilibrium of a body under its own weight."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.fields import assembled, cell_function, elastic_stress, nodal_average, strain
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.loads import elastic_load
from fenics_bridge.fem.stiffness import Stiffness
from fenics_bridge.fem.supports import Constraints


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

    def deviatoric_strain_function(self):
        """sqrt(2/3 e : e) of the strain's deviator e [-], as a function that is constant in each cell. Collective."""
        components = strain(self.displacement)
        mean = (components[0] + components[1] + components[2]) / 3
        normal = sum((components[k] - mean) ** 2 for k in range(3))
        shear = sum(components[k] ** 2 for k in range(3, components.ufl_shape[0]))
        size = ufl.as_vector([ufl.sqrt(2 / 3 * (normal + 0.5 * shear))])
        return cell_function(self.displacement.function_space.mesh, size, 0, "deviatoric_strain")

    def evaluate_at(self, points, smooth=False):
        """Dictionary with `displacement` (n, D) [m] and `stress` (n, S) [Pa] at points, on any rank.

        smooth: as for `stress_function`.
        Raises InputError, on all ranks, naming a point outside the body. Collective.
        """
        return evaluate_at(points, displacement=self.displacement, stress=self.stress_function(smooth))


def solve_elastic(
    domain,
    facet_tags,
    supports,
    young,
    poisson,
    unit_weight,
    degree=1,
    traction=None,
    body_force=None,
    options_prefix="elastic_",
):
    """Small-strain equilibrium of a linear elastic body (plane strain or 3D) under its weight and its supports.

    supports: from `fixed`, `roller`, `prescribed`; at least enough of them to hold the body
    young: [Pa], poisson: [-], unit_weight: [N/m3], acting against the last axis; degree: 1 or 2 of the displacement
    traction: force per area (D,) [Pa] by facet tag, or None
    body_force: function of positions (D, n) [m] that returns forces per volume (D, n) [N/m3], or None
    options_prefix: of the PETSc options of the linear solver
    Returns an ElasticSolution. Raises InputError for bad arguments, RuntimeError when the linear solver fails.
    Collective.
    """
    agree(domain.comm, _first_mistake(young, poisson, unit_weight, degree))
    space = compat.function_space(domain, "Lagrange", degree, domain.geometry.dim)
    constraints = Constraints(space, facet_tags, supports)
    v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
    stiffness = [fem.Constant(domain, float(value)) for value in (young, poisson)]

    def internal(u):
        return ufl.inner(elastic_stress(strain(u), *stiffness), strain(v)) * ufl.dx

    load = elastic_load(v, domain, facet_tags, unit_weight, traction or {}, body_force)
    u = _solved(space, constraints, internal(du), lambda u: load - internal(u), options_prefix)
    u.name = "displacement"
    return ElasticSolution(u, cell_function(domain, elastic_stress(strain(u), *stiffness), degree - 1, "stress"))


def solve_nearly_incompressible(
    domain, facet_tags, supports, young, poisson, unit_weight, traction=None, options_prefix="mixed_"
):
    """The same by Taylor-Hood elements, which do not lock as the Poisson ratio nears 0.5.

    Displacement is quadratic, pressure linear; poisson: above 0. Other arguments, result and errors as for
    `solve_elastic`. The system is indefinite: by default MUMPS solves it. Collective.
    """
    agree(domain.comm, _first_mistake(young, poisson, unit_weight, 2))
    agree(domain.comm, None if poisson > 0 else f"poisson: got {poisson!r}, expected more than 0")
    space = compat.taylor_hood_space(domain)
    constraints = Constraints(space.sub(0), facet_tags, supports)
    (v, q), trial = ufl.TestFunctions(space), ufl.TrialFunctions(space)
    shear = fem.Constant(domain, young / (2 * (1 + poisson)))
    flexibility = fem.Constant(domain, (1 + poisson) * (1 - 2 * poisson) / (young * poisson))

    def internal(u, p):
        stress = _mixed_stress(u, p, shear)
        return (ufl.inner(stress, strain(v)) - q * ufl.div(u) - flexibility * p * q) * ufl.dx

    load = elastic_load(v, domain, facet_tags, unit_weight, traction or {})
    both = _solved(space, constraints, internal(*trial), lambda w: load - internal(*ufl.split(w)), options_prefix)
    moved, pressed = ufl.split(both)
    u = both.sub(0).collapse()
    u.name = "displacement"
    return ElasticSolution(u, cell_function(domain, _mixed_stress(moved, pressed, shear), 1, "stress"))


def _mixed_stress(u, p, shear):
    """Stress components from displacement and pressure (here lambda times the volume lost, compression positive)."""
    e = strain(u)
    return ufl.as_vector([2 * shear * e[i] - p for i in range(3)] + [shear * e[i] for i in range(3, e.ufl_shape[0])])


def _solved(space, constraints, tangent, residual_of, options_prefix):
    """Solution of a linear problem: from the supports' displacements, one correction by the tangent."""
    solution, increment = fem.Function(space), fem.Function(space)
    solution.x.array[constraints.dofs] = constraints.values
    residual = assembled(fem.form(residual_of(solution)), space)
    residual.array[constraints.dofs] = 0.0
    matrix = Stiffness(tangent, constraints).assembled()
    failure = LinearSolver(space, options_prefix).solve(matrix, residual, increment)
    if failure:
        raise RuntimeError(failure)
    solution.x.array[:] += increment.x.array
    return solution


def _first_mistake(young, poisson, unit_weight, degree):
    if not (np.isfinite(young) and young > 0):
        return f"young: got {young!r} Pa, expected a positive number"
    if not 0 <= poisson < 0.5:
        return f"poisson: got {poisson!r}, expected at least 0 and below 0.5"
    if not np.isfinite(unit_weight):
        return f"unit_weight: got {unit_weight!r} N/m3, expected a finite number"
    if degree not in (1, 2):
        return f"degree: got {degree!r}, expected 1 or 2"
    return None
