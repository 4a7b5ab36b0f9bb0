"""Quasi-static Taylor-Hood elements for incompressible or nearly incompressible soil, where they do not lock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from numpy.typing import ArrayLike, NDArray

import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.errors import agree, require_mesh
from fenics_bridge.fem.equilibration import EquilibriumReport, find_equilibrium
from fenics_bridge.fem.equilibrium import Body
from fenics_bridge.fem.evaluate import evaluate_at
from fenics_bridge.fem.fields import SupportedBody, dilation, part_of
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held, weighted
from fenics_bridge.fem.kinematics import Kinematics
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.load_steps import LoadStep, raise_load
from fenics_bridge.fem.loads import Load, LoadVectors
from fenics_bridge.fem.materials import Materials
from fenics_bridge.fem.quadrature import QuadraturePoints
from fenics_bridge.fem.solver import Solver, given_solver
from fenics_bridge.fem.supports import Constraints, Support
from fenics_bridge.types import MeshTags
from fenics_bridge.views import body_text, law_lines
from mpm_core import Geometry


class MixedQuasiStatic(SupportedBody):
    """Small-strain equilibrium of undrained soil: quadratic displacement, linear pressure (Taylor-Hood). Collective.

    The law gives the deviatoric stress of the deviatoric strain; the pressure p = -K div u is an unknown of its own. That
    is exact for laws whose deviatoric stress does not depend on the mean stress: elastic, or of friction angle zero.
    It has the methods of `QuasiStatic` that `collapse_load` uses, so that it finds the collapse load of both.

    Args:
        domain: mesh of the body.
        law: LinearElastic, or MohrCoulomb with a friction angle of 0 and no tension cut-off.
        facet_tags: tags of the boundary.
        supports: boundary conditions from `fixed`, `roller` and `prescribed`.
        options_prefix: prefix of the PETSc options of the linear solver.
        solver: tolerances, as for `QuasiStatic`.
        geometry: as for `QuasiStatic`.

    Raises:
        InputError: another law, an unknown tag, or a geometry that does not go with the mesh. Raised on all ranks alike.
    """

    def __init__(
        self,
        domain: Mesh,
        law: mpm.LinearElastic | mpm.MohrCoulomb,
        facet_tags: MeshTags,
        supports: Sequence[Support],
        options_prefix: str = "mixed_",
        solver: Solver | None = None,
        geometry: Geometry | None = None,
    ) -> None:
        require_mesh(domain, connected=True)
        agree(domain.comm, _first_mistake(law))
        self.geometry = geometry_of(domain, geometry)
        """Plane strain, axial symmetry or a solid"""
        radius = radius_of(domain, self.geometry)
        space = compat.displacement_pressure_space(domain, 2)
        self.domain = domain
        """Mesh of the body"""
        self.law = law
        """The law in force"""
        constraints = Constraints(space.sub(0), facet_tags, supports)
        self.supports: tuple[Support, ...] = tuple(supports)
        """The boundary conditions"""
        require_axis_held(space.sub(0), self.geometry, constraints)
        self._loads = LoadVectors(space, facet_tags, test=ufl.TestFunctions(space)[0], radius=radius)
        number = Materials(domain, law, None).number
        self.points = QuadraturePoints(domain, [law], number, 2, radius is not None)
        """Quadrature points, whose stress is the deviatoric one"""
        self.load = Load()
        """The load in equilibrium"""
        self.converged = False
        """Whether the last call reached its load"""
        unknowns = fem.Function(space), fem.Function(space)
        self._kinematics = _MixedKinematics(*unknowns, self.points, constraints, law, self.geometry)
        linear = LinearSolver(space, options_prefix, newton=True)
        self._body = Body(*unknowns, self.points, self._kinematics, constraints, linear)
        self.solver = given_solver(domain.comm, solver)
        """Tolerances of the solution"""
        self._facet_tags = facet_tags
        self._displacements = space.sub(0).collapse()

    def __repr__(self) -> str:
        state = "in equilibrium" if self.converged else "not in equilibrium"
        return body_text(
            "MixedQuasiStatic", self.domain, repr(self.load), state, geometry=self.geometry, lines=law_lines(self.law)
        )

    @property
    def displacement(self) -> fem.Function:
        """Total displacement as a function [m]."""
        return part_of(self._body.solution, self._displacements, "displacement")

    @property
    def increment(self) -> fem.Function:
        """Displacement of the last step [m]."""
        return part_of(self._body.increment, self._displacements, "increment")

    def equilibrate(
        self, load: Load, law: mpm.LinearElastic | mpm.MohrCoulomb | None = None, **options: Any
    ) -> EquilibriumReport:
        """Find the equilibrium under a load, with a law, in one step; without equilibrium nothing changes. Collective.

        Args:
            load: load at the end of the step.
            law: law from now on; by default the one in force.
            **options: attributes of `Solver`, in place of those of `solver`.

        Returns:
            Report of the solution.

        Raises:
            InputError: a law or load that is not possible. Raised on all ranks alike.
        """
        law = law or self.law
        agree(self.domain.comm, _first_mistake(law))
        self._loads.require_acting(load, self.load)
        forces = self._loads.forces(load), self._loads.forces(self.load)
        report = find_equilibrium(self._body, [law], *forces, load.displacement, replace(self.solver, **options))
        self.converged = report.converged
        if report.converged:
            self.load, self.law = load, law
        return report

    def solve(
        self,
        load: Load,
        first_step: float = 0.25,
        tolerance: float = 1e-3,
        progress: Callable[[LoadStep], Any] | None = None,
    ) -> list[LoadStep]:
        """Raise the load from the present one to the given one, in steps that adapt; as `QuasiStatic.solve`. Collective.

        Args:
            load: load at the end.
            first_step: first step as a fraction of the way [-].
            tolerance: fraction of the way below which steps end [-].
            progress: function that is called with each load step, e.g. `print_step`.

        Returns:
            All steps. `converged` says whether the load was reached; if not, there is a warning, and `load` is the last one in
            equilibrium.
        """
        return raise_load(self, load, first_step, tolerance, progress)

    def _nodal_reactions(self) -> tuple[Any, NDArray[np.float64], MeshTags, Sequence[Support]]:
        self._body.increment.x.array[:] = 0.0
        forces = self._loads.forces(self.load) - self._kinematics.internal_forces(self.points.stress).array
        space, dofs = self._displacements
        return space, forces[dofs], self._facet_tags, self.supports

    def pressure_at(self, points: ArrayLike) -> NDArray[np.float64]:
        """Pressure at points, compression positive; the points and their cells may be on different ranks. Collective.

        Args:
            points: positions [m], shape (n, D).

        Returns:
            Pressure [Pa], shape (n,).

        Raises:
            InputError: a point is outside the body; the message names it. Raised on all ranks alike.
        """
        pressure = self._body.solution.sub(1).collapse()
        return self._kinematics.scale * evaluate_at(points, pressure=pressure)["pressure"][:, 0]

    def evaluate_at(self, points: ArrayLike) -> dict[str, NDArray[np.float64]]:
        """Values at points; the points and their cells may be on different ranks. Collective.

        Args:
            points: positions [m], shape (n, D).

        Returns:
            `displacement` [m], shape (n, D).

        Raises:
            InputError: a point is outside the body; the message names it. Raised on all ranks alike.
        """
        return evaluate_at(points, displacement=self.displacement)


class _MixedKinematics(Kinematics):
    """Deviatoric strain, forces and stiffness of displacement and pressure.

    The unknown pressure is in units of the shear modulus, so that both kinds of equations have entries of similar magnitude.
    """

    def __init__(
        self,
        solution: Any,
        increment: Any,
        points: QuadraturePoints,
        constraints: Constraints,
        law: Any,
        geometry: Geometry | None,
    ) -> None:
        young, poisson, size = law.young, law.poisson, points.size
        self.scale = young / (2 * (1 + poisson))
        flexibility = self.scale * 3 * (1 - 2 * poisson) / young  # G / K
        self._deviator = np.eye(size) - np.outer(np.arange(size) < 3, np.arange(size) < 3) / 3
        u, p = (a + b for a, b in zip(ufl.split(solution), ufl.split(increment)))
        domain = solution.function_space.mesh
        radius = radius_of(domain, geometry)
        # The pressure's terms have one degree more with the radius.
        degree = points.degree if radius is None else 3
        dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": degree})

        def volume(u: Any, p: Any, v: Any, q: Any) -> Any:
            terms = -p * dilation(v, radius) - q * dilation(u, radius) - flexibility * p * q
            return self.scale * weighted(terms, radius) * dx

        def further(test: Any, trial: Any) -> Any:
            return volume(u, p, *ufl.split(test)), volume(*ufl.split(trial), *ufl.split(test))

        super().__init__(increment, points, constraints, geometry, further)

    def strain_increment(self) -> NDArray[np.float64]:
        """Deviatoric strain of the increment at the points: (n, S)."""
        return super().strain_increment() @ self._deviator

    def internal_forces(self, stress: NDArray[np.float64]) -> Any:
        """Nodal forces of a stress (n, S), of which the deviatoric part counts, and of the pressure. Collective."""
        return super().internal_forces(stress @ self._deviator)

    def stiffness(self) -> Any:
        """Matrix of the points' present tangent, without the rows and columns of the supports. Collective."""
        return self.stiffness_of(self._deviator @ self._points.tangent @ self._deviator)


def _first_mistake(law: Any) -> str | None:
    if isinstance(law, mpm.LinearElastic):
        return None
    if not isinstance(law, mpm.MohrCoulomb):
        return f"law is {type(law).__name__}, expected LinearElastic or MohrCoulomb"
    if law.friction_angle != 0 or np.isfinite(law.tension_cutoff):
        return (
            f"law has a friction angle of {law.friction_angle:g} degrees and a tension cut-off of "
            f"{law.tension_cutoff:g} Pa, expected 0 and none"
        )
    return None
