"""A plain finite element solution, and the tangent of an implicit step as a SciPy matrix."""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

LEFT = 1
"""Tag of the low side along the first axis, as `core_cases.box` numbers them"""


def floor(dim):
    """Tag of the low side along the last axis."""
    return 2 * dim - 1


def linear_elastic_solution(points, cells, law, weight, held):
    """Displacements (nodes, D) [m] of linear finite elements under a weight [N/m3] along the last axis.

    held: (nodes, D), true where a component is zero.
    """
    dim = points.shape[1]
    lame = law.young * law.poisson / ((1 + law.poisson) * (1 - 2 * law.poisson))
    shear = law.young / (2 * (1 + law.poisson))
    rows, columns, entries, force = [], [], [], np.zeros(points.size)
    for cell in cells:
        corner = np.c_[np.ones(dim + 1), points[cell]]
        gradient = np.linalg.inv(corner)[1:].T
        volume = abs(np.linalg.det(corner)) / (2 if dim == 2 else 6)
        dofs = (cell[:, None] * dim + np.arange(dim)).ravel()
        force[cell * dim + dim - 1] -= weight * volume / (dim + 1)
        block = (
            lame * np.einsum("ai,bj->aibj", gradient, gradient)
            + shear * np.einsum("aj,bi->aibj", gradient, gradient)
            + shear * np.einsum("ak,bk,ij->aibj", gradient, gradient, np.eye(dim))
        )
        rows.append(np.repeat(dofs, len(dofs)))
        columns.append(np.tile(dofs, len(dofs)))
        entries.append(volume * block.ravel())
    matrix = sp.csr_matrix((np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))))
    free = np.flatnonzero(~held.ravel())
    u = np.zeros(points.size)
    u[free] = spla.spsolve(matrix[free][:, free].tocsc(), force[free])
    return u.reshape(points.shape)


def tangent(step, dim):
    """J of an assembled implicit step on one rank; with nodal mixed discretisation the product is added."""
    nodes, dofs = step.total_nodes, step.total_nodes * dim

    def matrix(places, values, shape):
        return sp.csr_matrix((values, places), shape=shape)

    j = matrix(step.stiffness_places(), step.stiffness_values(), (dofs, dofs))
    force, strain = step.volumetric_force_values(), step.volumetric_strain_values()
    if len(force) == 0:
        return j
    return j + matrix(step.volumetric_force_places(), force, (dofs, nodes)) @ matrix(
        step.volumetric_strain_places(), strain, (nodes, dofs)
    )
