"""Stress, strain and state at the quadrature points of a mesh, updated by a law of `mpm_core`."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.fields import N_STRESS, strain
from fenics_bridge.tagged import owned_cells


class QuadraturePoints:
    """The quadrature points of the cells that this rank owns, cell after cell.

    n: their number; per_cell: number in a cell
    stress, state: (n, S) [Pa] and (n, n_state) of the last equilibrium
    trial_stress, trial_state, tangent: (n, S), (n, n_state), (n, S, S) at the displacement under trial
    """

    def __init__(self, increment, n_state, degree):
        """increment: the displacement function whose strain drives the law; degree: of the quadrature rule."""
        domain = increment.function_space.mesh
        self.size = N_STRESS[domain.geometry.dim]
        self._domain = domain
        self.degree, self.reference = degree, compat.quadrature_points(domain, degree)
        self.per_cell = len(self.reference)
        self._cells = np.arange(owned_cells(domain), dtype=np.int32)
        self.n = len(self._cells) * self.per_cell
        self._strain = fem.Expression(strain(increment), self.reference)
        self.stress = np.zeros((self.n, self.size))
        self.state = np.zeros((self.n, n_state))
        self.trial_stress, self.trial_state = self.stress.copy(), self.state.copy()
        self.tangent = np.zeros((self.n, self.size, self.size))
        self.stress_function, self._stress_rows = self._function(self.size)
        self.tangent_function, self._tangent_rows = self._function(self.size**2)

    def strain_increment(self):
        """Strain of the driving displacement at the points: (n, S)."""
        values = compat.expression_values(self._strain, self._domain, self._cells)
        return np.ascontiguousarray(values.reshape(self.n, self.size))

    def update(self, law, strain_increment):
        """Trial stress, state and tangent by one call of the law; returns its report of this rank."""
        np.copyto(self.trial_stress, self.stress)
        np.copyto(self.trial_state, self.state)
        return law.update(strain_increment, self.trial_stress, self.trial_state, self.tangent)

    def accept(self):
        """The trial becomes the last equilibrium."""
        np.copyto(self.stress, self.trial_stress)
        np.copyto(self.state, self.trial_state)

    def write_stress(self, stress):
        """Hand a stress (n, S) to the forms that use `stress_function`."""
        _rows_of(self.stress_function, self.size)[self._stress_rows] = stress

    def write_tangent(self):
        """Hand the tangent to the forms that use `tangent_function`."""
        _rows_of(self.tangent_function, self.size**2)[self._tangent_rows] = self.tangent.reshape(self.n, -1)

    def tangent_matrix(self):
        """The tangent as a UFL matrix."""
        c, s = self.tangent_function, self.size
        return ufl.as_matrix([[c[i * s + j] for j in range(s)] for i in range(s)])

    def coordinates(self):
        """Where the points are: (n, D) [m]."""
        corners = self._domain.geometry.x[compat.cell_nodes(self._domain)[self._cells], : self._domain.geometry.dim]
        return np.einsum("qk,ckd->cqd", self._linear_shapes(), corners).reshape(self.n, -1)

    def cell_function(self, values, name, degree):
        """Function that is constant (degree 0: the mean) or linear (degree 1: through the points) in each cell.

        The mean of admissible stresses is admissible; the linear function is exact at the points. values: (n, k)
        """
        values = values.reshape(len(self._cells), self.per_cell, -1)
        if degree == 0:
            at_nodes = values.mean(axis=1, keepdims=True)
        else:
            at_nodes = np.einsum("kq,cqs->cks", np.linalg.inv(self._linear_shapes()), values)
        space = compat.function_space(self._domain, "DG", degree, values.shape[2])
        function = fem.Function(space, name=name)
        rows = compat.cell_dofs(space)[self._cells]
        _rows_of(function, values.shape[2])[rows] = at_nodes
        function.x.scatter_forward()
        return function

    def _linear_shapes(self):
        return np.column_stack([1 - self.reference.sum(axis=1), self.reference])

    def _function(self, size):
        space = compat.quadrature_space(self._domain, self.degree, size)
        rows = compat.cell_dofs(space)[self._cells].ravel()
        return fem.Function(space), rows


def _rows_of(function, size):
    return function.x.array.reshape(-1, size)
