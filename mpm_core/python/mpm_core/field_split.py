"""A preconditioner of displacements and pore pressures together: multigrid of each, and the Schur complement of the water."""

from __future__ import annotations

from typing import Any

import numpy as np
from petsc4py import PETSc

from .petsc import multigrid_options

SCHUR_WEIGHT = 5.0
"""Factor of diag(Q^T diag(K)^-1 Q): the diagonal of K is the stiffness of one node with its neighbours
fixed, while these move too. From 3 to 8 the number of iterations is the same; with 1 it is larger by a half."""


def split_options(dim: int, rtol: float) -> dict[str, Any]:
    """PETSc options for flexible GMRES with a block triangular preconditioner: a cycle of multigrid for each of u and p.

    Args:
        dim: 2 or 3.
        rtol: relative residual of the whole system.
    """
    whole = multigrid_options(dim, rtol)
    krylov = {name: value for name, value in whole.items() if name.startswith("ksp_")}
    cycle = {name: value for name, value in whole.items() if not name.startswith("ksp_")} | {"ksp_type": "preonly"}
    split = {"pc_type": "fieldsplit", "pc_fieldsplit_type": "schur", "pc_fieldsplit_schur_fact_type": "upper"}
    parts = {f"fieldsplit_{part}_{name}": value for part in ("u", "p") for name, value in cycle.items()}
    return krylov | split | parts


class FieldSplit:
    """Fields and Schur complement of a system whose rows are, node by node, D displacements and a pressure (W3).

    The Schur complement -(C + dt H) - Q^T K^-1 Q of the pressures is replaced by -(C + dt H) - diag(Q^T diag(K)^-1 Q): what the
    soil gives way under the pressure of a node, as in the fixed-stress iteration (Kim, Tchelepi and Juanes 2011).

    Args:
        matrix: of the system.
        dim: 2 or 3.
        near_null_space: rigid-body motions of the displacements.
    """

    def __init__(self, matrix: PETSc.Mat, dim: int, near_null_space: PETSc.NullSpace) -> None:
        self._unknowns = dim + 1
        rows = np.arange(*matrix.getOwnershipRange(), dtype=PETSc.IntType).reshape(-1, dim + 1)
        self._u = PETSc.IS().createGeneral(rows[:, :dim].ravel(), matrix.comm)
        self._u.setBlockSize(dim)
        self._u.compose("nearnullspace", near_null_space)
        self._p = PETSc.IS().createGeneral(rows[:, dim].copy(), matrix.comm)
        self._blocks: dict[str, PETSc.Mat] = {}

    def attach(self, pc: PETSc.PC, matrix: PETSc.Mat) -> None:
        """Give a preconditioner the fields, and the Schur complement of the present matrix. Collective."""
        schur = self._schur(matrix)
        if pc.getType() != PETSc.PC.Type.FIELDSPLIT:
            pc.setType(PETSc.PC.Type.FIELDSPLIT)
            pc.setFieldSplitIS(("u", self._u), ("p", self._p))
            pc.setFieldSplitType(PETSc.PC.CompositeType.SCHUR)
        pc.setFieldSplitSchurPreType(PETSc.PC.SchurPreType.USER, schur)

    def _schur(self, matrix: PETSc.Mat) -> PETSc.Mat:
        by_pressure = self._block("up", matrix, self._u, self._p)
        volumes = self._block("pu", matrix, self._p, self._u)
        schur = self._block("pp", matrix, self._p, self._p)
        whole, inverse = matrix.getDiagonal(), by_pressure.createVecLeft()
        inverse.array[:] = 1.0 / whole.array_r.reshape(-1, self._unknowns)[:, :-1].ravel()
        by_pressure.diagonalScale(inverse)
        product = volumes.matMult(by_pressure)
        diagonal, softness = schur.getDiagonal(), product.getDiagonal()
        diagonal.axpy(-SCHUR_WEIGHT, softness)
        schur.setDiagonal(diagonal)
        for temporary in (whole, inverse, product, diagonal, softness):
            temporary.destroy()  # petsc4py keeps those of several ranks until all ranks collect garbage
        return schur

    def _block(self, name: str, matrix: PETSc.Mat, rows: PETSc.IS, columns: PETSc.IS) -> PETSc.Mat:
        self._blocks[name] = matrix.createSubMatrix(rows, columns, self._blocks.get(name))
        return self._blocks[name]
