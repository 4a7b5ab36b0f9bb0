"""Linear elastic equilibrium of a body under its own weight."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.fields import (
    assembled,
    cell_function,
    dilation,
    elastic_stress,
    nodal_average,
    strain,
    strain_up_to_axis,
)
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held, weighted
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.loads import elastic_load
from fenics_bridge.fem.stiffness import Stiffness
from fenics_bridge.fem.supports import Constraints


class ElasticSolution:
    """Displacement and stress of an elastic body.

    displacement: function (Lagrange) [m]; stress: function, polynomial in each cell (constant for degree 1),
    components as in `mpm_core` [Pa], tension positive; geometry: a Geometry
    """

    def __init__(self, displacement, stress, geometry=None):
        """geometry: as for `solve_elastic`."""
        domain = displacement.function_space.mesh
        self.displacement, self.stress, self.geometry = displacement, stress, geometry_of(domain, geometry)
        self._radius = radius_of(domain, self.geometry)

    def stress_function(self, smooth=False):
        """The stress of the cells or, if `smooth`, its average at the nodes as a continuous function. Collective."""
        return nodal_average(self.stress, self._radius) if smooth else self.stress

    def deviatoric_strain_function(self):
        """sqrt(2/3 e : e) of the strain's deviator e [-], as a function that is constant in each cell. Collective."""
        components = strain(self.displacement, self._radius)
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
    geometry=None,
):
    """Small-strain equilibrium of a linear elastic body (plane strain, axisymmetric or 3D) under its weight and its supports.

    supports: from `fixed`, `roller`, `prescribed`; enough of them to prevent rigid-body motion
    young: [Pa], poisson: [-], unit_weight: [N/m3], acting against the last axis; degree: 1 or 2 of the displacement
    traction: force per area (D,) [Pa] by facet tag, or None
    body_force: function of positions (D, n) [m] that returns forces per volume (D, n) [N/m3], or None
    options_prefix: of the PETSc options of the linear solver; geometry: as for `QuasiStatic`
    Returns an ElasticSolution. Raises InputError for bad arguments, RuntimeError when the linear solver fails.
    Collective.
    """
    agree(domain.comm, _first_mistake(young, poisson, unit_weight, degree))
    geometry = geometry_of(domain, geometry)
    radius = radius_of(domain, geometry)
    space = compat.function_space(domain, "Lagrange", degree, domain.geometry.dim)
    constraints = Constraints(space, facet_tags, supports)
    require_axis_held(space, geometry, constraints)
    v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
    stiffness = [fem.Constant(domain, float(value)) for value in (young, poisson)]

    # As the elasto-plastic elements: the hoop strain u_r / r is no polynomial, and UFL's own degree would be high.
    dx = ufl.dx if radius is None else ufl.dx(metadata={"quadrature_degree": max(1, 2 * (degree - 1))})

    def internal(u):
        return weighted(ufl.inner(elastic_stress(strain(u, radius), *stiffness), strain(v, radius)), radius) * dx

    load = elastic_load(v, domain, facet_tags, unit_weight, traction or {}, body_force, radius)
    u = _solved(space, constraints, internal(du), load, internal, options_prefix)
    u.name = "displacement"
    stress = elastic_stress(strain_up_to_axis(u, radius), *stiffness)
    return ElasticSolution(u, cell_function(domain, stress, degree - 1, "stress"), geometry)


def solve_nearly_incompressible(
    domain, facet_tags, supports, young, poisson, unit_weight, traction=None, options_prefix="mixed_", geometry=None
):
    """The same as `solve_elastic` by Taylor-Hood elements, which do not lock as Poisson's ratio approaches 0.5.

    Displacement is quadratic, pressure linear; poisson: above 0. Other arguments, result and errors as for
    `solve_elastic`. The system is indefinite: by default MUMPS solves it. Collective.
    """
    agree(domain.comm, _first_mistake(young, poisson, unit_weight, 2))
    agree(domain.comm, None if poisson > 0 else f"poisson: got {poisson!r}, expected more than 0")
    geometry = geometry_of(domain, geometry)
    radius = radius_of(domain, geometry)
    space = compat.displacement_pressure_space(domain, 2)
    constraints = Constraints(space.sub(0), facet_tags, supports)
    require_axis_held(space.sub(0), geometry, constraints)
    (v, q), trial = ufl.TestFunctions(space), ufl.TrialFunctions(space)
    shear = fem.Constant(domain, young / (2 * (1 + poisson)))
    flexibility = fem.Constant(domain, (1 + poisson) * (1 - 2 * poisson) / (young * poisson))

    dx = ufl.dx if radius is None else ufl.dx(metadata={"quadrature_degree": 3})

    def internal(u, p):
        stress = _mixed_stress(strain(u, radius), p, shear)
        work = ufl.inner(stress, strain(v, radius)) - q * dilation(u, radius) - flexibility * p * q
        return weighted(work, radius) * dx

    load = elastic_load(v, domain, facet_tags, unit_weight, traction or {}, radius=radius)
    both = _solved(space, constraints, internal(*trial), load, lambda w: internal(*ufl.split(w)), options_prefix)
    moved, pressed = ufl.split(both)
    u = both.sub(0).collapse()
    u.name = "displacement"
    stress = _mixed_stress(strain_up_to_axis(moved, radius), pressed, shear)
    return ElasticSolution(u, cell_function(domain, stress, 1, "stress"), geometry)


def _mixed_stress(e, p, shear):
    """Stress components from strain and pressure (here lambda times the volumetric strain, compression positive)."""
    return ufl.as_vector([2 * shear * e[i] - p for i in range(3)] + [shear * e[i] for i in range(3, e.ufl_shape[0])])


def _solved(space, constraints, tangent, load, internal, options_prefix):
    """Solution of a linear problem: one correction by the tangent, starting from the displacements of the supports.

    load: UFL; internal: function of the solution that returns UFL. They are assembled one by one: in a form with integrals of
    degree 1 and 2, FFCx 0.5 takes the radius of the first degree for both.
    """
    solution, increment = fem.Function(space), fem.Function(space)
    solution.x.array[constraints.dofs] = constraints.values
    residual = assembled(fem.form(load), space)
    residual.array[:] -= assembled(fem.form(internal(solution)), space).array
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
