"""Bilinear forms as matrices that are made once and filled again and again."""

from __future__ import annotations

from dolfinx import fem
from dolfinx.fem import petsc


class Stiffness:
    """A bilinear form on a space and itself as a PETSc matrix, the supports' rows and columns taken out."""

    def __init__(self, form, constraints):
        """form: UFL; constraints: Constraints. Collective."""
        self._form, self._constraints = fem.form(form), constraints
        self._matrix = petsc.create_matrix(self._form)

    def assembled(self):
        """The matrix with the form's present coefficients; the same object each time. Collective."""
        self._matrix.zeroEntries()
        petsc.assemble_matrix(self._matrix, self._form, bcs=self._constraints.bcs)
        self._matrix.assemble()
        return self._matrix
