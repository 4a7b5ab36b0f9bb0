"""Forces of boundary pressures and pore water on particles, as on the finite elements."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from fenics_bridge.errors import agree
from mpm_core import Geometry


def boundary_forces(model, tag, pressure):
    """Force on each particle by a pressure on the boundary with a tag: (n, D) [N] ([N/m] in plane strain, [N] per radian).

    A boundary is pressed where there are particles on one side of it only, by those of a cell that are nearest to it.
    pressure: [Pa], compression positive. Collective.
    """
    mesh = model.mesh
    force, pressed = _surface_forces(model, mesh._core.facet_tags == tag, np.full(len(mesh.points), float(pressure)))
    agree(model.comm, None if pressed else f"pressure: no soil lies at the boundary with the tag {tag}")
    return force


def seepage_forces(model, pore_pressure):
    """Force -V grad p of the pore water on each particle, p being linear in each cell: (n, D) [N] ([N/m] in plane strain, [N] per radian).

    As for the finite elements, water presses on the surface where it stands on it, and suction does not pull at it. Collective.
    """
    mesh, cells = model.mesh, model.particles.cell
    p = np.broadcast_to(np.asarray(pore_pressure(mesh.points), dtype=float), len(mesh.points))
    agree(model.comm, None if np.all(np.isfinite(p)) else "pore_pressure: it gives values that are not finite")
    gradient = np.einsum("ck,ckd->cd", p[mesh.cells], _gradients(mesh))
    force = -model.particles.volume[:, None] * gradient[cells]
    suction = np.maximum(-p, 0.0)
    if model.comm.allreduce(float(suction.max(initial=0.0)), MPI.MAX) == 0:
        return force
    everywhere = np.ones(np.shape(mesh.cells), dtype=bool)
    return force + _surface_forces(model, everywhere, suction)[0]


def _surface_forces(model, chosen, pressure):
    """Forces by a pressure at the nodes (k,) [Pa] on those chosen facets (m, D + 1) of cells beyond which there are no particles.

    Returns the forces and the number of chosen facets at cells with particles, over all ranks. Collective.
    """
    mesh, p, dim = model.mesh, model.particles, model.mesh.dim
    cells, position = p.cell, p.position
    full = np.bincount(cells, minlength=len(mesh.cells)) > 0
    full = mesh._core.with_ghost_values(full[: mesh.owned_cells].astype(float), MPI._addressof(model.comm)) > 0
    force, gradients = np.zeros((len(p), dim)), _gradients(mesh)
    facets = np.argwhere(chosen[: mesh.owned_cells] & full[: mesh.owned_cells, None])
    order = np.argsort(cells, kind="stable")
    starts = np.searchsorted(cells[order], np.arange(mesh.owned_cells + 1))
    for cell, k in facets:
        neighbour = mesh._core.neighbours[cell, k]
        if neighbour >= 0 and full[neighbour]:
            continue
        rows, gradient, nodes = order[starts[cell] : starts[cell + 1]], gradients[cell, k], mesh.cells[cell]
        distance = (position[rows] - mesh.points[nodes[(k + 1) % (dim + 1)]]) @ gradient  # shape function of k
        nearest = rows[distance < distance.min() + 1e-6]
        # The outward normal times the area is -D V grad N of the opposite corner.
        area = dim * mesh.cell_volumes[cell] * gradient
        fraction = np.full(len(nearest), 1 / len(nearest))
        if model.geometry == Geometry.AXISYMMETRIC:  # each carries its own ring
            area *= np.delete(mesh.points[nodes, 0], k).mean()
            fraction = position[nearest, 0] / position[nearest, 0].sum()
        force[nearest] += np.delete(pressure[nodes], k).mean() * fraction[:, None] * area
    return force, model.comm.allreduce(len(facets))


def _gradients(mesh):
    """Gradients of the shape functions of each cell: (m, D + 1, D) [1/m]."""
    corners = mesh.points[mesh.cells]
    inner = np.swapaxes(np.linalg.inv(corners[:, 1:] - corners[:, :1]), 1, 2)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
