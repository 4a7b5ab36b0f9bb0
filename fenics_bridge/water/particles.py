"""Boundary conditions of the water of finite elements, for implicit particles whose pores hold water."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from dolfinx.mesh import Mesh, meshtags

import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.active_cells import cells_there, lonely_nodes
from fenics_bridge.mesh.names import name_tags, tag_numbers
from fenics_bridge.types import MeshTags
from fenics_bridge.water.boundary import Reservoir, WaterBoundary, value_at

WATERLESS = "waterless"
"""Name of the facets of `waterless_facets`"""


def apply_reservoirs(model: mpm.Model, boundary: Iterable[WaterBoundary], time: float) -> None:
    """Let reservoirs stand against the soil of particles, with the levels that they have at a time. Collective.

    Their water has hydrostatic pressure below the level, in the pores and on the soil. Above the level the pressure is zero, so
    that water may enter there, which finite elements do not allow: keep the boundary under water, or wet.

    Args:
        model: particles with pore water, see `Model.add_water`.
        boundary: boundary conditions as for `Consolidation`, all of them reservoirs.
        time: [s].

    Raises:
        InputError: another boundary condition, particles without water, or an unknown tag. Raised on all ranks alike.
    """
    conditions = list(boundary)
    reservoirs = [one for one in conditions if isinstance(one, Reservoir)]
    others = [one for one in conditions if not isinstance(one, Reservoir)]
    agree(model.comm, f"boundary has {others[0]!r}, expected reservoirs only for particles" if others else None)
    for one in reservoirs:
        model.hold_pore_pressure(one.facet_tag, level=value_at(one.level, time))


def waterless_facets(domain: Mesh, cell_tags: MeshTags, facet_tags: MeshTags, soils: Sequence[int | str]) -> MeshTags:
    """Facets in soil that holds no water, beside those that have a tag, under the name `WATERLESS`.

    All particles of a model have pore water or none. Soil that drains at once, such as a fill, has the pressure zero at these
    facets, which have no node in common with other soil: there the boundary conditions of the water hold.

    Args:
        domain: mesh of the soils.
        cell_tags: tags of its cells.
        facet_tags: tags of its boundary.
        soils: tags of the soils without water, by number or name.

    Returns:
        The tags of the facets with these facets among them, for `background_mesh`.

    Raises:
        InputError: no cell has a tag. Raised on all ranks alike.

    Note:
        Collective.
    """
    comm, dim = domain.comm, domain.topology.dim
    wet = cells_there(domain, cell_tags, tag_numbers(comm, cell_tags, list(soils), "soils", "cell"))
    space = compat.function_space(domain, "Lagrange", 1)
    alone = np.zeros(len(domain.geometry.x), dtype=bool)  # by geometry node
    dofs, nodes = compat.cell_dofs(space), compat.cell_nodes(domain)
    alone[nodes.ravel()] = np.isin(dofs.ravel(), lonely_nodes(space, wet))
    domain.topology.create_entities(dim - 1)
    facets = domain.topology.index_map(dim - 1)
    own = np.setdiff1d(np.arange(facets.size_local + facets.num_ghosts, dtype=np.int32), facet_tags.indices)
    own = own[alone[compat.facet_nodes(domain, own)].all(axis=1)]
    number = 1 + max(comm.allgather(int(facet_tags.values.max(initial=0))))
    indices = np.concatenate([facet_tags.indices, own])
    values = np.concatenate([facet_tags.values, np.full(len(own), number, dtype=np.int32)])
    order = np.argsort(indices)
    tags = meshtags(domain, dim - 1, indices[order], values[order])
    return name_tags(tags, {**getattr(facet_tags, "names", {}), WATERLESS: number})
