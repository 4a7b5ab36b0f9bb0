"""Forces of boundary pressures and pore water on particles, as on the finite elements."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.checks import of_kind
from mpm_core.collective import collectively
from numpy.typing import ArrayLike, NDArray

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.fem.pore_water import pressures_at
from fenics_bridge.types import OfPosition
from mpm_core import Geometry


def boundary_forces(model: mpm.Model, facet_tag: int | str, pressure: float | OfPosition) -> NDArray[np.float64]:
    """Force on each particle by a pressure on the boundary with a tag. Collective.

    A boundary is pressed where there are particles on one side of it only, by those of a cell that are nearest to it. As fields of
    particles the forces move with them: set them anew as they move.

    Args:
        model: the particles.
        facet_tag: number or name of the tag.
        pressure: pressure [Pa], compression positive, or function of positions (n, D) [m] that returns pressures (n,) [Pa], such as
            `hydrostatic` for water that stands over the soil.

    Returns:
        Shape (n, D) [N], [N/m] in plane strain, [N] per radian in an axisymmetric body.

    Raises:
        InputError: no soil lies at the boundary, or pressures that are not finite or of another shape. Raised on all ranks alike.

    Example:
        >>> model.particles.set("traction", boundary_forces(model, SLOPE, hydrostatic(1.5)))
    """
    mesh = of_kind("model", model, mpm.Model).mesh
    tags = collectively(model.comm, lambda: mesh.tags_of("facet", facet_tag))

    def at(x: NDArray[np.float64]) -> ArrayLike:
        return pressure(x) if callable(pressure) else pressure

    nodal = pressures_at(model.comm, at, mesh.points, "pressure")
    force, pressed = _surface_forces(model, np.isin(mesh._core.facet_tags, tags), nodal)
    agree(model.comm, None if pressed else f"pressure: no soil lies at the boundary with the tag {facet_tag!r}")
    return force


def seepage_forces(model: mpm.Model, pore_pressure: OfPosition) -> NDArray[np.float64]:
    """Force -V grad p of the pore water on each particle, p being linear in each cell. Collective.

    For drained soil whose pore pressures stay as they are in space: the laws are then those of effective stresses. As for the
    finite elements, water presses on the surface where it stands on it, and suction does not pull at it: the particles next
    to the surface carry this part. Set the forces anew as particles move.

    Args:
        model: the particles.
        pore_pressure: function of positions (n, D) [m] that returns pore pressures (n,) [Pa].

    Returns:
        Shape (n, D) [N], [N/m] in plane strain, [N] per radian in an axisymmetric body.

    Raises:
        InputError: pore pressures of another shape or not finite. Raised on all ranks alike.

    Example:
        >>> model.particles.set("traction", seepage_forces(model, flow.pore_pressure()))
    """
    mesh, cells = of_kind("model", model, mpm.Model).mesh, model.particles.cell
    problem = f"pore_pressure is {pore_pressure!r}, expected a function of positions, such as hydrostatic(2.0)"
    agree(model.comm, None if callable(pore_pressure) else problem)
    p = pressures_at(model.comm, pore_pressure, mesh.points)
    gradient = np.einsum("ck,ckd->cd", p[mesh.cells], _gradients(mesh))
    force = -model.particles.volume[:, None] * gradient[cells]
    suction = np.maximum(-p, 0.0)
    if model.comm.allreduce(float(suction.max(initial=0.0)), MPI.MAX) == 0:
        return force
    everywhere = np.ones(np.shape(mesh.cells), dtype=bool)
    return force + _surface_forces(model, everywhere, suction)[0]


def _surface_forces(model: mpm.Model, chosen: Any, pressure: Any) -> tuple[NDArray[np.float64], Any]:
    """Forces by a pressure on those chosen facets of cells beyond which there are no particles. Collective.

    Args:
        model: the particles.
        chosen: which facets of the cells, shape (m, D + 1).
        pressure: pressure at the nodes [Pa], shape (k,).

    Returns:
        The forces, and the number of chosen facets at cells with particles, over all ranks.
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


def _gradients(mesh: Any) -> NDArray[np.float64]:
    """Gradients of the shape functions of each cell: (m, D + 1, D) [1/m]."""
    corners = mesh.points[mesh.cells]
    inner = np.swapaxes(np.linalg.inv(corners[:, 1:] - corners[:, :1]), 1, 2)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)
