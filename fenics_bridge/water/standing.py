"""Water that stands on the ground: the load of reservoirs on the soil below them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from fenics_bridge.compat import facet_nodes
from fenics_bridge.errors import agree
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.types import MeshTags
from fenics_bridge.water.boundary import Reservoir, WaterBoundary, value_at
from fenics_bridge.water.soils import WATER_WEIGHT


def standing_water(
    domain: Mesh, facet_tags: MeshTags, boundary: Sequence[WaterBoundary], unit_weight: float = WATER_WEIGHT
) -> Callable[[NDArray[np.float64], float], NDArray[np.float64]]:
    """Pressure of the reservoirs on the ground above each point, for `loading` of `Seepage`, in plane sections. Collective.

    Args:
        domain: mesh of the body.
        facet_tags: tags of the boundary.
        boundary: boundary conditions, of which each Reservoir counts; its surface has one height at each horizontal coordinate.
        unit_weight: unit weight of water [N/m3].

    Returns:
        Function of positions (n, 2) [m] and a time [s] that returns pressures (n,) [Pa]; it may be called on any rank.

    Raises:
        InputError: the mesh has not two dimensions, a tag is unknown, or there is no reservoir. Raised on all ranks alike.
    """
    dim = domain.geometry.dim
    agree(domain.comm, None if dim == 2 else f"domain has {dim} dimensions, expected a plane section")
    reservoirs = [condition for condition in boundary if isinstance(condition, Reservoir)]
    agree(domain.comm, None if reservoirs else "boundary has no Reservoir, expected one or more")
    grounds = [(condition, ground_line(domain, facet_tags, condition.facet_tag)) for condition in reservoirs]
    close = 1e-9 * max(
        (np.ptp(line) for _, ground in grounds for line in ground), default=0.0
    )  # round-off of coordinates

    def pressure(points: NDArray[np.float64], time: float) -> Any:
        deepest = np.zeros(len(points))
        for condition, (x, y) in grounds:
            below = (points[:, 0] >= x[0] - close) & (points[:, 0] <= x[-1] + close)
            depth = np.where(below, value_at(condition.level, time) - np.interp(points[:, 0], x, y), 0.0)
            deepest = np.maximum(deepest, depth)
        return unit_weight * deepest

    return pressure


def ground_line(domain: Mesh, facet_tags: MeshTags, tag: int | str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The surface at the facets of a tag as a line, in a plane section. Collective.

    Args:
        domain: mesh of the body.
        facet_tags: tags of the boundary.
        tag: number or name of the tag.

    Returns:
        Coordinates x, rising, and the highest y at each of them [m], both of shape (k,).

    Raises:
        InputError: no facet has the tag. Raised on all ranks alike.
    """
    facets = tagged_facets(domain.comm, facet_tags, tag, "boundary")
    nodes = domain.geometry.x[facet_nodes(domain, facets).ravel()][:, :2]
    x, y = np.concatenate(domain.comm.allgather(nodes)).T
    size = max(np.ptp(x), np.ptp(y))
    order = np.lexsort((-y, np.round(x / (1e-9 * size))))
    x, y = x[order], y[order]
    first = np.concatenate([[True], np.diff(x) > 1e-9 * size])
    return x[first], y[first]
