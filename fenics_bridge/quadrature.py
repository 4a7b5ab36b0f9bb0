"""Stress, state and tangent at the quadrature points of a mesh, updated by a law of `mpm_core`."""

from __future__ import annotations

import numpy as np
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.fields import N_STRESS
from fenics_bridge.tagged import owned_cells


class QuadraturePoints:
    """The quadrature points of the cells that this rank owns, cell after cell.

    n: their number; per_cell: number in a cell; cells: (m,) int32, the cells
    stress, state: (n, S) [Pa] and (n, n_state) of the last equilibrium
    trial_stress, trial_state, tangent: (n, S), (n, n_state), (n, S, S) at the displacement under trial
    """

    def __init__(self, domain, n_state, degree):
        """degree: of the quadrature rule."""
        self.size = N_STRESS[domain.geometry.dim]
        self._domain = domain
        self.degree, self.reference = degree, compat.quadrature_points(domain, degree)
        self.per_cell = len(self.reference)
        self.cells = np.arange(owned_cells(domain), dtype=np.int32)
        self.n = len(self.cells) * self.per_cell
        self.stress = np.zeros((self.n, self.size))
        self.state = np.zeros((self.n, n_state))
        self.trial_stress, self.trial_state = self.stress.copy(), self.state.copy()
        self.tangent = np.zeros((self.n, self.size, self.size))

    def reset_state(self, law):
        """State variables as a law wants them at the start: zero, but for the size of the cells [m] where it asks for it."""
        self.state[:] = 0.0
        if "cell_size" in law.state_names:
            corners = self._domain.geometry.x[compat.cell_nodes(self._domain)[self.cells], : self._domain.geometry.dim]
            filled = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))  # D! times the volume
            size = filled ** (1 / self._domain.geometry.dim)
            self.state[:, law.state_names.index("cell_size")] = np.repeat(size, self.per_cell)

    def update(self, law, strain_increment):
        """Trial stress, state and tangent by one call of the law; returns its report of this rank."""
        np.copyto(self.trial_stress, self.stress)
        np.copyto(self.trial_state, self.state)
        return law.update(strain_increment, self.trial_stress, self.trial_state, self.tangent)

    def failure(self, law, report, strain_increment):
        """The first point where a law failed, in words: law, place and strain increment; empty without failures."""
        if not report.failed:
            return ""
        position = ", ".join(f"{x:.6g}" for x in self.coordinates()[report.first_failed])
        strain = ", ".join(f"{e:.6g}" for e in strain_increment[report.first_failed])
        return f"the law {law.name} failed at ({position}) m for the strain increment ({strain})"

    def accept(self):
        """The trial becomes the last equilibrium."""
        np.copyto(self.stress, self.trial_stress)
        np.copyto(self.state, self.trial_state)

    def coordinates(self):
        """Where the points are: (n, D) [m]."""
        corners = self._domain.geometry.x[compat.cell_nodes(self._domain)[self.cells], : self._domain.geometry.dim]
        return np.einsum("qk,ckd->cqd", self._linear_shapes(), corners).reshape(self.n, -1)

    def cell_function(self, values, name, degree):
        """Function that is constant (degree 0: the mean) or linear (degree 1: through the points) in each cell.

        The mean of admissible stresses is admissible; the linear function is exact at the points. values: (n, k)
        """
        values = values.reshape(len(self.cells), self.per_cell, -1)
        if degree == 0:
            at_nodes = values.mean(axis=1, keepdims=True)
        else:
            at_nodes = np.einsum("kq,cqs->cks", np.linalg.inv(self._linear_shapes()), values)
        space = compat.function_space(self._domain, "DG", degree, values.shape[2])
        function = fem.Function(space, name=name)
        function.x.array.reshape(-1, values.shape[2])[compat.cell_dofs(space)[self.cells]] = at_nodes
        function.x.scatter_forward()
        return function

    def _linear_shapes(self):
        return np.column_stack([1 - self.reference.sum(axis=1), self.reference])
