"""How strain follows from displacement, and so forces from stress and stiffness from the tangent."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem, la

from fenics_bridge import compat
from fenics_bridge.fem.fields import assembled, strain
from fenics_bridge.fem.geometry import radius_of, weighted
from fenics_bridge.fem.stiffness import Stiffness


class Kinematics:
    """The strain of the finite elements as it is, at quadrature points; assembled by DOLFINx.

    (`averaged.AveragedKinematics` has the same methods for strains that are averaged over nodes.)
    """

    def __init__(self, increment, points, constraints, geometry=None):
        """increment: displacement function whose strain is wanted; points: QuadraturePoints; geometry: a Geometry."""
        self._space, self._points = increment.function_space, points
        domain, size = self._space.mesh, points.size
        radius = radius_of(domain, geometry)
        self._strain = fem.Expression(strain(increment, radius), points.reference)
        self._stress, self._stress_rows = self._quadrature_function(size)
        self._tangent, self._tangent_rows = self._quadrature_function(size**2)
        dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": points.degree})
        test, trial = ufl.TestFunction(self._space), ufl.TrialFunction(self._space)
        matrix = ufl.as_matrix([[self._tangent[i * size + j] for j in range(size)] for i in range(size)])
        self._internal = fem.form(weighted(ufl.inner(self._stress, strain(test, radius)), radius) * dx)
        stiffness = weighted(ufl.inner(ufl.dot(matrix, strain(trial, radius)), strain(test, radius)), radius) * dx
        self._stiffness = Stiffness(stiffness, constraints)
        self._forces = la.vector(self._space.dofmap.index_map, self._space.dofmap.index_map_bs)

    def strain_increment(self):
        """Strain of the increment at the points: (n, S)."""
        values = compat.expression_values(self._strain, self._space.mesh, self._points.cells)
        return np.ascontiguousarray(values.reshape(self._points.n, self._points.size))

    def internal_forces(self, stress):
        """Nodal forces of a stress (n, S) as a vector (`dolfinx.la`), ghosts up to date. Collective."""
        self._stress.x.array.reshape(-1, self._points.size)[self._stress_rows] = stress
        return assembled(self._internal, self._space, self._forces)

    def stiffness(self):
        """Matrix of the points' present tangent, with the supports' rows and columns taken out. Collective."""
        size = self._points.size**2
        self._tangent.x.array.reshape(-1, size)[self._tangent_rows] = self._points.tangent.reshape(-1, size)
        return self._stiffness.assembled()

    def _quadrature_function(self, size):
        space = compat.quadrature_space(self._space.mesh, self._points.degree, size)
        return fem.Function(space), compat.cell_dofs(space)[self._points.cells].ravel()
