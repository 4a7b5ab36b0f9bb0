"""Bilinear forms as matrices that are made once and filled again and again."""

from __future__ import annotations

from typing import Any

from dolfinx import fem
from dolfinx.fem import petsc
from petsc4py import PETSc


class Stiffness:
    """A bilinear form on a space and itself as a PETSc matrix, without the rows and columns of the supports. Collective.

    Args:
        form: UFL form.
        constraints: the boundary conditions.
    """

    def __init__(self, form: Any, constraints: Any) -> None:
        self._form, self._constraints = fem.form(form), constraints
        self._matrix = petsc.create_matrix(self._form)

    def assembled(self) -> PETSc.Mat:
        """The matrix with the form's present coefficients; the same object each time. Collective."""
        self._matrix.zeroEntries()
        petsc.assemble_matrix(self._matrix, self._form, bcs=self._constraints.bcs)
        self._matrix.assemble()
        return self._matrix
