"""PETSc as implicit steps and the finite elements use it: so that two runs are the same to the last bit."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

DIRECT_LIMIT = {2: 150_000, 3: 20_000}
"""Nodes up to which one rank factorises the whole system by default, by dimension."""


def direct_options(ranks: int, factor: dict[str, Any]) -> dict[str, Any]:
    """PETSc options for LU, with options of the factorisation. On several ranks the system is gathered and factorised on one
    of them: MUMPS spread over ranks adds up in the order in which messages arrive, so that no two runs would be the same to
    the last bit."""
    lu = {"ksp_type": "preonly", "pc_type": "lu", **factor}
    if ranks == 1:
        return lu
    gathered = {"ksp_type": "preonly", "pc_type": "telescope", "pc_telescope_reduction_factor": ranks}
    return {**gathered, **{f"telescope_{name}": value for name, value in lu.items()}}


@contextmanager
def defaults(prefix: str, values: dict[str, Any]) -> Iterator[None]:
    """PETSc options that hold in between unless the user has set them; multigrid reads them whenever it is set up."""
    options = PETSc.Options(prefix)
    added = [name for name in values if not options.hasName(name)]
    for name in added:
        options[name] = values[name]
    try:
        yield
    finally:
        for name in added:
            options.delValue(name)


def solved(ksp: PETSc.KSP, right: PETSc.Vec, solution: PETSc.Vec) -> bool:
    """Solve; whether that worked, on all ranks alike: one that factorises for all may be alone in knowing. Collective."""
    try:
        ksp.solve(right, solution)
        good = ksp.getConvergedReason() > 0 and bool(np.all(np.isfinite(solution.array_r)))
    except PETSc.Error:  # MUMPS could not factorise: the matrix is singular, or not finite
        good = False
    if not ksp.comm.tompi4py().allreduce(int(good), MPI.MIN):
        ksp.reset()  # MUMPS cannot be used again
        return False
    return True


def coo_matrix(comm: MPI.Comm, sizes: tuple[int, int], blocks: tuple[int, int], places: Any) -> PETSc.Mat:
    """Matrix with this rank's numbers of rows and columns, for values at (rows, columns); see ``set_values``."""
    matrix = PETSc.Mat().create(comm)
    matrix.setSizes(((sizes[0], None), (sizes[1], None)))
    matrix.setBlockSizes(*blocks)
    matrix.setType(PETSc.Mat.Type.AIJ)
    rows, columns = (np.array(p, dtype=PETSc.IntType) for p in places)
    if hasattr(matrix, "setPreallocationCOO"):
        matrix.setPreallocationCOO(rows, columns)
    else:  # petsc4py before 3.19 does not wrap it
        _checked(
            _petsc().MatSetPreallocationCOO(
                ctypes.c_void_p(matrix.handle),
                ctypes.c_ssize_t(len(rows)),
                ctypes.c_void_p(rows.ctypes.data),
                ctypes.c_void_p(columns.ctypes.data),
            )
        )
    return matrix


def set_values(matrix: PETSc.Mat, values: NDArray[np.float64]) -> None:
    """Set the values at the matrix's places; those of the same place add up, also across ranks."""
    values = np.ascontiguousarray(values, dtype=PETSc.ScalarType)
    if hasattr(matrix, "setValuesCOO"):
        matrix.setValuesCOO(values, PETSc.InsertMode.INSERT_VALUES)
        return
    _checked(
        _petsc().MatSetValuesCOO(
            ctypes.c_void_p(matrix.handle),
            ctypes.c_void_p(values.ctypes.data),
            ctypes.c_int(int(PETSc.InsertMode.INSERT_VALUES)),
        )
    )


def _petsc() -> ctypes.CDLL:
    """The PETSc library that petsc4py is linked with."""
    return ctypes.CDLL(PETSc.__file__)


def _checked(code: int) -> None:
    if code:
        raise PETSc.Error(code)
