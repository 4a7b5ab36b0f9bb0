"""Systems whose tangent is singular: they get a part of the first matrix."""

import numpy as np
from dolfinx import fem, la
from mpi4py import MPI
from petsc4py import PETSc
from scipy import sparse

import fenics_bridge as bridge
from fenics_bridge import compat
from fenics_bridge.fem.linear_solver import PARTS, LinearSolver

COMM = MPI.COMM_WORLD


def matrix_of(rows):
    matrix = sparse.csr_matrix(np.array(rows))
    return PETSc.Mat().createAIJ(matrix.shape, csr=(matrix.indptr, matrix.indices, matrix.data), comm=COMM)


def test_a_singular_tangent_gets_its_part_of_the_first_matrix_also_where_members_have_changed_its_places():
    """Members that yield, or are locked off, couple other degrees of freedom than those of the first matrix."""
    space = compat.function_space(bridge.box_mesh(COMM, (1.0, 1.0), (1, 1))[0], "Lagrange", 1, 2)
    solver, n = LinearSolver(space, "places_", newton=True), 8
    first, later = 2.0 * np.eye(n), 2.0 * np.eye(n)
    later[0, 7] = later[7, 0] = 1.0  # by a member
    later[3, 3] = 0.0  # failed soil
    right, found = la.vector(space.dofmap.index_map, 2), fem.Function(space)
    right.array[:] = np.arange(1.0, n + 1)
    assert solver.solve(matrix_of(first), right, found) == ""
    assert solver.solve(matrix_of(later), right, found) == ""
    assert np.allclose(found.x.array, np.linalg.solve(later + PARTS[0] * first, right.array))
