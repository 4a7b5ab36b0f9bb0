"""Supports of a body by facet tag: fixed, rollers, prescribed displacements."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import InputError, agree, is_finite, require_mesh
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.mesh.tagged import require_tags_of
from fenics_bridge.types import MeshTags
from mpm_core.mesh import Tag, floats


@dataclass(frozen=True)
class Support:
    """Boundary condition on the facets of one tag: prescribed components of the displacement."""

    facet_tag: int | str
    """Number or name of the tag"""
    displacement: tuple[float | None, ...] | None = None
    """Components of the displacement [m], shape (D,), of which None leaves one free; None instead of a tuple sets all to zero"""


def fixed(facet_tag: int | str) -> Support:
    """Fixed boundary: no displacement in any direction.

    Args:
        facet_tag: number or name of the tag of the facets.
    """
    return Support(facet_tag)


def roller(facet_tag: int | str, normal: ArrayLike) -> Support:
    """Roller: no displacement along the normal, free in the tangential directions.

    (The finite elements prescribe components of displacements; a roller at an angle to the axes would tie several of them
    together. Particles can have one: `mpm_core.Model.roller`.)

    Args:
        facet_tag: number or name of the tag of the facets.
        normal: axis of the normal, shape (D,), e.g. (1, 0).

    Raises:
        InputError: normal is not an axis.
    """
    normal = floats("normal", normal, (None,))
    along = np.flatnonzero(normal)
    if len(along) != 1:
        raise InputError(
            f"normal is {tuple(normal.tolist())}, expected an axis such as (1, 0): the finite elements hold "
            "components of the displacement, so their rollers cannot be inclined"
        )
    return Support(facet_tag, tuple(0.0 if i == along[0] else None for i in range(len(normal))))


def prescribed(facet_tag: int | str, displacement: Sequence[float | None]) -> Support:
    """Prescribed displacement on a part of the boundary, of which a load applies the fraction `Load.displacement`, by default 0.

    Args:
        facet_tag: number or name of the tag of the facets.
        displacement: components of the displacement [m], shape (D,); None leaves a component free.

    Example:
        >>> fem = bridge.QuasiStatic(domain, soil, facet_tags, [bridge.fixed("base"), bridge.prescribed("plate", (None, -0.01))])
        >>> fem.solve(bridge.Load(unit_weight=20e3, displacement=1.0))  # the plate moves down by 10 mm

    Raises:
        InputError: displacement is no sequence.
    """
    if isinstance(displacement, str) or not hasattr(displacement, "__iter__"):
        raise InputError(f"displacement is {displacement!r}, expected its components, such as (None, -0.01)")
    return Support(facet_tag, tuple(displacement))


class Constraints:
    """The supports of a body on the degrees of freedom of a displacement space. Collective.

    Where supports meet, the later one holds.

    Args:
        space: space of the displacement, or that part of a mixed space.
        facet_tags: tags of the boundary.
        supports: the boundary conditions.
        held: further dofs (local, blocked) that stay.

    Raises:
        InputError: an unknown tag, tags of another mesh, or displacements of another shape or not finite. Raised on all ranks
            alike.
    """

    def __init__(
        self,
        space: Any,
        facet_tags: MeshTags,
        supports: Sequence[Support],
        held: Sequence[int] | NDArray[np.int32] = (),
    ) -> None:
        domain, dim = space.mesh, space.mesh.geometry.dim
        require_tags_of(domain, facet_tags, domain.topology.dim - 1)
        agree(domain.comm, _first_mistake(domain, facet_tags, supports, dim))
        domain.topology.create_connectivity(dim - 1, dim)
        value_of = {}
        self.supports = supports
        self.bcs = []
        """Conditions for the assembly of matrices"""
        for support in supports:
            displacement = support.displacement or (0.0,) * dim
            facets = tagged_facets(domain.comm, facet_tags, support.facet_tag, "supports")
            for component, value in enumerate(displacement):
                if value is None:
                    continue
                part = space.sub(component)
                dofs = fem.locate_dofs_topological(part, dim - 1, facets)
                self.bcs.append(fem.dirichletbc(np.float64(0.0), dofs, part))
                value_of.update(dict.fromkeys(dofs.tolist(), float(value)))
        if len(held):
            self.bcs.append(fem.dirichletbc(np.zeros(dim), np.asarray(held, dtype=np.int32), space))
            value_of.update(dict.fromkeys((dim * np.asarray(held)[:, None] + np.arange(dim)).ravel().tolist(), 0.0))
        self.dofs = np.fromiter(value_of.keys(), np.int32, len(value_of))
        """Prescribed dofs, shape (k,), int32 local, unrolled over components and with ghosts"""
        self.values = np.fromiter(value_of.values(), float, len(value_of))
        """Their displacements [m], shape (k,)"""
        self.origin = np.zeros(len(value_of))
        """Displacements from which the values count [m], shape (k,)"""

    def at(self, fraction: float) -> NDArray[np.float64]:
        """Displacements (k,) [m] of the dofs at a fraction of the values."""
        return self.origin + fraction * self.values


def carried_fractions(
    space: Any, facet_tags: MeshTags, supports: Sequence[Support], facet_tag: int | str
) -> NDArray[np.float64]:
    """Fractions of the forces at the nodes of a body that its supports at the facets of a tag carry. Collective.

    A component that the supports of several tags hold at a node, such as a corner, belongs to them in proportion to the areas
    of their facets as seen along it: that across a side to the side, that across the base to the base.

    Args:
        space: Lagrange space of displacements.
        facet_tags: tags of the boundary.
        supports: the boundary conditions.
        facet_tag: number or name of the tag.

    Returns:
        Shape (n, D), by local nodes; 0 for components that nothing holds.

    Raises:
        InputError: no facet has the tag. Raised on all ranks alike.
    """
    comm, dim = space.mesh.comm, space.mesh.geometry.dim
    asked = tag_numbers(comm, facet_tags, facet_tag, "facet_tag")
    areas = fem.Function(space), fem.Function(space)
    carried, whole = (function.x.array.reshape(-1, dim) for function in areas)
    for number, held in held_components(space.mesh, facet_tags, supports).items():
        for nodes, area in _areas_of_nodes(space, facet_tags.indices[facet_tags.values == number]):
            whole[nodes] += held * area
            if number in asked:
                carried[nodes] += held * area
    for function in areas:
        compat.add_shared(function.x)
    return carried / np.where(whole > 0, whole, 1.0)


def held_components(domain: Mesh, facet_tags: MeshTags, supports: Sequence[Support]) -> dict[int, NDArray[np.bool_]]:
    """Which components of the displacement (D,) supports hold, by the number of each tag that has any. Collective."""
    holds: dict[int, NDArray[np.bool_]] = {}
    for support in supports:
        components = [value is not None for value in support.displacement or (0.0,) * domain.geometry.dim]
        for number in tag_numbers(domain.comm, facet_tags, support.facet_tag, "supports"):
            holds[number] = holds.get(number, False) | np.array(components)
    return holds


def _areas_of_nodes(space: Any, facets: NDArray[np.int32]) -> Iterator[tuple[NDArray[np.int32], NDArray[np.float64]]]:
    """For each of these facets that this rank owns, its nodes, and its area as seen along the axes (D) [m^(D-1)]."""
    domain, dim = space.mesh, space.mesh.geometry.dim
    domain.topology.create_connectivity(dim - 1, dim)
    domain.topology.create_connectivity(dim, dim - 1)
    cells_of, facets_of = domain.topology.connectivity(dim - 1, dim), domain.topology.connectivity(dim, dim - 1)
    own = facets[facets < domain.topology.index_map(dim - 1).size_local]
    edges = np.diff(domain.geometry.x[compat.facet_nodes(domain, own)][:, :, :dim], axis=1)
    across = np.cross(edges[:, 0], edges[:, 1]) if dim == 3 else edges[:, 0, ::-1]
    seen = np.abs(across) + 1e-9 * np.linalg.norm(
        across, axis=1, keepdims=True
    )  # for components that slide along all of them
    for facet, area in zip(own, seen, strict=True):
        cell = cells_of.links(facet)[0]
        closure = space.dofmap.dof_layout.entity_closure_dofs(dim - 1, list(facets_of.links(cell)).index(facet))
        yield space.dofmap.cell_dofs(cell)[closure], area


def flat_normal(domain: Mesh, facet_tags: MeshTags, tag: int | str) -> tuple[float, ...] | None:
    """The axis to which all facets of a tag are at right angles. Collective.

    Args:
        domain: mesh of DOLFINx.
        facet_tags: tags of its facets.
        tag: number or name of a tag.

    Returns:
        The axis, such as (1.0, 0.0); None where there is none.

    Raises:
        InputError: no facet has the tag. Raised on all ranks alike.
    """
    require_mesh(domain)
    facets = tagged_facets(domain.comm, facet_tags, tag, "facet_tag")
    corners = domain.geometry.x[compat.facet_nodes(domain, facets)][:, :, : domain.geometry.dim]
    size = np.ptp(domain.geometry.x, axis=0).max() if len(domain.geometry.x) else 0.0
    flat = np.ptp(corners, axis=1) <= 1e-9 * size
    along = np.flatnonzero(np.all(domain.comm.allgather(flat.all(axis=0)), axis=0))
    return tuple(float(k == along[0]) for k in range(domain.geometry.dim)) if len(along) == 1 else None


def tagged_facets(comm: MPI.Comm, facet_tags: MeshTags, tag: Tag, argument: str) -> NDArray[np.int32]:
    """Facets of this rank with a tag, or tags, by number or name. Raises InputError, on all ranks, for none. Collective."""
    return facet_tags.indices[np.isin(facet_tags.values, tag_numbers(comm, facet_tags, tag, argument))]


def not_supports(supports: Any) -> str | None:
    """What is wrong where an argument is no list of supports."""
    if isinstance(supports, Sequence) and all(isinstance(support, Support) for support in supports):
        return None
    return f"supports is {supports!r}, expected a list of what `fixed`, `roller` and `prescribed` return"


def _first_mistake(domain: Mesh, facet_tags: MeshTags, supports: Sequence[Support], dim: int) -> str | None:
    if text := not_supports(supports):
        return text
    for support in supports:
        tag_numbers(domain.comm, facet_tags, support.facet_tag, "supports")
        displacement = support.displacement
        if displacement is not None and len(displacement) != dim:
            return f"supports: {support} has {len(displacement)} components, expected {dim}"
        if displacement is not None and not all(v is None or is_finite(v) for v in displacement):
            return f"supports: {support} has a value that is no finite number"
    return None
