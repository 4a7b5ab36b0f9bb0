"""Facets on a border where two meshes meet, of finite elements and of particles."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.mesh.tagged import owned_cells
from mpm_core import Mesh as BackgroundMesh

CLOSE = 1e-9
"""Part of the size of a facet within which points count as the same"""


class Facets(NamedTuple):
    """Facets of a border, on all ranks alike: the simplices of dimension D - 1, and the nodes of a polynomial on each."""

    corners: NDArray[np.float64]
    """Corners [m], shape (m, D, D)"""
    nodes: NDArray[np.int64]
    """Numbers of the nodes over all ranks, shape (m, k)"""
    points: NDArray[np.float64]
    """Positions of these nodes [m], shape (m, k, D)"""


def facets_of_space(space: Any, facets: NDArray[np.int32]) -> Facets:
    """Facets on the border of the body of a Lagrange space, with its nodes on them. Collective.

    Args:
        space: Lagrange space of displacements of any degree.
        facets: facets of this rank on the border, ghosts too.

    Raises:
        InputError: a facet inside of the body. Raised on all ranks alike.
    """
    domain: Mesh = space.mesh
    dim = domain.topology.dim
    domain.topology.create_connectivity(dim - 1, dim)
    cells_of = domain.topology.connectivity(dim - 1, dim)
    inner = sum(len(cells_of.links(f)) > 1 for f in facets)
    agree(
        domain.comm,
        f"border: {inner} of its facets lie inside of the far field, expected its outer sides" if inner else None,
    )
    pairs = [(f, cells_of.links(f)[0]) for f in facets if cells_of.links(f)[0] < owned_cells(domain)]
    corners = domain.geometry.x[compat.facet_nodes(domain, [f for f, _ in pairs])][:, :, :dim]
    dofs = compat.cell_dofs(space)[[cell for _, cell in pairs]]
    points = space.tabulate_dof_coordinates()[dofs][:, :, :dim]
    numbers = space.dofmap.index_map.local_to_global(dofs.ravel().astype(np.int32)).reshape(dofs.shape)
    degree = next(p for p in range(dofs.shape[1] + 1) if math.comb(p + dim, dim) == dofs.shape[1])
    k = math.comb(degree + dim - 1, dim - 1)
    on_facet = np.argsort(distances(corners, points), axis=1, kind="stable")[:, :k]
    local = Facets(
        corners, np.take_along_axis(numbers, on_facet, 1), np.take_along_axis(points, on_facet[:, :, None], 1)
    )
    return _gathered(domain.comm, local)


def facets_of_mesh(mesh: BackgroundMesh, tags: tuple[int, ...]) -> Facets:
    """Facets of a background mesh with some tags, and its nodes; a facet between two cells once. Collective."""
    dim, n = mesh.dim, mesh.owned_cells
    cells = mesh.cells[:n]
    tagged = [(c, k) for k in range(dim + 1) for c in np.flatnonzero(np.isin(mesh._core.facet_tags[:n, k], tags))]
    nodes = np.array([np.delete(cells[c], k) for c, k in tagged], dtype=np.int64).reshape(-1, dim)
    points = mesh.points[nodes]
    every = _gathered(mesh.comm, Facets(points, np.asarray(mesh.global_nodes)[nodes], points))
    _, first = np.unique(np.sort(every.nodes, axis=1), axis=0, return_index=True)
    return Facets(every.corners[first], every.nodes[first], every.points[first])


def _gathered(comm: MPI.Comm, local: Facets) -> Facets:
    """The facets of all ranks, in an order that does not depend on these."""
    every = Facets(*(np.concatenate(part) for part in zip(*comm.allgather(local), strict=True)))
    centres = np.round(every.corners.mean(axis=1), 9) if len(every.corners) else np.zeros((0, 2))
    order = np.lexsort(centres.T)
    return Facets(*(part[order] for part in every))


def distances(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distances (m, k) of points (m, k, D) from the planes of facets (m, D, D)."""
    return np.abs(np.einsum("mkd,md->mk", points - corners[:, :1], normals(corners)))


def normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals (m, D) of facets (m, D, D), of either sign."""
    edges = corners[:, 1:] - corners[:, :1]
    if corners.shape[-1] == 2:
        across = edges[:, 0] @ np.array([[0.0, -1.0], [1.0, 0.0]])
    else:
        across = np.cross(edges[:, 0], edges[:, 1])
    return across / np.linalg.norm(across, axis=1, keepdims=True)


def barycentric(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Barycentric coordinates (n, D) in a facet (D, D) of points (n, D) in its plane."""
    edges = (corners[1:] - corners[0]).T
    inner = np.linalg.lstsq(edges, (points - corners[0]).T, rcond=None)[0].T
    return np.column_stack([1 - inner.sum(axis=1), inner])


def measure(corners: NDArray[np.float64]) -> float:
    """Length or area of a facet (D, D)."""
    edges = corners[1:] - corners[0]  # the root of Gram's determinant would turn round-off into its root
    return float(np.linalg.norm(edges[0]) if len(edges) == 1 else np.linalg.norm(np.cross(*edges)) / 2)


def sides_of(facets: Facets) -> list[Facets]:
    """Facets in parts that lie in one plane, or on one line, each."""
    across = normals(facets.corners)
    across *= np.sign(across[np.arange(len(across)), np.argmax(np.abs(across), axis=1)])[:, None]
    offset = np.einsum("md,md->m", across, facets.corners[:, 0])
    size = np.ptp(facets.corners.reshape(-1, across.shape[1]), axis=0).max()
    planes = np.column_stack([across, offset / size])
    left, found = np.arange(len(planes)), []
    while len(left):
        same = np.abs(planes[left] - planes[left[0]]).max(axis=1) < 1e-6
        found.append(Facets(*(part[left[same]] for part in facets)))
        left = left[~same]
    return found
