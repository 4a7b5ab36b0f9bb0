"""Strain from displacement; nodal forces from stress, and stiffness from the tangent, by the same operator."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import ufl
from dolfinx import fem, la
from numpy.typing import NDArray
from petsc4py import PETSc

from fenics_bridge import compat
from fenics_bridge.fem.fields import assembled, strain
from fenics_bridge.fem.geometry import radius_of, weighted
from fenics_bridge.fem.stiffness import Stiffness
from mpm_core import Geometry


class Kinematics:
    """Strain of the finite elements at quadrature points, without averaging; assembled by DOLFINx.

    (`averaged.AveragedKinematics` has the same methods for strains that are averaged over nodes.)

    Args:
        increment: displacement function whose strain is taken.
        points: the quadrature points.
        constraints: the boundary conditions.
        geometry: plane strain, axial symmetry or a solid.
        further: on a mixed space, whose first part is the displacement: function of its test and trial functions that returns its
            further internal forces and their tangent, UFL forms.
    """

    def __init__(
        self,
        increment: fem.Function,
        points: Any,
        constraints: Any,
        geometry: Geometry | None = None,
        further: Callable[[Any, Any], tuple[Any, Any]] | None = None,
    ) -> None:
        self._space, self._points = increment.function_space, points
        domain, size = self._space.mesh, points.size
        radius = radius_of(domain, geometry)
        functions = increment, ufl.TestFunction(self._space), ufl.TrialFunction(self._space)
        du, test, trial = functions if further is None else (ufl.split(f)[0] for f in functions)
        more_forces, more_stiffness = further(*functions[1:]) if further is not None else (0, 0)
        self._strain = fem.Expression(strain(du, radius), points.reference)
        self._stress, self._stress_rows = self._quadrature_function(size)
        self._tangent, self._tangent_rows = self._quadrature_function(size**2)
        dx = compat.measure_beside(domain, more_forces)(metadata={"quadrature_degree": points.degree})
        matrix = ufl.as_matrix([[self._tangent[i * size + j] for j in range(size)] for i in range(size)])
        forces = weighted(ufl.inner(self._stress, strain(test, radius)), radius) * dx
        stiffness = weighted(ufl.inner(ufl.dot(matrix, strain(trial, radius)), strain(test, radius)), radius) * dx
        self._internal = fem.form(forces + more_forces)
        self._stiffness = Stiffness(stiffness + more_stiffness, constraints)
        self._forces = la.vector(self._space.dofmap.index_map, self._space.dofmap.index_map_bs)

    def strain_increment(self) -> NDArray[np.float64]:
        """Strain of the increment at the points: (n, S)."""
        values = compat.expression_values(self._strain, self._space.mesh, self._points.cells)
        return np.ascontiguousarray(values.reshape(self._points.n, self._points.size))

    def internal_forces(self, stress: NDArray[np.float64]) -> Any:
        """Nodal forces of a stress (n, S) as a vector (`dolfinx.la`), ghosts up to date. Collective."""
        self._stress.x.array.reshape(-1, self._points.size)[self._stress_rows] = stress
        return assembled(self._internal, self._space, self._forces)

    def carried_stress(self) -> NDArray[np.float64]:
        """The stress (n, S) [Pa] of the points as the nodal forces have it: as it is."""
        return self._points.stress

    def stiffness(self) -> PETSc.Mat:
        """Matrix of the points' present tangent, without the rows and columns of the supports. Collective."""
        return self.stiffness_of(self._points.tangent)

    def stiffness_of(self, tangent: NDArray[np.float64]) -> PETSc.Mat:
        """Matrix of a given tangent (n, S, S) [Pa], without the rows and columns of the supports. Collective."""
        size = self._points.size**2
        self._tangent.x.array.reshape(-1, size)[self._tangent_rows] = tangent.reshape(-1, size)
        return self._stiffness.assembled()

    def _quadrature_function(self, size: int) -> Any:
        space = compat.quadrature_space(self._space.mesh, self._points.degree, size)
        return fem.Function(space), compat.cell_dofs(space)[self._points.cells].ravel()
