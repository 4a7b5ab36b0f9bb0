"""A plain finite element solution, and the tangent of an implicit step as a SciPy matrix."""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

import mpm_core as mpm

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
    """J of an assembled implicit step on one rank; with nodal mixed discretisation the product is added, with pore water J has
    the pressures too."""
    means, dofs = step.owned_means, step.total_nodes * step.unknowns

    def matrix(places, values, shape):
        return sp.csr_matrix((values, places), shape=shape)

    j = matrix(step.stiffness_places(), step.stiffness_values(), (dofs, dofs))
    force, strain = step.volumetric_force_values(), step.volumetric_strain_values()
    if len(force) == 0:
        return j
    g = matrix(step.volumetric_strain_places(), strain, (means, dofs))
    j = j + matrix(step.volumetric_force_places(), force, (dofs, means)) @ g
    if len(step.mean_stress_values()) == 0:
        return j
    h = matrix(step.mean_stress_by_strain_places(), step.mean_stress_by_strain_values(), (means, means))
    return j + g.T @ (matrix(step.mean_stress_places(), step.mean_stress_values(), (means, dofs)) + h @ g)


def matrix_of_strains(step, dim, by_strain):
    """Rows by the nodes' averaged volumetric strains, (k, means), as rows by displacements, (k, unknowns)."""
    strain = step.volumetric_strain_values()
    if len(strain) == 0:
        return np.zeros((len(by_strain), step.total_nodes * step.unknowns))
    shape = (step.owned_means, step.total_nodes * step.unknowns)
    return by_strain @ sp.csr_matrix((strain, step.volumetric_strain_places()), shape=shape)


SLOPE_SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)


def slope(h=0.1, weight=80e3, per_cell=10, law=SLOPE_SOIL):
    """The slope of the paper's section 6: height 1 m, 45 degrees, squares of side h cut in four by their diagonals."""
    nx, ny = round(4.1 / h), round(1.0 / h)
    corner = np.stack(np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij"), -1).reshape(-1, 2) * h
    square = np.stack(np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij"), -1).reshape(-1, 2)
    points = np.concatenate([corner, (square + 0.5) * h])
    low = square[:, 0] * (ny + 1) + square[:, 1]
    round_square = np.stack([low, low + ny + 1, low + ny + 2, low + 1, low], axis=1)
    middle = len(corner) + np.arange(len(square))
    cells = np.concatenate([np.c_[round_square[:, k : k + 2], middle] for k in range(4)]).astype(np.int32)
    sides = [cells[points[cells[:, :2], axis].max(axis=1) < 1e-9][:, :2] for axis in (0, 1)]
    centres = points[cells].mean(axis=1)
    mesh = mpm.Mesh(
        points,
        cells,
        cell_tags=np.where(centres.sum(axis=1) < 2.1, 1, 2).astype(np.int32),
        facets=np.concatenate(sides),
        facet_tags=np.repeat([1, 2], [len(s) for s in sides]).astype(np.int32),
    )
    model = mpm.Model(mesh, law)
    model.seed(density=weight / 9.81, per_cell=per_cell, cell_tag=1)
    model.roller(1, (1, 0))
    model.fix(2)
    model.set_gravity((0, -9.81))
    return model


def crest_displacement(model):
    """Length of the displacement of the particle that was nearest to the slope's crest [m]."""
    start = model.particles.initial_position
    return np.linalg.norm(model.particles.displacement[np.argmin(np.hypot(start[:, 0] - 1.1, start[:, 1] - 1.0))])


def difference_of_residual(step, v, direction, dt, h=1e-7):
    """-dr/du along a direction by central differences of h [m] about the iterate v: the tangent times the direction."""
    forces = []
    for side in (1, -1):
        step.iterate = v + side * h / dt * direction
        step.trial()
        forces.append(step.residual)
    return (forces[1] - forces[0]) / (2 * h)
