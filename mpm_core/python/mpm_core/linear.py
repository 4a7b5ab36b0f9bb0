"""The tangent of an implicit step as a PETSc matrix, and the solution of its linear systems."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray
from petsc4py import PETSc

_DIRECT_LIMIT = {2: 150_000, 3: 20_000}
"""Nodes up to which the default is a direct solver, by dimension."""


def _direct(ranks: int) -> dict[str, Any]:
    """PETSc options for LU. On several ranks the system is gathered and factorised on one of them: MUMPS spread over ranks
    adds up in the order in which messages arrive, so that no two runs would be the same to the last bit."""
    lu = {"ksp_type": "preonly", "pc_type": "lu"}
    if PETSc.Sys.hasExternalPackage("mumps"):
        lu["pc_factor_mat_solver_type"] = "mumps"
    if ranks == 1:
        return lu
    gathered = {"ksp_type": "preonly", "pc_type": "telescope", "pc_telescope_reduction_factor": ranks}
    return {**gathered, **{f"telescope_{name}": value for name, value in lu.items()}}


_MULTIGRID: dict[str, Any] = {
    "ksp_type": "fgmres",
    "ksp_rtol": 1e-6,
    "ksp_gmres_restart": 100,
    "pc_type": "gamg",
    "pc_gamg_aggressive_coarsening": 0,
    "mg_levels_ksp_type": "gmres",
    "mg_levels_pc_type": "jacobi",
}
"""PETSc options for large systems. Soil that yields has an unsymmetric tangent with weak directions, where the customary
smoother, Chebyshev's polynomials for a positive spectrum, fails; GMRES does not. With the first coarsening not aggressive,
two smoothing steps for each direction in space, and W-cycles in three dimensions, iterations hardly grow as the mesh becomes
finer."""


def _coo_matrix(comm: MPI.Comm, sizes: tuple[int, int], blocks: tuple[int, int], places: Any) -> PETSc.Mat:
    """Matrix with this rank's numbers of rows and columns, for values at (rows, columns); see ``_set_values``."""
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


def _set_values(matrix: PETSc.Mat, values: NDArray[np.float64]) -> None:
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


class Tangent:
    """J = d (f_int + inertia) / du of an implicit step.

    With nodal mixed discretisation J = K + K_p G, where G gives the nodes' averaged volumetric strain: the product grows the
    stencil to two rings. Where mean stresses are averaged too, J = K + K_p G + G^T (L + H G), over three rings.

    Args:
        step: the core's implicit step, assembled.
        comm: its ranks.
        dim: 2 or 3.
        prefix: of the PETSc options of solver and preconditioner.

    Note:
        Collective, as its methods are.
    """

    def __init__(self, step: Any, comm: MPI.Comm, dim: int, prefix: str) -> None:
        nodes, dofs = step.owned_nodes, step.owned_nodes * dim
        self._stiffness = _coo_matrix(comm, (dofs, dofs), (dim, dim), step.stiffness_places())
        self._averaged = comm.allreduce(len(step.volumetric_force_values())) > 0
        self._product: PETSc.Mat | None = None
        if self._averaged:
            self._force = _coo_matrix(comm, (dofs, nodes), (dim, 1), step.volumetric_force_places())
            self._strain = _coo_matrix(comm, (nodes, dofs), (1, dim), step.volumetric_strain_places())
        self._conjugate = comm.allreduce(len(step.mean_stress_values())) > 0
        if self._conjugate:
            self._mean_stress = _coo_matrix(comm, (nodes, dofs), (1, dim), step.mean_stress_places())
            self._mean_stress_by_strain = _coo_matrix(comm, (nodes, nodes), (1, 1), step.mean_stress_by_strain_places())
        self._prefix = prefix
        multigrid = {**_MULTIGRID, "mg_levels_ksp_max_it": 2 * dim, "pc_mg_cycle_type": "v" if dim == 2 else "w"}
        self._options = _direct(comm.size) if step.total_nodes <= _DIRECT_LIMIT[dim] else multigrid
        self._ksp = PETSc.KSP().create(comm)
        self._ksp.setOptionsPrefix(prefix)
        self._near_null_space = _rigid_body_motions(step, comm, dim)
        self.iterations = 0
        """Krylov iterations of the last solution."""

    def update(self, step: Any) -> None:
        """Take the values of the step's present iterate."""
        _set_values(self._stiffness, step.stiffness_values())
        self.matrix = self._stiffness
        if self._averaged:
            _set_values(self._force, step.volumetric_force_values())
            _set_values(self._strain, step.volumetric_strain_values())
            self._product = self._force.matMult(self._strain, self._product)
            self._product.axpy(1.0, self._stiffness, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            self.matrix = self._product
        if self._conjugate:
            _set_values(self._mean_stress, step.mean_stress_values())
            _set_values(self._mean_stress_by_strain, step.mean_stress_by_strain_values())
            work = self._mean_stress_by_strain.matMult(self._strain)
            work.axpy(1.0, self._mean_stress, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
            self.matrix = self._strain.transposeMatMult(work)
            self.matrix.setBlockSize(self._stiffness.getBlockSize())
            self.matrix.axpy(1.0, self._product, PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        self.matrix.setNearNullSpace(self._near_null_space)
        self._ksp.setOperators(self.matrix)
        with _defaults(self._prefix, self._options):
            self._ksp.setFromOptions()
            self._ksp.setUp()

    def solve(self, right: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """J^-1 times this rank's part of a vector; None when the solver failed."""
        x, b = self.matrix.createVecs()
        b.array[:] = right
        try:
            self._ksp.solve(b, x)
        except PETSc.Error:  # MUMPS could not factorise: the matrix is singular, or not finite
            self._ksp.reset()  # it cannot be used again
            return None
        self.iterations = self._ksp.getIterationNumber()
        good = self._ksp.getConvergedReason() > 0 and np.isfinite(x.norm())
        return x.array.copy() if good else None


@contextmanager
def _defaults(prefix: str, values: dict[str, Any]) -> Iterator[None]:
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


def _rigid_body_motions(step: Any, comm: MPI.Comm, dim: int) -> PETSc.NullSpace:
    """What multigrid must keep on its coarse levels."""
    points = PETSc.Vec().createWithArray(np.ascontiguousarray(step.points).ravel(), bsize=dim, comm=comm)
    return PETSc.NullSpace().createRigidBody(points)
