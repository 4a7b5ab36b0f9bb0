"""Water that stands on the ground: the load of reservoirs on the soil below them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from mpm_core.water_checks import LABORATORY_GRAVITY
from numpy.typing import NDArray

from fenics_bridge.compat import facet_nodes
from fenics_bridge.errors import agree, require_mesh
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.types import MeshTags, OfPosition
from fenics_bridge.water.boundary import Reservoir, WaterBoundary, value_at
from fenics_bridge.water.soils import given_water


def standing_water(
    domain: Mesh,
    facet_tags: MeshTags,
    boundary: Sequence[WaterBoundary],
    unit_weight: float | None = None,
    gravity: float = LABORATORY_GRAVITY,
) -> Callable[[NDArray[np.float64], float], NDArray[np.float64]]:
    """Pressure of the reservoirs on the ground above each point, for `loading` of `Seepage`, in plane sections. Collective.

    Args:
        domain: mesh of the body.
        facet_tags: tags of the boundary.
        boundary: boundary conditions, of which each Reservoir counts; its surface has one height at each horizontal coordinate.
        unit_weight: unit weight of water [N/m3], under the gravity of the model; by default that of 1000 kg/m3.
        gravity: of the model [m/s2].

    Returns:
        Function of positions (n, 2) [m] and a time [s] that returns pressures (n,) [Pa]; it may be called on any rank.

    Raises:
        InputError: the mesh has not two dimensions, a tag is unknown, or there is no reservoir. Raised on all ranks alike.
    """
    grounds, close, weight = _grounds(domain, facet_tags, boundary, unit_weight, gravity)

    def pressure(points: NDArray[np.float64], time: float) -> Any:
        deepest = np.zeros(len(points))
        for condition, (x, y) in grounds:
            below = (points[:, 0] >= x[0] - close) & (points[:, 0] <= x[-1] + close)
            depth = np.where(below, value_at(condition.level, time) - np.interp(points[:, 0], x, y), 0.0)
            deepest = np.maximum(deepest, depth)
        return weight * deepest

    return pressure


def reservoir_pressure(
    domain: Mesh,
    facet_tags: MeshTags,
    boundary: Sequence[WaterBoundary],
    time: float = 0.0,
    unit_weight: float | None = None,
    gravity: float = LABORATORY_GRAVITY,
) -> OfPosition:
    """Pressure in the water of the reservoirs, for `outside` of `Seepage.pore_pressure`, in plane sections. Collective.

    Args:
        domain: mesh of the body.
        facet_tags: tags of the boundary.
        boundary: boundary conditions, of which each Reservoir counts; its water stands above the facets of its tag.
        time: at which the levels hold [s].
        unit_weight: unit weight of water [N/m3], under the gravity of the model; by default that of 1000 kg/m3.
        gravity: of the model [m/s2].

    Returns:
        Function of positions (n, 2) [m] that returns pressures (n,) [Pa], zero where no reservoir is below; it may be called on any
        rank.

    Raises:
        InputError: as for `standing_water`. Raised on all ranks alike.
    """
    grounds, close, weight = _grounds(domain, facet_tags, boundary, unit_weight, gravity)

    def pressure(points: NDArray[np.float64]) -> Any:
        deepest = np.zeros(len(points))
        for condition, (x, _) in grounds:
            above = (points[:, 0] >= x[0] - close) & (points[:, 0] <= x[-1] + close)
            deepest = np.maximum(deepest, np.where(above, value_at(condition.level, time) - points[:, 1], 0.0))
        return weight * deepest

    return pressure


Line = tuple[NDArray[np.float64], NDArray[np.float64]]


def _grounds(
    domain: Mesh, facet_tags: MeshTags, boundary: Sequence[WaterBoundary], unit_weight: float | None, gravity: float
) -> tuple[list[tuple[Reservoir, Line]], float, float]:
    """The reservoirs with their grounds, the round-off of coordinates [m], and the unit weight of water [N/m3]. Collective."""
    require_mesh(domain)
    dim, weight = domain.geometry.dim, given_water(domain.comm, unit_weight, gravity).unit_weight
    agree(domain.comm, None if dim == 2 else f"domain has {dim} dimensions, expected a plane section")
    reservoirs = [condition for condition in boundary if isinstance(condition, Reservoir)]
    agree(domain.comm, None if reservoirs else "boundary has no Reservoir, expected one or more")
    grounds = [
        (condition, line) for condition in reservoirs for line in ground_lines(domain, facet_tags, condition.facet_tag)
    ]
    return grounds, 1e-9 * max((np.ptp(line) for _, ground in grounds for line in ground), default=0.0), weight


def ground_lines(domain: Mesh, facet_tags: MeshTags, tag: int | str) -> list[Line]:
    """The surface at the facets of a tag as lines of facets that meet, in a plane section. Collective.

    Vertical facets, on which nothing stands, are left out.

    Args:
        domain: mesh of the body.
        facet_tags: tags of the boundary.
        tag: number or name of the tag.

    Returns:
        Coordinates x, rising, and y of the ends of the facets of each line [m], both of shape (k,).

    Raises:
        InputError: no facet has the tag. Raised on all ranks alike.
    """
    require_mesh(domain)
    facets = tagged_facets(domain.comm, facet_tags, tag, "boundary")
    nodes = domain.geometry.x[facet_nodes(domain, facets)][:, :, :2]
    ends = np.concatenate(domain.comm.allgather(nodes))  # (k, 2, 2), those of ghosts several times
    close = 1e-9 * max(np.ptp(ends, axis=(0, 1)))
    ends = np.take_along_axis(ends, np.argsort(ends[:, :, :1], axis=1), axis=1)
    ends = ends[ends[:, 1, 0] - ends[:, 0, 0] > close]
    if not len(ends):
        return []
    ends = ends[np.unique(np.round(ends.reshape(-1, 4) / close), axis=0, return_index=True)[1]]  # from left to right
    gaps = np.flatnonzero(np.abs(ends[1:, 0] - ends[:-1, 1]).max(axis=1) > close) + 1
    lines = (np.concatenate([line[:, 0], line[-1:, 1]]) for line in np.split(ends, gaps))
    return [(line[:, 0], line[:, 1]) for line in lines]
