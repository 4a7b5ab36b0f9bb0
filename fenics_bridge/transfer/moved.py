"""Volumes of particles that have moved with a body, fitted to its volume in each cell of their mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.fields import cell_function
from fenics_bridge.fem.geometry import Geometry, body_volumes
from fenics_bridge.mesh.tagged import cell_corners, cell_volumes

_SAMPLES = 400
"""Approximate number of samples of the body in one cell of the particles' mesh"""
_FULL = 0.95
"""Filled fraction above which a cell counts as full: the samples are accurate to about a hundredth."""


def volume_change(displacement: fem.Function) -> fem.Function:
    """det(1 + grad u) as a function that is linear in each cell: exact for linear displacements.

    Of an axisymmetric body it is the change of the section's area; volumes change by the ratio of the radii besides.
    """
    domain = displacement.function_space.mesh
    change = ufl.det(ufl.Identity(domain.geometry.dim) + ufl.grad(displacement))
    return cell_function(domain, ufl.as_vector([change]), 1, "volume change")


def cell_gradient(function: fem.Function) -> fem.Function:
    """Gradient of a scalar function that is linear in each cell: a function that is constant in each cell."""
    return cell_function(function.function_space.mesh, ufl.grad(function), 0, "gradient")


def held_volumes(domain: Mesh, displacement: fem.Function, geometry: Geometry | None = None) -> NDArray[np.float64]:
    """Volume of the moved body in each cell of another mesh that this rank owns. Collective.

    Sampled in the cells of the finite elements, each sample moved by the displacement. Parts of the body outside of
    the other mesh are left out.

    Args:
        domain: the other mesh.
        displacement: displacement of the finite elements [m].
        geometry: plane strain, axial symmetry or a solid; volumes of an axisymmetric body are those of one radian.

    Returns:
        Shape (m,) [m^D].
    """
    body, volumes = displacement.function_space.mesh, body_volumes(domain, geometry)
    own = cell_volumes(body)
    per_cell = max(1, round(_SAMPLES * _mean(body.comm, own) / _mean(domain.comm, cell_volumes(domain))))
    samples = simplex_samples(body.geometry.dim, per_cell)
    at = np.zeros((len(own) * len(samples), 3))
    places = np.einsum("qk,ckd->cqd", samples, _ordered(cell_corners(body)))
    at[:, : body.geometry.dim] = places.reshape(len(at), body.geometry.dim)
    cells = np.repeat(np.arange(len(own), dtype=np.int32), len(samples))
    moved, sampled = at[:, : body.geometry.dim], np.repeat(own / len(samples), len(samples))
    if len(at):
        moved = moved + np.asarray(displacement.eval(at, cells)).reshape(moved.shape)
        sampled = sampled * np.asarray(volume_change(displacement).eval(at, cells)).ravel()
    if geometry == Geometry.AXISYMMETRIC:
        sampled = sampled * moved[:, 0]
    held = PointSearch(domain, moved).cell_sums(sampled)
    return np.where(held > _FULL * volumes, volumes, held)


def fitted_volumes(
    volume: NDArray[np.float64], cell: NDArray[np.integer], held: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Volumes of particles, scaled in each cell so that they add up to what the cell holds of the body.

    A particle that has crossed into a full cell would else make it fuller than full, and leave a gap where it was:
    forces out of balance by a fraction of the stress on a cell's side, however small the displacements are.

    Args:
        volume: volumes of the particles [m^D], shape (n,).
        cell: their cells, shape (n,).
        held: volume of the body in each cell [m^D], shape (m,); 0 where the samples found nothing, and the particles keep their
            volume.
    """
    together = np.bincount(cell, volume, len(held))
    factor = np.divide(held, together, out=np.ones(len(held)), where=(together > 0) & (held > 0))
    return volume * factor[cell]


def simplex_samples(dim: int, count: int) -> NDArray[np.float64]:
    """Points spread evenly over a simplex, for equal fractions of its volume.

    A sequence of low discrepancy in the unit cube, multiples of the powers of 1/g with g^(D + 1) = g + 1 (Roberts 2018,
    The unreasonable effectiveness of quasirandom sequences); sorting coordinates maps the cube evenly to the simplex
    1 > x > y > z > 0.

    Args:
        dim: dimension D of the simplex, 2 or 3.
        count: number of points.

    Returns:
        Barycentric coordinates, shape (count, D + 1).
    """
    root = {2: 1.324717957244746, 3: 1.2207440846057596}[dim]
    points = -np.sort(-(np.outer(np.arange(count) + 0.5, root ** -np.arange(1.0, dim + 1)) % 1.0), axis=1)
    ends = np.pad(points, ((0, 0), (1, 1)), constant_values=((0, 0), (1, 0)))
    return -np.diff(ends, axis=1)


def _ordered(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """The corners of each cell by their coordinates: their numbers, and so the samples, would depend on the partition."""
    order = np.lexsort(np.moveaxis(corners, 2, 0), axis=-1)
    return np.take_along_axis(corners, order[:, :, None], axis=1)


def _mean(comm: MPI.Comm, values: NDArray[Any]) -> Any:
    return comm.allreduce(float(values.sum())) / comm.allreduce(len(values), MPI.SUM)
