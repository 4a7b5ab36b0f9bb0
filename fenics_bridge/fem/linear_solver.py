"""Solution of linear systems by PETSc."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from dolfinx import fem
from mpm_core.petsc import (
    ALONE_LIMIT,
    DIRECT_LIMIT,
    defaults,
    direct_options,
    multigrid_options,
    new_solver,
    rigid_body_motions,
    solved,
)
from petsc4py import PETSc

from fenics_bridge.fem.averaged_stiffness import FactoredStiffness

EXACT = 1e-10
"""Relative tolerance of a single linear system."""

LOOSEST, TIGHTEST = 1e-2, 1e-6
"""Bounds of the relative tolerance in an iteration of Newton's method."""

PARTS = (0.01, 0.1)
"""Fractions of the first matrix, in most cases the elastic one, that are added to a tangent that cannot be solved"""

CONVERGING = 0.1
"""Reduction of the residual in an iteration of Newton's method below which it converges fast"""

MOST_ITERATIONS = 100
"""Krylov iterations in an iteration of Newton's method; a tangent that needs more is close to singular"""

AVERAGED_LIMIT = 100
"""Nodes in three dimensions up to which a system with averaged strains is factorised by default: its rows have many entries"""

FALLBACK_LIMIT = 20_000
"""Nodes in three dimensions up to which a factorisation takes the place of an iterative solver that has failed beside structural members"""

FACTORISING = ("lu", "cholesky", "telescope", "redundant")
"""PETSc's preconditioners that factorise the matrix"""


def _factorised_by_default(space: Any, averaged: bool, reinforced: bool) -> bool:
    """Whether systems on a space are factorised unless PETSc options say otherwise; see `LinearSolver` for the arguments."""
    index_map, dim = space.dofmap.index_map, space.mesh.geometry.dim
    limit = AVERAGED_LIMIT if averaged and dim == 3 and not reinforced else DIRECT_LIMIT[dim]
    return bool(space.dofmap.index_map_bs != dim or index_map.size_global <= limit)


def factorises(space: Any, options_prefix: str, averaged: bool, reinforced: bool) -> bool:
    """Whether a `LinearSolver` would factorise systems, by default or by the user's PETSc options; see there for the arguments."""
    chosen = PETSc.Options(options_prefix).getString("pc_type", "")
    return chosen in FACTORISING if chosen else _factorised_by_default(space, averaged, reinforced)


class LinearSolver:
    """Solution of linear systems on a space by PETSc.

    The default is LU up to `DIRECT_LIMIT` nodes and for mixed spaces, by MUMPS on all ranks where there are more than
    `ALONE_LIMIT`, and GMRES with algebraic multigrid above; averaged strains in three dimensions have their limit
    at `AVERAGED_LIMIT`, but for those with structural members, whose stiffness can be added to a matrix only. Where multigrid fails
    beside members, which may be stiffer than the soil by many orders, LU takes its place from then on, with a warning.
    PETSc options with `options_prefix` change all this, for instance -elastic_ksp_type cg -elastic_pc_type gamg.

    Args:
        space: space of the unknowns.
        options_prefix: prefix of the PETSc options.
        newton: whether systems are those of Newton's iterations: an iterative solver need not solve the first ones well, and a
            tangent that is singular, as where all soil around a node has failed in tension, gets a part of the first matrix.
        averaged: whether strains are averaged over nodes, which gives a matrix many entries.
        reinforced: whether there are structural members.
    """

    def __init__(
        self, space: Any, options_prefix: str, newton: bool = False, averaged: bool = False, reinforced: bool = False
    ) -> None:
        self._comm, index_map = space.mesh.comm, space.dofmap.index_map
        dim, bs = space.mesh.geometry.dim, space.dofmap.index_map_bs
        self._n_owned = index_map.size_local * bs
        displacements = bs == dim
        alone = index_map.size_global <= ALONE_LIMIT[dim]
        direct = _factorised_by_default(space, averaged, reinforced)
        self._factorising = direct_options(self._comm.size, alone, pivoting=not displacements)
        self._may_factorise = reinforced and not direct and index_map.size_global <= FALLBACK_LIMIT
        self._options = self._factorising if direct else multigrid_options(dim, EXACT)
        if newton and not direct:
            self._options["ksp_max_it"] = MOST_ITERATIONS
        self._options_prefix, self._newton = options_prefix, newton
        self._last: float | None = None
        self._first: PETSc.Mat | None = None
        self._part = 0.0  # of the first matrix, that the last system needed
        self._rigid = None
        if displacements:
            points = space.tabulate_dof_coordinates()[: index_map.size_local, :dim]
            self._rigid = rigid_body_motions(points, self._comm)
        self._ksp = new_solver(self._comm, options_prefix)
        self.iterations: list[int] = []
        """Krylov iterations of each solution so far"""

    @property
    def direct(self) -> bool:
        """Whether systems are factorised, which needs their matrix: by default, or by the user's PETSc options."""
        chosen = PETSc.Options(self._options_prefix).getString("pc_type", self._options["pc_type"])
        return chosen in FACTORISING

    def solve(self, matrix: PETSc.Mat | FactoredStiffness, residual: Any, increment: fem.Function) -> str:
        """Solve a linear system. Collective.

        Args:
            matrix: matrix of the system, for an iterative solver perhaps in factors; it may be changed.
            residual: right-hand side, a vector (`dolfinx.la`).
            increment: function on the same space, to which the solution is written.

        Returns:
            The reason of a failure in words, or an empty text.
        """
        solution, right = matrix.createVecs()
        right.array[:] = residual.array[: self._n_owned]
        options = dict(self._options)
        if self._newton:
            tolerance = self._follow(right.norm())
            if "ksp_rtol" in options:
                options["ksp_rtol"] = tolerance
        self.iterations.append(0)
        failure, added = self._solved_with_parts(matrix, right, solution, options)
        if failure and self._gives_way(matrix):
            if added and self._first is not None:
                matrix.axpy(-added, self._first, PETSc.Mat.Structure.UNKNOWN_NONZERO_PATTERN)
            self._part = 0.0
            failure, added = self._solved_with_parts(matrix, right, solution, self._options)
        self._part = 0.0 if failure else added
        if self._newton and not failure and self._first is None:
            self._first = matrix.copy()
        if not failure:
            increment.x.array[: self._n_owned] = solution.array_r
            increment.x.scatter_forward()
        return failure

    def _solved_with_parts(self, matrix: Any, right: Any, solution: Any, options: dict[str, Any]) -> tuple[str, float]:
        """Solve with as small a part of the first matrix added as it takes; the reason of a failure, and the part. Collective."""
        failure, added = "", 0.0
        for part in [p for p in (0.0, *PARTS) if p >= self._part]:
            if self._first is not None and part > added:
                matrix.axpy(part - added, self._first, PETSc.Mat.Structure.UNKNOWN_NONZERO_PATTERN)
                added = part
            solution.set(0.0)
            failure = self._solved(matrix, right, solution, options)
            if not failure or self._first is None:
                break
        return failure, added

    def _gives_way(self, matrix: Any) -> bool:
        """Whether a factorisation takes the place of the iterative solver, which has failed, from now on. Collective."""
        chosen = PETSc.Options(self._options_prefix)
        own = any(chosen.hasName(name) for name in ("pc_type", "ksp_type", "ksp_max_it"))
        if not self._may_factorise or own or not isinstance(matrix, PETSc.Mat):
            return False
        self._options, self._may_factorise = self._factorising, False
        if self._comm.rank == 0:
            warnings.warn(
                "the iterative solver of linear systems failed beside structural members, which may be much stiffer than the soil: a "
                "factorisation takes its place from now on, which needs more memory (docs/members.md)",
                RuntimeWarning,
                stacklevel=2,
            )
        return True

    def _solved(self, matrix: Any, right: Any, solution: Any, options: dict[str, Any]) -> Any:
        operators = (matrix, matrix) if isinstance(matrix, PETSc.Mat) else (matrix.operator, matrix.preconditioner)
        if self._rigid is not None:
            operators[1].setNearNullSpace(self._rigid)
        self._ksp.setOperators(*operators)
        with defaults(self._options_prefix, options):
            self._ksp.setFromOptions()
            failure = solved(self._ksp, right, solution)
        self.iterations[-1] += self._ksp.getIterationNumber()
        if failure:
            self._ksp = new_solver(self._comm, self._options_prefix)
        return failure

    def _follow(self, size: float) -> float:
        """Follow the residuals of Newton's method; returns the relative tolerance of the next system, from the last reduction.

        Choice 2 of Eisenstat and Walker (1996, SIAM J. Sci. Comput. 17, 16-32), 0.9 of the square of the reduction, keeps
        convergence quadratic. A residual that has grown begins a new step. As long as the residual falls slowly, a part of
        the first matrix that a system needed is added to the next one at once, which most likely needs it too.
        """
        reduction = np.inf if self._last is None else size / self._last
        if not CONVERGING < reduction < 1:
            self._part = 0.0
        self._last = size if size > 0 else None
        return max(TIGHTEST, min(LOOSEST, 0.9 * reduction**2))
