"""A warning of soil whose free surface is to drain, and that ends at the top of the mesh, where no free surface is found."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ._core import Geometry

if TYPE_CHECKING:
    from .mesh import Mesh
    from .model import Model

UPWARDS = 0.05
"""Vertical component of an outward unit normal above which a facet is on top of the soil, not beside it"""

GAP = 0.7
"""Filled fraction around a node up to which an empty cell there is outside of the soil, as in `implicit/pore_surface.cpp`"""


class _Facets(NamedTuple):
    """Facets on top of the soil cells of this rank at the border of the mesh that no boundary condition describes."""

    cells: NDArray[np.int_]
    """Cell of each, (n,)"""
    corners: NDArray[np.float64]
    """Corners of each [m], (n, D, D)"""
    sizes: NDArray[np.float64]
    """Length [m] or area [m2] of each, (n,)"""


def undrained_border(model: Model) -> str:
    """What a warning says where soil that is to drain at its free surface ends at the top of the mesh; else empty. Collective.

    Implicit steps find the free surface within the mesh, between full and empty surroundings of nodes. A border of the mesh on
    which a boundary condition prescribes the pressure or holds the soil against the vertical, as a lid does, is left alone.
    """
    water, comm, mesh = model._core.water, model.comm, model.mesh
    if water is None or not water.drained_surface or model._core.has_two_phases:
        return ""
    has_soil = np.zeros(mesh.owned_cells, dtype=bool)
    has_soil[model.particles.cell] = True
    facets = _top_facets(model, has_soil)
    closed = ~_has_surface(model, facets.cells, has_soil)
    size = comm.allreduce(float(facets.sizes[closed].sum()))
    drains = comm.allreduce(bool(not has_soil.all() or not closed.all()), MPI.LOR)
    if size == 0 and (drains or any(held for _, _, _, held, _ in model._water_conditions)):
        return ""
    what = "does not drain all of the soil" if drains else "has no effect"
    where = _place(model, facets.corners[closed], size) if size else "the soil fills the mesh"
    return (
        f"drained_surface=True {what}: {where}, whose border is impervious: no free surface is there, at which water would leave, "
        "stand or fall as rain; extend the mesh by empty cells above the soil, or prescribe the pressure at facets "
        "(model.hold_pore_pressure(tag, 0))"
    )


def _place(model: Model, corners: NDArray[np.float64], size: float) -> str:
    """Where the soil ends at the top of the mesh: the box around these facets, (n, D, D), of this size altogether. Collective."""
    dim = model.mesh.dim
    points = corners.reshape(-1, dim)
    box = np.array([points.min(axis=0, initial=np.inf), -points.max(axis=0, initial=-np.inf)])
    model.comm.Allreduce(MPI.IN_PLACE, box, MPI.MIN)
    low, high = (f"({', '.join(f'{x:.4g}' for x in corner)})" for corner in (box[0] + 0.0, 0.0 - box[1]))
    return (
        f"over {size:.3g} {'m' if dim == 2 else 'm2'}, between {low} and {high} m, the soil ends at the top of the mesh"
    )


def _top_facets(model: Model, has_soil: NDArray[np.bool_]) -> _Facets:
    mesh = model.mesh
    owned = slice(0, mesh.owned_cells)
    tags, beside = np.asarray(mesh._core.facet_tags)[owned], np.asarray(mesh._core.neighbours)[owned]
    described = [tag for tag, _, _, held, _ in model._water_conditions if held]
    described += [tag for tag, whole, vector in model._conditions if _holds_vertically(whole, vector)]
    cells, opposite = np.nonzero((beside < 0) & has_soil[:, None] & ~np.isin(tags, described))
    others = np.array([[k for k in range(mesh.dim + 1) if k != left] for left in range(mesh.dim + 1)])
    corners = mesh.points[np.take_along_axis(mesh.cells[cells], others[opposite], axis=1)]
    normals = _normals(corners)
    inwards = np.einsum("na,na->n", normals, mesh.points[mesh.cells[cells, opposite]] - corners[:, 0]) > 0
    normals[inwards] *= -1
    sizes = np.linalg.norm(normals, axis=1)
    up = normals[:, -1] > UPWARDS * sizes
    return _Facets(cells[up], corners[up], sizes[up])


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normals of facets with these corners, (n, D, D), as long as these are, or as large: (n, D)."""
    edges = corners[:, 1:] - corners[:, :1]
    if corners.shape[-1] == 2:
        return edges[:, 0, ::-1] * (1.0, -1.0)
    return 0.5 * np.cross(edges[:, 0], edges[:, 1])


def _holds_vertically(whole: bool, vector: list[float | None]) -> bool:
    """Whether a boundary condition of the displacements acts along the last axis: one by axes, or one along a normal."""
    return vector[-1] is not None if whole else bool(vector[-1])


def _has_surface(model: Model, cells: NDArray[np.int_], has_soil: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of these cells with soil the free surface cuts, or touches: not all of their nodes are within the soil. Collective."""
    mesh, p = model.mesh, model.particles
    corners = mesh.global_nodes[mesh.cells[cells]]
    nodes = np.unique(np.concatenate(model.comm.allgather(np.unique(corners))))
    numbers = np.full(len(mesh.points), -1)  # of these nodes, among the others
    numbers[np.isin(mesh.global_nodes, nodes)] = np.searchsorted(
        nodes, mesh.global_nodes[np.isin(mesh.global_nodes, nodes)]
    )

    def sums(of: NDArray[np.int_], weights: NDArray[np.float64]) -> NDArray[np.float64]:
        near = of >= 0
        found: NDArray[np.float64] = np.bincount(of[near], weights[near], minlength=len(nodes)).astype(float)
        return found

    of_cells = numbers[mesh.cells[: mesh.owned_cells]]
    parts = np.repeat(_volumes(model)[:, None] / (mesh.dim + 1), mesh.dim + 1, axis=1)
    near = (of_cells[p.cell] >= 0).any(axis=1)
    filled = p.volume[near, None] * _shapes(mesh, p.cell[near], p.position[near])
    around = np.array(
        [
            sums(of_cells, parts),
            sums(of_cells[p.cell[near]], filled),
            sums(of_cells, np.repeat(~has_soil[:, None], mesh.dim + 1, axis=1).astype(float)),
        ]
    )
    model.comm.Allreduce(MPI.IN_PLACE, around, MPI.SUM)
    fraction = around[1] / around[0]
    within = (fraction > 0.5) & ((fraction >= GAP) | (around[2] == 0))
    return ~within[np.searchsorted(nodes, corners)].all(axis=1)


def _volumes(model: Model) -> NDArray[np.float64]:
    """Volumes of the cells that this rank owns, per radian in axial symmetry."""
    mesh = model.mesh
    volumes = mesh.cell_volumes[: mesh.owned_cells]
    if model.geometry != Geometry.AXISYMMETRIC:
        return volumes
    return volumes * mesh.points[mesh.cells[: mesh.owned_cells], 0].mean(axis=1)


def _shapes(mesh: Mesh, cells: NDArray[np.int_], positions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shape functions of cells, (n, D + 1), at one position in each, (n, D)."""
    x = mesh.points[mesh.cells[cells]]
    edges = np.swapaxes(x[:, 1:] - x[:, :1], 1, 2)
    others = np.linalg.solve(edges, (positions - x[:, 0])[..., None])[..., 0]
    return np.column_stack([1 - others.sum(axis=1), others])
