"""Elastic ground far from a slide, eliminated once to a stiffness on the border of the particles' mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.errors import agree, is_finite, require_mesh
from fenics_bridge.fem.fields import assembled, elastic_stress, strain
from fenics_bridge.fem.geometry import geometry_of, radius_of, require_axis_held, require_same_geometry, weighted
from fenics_bridge.fem.linear_solver import LinearSolver
from fenics_bridge.fem.stiffness import Stiffness
from fenics_bridge.fem.supports import Constraints, Support, tagged_facets
from fenics_bridge.transfer.border import Facets, facets_of_mesh, facets_of_space, measure, sides_of
from fenics_bridge.transfer.mortar import interpolated, overlap, projection
from fenics_bridge.types import MeshTags
from fenics_bridge.views import body_text


class Border(NamedTuple):
    """The far field on the nodes of a particles' mesh, on all ranks."""

    nodes: NDArray[np.int64]
    """Numbers of the nodes over all ranks (n,), in the order of their places"""
    stiffness: NDArray[np.float64]
    """K [N/m], shape (n D, n D)"""
    mass: NDArray[np.float64]
    """W [kg], shape (n, D, D): forces by a gravity of 1 m/s2 along each axis, in the last index"""


class FarField:
    """Linear elastic ground, condensed to the border where the particles' mesh begins: f = W g - K u.

    Finite elements of any degree, on a mesh of their own, give the stiffness of the border by static condensation: one solution
    for each of its degrees of freedom, with one factorisation. Their ground has no inertia.

    Args:
        domain: mesh of the ground beyond the border.
        facet_tags: tags of its facets.
        border: facets at which the mesh of the particles begins, by tag or name.
        supports: boundary conditions elsewhere, of displacements that are zero.
        young: Young's modulus [Pa].
        poisson: Poisson's ratio [-].
        density: [kg/m3]; without weight by default.
        degree: of the elements, from 1 on.
        geometry: `Geometry.AXISYMMETRIC` for a half section of a body of revolution, with x the radius; by default plane strain
            in two dimensions and a solid in three.
        options_prefix: prefix of the PETSc options of the linear solver.

    Raises:
        InputError: an argument out of range, an unknown tag, a border inside of the ground, a support that moves. On all ranks.
        RuntimeError: the linear solver failed.

    Note:
        Collective, as its methods are. The stiffness is full: (D n)^2 numbers on each rank for n nodes on the border.

    Example:
        >>> far = bridge.FarField(ground, facets, border="cut", supports=[bridge.fixed("base")], young=1e9, poisson=0.3)
        >>> far.attach(model, "cut")
    """

    def __init__(
        self,
        domain: Mesh,
        facet_tags: MeshTags,
        *,
        border: int | str | Sequence[int | str],
        supports: Sequence[Support],
        young: float,
        poisson: float,
        density: float = 0.0,
        degree: int = 2,
        geometry: mpm.Geometry | None = None,
        options_prefix: str = "far_field_",
    ) -> None:
        require_mesh(domain, connected=True)
        agree(domain.comm, _first_mistake(young, poisson, density, degree, supports))
        self._domain = domain
        self.geometry = geometry_of(domain, geometry)
        self._space = compat.function_space(domain, "Lagrange", degree, domain.geometry.dim)
        on_border = tagged_facets(domain.comm, facet_tags, border, "border")
        self._facets = facets_of_space(self._space, on_border)
        domain.topology.create_connectivity(domain.topology.dim - 1, domain.topology.dim)
        blocks = fem.locate_dofs_topological(self._space, domain.topology.dim - 1, on_border)
        held = Constraints(self._space, facet_tags, supports)
        require_axis_held(self._space, self.geometry, held)
        self._ground = f"linear elastic, E = {young:g} Pa, nu = {poisson:g}, density {density:g} kg/m3"
        self._degree = degree
        self._condense(blocks, held, float(young), float(poisson), float(density), options_prefix)

    def __repr__(self) -> str:
        border = f"border of {len(self.nodes)} nodes with {len(self.stiffness)} degrees of freedom"
        return body_text(
            "FarField",
            self._domain,
            f"displacement of degree {self._degree}",
            self._ground,
            border,
            geometry=self.geometry,
        )

    def _condense(
        self,
        blocks: NDArray[np.int32],
        held: Constraints,
        young: float,
        poisson: float,
        density: float,
        options_prefix: str,
    ) -> None:
        """Find the stiffness of the free components of the border's nodes, and their forces by unit gravity."""
        space, dim = self._space, self._domain.geometry.dim
        v, du = ufl.TestFunction(space), ufl.TrialFunction(space)
        moduli = [fem.Constant(self._domain, value) for value in (young, poisson)]
        radius = radius_of(self._domain, self.geometry)
        work = weighted(ufl.inner(elastic_stress(strain(du, radius), *moduli), strain(v, radius)), radius) * ufl.dx
        self._whole = petsc.assemble_matrix(fem.form(work))
        self._whole.assemble()
        self._inner_ends = Constraints(space, None, (), blocks)
        self._fixed = np.union1d(held.dofs, self._inner_ends.dofs)
        self._inner_ends.bcs += held.bcs
        self._inner = Stiffness(work, self._inner_ends).assembled()
        self._solver = LinearSolver(space, options_prefix)
        self._loads = []
        for axis in np.eye(dim):
            force = fem.Constant(self._domain, density * axis)
            self._loads.append(assembled(fem.form(weighted(ufl.inner(force, v), radius) * ufl.dx), space).array.copy())

        index_map = space.dofmap.index_map
        numbers = index_map.local_to_global(np.arange(index_map.size_local + index_map.num_ghosts, dtype=np.int32))
        own = np.unique(blocks[blocks < index_map.size_local])
        self.nodes = np.unique(np.concatenate(self._domain.comm.allgather(numbers[own])))
        """Numbers over all ranks of the border's nodes, rising (n,)"""
        is_held = np.zeros(len(numbers) * dim, dtype=np.int8)
        is_held[held.dofs] = 1
        self._own = own, np.searchsorted(self.nodes, numbers[own])
        self._free = self._summed(1 - is_held.reshape(-1, dim)) > 0
        rows = np.argwhere(self._free)
        self.stiffness = np.zeros((len(rows), len(rows)))
        """K of the free components of the border's nodes, node after node [N/m]"""
        for column, (node, component) in enumerate(rows):
            unit = np.zeros(self._free.shape)
            unit[node, component] = 1.0
            self.stiffness[:, column] = self._reaction(self._displaced(unit))[self._free]
        self.stiffness = 0.5 * (self.stiffness + self.stiffness.T)  # but for round-off of the solver
        weights = [
            self._summed(load.reshape(-1, dim)) - self._reaction(self._displaced(np.zeros(self._free.shape), load))
            for load in self._loads
        ]
        self.mass = np.stack([weight[self._free] for weight in weights], axis=1)
        """Forces on these components by a gravity of 1 m/s2 along each axis [kg], shape (n free, D)"""

    def _summed(self, values: NDArray) -> NDArray[np.float64]:
        """Values of the border's nodes (n, D), on all ranks, from those at all nodes of each rank."""
        found = np.zeros((len(self.nodes), values.shape[1]))
        rows, places = self._own
        found[places] = values[rows]
        return self._domain.comm.allreduce(found)

    def _displaced(self, border: NDArray[np.float64], load: NDArray[np.float64] | float = 0.0) -> fem.Function:
        """Equilibrium of the ground for displacements (n, D) [m] of the border's nodes and forces on its nodes [N]."""
        space, dim = self._space, self._domain.geometry.dim
        displacement, inner = fem.Function(space, name="displacement"), fem.Function(space)
        rows, places = self._own
        displacement.x.array.reshape(-1, dim)[rows] = border[places]
        displacement.x.scatter_forward()
        residual = fem.Function(space).x
        residual.array[:] = load - self._forces(displacement)
        residual.array[self._fixed] = 0.0
        failure = self._solver.solve(self._inner, residual, inner)
        if failure:
            raise RuntimeError(f"far field: {failure}")
        displacement.x.array[:] += inner.x.array
        return displacement

    def _forces(self, displacement: fem.Function) -> NDArray[np.float64]:
        """Forces of the ground's stresses on its nodes [N], unrolled, zero for ghosts."""
        n = self._space.dofmap.index_map.size_local * self._domain.geometry.dim
        x, y = self._whole.createVecs()
        x.array[:] = displacement.x.array[:n]
        self._whole.mult(x, y)
        forces = np.zeros_like(displacement.x.array)
        forces[:n] = y.array_r
        return forces

    def _reaction(self, displacement: fem.Function) -> NDArray[np.float64]:
        """Forces of stresses on the border's nodes (n, D), on all ranks."""
        return self._summed(self._forces(displacement).reshape(-1, self._domain.geometry.dim))

    def attach(self, model: mpm.Model, facet_tag: int | str | Sequence[int | str], *, balanced: bool = False) -> None:
        """Attach the ground to the particles' mesh; it acts in all later implicit steps.

        The border's nodes need not match. The displacement of the finite elements' border is the mortar projection of that of the
        particles' mesh, and the forces on the latter are its transpose: they do the same work, and a state of constant stress
        passes through the border as it is.

        Args:
            model: the particles; all cells along the border have some.
            facet_tag: the border's facets in the particles' mesh, by tag or name: the same lines or surfaces as the border.
            balanced: whether the soil is in equilibrium now, held by the ground beyond; see `mpm_core.Model.attach_far_field`.

        Raises:
            InputError: the facets do not cover the border, or what `mpm_core.Model.attach_far_field` refuses. On all ranks alike.
        """
        require_same_geometry(model, self)
        border = self.on_mesh(model.mesh, facet_tag)
        model.attach_far_field(border.nodes, border.stiffness, border.mass, balanced=balanced)

    def on_mesh(self, mesh: mpm.Mesh, facet_tag: int | str | Sequence[int | str]) -> Border:
        """Stiffness and weight on the nodes of a particles' mesh along the border, as `attach` takes them.

        Args:
            mesh: mesh of the particles.
            facet_tag: the border's facets in it, by tag or name.

        Raises:
            InputError: the facets do not cover the border. On all ranks alike.
        """
        other = facets_of_mesh(mesh, tuple(mesh.tags_of("facet", facet_tag)))
        nodes, first = np.unique(other.nodes, return_index=True)
        by_radius = self.geometry == mpm.Geometry.AXISYMMETRIC
        sides = [overlap(side, other, self.nodes, nodes, by_radius) for side in sides_of(self._facets)]
        _require_same_border(mesh.comm, self._facets, other, sum(side.area for side in sides))
        places = other.points.reshape(-1, mesh.dim)[first]
        order = np.lexsort(np.round(places, 9).T)  # which does not depend on the ranks
        interpolation = interpolated(other, nodes, self._positions())
        self._projection = [
            projection(sides, free, interpolation, self._positions())[:, order] for free in self._free.T
        ]
        whole = np.zeros((len(self.stiffness), len(nodes), mesh.dim))  # from that mesh to the free components
        for row, (node, component) in enumerate(np.argwhere(self._free)):
            whole[row, :, component] = self._projection[component][node]
        flat = whole.reshape(len(whole), -1)
        return Border(nodes[order], flat.T @ self.stiffness @ flat, np.einsum("rna,rd->nad", whole, self.mass))

    def _positions(self) -> NDArray[np.float64]:
        numbers, first = np.unique(self._facets.nodes, return_index=True)
        return self._facets.points.reshape(-1, self._domain.geometry.dim)[first]

    def displacement(self, model: mpm.Model) -> fem.Function:
        """Displacement of the far field since `attach` [m], which follows from that of the border and from the present gravity.

        A far field that was attached as `balanced` was in equilibrium with the gravity of that time: only its change counts.

        Args:
            model: the model that the far field is attached to.
        """
        moved = model.far_field_displacement
        border = np.stack([self._projection[a] @ moved[:, a] for a in range(moved.shape[1])], axis=1)
        added = model.gravity - model.far_field_gravity
        return self._displaced(border, sum(g * load for g, load in zip(added, self._loads, strict=True)))


def _first_mistake(
    young: float, poisson: float, density: float, degree: int, supports: Sequence[Support]
) -> str | None:
    if not (is_finite(young) and young > 0):
        return f"young is {young!r} Pa, expected a positive number"
    if not (is_finite(poisson) and 0 <= poisson < 0.5):
        return f"poisson is {poisson!r}, expected at least 0 and below 0.5"
    if not (is_finite(density) and density >= 0):
        return f"density is {density!r} kg/m3, expected a number not below zero"
    if isinstance(degree, bool) or degree != int(degree) or degree < 1:
        return f"degree is {degree!r}, expected a whole number from 1 on"
    moving = [support for support in supports if any(support.displacement or ())]
    return f"supports: {moving[0]} moves, expected displacements of zero" if moving else None


def _require_same_border(comm: MPI.Comm, first: Facets, second: Facets, common: float) -> None:
    """Raise InputError unless two borders are the same lines or surfaces."""
    sizes = [sum(measure(corners) for corners in facets.corners) for facets in (first, second)]
    same = np.allclose(sizes, common, rtol=1e-6)
    agree(
        comm,
        None
        if same
        else f"facet_tag: its facets have {sizes[1]:.6g} m^(D-1), the border of the far field {sizes[0]:.6g}, of which "
        f"{common:.6g} lie on each other; expected the same lines or surfaces",
    )
