"""The geometries of a body of two dimensions: plane strain, or a half section of an axisymmetric body.

In an axisymmetric body the first coordinate is the radius r from the axis and the second one runs along the axis; the components
of stress and strain are rr, yy, theta theta, ry. Volumes, forces and energies are those of one radian: times 2 pi they are those
of the whole body.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, Mesh
from mpi4py import MPI
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.mesh.tagged import cell_corners, cell_volumes
from mpm_core import Geometry


def geometry_of(domain: Mesh, given: Geometry | None = None) -> Geometry:
    """The geometry of a mesh: the one that is given, or that of its dimension. Collective.

    Args:
        domain: mesh of the body.
        given: geometry; None for plane strain in two dimensions and a solid in three.

    Raises:
        InputError: other cells than triangles and tetrahedra, a geometry that does not go with the dimension, or radii below zero.
            Raised on all ranks alike.
    """
    dim, kind = domain.geometry.dim, domain.topology.cell_type
    simplices = {2: CellType.triangle, 3: CellType.tetrahedron}
    text = f"domain has cells of the kind {kind.name} in {dim} dimensions, expected triangles in 2 or tetrahedra in 3"
    agree(domain.comm, None if simplices.get(dim) == kind else text)
    usual = Geometry.PLANE_STRAIN if dim == 2 else Geometry.SOLID
    geometry = usual if given is None else given
    fits = geometry == usual or (geometry == Geometry.AXISYMMETRIC and dim == 2)
    agree(domain.comm, None if fits else f"geometry is {given!r}, which a mesh of {dim} dimensions cannot have")
    if geometry == Geometry.AXISYMMETRIC:
        least = float(domain.geometry.x[:, 0].min(initial=np.inf))
        good = least >= 0
        agree(domain.comm, None if good else f"domain has the radius {least:g} m, expected radii from 0 on")
    return geometry


def radius_of(domain: Mesh, geometry: Geometry | None) -> Any:
    """The radius as a UFL expression in an axisymmetric body; None in others."""
    return ufl.SpatialCoordinate(domain)[0] if geometry == Geometry.AXISYMMETRIC else None


def nodal_radius(domain: Mesh, geometry: Geometry | None) -> Any:
    """The radius as a function that is linear in each cell, in an axisymmetric body; None in others.

    Beside integrals of degree 1, for which FFCx 0.5 takes one radius, others of the same cells need this one.
    """
    if geometry != Geometry.AXISYMMETRIC:
        return None
    radius = fem.Function(compat.function_space(domain, "Lagrange", 1))
    radius.x.array[:] = radius.function_space.tabulate_dof_coordinates()[:, 0]
    return radius


def weighted(integrand: Any, radius: Any) -> Any:
    """An integrand over a mesh, multiplied by the radius in axisymmetric bodies."""
    return integrand if radius is None else radius * integrand


def lumped_radius(domain: Mesh, geometry: Geometry | None) -> Any:
    """The weight of integrals over a mesh by its vertices, in an axisymmetric body; None in others.

    The integral of N_i r dA over a triangle of area A is A / 3 (3 r_m + r_i) / 4, with its mean radius r_m and the radius r_i of
    the vertex: it is above zero on the axis too, and over all vertices the sum is the volume of the triangle. At the vertices
    this function has that value beside A / 3, and no radius, which would be zero on the axis.
    """
    if geometry != Geometry.AXISYMMETRIC:
        return None
    space = compat.function_space(domain, "DG", 1)
    weight, dofs = fem.Function(space), compat.cell_dofs(space)
    radii = space.tabulate_dof_coordinates()[dofs, 0]
    weight.x.array[dofs] = 0.75 * radii.mean(axis=1, keepdims=True) + 0.25 * radii
    return weight


def largest_radius(domain: Mesh, geometry: Geometry | None) -> float:
    """The largest radius of an axisymmetric body [m]; 1 of others. Collective."""
    if geometry != Geometry.AXISYMMETRIC:
        return 1.0
    return float(domain.comm.allreduce(float(domain.geometry.x[:, 0].max(initial=0.0)), MPI.MAX))


def body_volumes(domain: Mesh, geometry: Geometry | None) -> NDArray[np.float64]:
    """Volumes of the cells that this rank owns (m,): [m^D], or of one radian, the integral of r dA, in an axisymmetric body."""
    volumes = cell_volumes(domain)
    return volumes * cell_corners(domain)[:, :, 0].mean(axis=1) if geometry == Geometry.AXISYMMETRIC else volumes


def require_same_geometry(model: Any, fem: Any) -> None:
    """Raise InputError, on all ranks, unless particles and finite elements have the same geometry. Collective."""
    same = model.geometry == fem.geometry
    problem = (
        f"the geometry of the finite elements is {fem.geometry.name}, that of the particles is {model.geometry.name}"
    )
    agree(model.comm, None if same else problem)


def require_axis_held(space: Any, geometry: Geometry, constraints: Any) -> None:
    """Require that nodes on the axis of an axisymmetric body are fixed along the radius. Collective.

    Args:
        space: space of the displacement, or that part of a mixed space.
        geometry: plane strain, axial symmetry or a solid.
        constraints: the boundary conditions.

    Raises:
        InputError: a node on the axis may move along the radius. Raised on all ranks alike.
    """
    if geometry != Geometry.AXISYMMETRIC:
        return
    domain, radial = space.mesh, space.sub(0)
    size = largest_radius(domain, geometry)
    on_axis = fem.locate_dofs_geometrical((radial, radial.collapse()[0]), lambda x: x[0] <= 1e-12 * size)[0]
    free = np.setdiff1d(on_axis, constraints.dofs)
    problem = f"supports: {len(free)} nodes lie on the axis and may move along the radius, expected a roller there"
    agree(domain.comm, problem if len(free) else None)
