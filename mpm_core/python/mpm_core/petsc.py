"""PETSc solvers of implicit steps and finite elements, chosen by the size of the system, and messages about their failures."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

DIRECT_LIMIT = {2: 150_000, 3: 6_000}
"""Nodes up to which the system is factorised by default, by dimension; larger ones are solved by multigrid."""

ALONE_LIMIT = {2: 6_000, 3: 700}
"""Nodes up to which one rank factorises the whole system faster than all ranks together, by dimension."""

MOST_ITERATIONS = 1000
"""Krylov iterations after which a system counts as not solved."""


SINGULAR = 1e-3
"""Relative residual of a solution above which the matrix counts as singular."""


def direct_options(ranks: int, alone: bool, pivoting: bool = True) -> dict[str, Any]:
    """PETSc options for LU: by MUMPS or, where it can do without pivoting and is small, by PETSc itself.

    alone: gather the system on one rank and factorise it there, rather than on all. Two runs on all ranks agree to round-off:
    MUMPS adds up in the order in which messages arrive.
    """
    lu: dict[str, Any] = {"ksp_type": "preonly", "pc_type": "lu"}
    mumps = PETSc.Sys.hasExternalPackage("mumps") and (pivoting or not alone)
    # Of PETSc's own orderings, approximate minimum degree needs half the time of the default, nested dissection.
    choice = {"pc_factor_mat_solver_type": "mumps"} if mumps else {"pc_factor_mat_ordering_type": "amd"}
    lu.update(choice)
    if ranks == 1 or (mumps and not alone):
        return lu
    gathered = {"ksp_type": "preonly", "pc_type": "telescope", "pc_telescope_reduction_factor": ranks}
    return {**gathered, **{f"telescope_{name}": value for name, value in lu.items()}}


def multigrid_options(dim: int, rtol: float) -> dict[str, Any]:
    """PETSc options for GMRES with algebraic multigrid: BoomerAMG of hypre or, where PETSc is built without it, GAMG.

    GMRES is preconditioned from the right, so that it stops by the residual itself. BoomerAMG gets displacement components
    as functions of their own, from the block size of the matrix.
    """
    krylov = {
        "ksp_type": "fgmres",
        "ksp_rtol": rtol,
        "ksp_gmres_restart": 100,
        "ksp_max_it": MOST_ITERATIONS,
    }
    if PETSc.Sys.hasExternalPackage("hypre"):
        boomer = "pc_hypre_boomeramg_"
        return {
            **krylov,
            "pc_type": "hypre",
            "pc_hypre_type": "boomeramg",
            f"{boomer}strong_threshold": {2: 0.5, 3: 0.7}[dim],
            f"{boomer}coarsen_type": "HMIS",
            f"{boomer}interp_type": "ext+i",
            f"{boomer}P_max": 4,
        }
    # Soil that yields has an unsymmetric tangent, where GAMG's own smoother, Chebyshev's polynomials, fails.
    return {
        **krylov,
        "pc_type": "gamg",
        "pc_gamg_threshold": 0.01,
        "mg_levels_ksp_type": "gmres",
        "mg_levels_ksp_max_it": 2 * dim,
        "mg_levels_pc_type": "jacobi",
    }


def rigid_body_motions(points: NDArray[np.float64], comm: MPI.Comm) -> PETSc.NullSpace:
    """Rigid-body modes, which multigrid must keep on its coarse levels. Collective.

    points: (n, D) of this rank's own nodes [m]
    """
    coordinates = np.ascontiguousarray(points)
    vector = PETSc.Vec().createWithArray(coordinates.ravel(), bsize=coordinates.shape[1], comm=comm)
    return PETSc.NullSpace().createRigidBody(vector)


@contextmanager
def defaults(prefix: str, values: dict[str, Any]) -> Iterator[None]:
    """PETSc options that hold within the context unless the user has set them; multigrid reads them at each set-up."""
    options = PETSc.Options(prefix)
    added = [name for name in values if not options.hasName(name)]
    for name in added:
        options[name] = values[name]
    try:
        yield
    finally:
        for name in added:
            options.delValue(name)


def new_solver(comm: MPI.Comm, prefix: str) -> PETSc.KSP:
    """A solver of linear systems that takes options of a prefix.

    One that has failed must not be used again: MUMPS cannot, and a system gathered on one rank keeps its failure. Collective.
    """
    ksp = PETSc.KSP().create(comm)
    ksp.setOptionsPrefix(prefix)
    return ksp


def solved(ksp: PETSc.KSP, right: PETSc.Vec, solution: PETSc.Vec) -> str:
    """Solve; returns the reason of a failure, or an empty text, the same on all ranks, also where one rank factorises alone.

    After a failure the solver must not be used again, see `new_solver`. Collective.
    """
    # PETSc keeps what Python has dropped, matrices of earlier systems above all, until all ranks agree to free it.
    PETSc.garbage_cleanup(ksp.comm)
    reason, iterations = 0, 0
    try:
        ksp.solve(right, solution)
        reason, iterations = ksp.getConvergedReason(), ksp.getIterationNumber()
        if reason > 0 and not np.all(np.isfinite(solution.array_r)):
            reason = PETSc.KSP.ConvergedReason.DIVERGED_NANORINF
    except PETSc.Error:  # MUMPS could not factorise: the matrix is singular, or not finite
        reason = PETSc.KSP.ConvergedReason.DIVERGED_PCSETUP_FAILED
    reason = ksp.comm.tompi4py().allreduce(int(reason), MPI.MIN)
    if reason > 0 and _remaining(ksp, right, solution) > _allowed(ksp):
        reason = PETSc.KSP.ConvergedReason.DIVERGED_BREAKDOWN
    if reason > 0:
        return ""
    return _failure(ksp, reason, iterations)


def _remaining(ksp: PETSc.KSP, right: PETSc.Vec, solution: PETSc.Vec) -> float:
    """Residual relative to the right side.

    A pivot of round-off in place of zero does not stop a factorisation, and the residual that a Krylov method carries along
    deviates from the true one where the solution grows without bound.
    """
    residual, size = right.duplicate(), right.norm()
    ksp.getOperators()[0].mult(solution, residual)
    residual.axpy(-1.0, right)
    return residual.norm() / size if size > 0 else 0.0


def _allowed(ksp: PETSc.KSP) -> float:
    """Largest relative residual of an accepted solution; a Krylov method may measure its own in another norm."""
    return SINGULAR if ksp.getType() == "preonly" else min(0.9, max(SINGULAR, 100 * ksp.getTolerances()[0]))


def _failure(ksp: PETSc.KSP, reason: int, iterations: int) -> str:
    """A failure in words: the solver, PETSc's reason, iterations and what to try."""
    prefix, method, pc = ksp.getOptionsPrefix() or "", ksp.getType(), ksp.getPC().getType()
    names = {
        v: k for k, v in vars(PETSc.KSP.ConvergedReason).items() if isinstance(v, int) and k.startswith("DIVERGED")
    }
    failed = f"the linear solver failed ({method} with {pc}: {names.get(reason, reason)}"
    if method == "preonly":
        return (
            f"{failed}: the matrix is singular, or not finite; do the supports hold the body, also each part of it that is joined to "
            "the rest at one node of the mesh only?)"
        )
    return (
        f"{failed} after {iterations} iterations; do the supports hold the body? Near collapse a smaller step or a direct "
        f"solver may help: -{prefix}ksp_type preonly -{prefix}pc_type lu -{prefix}pc_factor_mat_solver_type mumps)"
    )


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
