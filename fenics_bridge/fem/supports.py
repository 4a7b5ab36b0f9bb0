"""Supports of a body by facet tag: fixed, rollers, prescribed displacements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.compat import facet_nodes
from fenics_bridge.errors import InputError, agree
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.types import MeshTags
from mpm_core.mesh import Tag


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
    """Roller: no displacement along the normal, free sliding across it.

    (The finite elements prescribe components of displacements; a roller at an angle to the axes would tie several of them
    together. Particles can have one: `mpm_core.Model.roller`.)

    Args:
        facet_tag: number or name of the tag of the facets.
        normal: axis of the normal, shape (D,), e.g. (1, 0).

    Raises:
        InputError: normal is not an axis.
    """
    normal = np.asarray(normal, dtype=float)
    along = np.flatnonzero(normal)
    if len(along) != 1:
        raise InputError(
            f"normal is {tuple(normal.tolist())}, expected an axis such as (1, 0): the finite elements hold "
            "components of the displacement, so their rollers cannot be inclined"
        )
    return Support(facet_tag, tuple(0.0 if i == along[0] else None for i in range(len(normal))))


def prescribed(facet_tag: int | str, displacement: Sequence[float | None]) -> Support:
    """Prescribed displacement on a part of the boundary.

    Args:
        facet_tag: number or name of the tag of the facets.
        displacement: components of the displacement [m], shape (D,); None leaves a component free.
    """
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
        InputError: an unknown tag, or displacements of another shape or not finite. Raised on all ranks alike.
    """

    def __init__(
        self,
        space: Any,
        facet_tags: MeshTags,
        supports: Sequence[Support],
        held: Sequence[int] | NDArray[np.int32] = (),
    ) -> None:
        domain, dim = space.mesh, space.mesh.geometry.dim
        agree(domain.comm, _first_mistake(domain, facet_tags, supports, dim))
        domain.topology.create_connectivity(dim - 1, dim)
        value_of = {}
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
    facets = tagged_facets(domain.comm, facet_tags, tag, "facet_tag")
    corners = domain.geometry.x[facet_nodes(domain, facets)][:, :, : domain.geometry.dim]
    size = np.ptp(domain.geometry.x, axis=0).max() if len(domain.geometry.x) else 0.0
    flat = np.ptp(corners, axis=1) <= 1e-9 * size
    along = np.flatnonzero(np.all(domain.comm.allgather(flat.all(axis=0)), axis=0))
    return tuple(float(k == along[0]) for k in range(domain.geometry.dim)) if len(along) == 1 else None


def tagged_facets(comm: MPI.Comm, facet_tags: MeshTags, tag: Tag, argument: str) -> NDArray[np.int32]:
    """Facets of this rank with a tag, or tags, by number or name. Raises InputError, on all ranks, for none. Collective."""
    return facet_tags.indices[np.isin(facet_tags.values, tag_numbers(comm, facet_tags, tag, argument))]


def _first_mistake(domain: Mesh, facet_tags: MeshTags, supports: Sequence[Support], dim: int) -> str | None:
    if isinstance(supports, Support) or not all(isinstance(support, Support) for support in supports):
        return f"supports is {supports!r}, expected a list of what `fixed`, `roller` and `prescribed` return"
    for support in supports:
        tag_numbers(domain.comm, facet_tags, support.facet_tag, "supports")
        displacement = support.displacement
        if displacement is not None and len(displacement) != dim:
            return f"supports: {support} has {len(displacement)} components, expected {dim}"
        if displacement is not None and not all(v is None or np.isfinite(v) for v in displacement):
            return f"supports: {support} has a value that is not finite"
    return None
