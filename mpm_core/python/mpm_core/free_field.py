"""The layers of the soil at a side, from which the free field beside it begins."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._core import InputError
from .ground_column import SHEAR_OF_PLANE, Layers
from .mesh import cell_sizes
from .resting import represented
from .water_checks import filled_fraction

SAME_LEVEL = 1e-6
"""Difference in height, over that of the side, of nodes on one level"""
CLOSED = 1e-30
"""Conductivity through which no water flows [m/s]"""
LEAST_LAYER = 0.3
"""Least thickness of a layer, over the height of the facets of a side in three dimensions"""


def coupled_mass(count: int, dim: int) -> float:
    """Fraction of the mass between two levels of a regular mesh by which one takes the velocity of the other.

    Each cell couples two of its nodes by its mass times the mean of the product of their shape functions over its particles,
    1/12 in a triangle of many and 1/20 in a tetrahedron. Pairs of nodes on both levels are 2 in each triangle of a square cut in
    two, and 10/3 in the mean over the tetrahedra of a cube cut in six: 1/6 in both.

    Args:
        count: particles per cell. Where these are no rule of `Model.seed`, they count as many.
        dim: dimension.
    """
    pairs, many = {2: (2, 1 / 12), 3: (10 / 3, 1 / 20)}[dim]
    try:
        points = np.array((_core.Mesh2 if dim == 2 else _core.Mesh3).even_points(count))
    except InputError:
        return pairs * many
    return pairs * float((points[:, 0] * points[:, 1]).mean())


def layers_at(model: Any, tag: int) -> Layers:
    """The layers between the levels of the nodes on a side, with the means of the cells there. Collective.

    Level ground bears no shear stress on level planes. That of the cells, which comes from their size and from what is on the ground, is left out: a
    layer that liquefies would lose it, and flow sideways without end under the load that it bore.

    Raises:
        InputError: on all ranks: a side that is not a vertical plane, or without soil.
    """
    facets = model.comm.allgather(_facets_of(model, tag))
    corners, normals, cells = (np.concatenate(parts) for parts in zip(*facets))
    if len(cells) == 0:
        raise InputError(
            f"facet_tag {tag} has no soil at its facets, expected particles in the cells at a side that absorbs"
        )
    normal = normals.mean(axis=0)
    if abs(normals[:, -1]).max() > 1e-6 or np.linalg.norm(normals - normal, axis=1).max() > 1e-6:
        raise InputError(f"facet_tag {tag} is not a vertical plane, expected one beside a free field")
    heights = _levels(corners[:, :, -1])
    columns = cells[:, 1:] / cells[:, :1]  # by the volume
    dim = corners.shape[2]
    width = {2: 4, 3: 6}[dim]
    middle = corners[:, :, -1].mean(axis=1)
    rows = []
    for low, high in zip(heights[:-1], heights[1:]):
        inside = (middle > low) & (middle < high)
        nearest = np.abs(middle - 0.5 * (low + high)) == np.abs(middle - 0.5 * (low + high)).min()
        chosen = inside if inside.any() else nearest
        mean = np.average(columns[chosen], axis=0, weights=cells[chosen, 0])
        first = columns[chosen][0]  # of several laws beside each other
        rows.append([*first[:2], *mean[2:]])
    values = np.array(rows)
    water, wet, pores = model._core.water, 4, []
    if water is not None:
        wet += dim + 4
        pores = _pores_at(0.5 * (heights[:-1] + heights[1:]), values[:, 4:wet], water, max(0.0, -model.gravity[-1]))
    stress = values[:, wet : wet + width]
    stress[:, SHEAR_OF_PLANE[dim][:-1]] = 0.0
    return Layers(
        heights=heights.tolist(),
        law=values[:, 0].astype(int).tolist(),
        coupled_mass=[coupled_mass(count, dim) for count in values[:, 1].round().astype(int)],
        density=values[:, 2].tolist(),
        cell_size=values[:, 3].tolist(),
        pores=pores,
        stress=stress.tolist(),
        state=values[:, wet + width :].tolist(),
        normal=(normal / np.linalg.norm(normal)).tolist(),
        time=model.time,
        gravity=max(0.0, -model.gravity[-1]),
    )


def _pores_at(middle: NDArray[np.float64], means: NDArray[np.float64], water: Any, gravity: float) -> list[list[float]]:
    """Pores and water of layers, see `Layers`.

    Args:
        middle: heights of the middle of the layers [m], (n).
        means: of `_pores` over their cells, (n, D + 4), whose particles may lie at other heights.
        water: properties of the water.
        gravity: downwards [m/s2].
    """
    porosity, content, pressure, height = means[:, 0], *means[:, -3:].T
    full = pressure > -water.suction_limit
    pressure = np.where(full, pressure + water.density * gravity * (height - middle), pressure)
    content = np.where(full, water.density * porosity * (1 + pressure / water.modulus), content)
    return np.column_stack([means[:, :-3], content, pressure]).tolist()


def layers_of(entry: dict[str, Any], water: Any) -> Layers:
    """Layers from a checkpoint; an older one has the stiffness K_w / n of water that moves with the soil."""
    fields = dict(entry)
    stiffness = np.array(fields.pop("water", []))
    if stiffness.any():
        porosity = water.modulus / stiffness
        still = np.full((len(porosity), len(fields["normal"])), CLOSED)
        fields["pores"] = np.column_stack([porosity, still, water.density * porosity, 0 * porosity]).tolist()
    return Layers(**fields)


def _levels(heights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Heights of nodes, each once, without those that are much nearer to another than facets are high."""
    rising = np.unique(heights)
    apart = SAME_LEVEL * (rising[-1] - rising[0])
    if heights.shape[1] > 2:  # facets of tetrahedra, whose nodes may lie at any height
        apart = max(apart, LEAST_LAYER * float(np.median(np.ptp(heights, axis=1))))
    levels = [rising[0]]
    for height in rising[1:-1]:
        if height - levels[-1] > apart and rising[-1] - height > apart:
            levels.append(height)
    return np.array([*levels, rising[-1]])


def _counts(model: Any) -> NDArray[np.float64]:
    """Number of particles in the cell of each particle, or for which its cell rests, (n)."""
    p = model.particles
    in_cell = np.bincount(p.cell, minlength=model.mesh.owned_cells)[p.cell]
    return np.where(p.is_resting, represented(p), in_cell)


def _mass(model: Any) -> NDArray[np.float64]:
    """Mass of the particles with their water [kg], (n)."""
    p = model.particles
    return p.mass + p.water_mass if model._core.has_two_phases else p.mass


def _pores(model: Any) -> NDArray[np.float64]:
    """Porosity, conductivity along each axis [m/s], mass of the water in a volume of soil [kg/m3], pore pressure [Pa] and height [m]
    of the particles, (n, D + 4); (n, 0) without pore water."""
    p, water, dim = model.particles, model._core.water, model.mesh.dim
    if water is None:
        return np.empty((len(p), 0))
    if model._core.has_two_phases:
        content = p.water_mass / p.volume
    else:
        content = filled_fraction(p) * water.density * p.porosity * (1 + p.pore_pressure / water.modulus)
    ratios = np.ones((len(p), dim))
    if water.anisotropy:
        ratios = np.diagonal(np.array(water.anisotropy), axis1=1, axis2=2)[p.material, :dim]
    conductivity = p.conductivity[:, None] * ratios
    return np.column_stack([p.porosity, conductivity, content, p.pore_pressure, p.position[:, -1]])


def _facets_of(model: Any, tag: int) -> tuple[NDArray, NDArray, NDArray]:
    """Of this rank's facets with soil: corners (m, D, D), outer normals (m, D), and sums over their cells (m, ...).

    The sums are those of volume times 1, law, number of particles, density, cell size, pores, stress and state.
    """
    mesh, n, p = model.mesh, model.mesh.owned_cells, model.particles
    dim = mesh.dim
    values = np.column_stack(
        [np.ones(len(p)), p.material, _counts(model), _mass(model) / p.volume, cell_sizes(mesh.cell_volumes, dim)[p.cell],
         _pores(model), p.stress, p.state]
    )  # fmt: skip
    sums = np.zeros((n, values.shape[1]))
    np.add.at(sums, p.cell, p.volume[:, None] * values)
    cell, k = np.nonzero((mesh._core.facet_tags[:n] == tag) & (sums[:, :1] > 0))
    nodes = np.array([np.delete(mesh.cells[c], j) for c, j in zip(cell, k)], dtype=int).reshape(-1, dim)
    corners = mesh.points[nodes]
    inner = mesh.points[mesh.cells[cell, k]]
    edges = corners[:, 1:] - corners[:, :1]
    if dim == 2:
        normals = np.column_stack([edges[:, 0, 1], -edges[:, 0, 0]])
    else:
        normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    outward = np.einsum("ni,ni->n", normals, corners[:, 0] - inner) > 0
    return corners, np.where(outward[:, None], normals, -normals), sums[cell]
