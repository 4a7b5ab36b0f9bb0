"""Linear elastic equilibrium of a body under its own weight."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, is_finite, require_mesh
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
from fenics_bridge.fem.supports import Constraints, Support
from fenics_bridge.types import MeshTags
from fenics_bridge.views import body_text
from mpm_core import Geometry


class ElasticSolution:
    """Displacement and stress of an elastic body.

    Args:
        displacement: Lagrange function [m].
        stress: function that is polynomial in each cell (constant for degree 1), components as in `mpm_core` [Pa], tension
            positive.
        geometry: as for `solve_elastic`.
    """

    def __init__(self, displacement: fem.Function, stress: fem.Function, geometry: Geometry | None = None) -> None:
        domain = displacement.function_space.mesh
        self.displacement = displacement
        """Displacement [m], a Lagrange function"""
        self.stress = stress
        """Stress [Pa], polynomial in each cell; tension positive"""
        self.geometry = geometry_of(domain, geometry)
        """Plane strain, axial symmetry or a solid"""
        self._radius = radius_of(domain, self.geometry)

    def __repr__(self) -> str:
        return body_text("ElasticSolution", self.displacement.function_space.mesh, geometry=self.geometry)

    def stress_function(self, smooth: bool = False) -> fem.Function:
        """The stress as a function. Collective.

        Args:
            smooth: average the stress of the cells at the nodes, which makes it continuous.

        Returns:
            The stress [Pa], polynomial in each cell, or continuous if `smooth`.
        """
        return nodal_average(self.stress, self._radius) if smooth else self.stress

    def deviatoric_strain_function(self) -> fem.Function:
        """sqrt(2/3 e : e) of the strain's deviator e [-], as a function that is constant in each cell. Collective."""
        components = strain(self.displacement, self._radius)
        mean = (components[0] + components[1] + components[2]) / 3
        normal = sum((components[k] - mean) ** 2 for k in range(3))
        shear = sum(components[k] ** 2 for k in range(3, components.ufl_shape[0]))
        size = ufl.as_vector([ufl.sqrt(2 / 3 * (normal + 0.5 * shear))])
        return cell_function(self.displacement.function_space.mesh, size, 0, "deviatoric_strain")

    def evaluate_at(self, points: ArrayLike, smooth: bool = False) -> dict[str, NDArray[np.float64]]:
        """Values at points; the points and their cells may be on different ranks. Collective.

        Args:
            points: positions [m], shape (n, D).
            smooth: as for `stress_function`.

        Returns:
            `displacement` [m], shape (n, D), and `stress` [Pa], shape (n, S).

        Raises:
            InputError: a point is outside the body; the message names it. Raised on all ranks alike.
        """
        return evaluate_at(points, displacement=self.displacement, stress=self.stress_function(smooth))


def solve_elastic(
    domain: Mesh,
    facet_tags: MeshTags,
    supports: Sequence[Support],
    young: float,
    poisson: float,
    unit_weight: float,
    degree: int = 1,
    traction: Mapping[int | str, ArrayLike] | None = None,
    body_force: Callable[[NDArray[np.float64]], ArrayLike] | None = None,
    options_prefix: str = "elastic_",
    geometry: Geometry | None = None,
) -> ElasticSolution:
    """Small-strain equilibrium of a linear elastic body (plane strain, axisymmetric or 3D) under its weight and its supports.

    Collective.

    Args:
        domain: mesh of the body.
        facet_tags: tags of its boundary.
        supports: boundary conditions from `fixed`, `roller` and `prescribed`; enough of them to prevent rigid-body motion.
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        unit_weight: unit weight [N/m3], acting against the last axis.
        degree: degree of the displacement, 1 or 2.
        traction: force per area [Pa], shape (D,), by facet tag.
        body_force: function of positions of shape (D, n) [m] that returns forces per volume of shape (D, n) [N/m3].
        options_prefix: prefix of the PETSc options of the linear solver.
        geometry: Geometry.AXISYMMETRIC for the half section of an axisymmetric body, whose nodes on the axis need a roller; by
            default plane strain in two dimensions.

    Returns:
        Displacement and stress.

    Raises:
        InputError: an argument out of range, an unknown tag, or a geometry that does not go with the mesh. Raised on all ranks
            alike.
        RuntimeError: the linear solver failed.
    """
    require_mesh(domain, connected=True)
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

    def internal(u: Any) -> Any:
        return weighted(ufl.inner(elastic_stress(strain(u, radius), *stiffness), strain(v, radius)), radius) * dx

    load = elastic_load(v, domain, facet_tags, unit_weight, traction or {}, body_force, radius)
    u = _solved(space, constraints, internal(du), load, internal, options_prefix)
    u.name = "displacement"
    stress = elastic_stress(strain_up_to_axis(u, radius), *stiffness)
    return ElasticSolution(u, cell_function(domain, stress, degree - 1, "stress"), geometry)


def solve_nearly_incompressible(
    domain: Mesh,
    facet_tags: MeshTags,
    supports: Sequence[Support],
    young: float,
    poisson: float,
    unit_weight: float,
    traction: Mapping[int | str, ArrayLike] | None = None,
    options_prefix: str = "mixed_",
    geometry: Geometry | None = None,
) -> ElasticSolution:
    """Elastic equilibrium by Taylor-Hood elements, which do not lock as Poisson's ratio approaches 0.5. Collective.

    Displacement is quadratic, pressure linear. The system is indefinite: by default MUMPS solves it.

    Args:
        domain: mesh of the body.
        facet_tags: tags of its boundary.
        supports: boundary conditions from `fixed`, `roller` and `prescribed`; enough of them to prevent rigid-body motion.
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-], above 0.
        unit_weight: unit weight [N/m3], acting against the last axis.
        traction: force per area [Pa], shape (D,), by facet tag.
        options_prefix: prefix of the PETSc options of the linear solver.
        geometry: as for `solve_elastic`.

    Returns:
        Displacement and stress.

    Raises:
        InputError: as for `solve_elastic`. Raised on all ranks alike.
        RuntimeError: the linear solver failed.
    """
    require_mesh(domain, connected=True)
    agree(domain.comm, _first_mistake(young, poisson, unit_weight, 2))
    agree(domain.comm, None if poisson > 0 else f"poisson is {poisson!r}, expected more than 0")
    geometry = geometry_of(domain, geometry)
    radius = radius_of(domain, geometry)
    space = compat.displacement_pressure_space(domain, 2)
    constraints = Constraints(space.sub(0), facet_tags, supports)
    require_axis_held(space.sub(0), geometry, constraints)
    (v, q), trial = ufl.TestFunctions(space), ufl.TrialFunctions(space)
    shear = fem.Constant(domain, young / (2 * (1 + poisson)))
    flexibility = fem.Constant(domain, (1 + poisson) * (1 - 2 * poisson) / (young * poisson))

    dx = ufl.dx if radius is None else ufl.dx(metadata={"quadrature_degree": 3})

    def internal(u: Any, p: Any) -> Any:
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


def _mixed_stress(e: Any, p: Any, shear: Any) -> Any:
    """Stress components from strain and pressure (here lambda times the volumetric strain, compression positive)."""
    return ufl.as_vector([2 * shear * e[i] - p for i in range(3)] + [shear * e[i] for i in range(3, e.ufl_shape[0])])


def _solved(space: Any, constraints: Any, tangent: Any, load: Any, internal: Any, options_prefix: str) -> Any:
    """Solution of a linear problem: one correction by the tangent, starting from the displacements of the supports.

    Load and internal forces are assembled one by one: in a form with integrals of degree 1 and 2, FFCx 0.5 takes the radius of
    the first degree for both.

    Args:
        space: space of the unknowns.
        constraints: the boundary conditions.
        tangent: bilinear form, UFL.
        load: work of the load, UFL.
        internal: function of the solution that returns the work of the internal forces, UFL.
        options_prefix: prefix of the PETSc options of the linear solver.
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


def _first_mistake(young: float, poisson: float, unit_weight: Any, degree: int) -> str | None:
    if not (is_finite(young) and young > 0):
        return f"young is {young!r} Pa, expected a positive number"
    if not (is_finite(poisson) and 0 <= poisson < 0.5):
        return f"poisson is {poisson!r}, expected at least 0 and below 0.5"
    if not is_finite(unit_weight):
        return f"unit_weight is {unit_weight!r} N/m3, expected a finite number"
    if degree not in (1, 2):
        return f"degree is {degree!r}, expected 1 or 2"
    return None
