"""The soils of a mesh in pictures: the sides of cells around each of them, and a place for its name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

import fenics_bridge as bridge
from particle_player import boundary_edges


def soil_outlines(domain: object, cell_tags: object, off: Sequence[int] = ()) -> dict[str, np.ndarray] | None:
    """Sides of cells around each soil that is there, by its name: segments (k, 2, 2) [m]; None but on the first rank. Collective.

    off: tags of the soils that are not there
    """
    mesh = bridge.background_arrays(domain, cell_tags)
    own = (mesh["cell_owners"] == domain.comm.rank) & ~np.isin(mesh["cell_tags"], off)
    parts = domain.comm.gather((mesh["points"][mesh["cells"][own]], mesh["cell_tags"][own]))
    if parts is None:
        return None
    corners, tags = (np.concatenate(arrays) for arrays in zip(*parts))
    points, cells = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
    cells = cells.reshape(-1, 3)
    return {name: points[boundary_edges(cells[np.isin(tags, of_soil)])]
            for name, of_soil in bridge.names_of(cell_tags).items() if np.isin(tags, of_soil).any()}  # fmt: skip


def name_places(outlines: Mapping[str, np.ndarray], wide: float = 3.0) -> dict[str, np.ndarray]:
    """A place within each soil that is far from its border and from the names of those before it: (2,) [m], by name.

    Args:
        outlines: segments (k, 2, 2) [m] around each soil.
        wide: how many times as wide as high a name is; distances along the first axis count less by it.
    """
    places: dict[str, np.ndarray] = {}
    shorter = np.array([1 / wide, 1.0])
    for name, segments in outlines.items():
        low, high = segments.min(axis=(0, 1)), segments.max(axis=(0, 1))
        grid = np.stack(np.meshgrid(*(np.linspace(a, b, 26)[1:-1] for a, b in zip(low, high))), axis=-1).reshape(-1, 2)
        grid = grid[_inside(grid, segments)]
        if not len(grid):  # thinner than the grid
            places[name] = 0.5 * (low + high)
            continue
        free = _distance(grid * shorter, segments * shorter)
        for place in places.values():
            free = np.minimum(free, 0.5 * np.linalg.norm((grid - place) * shorter, axis=1))
        good = grid[free >= 0.9 * free.max()]  # the middle one of them, since a layer is as wide in many places
        places[name] = good[np.argmin(np.linalg.norm((good - good.mean(axis=0)) * shorter, axis=1))]
    return places


def _inside(points: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """Whether points are within a closed outline, which a ray from each of them then crosses an odd number of times: (n,)."""
    (x, y), (a, b) = points.T[:, :, None], segments.transpose(1, 0, 2)
    across = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(a[:, 1] == b[:, 1], 1.0, b[:, 1] - a[:, 1])  # level segments are never crossed
    return np.sum(across & (x < a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise), axis=1) % 2 == 1


def _distance(points: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """Distance of points to the nearest segment: (n,)."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    offset = points[:, None] - start
    part = np.clip((offset * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    return np.linalg.norm(offset - part[..., None] * along, axis=2).min(axis=1)
