"""The hydraulic gradient with which water leaves the ground: whether it lifts the soil there."""

from __future__ import annotations

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh, exterior_facet_indices
from mpi4py import MPI
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.mesh.tagged import owned_cells
from fenics_bridge.water.seepage import Seepage


def exit_gradient(flow: Seepage, facet_tag: int | str, upward: bool = False) -> float:
    """Largest gradient of the total head with which water leaves through the facets of a tag [-]; 0 where it enters only. Collective.

    Soil without cohesion is lifted by water that leaves upwards with the critical gradient (gamma - gamma_w) / gamma_w, about 1
    (Terzaghi 1922), where gamma is its saturated unit weight. At a corner of the ground the gradient may be singular, and grows as
    cells become smaller.

    Args:
        flow: the flow.
        facet_tag: number or name of the tag.
        upward: whether its upward component alone counts, which lifts the soil; at a steep face water leaves sideways.

    Raises:
        InputError: no facet has the tag. Raised on all ranks alike.
    """
    domain, psi = flow.domain, flow.pressure_head
    dim, n = domain.geometry.dim, owned_cells(domain)
    facets = tagged_facets(domain.comm, flow.facet_tags, facet_tag, "facet_tag")
    domain.topology.create_connectivity(dim, dim - 1)
    domain.topology.create_connectivity(dim - 1, dim)
    facets = np.intersect1d(facets, exterior_facet_indices(domain.topology))
    space = compat.function_space(domain, "DG", compat.degree_of(psi.function_space) - 1, dim)
    gradient = fem.Function(space)
    up = ufl.as_vector([0.0] * (dim - 1) + [1.0])
    gradient.interpolate(fem.Expression(ufl.grad(psi) + up, compat.interpolation_points(space)))
    of_cells = domain.topology.connectivity(dim, dim - 1).array.reshape(-1, dim + 1)[:n]
    cells, opposite = np.nonzero(np.isin(of_cells, facets))
    values = gradient.x.array.reshape(-1, dim)[
        compat.cell_dofs(space)[cells]
    ]  # of each cell, at one node or at its corners
    at_facet = (
        np.arange(values.shape[1]) != opposite[:, None] if values.shape[1] > 1 else np.ones((len(cells), 1), bool)
    )
    leaving = -np.einsum("ckd,cd->ck", values, _outward(domain, cells, opposite))
    rising = np.where(leaving > 0, -values[:, :, -1], 0.0)
    return domain.comm.allreduce(float((rising if upward else leaving)[at_facet].max(initial=0.0)), MPI.MAX)


def _outward(domain: Mesh, cells: NDArray[np.integer], opposite: NDArray[np.integer]) -> NDArray[np.float64]:
    """Outward unit normals (k, D) of the facets opposite to a corner of cells of triangles or tetrahedra."""
    dim = domain.geometry.dim
    corners = domain.geometry.x[compat.cell_nodes(domain)[cells], :dim]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    inverse = np.linalg.inv(edges)  # rows: gradients of the barycentric coordinates of corners 1 to D
    gradients = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    inward = gradients[np.arange(len(cells)), opposite]
    return -inward / np.linalg.norm(inward, axis=1, keepdims=True)
