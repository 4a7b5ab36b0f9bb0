"""Soil that has dried, from finite elements to particles: suction and lost weight as the elements integrate them."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx.fem import Function
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.fields import cell_function
from fenics_bridge.transfer.moved import cell_gradient
from fenics_bridge.water.consolidation import Consolidation

_SAME_SATURATION = 1e-3
"""Difference of degrees of saturation up to which retention curves count as the same"""
_SAME = 1e-6
"""Relative difference up to which a cell of one mesh is that of the other, and its particles fill it"""


def balance_dried_soil(
    model: mpm.Model, fem: Consolidation, search: PointSearch, stress: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Let particles of dried soil act on the nodes of their cells as the finite elements do.

    S_e p and the weight of the water are no polynomials, so that particles, which take other points than the elements, would find
    other integrals of them. Where a cell is one of the elements', the particles keep their pressures and saturation. Their total
    stress has the elements' mean, from which the effective one follows; and what their water weighs is corrected, linearly in the
    cell, to the elements' moments. In axial symmetry the mean stress of a cell does not say what its hoop stresses do, and nothing
    is changed.

    Args:
        model: particles whose pore pressures and saturation are those of the elements; their masses are changed.
        fem: the finite elements.
        search: the particles in their mesh.
        stress: effective stresses of the elements at the particles [Pa], shape (n, S).

    Returns:
        Effective stresses [Pa], shape (n, S).

    Raises:
        InputError: the particles have other retention curves than the elements. Raised on all ranks alike.

    Note:
        Collective.
    """
    p, mesh, water = model.particles, model.mesh, model._core.water
    _require_same_curves(model, fem, search)
    if not (water.may_dry and fem._terms.may_dry) or model.geometry == mpm.Geometry.AXISYMMETRIC:
        return stress
    acting, lost = fem._terms.dried()
    lost.x.array[:] /= fem.water.gravity  # [kg/m3]
    cells, centres = p.cell, mesh.points[mesh.cells].mean(axis=1)
    filled = np.bincount(cells, p.volume, len(mesh.cells))
    there = search.values(cell_function(fem.domain, ufl.SpatialCoordinate(fem.domain), 0, "centre"))
    size = np.max(np.ptp(mesh.points[mesh.cells], axis=1), axis=1)
    other = np.abs(there - centres[cells]).max(axis=1) > _SAME * size[cells]
    same = np.bincount(cells, other | p.is_resting, len(mesh.cells)) == 0
    same &= np.abs(filled - mesh.cell_volumes) < _SAME * mesh.cell_volumes
    rows = np.flatnonzero(same[cells])

    pressure = np.asarray(water.acting(p.material, p.pore_pressure), dtype=float)
    mean = np.bincount(cells, p.volume * pressure, len(mesh.cells)) / np.where(same, filled, 1.0)
    stress = stress.copy()
    stress[rows, :3] += (mean[cells] - search.values(acting)[:, 0])[rows, None]

    offset = p.position - centres[cells]
    slope = search.values(cell_gradient(lost))
    wanted = search.values(lost)[:, 0] - np.einsum("pa,pa->p", slope, offset)  # at the centre
    dried = water.density * p.porosity * (1 - p.saturation)
    mass = p.mass.copy()
    mass[rows] -= p.volume[rows] * _corrections(mesh, cells, p.volume, offset, dried, wanted, slope, rows)
    p.set("mass", mass)
    return stress


def _corrections(
    mesh: Any, cells: Any, volume: Any, offset: Any, dried: Any, wanted: Any, slope: Any, rows: Any
) -> NDArray[np.float64]:
    """What densities of particles lack of the moments of a linear function in their cell, as such a function [kg/m3].

    Where a cell has too few particles for all moments, they get the sum.
    """
    dim, used = mesh.dim, np.unique(cells[rows])
    number = np.searchsorted(used, cells[rows])
    terms = np.column_stack([np.ones(len(rows)), offset[rows]])
    moments, lacking = np.zeros((len(used), dim + 1, dim + 1)), np.zeros((len(used), dim + 1))
    np.add.at(moments, number, volume[rows, None, None] * terms[:, :, None] * terms[:, None, :])
    np.subtract.at(lacking, number, (volume * dried)[rows, None] * terms)
    corners = mesh.points[mesh.cells[used]]
    corners = corners - corners.mean(axis=1, keepdims=True)
    second = np.einsum("cka,ckb->cab", corners, corners) / ((dim + 1) * (dim + 2))
    first = np.zeros(len(used), dtype=int)
    first[number] = rows  # any particle of the cell
    size = mesh.cell_volumes[used]
    lacking[:, 0] += size * wanted[first]
    lacking[:, 1:] += size[:, None] * np.einsum("cab,cb->ca", second, slope[first])
    lengths = np.column_stack([np.ones(len(used)), *[size ** (1 / dim)] * dim])  # moments of one size
    scaled = moments / (lengths[:, :, None] * lengths[:, None, :])
    found = np.einsum("ckl,cl->ck", np.linalg.pinv(scaled, rcond=1e-6, hermitian=True), lacking / lengths) / lengths
    return np.einsum("pk,pk->p", found[number], terms)


def _require_same_curves(model: mpm.Model, fem: Consolidation, search: PointSearch) -> None:
    """Raise InputError, on all ranks, where particles have another saturation than the elements' curves give."""
    p = model.particles
    number = Function(compat.function_space(fem.domain, "DG", 0), name="soil")
    for k, of_soil in enumerate(fem._soils[2]):
        number.x.array[of_soil] = k
    soil = search.values(number)[:, 0].astype(int)
    expected = np.ones(len(p))
    for k, one in enumerate(fem._soils[0]):
        rows = soil == k
        expected[rows] = one.retention.saturation(-p.pore_pressure[rows])
    found = p.saturation if model._core.water.may_dry else np.ones(len(p))
    worst = int(np.argmax(np.abs(found - expected))) if len(p) else -1
    differs = len(p) > 0 and abs(found[worst] - expected[worst]) > _SAME_SATURATION
    agree(
        model.comm,
        f"fem: under a pore pressure of {p.pore_pressure[worst]:.4g} Pa its soil has a degree of saturation of "
        f"{expected[worst]:.4g}, the particles {found[worst]:.4g}; expected the same retention curves (Model.add_water)"
        if differs
        else None,
    )
