"""A warning of cells at drained boundaries that are too large for the first step of a consolidation.

In a step dt water leaves a layer of the thickness sqrt(c_v dt), c_v = k M / gamma_w, at a drained boundary. Cells have one linear
pressure, which is that of the boundary at one end, so that a larger cell gives off too much water: cells twice as high as this length
let Terzaghi's layer settle by a fifth too much in the first step with quadratic displacements, and by twice as much with linear ones
(docs/water.md). With cells as high as it the error is about that of backward Euler. Pressures do not oscillate in steps above the bound of
Vermeer and Verruijt (1981), h^2 / (6 theta c_v); for settlements six times that is asked for here, theta being 1.
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.mesh.tagged import owned_cells
from fenics_bridge.water.boundary import Flux, Head
from fenics_bridge.water.retention import AlwaysSaturated

if TYPE_CHECKING:
    from fenics_bridge.water.consolidation import Consolidation

NOTHING = 1e-6
"""Part of the load that is round-off [-]"""

MISSED = 1e-6
"""Pressure head by which a pressure at its upper bound may miss it [m]"""

BALANCED = 1e-5
"""Change of the forces, over all forces, that an equilibrium may leave (`Solver.relaxed_tolerance`); more with a coarser tolerance"""

FEW = 0.05
"""Fraction of the load at drained boundaries below which a boundary is left out"""

UNLOADED = 1e-3
"""Modulus over that of the law below which soil has no stiffness yet, as clay has none that carries nothing"""

DAY = 86400.0


class _Cells(NamedTuple):
    """Cells of this rank, (n,) each, with a facet at a drained boundary."""

    cells: NDArray[np.int_]
    """Their numbers"""
    areas: NDArray[np.float64]
    """Of the facets [m], [m2] in space"""
    heights: NDArray[np.float64]
    """Across the facets [m]"""
    diffusivity: NDArray[np.float64]
    """c_v along the normal of the facets [m2/s]"""


def warn_of_coarse_cells(model: Consolidation, first_step: float, until: float) -> bool:
    """Warn where cells at drained boundaries that are loaded are too large for the first step of a run [s]; returns whether it does.

    Soil without a stiffness before its first load, and soil that may dry, is left out. So is that a run which ends within its first
    step, such as at a time of output, makes it shorter. Collective.

    Args:
        model: the consolidation.
        first_step: length of the first step [s].
        until: time at the end of the run [s].

    Raises:
        InputError: a load or boundary condition is not possible at the end of the step. Raised on all ranks alike.
    """
    model._take_boundary()
    end = min(model.time + first_step, until)
    model._applied.require_values(end)
    text = _coarse_cells(model, first_step, end)
    if text and model.domain.comm.rank == 0:
        warnings.warn(text, RuntimeWarning, stacklevel=4)  # where `run` is called
    return bool(text)


def _coarse_cells(model: Any, dt: float, end: float) -> str:
    """What the warning says of steps dt [s]; empty where cells are small enough, or nothing changes up to a time [s]."""
    comm = model.domain.comm
    coming = _forces_to_come(model, end)
    if coming is None:
        return ""
    diffusivity, drained = _diffusivity(model), _drained(model, end)
    found = [_beside(model, diffusivity, held.dofs[drained[held.dofs]]) for held in model._applied.held]
    sums = np.zeros((2, len(found), 3))  # by load and by area: weight, and with it height and length
    for k, at in enumerate(found):
        values = np.array([np.ones(len(at.cells)), at.heights, np.sqrt(dt * at.diffusivity)])
        sums[:, k] = values @ coming[at.cells], values @ at.areas
    by_load, by_area = comm.allreduce(sums)
    loaded = by_load[:, 0].sum() > NOTHING * comm.allreduce(float(coming.sum()))
    weight, height, length = (by_load if loaded else by_area).T
    counts = weight > FEW * weight.sum()
    ratios = np.divide(height, length, out=np.zeros_like(height), where=counts & (length > 0))
    if not len(ratios) or ratios.max() <= 1.0:
        return ""
    worst = int(ratios.argmax())
    return _text(model._applied.held[worst].condition.facet_tag, height[worst] / weight[worst], ratios[worst], dt)


def _text(tag: int | str, height: float, ratio: float, dt: float) -> str:
    needed, small = dt * ratio**2, -_up(-height / ratio)
    return (
        f"the cells at the drained boundary {tag!r} are {height:.2g} m high, more than the sqrt(c_v dt) = {small:.2g} m that consolidate in "
        f"the first step of {dt / DAY:.2g} days: settlements soon after a change of load or head are too large. Take a longer first_step, "
        f"{_up(needed / DAY):.2g} days ({_up(needed):.2g} s), or cells of {small:.2g} m there (docs/water.md)"
    )


def _up(value: float) -> float:
    """The next number above that has two digits."""
    digit = 10.0 ** (np.floor(np.log10(abs(value))) - 1)
    return float(np.ceil(value / digit - 1e-9) * digit)


def _forces_to_come(model: Any, end: float) -> NDArray[np.float64] | None:
    """Sum of the nodal forces of each cell of this rank that a step brings, (m,); None where it brings none. Collective.

    They are those of loads, and of pore pressures that change at a boundary by its head.

    Standing water that rises or falls does not count, nor that of a reservoir in the place of another: the pores follow it at once, as
    its pressure on the soil does.
    """
    (space, dofs), domain, body = model._displacements, model.domain, model._body
    water, before = model._reservoirs, body.increment.x.array.copy()
    standing = water.forces(model.time) if model._standing is None else model._standing
    external = model._external_at(end) - water.forces(end) + standing
    body.increment.x.array[:] = _prescribed(model, end)
    forces = external - body.kinematics.internal_forces(model.points.stress).array
    body.increment.x.array[:] = before
    forces[model._supports.dofs] = 0.0
    here = forces[dofs].reshape(-1, domain.geometry.dim)
    sizes = np.abs(np.array([here, np.reshape(external[dofs], here.shape)])).sum(axis=(1, 2))
    change, whole = domain.comm.allreduce(sizes)
    if change <= max(BALANCED, model.solver.tolerance) * whole:
        return None
    of_cells = np.linalg.norm(here, axis=1)[compat.cell_dofs(space)[: owned_cells(domain)]]
    return np.asarray(of_cells.sum(axis=1))


def _prescribed(model: Any, end: float) -> NDArray[np.float64]:
    """The increment of a step that the heads on boundaries prescribe up to a time [s]: (m,); reservoirs press on the soil as well."""
    fixed, heads, _ = model._applied.bounds(end)
    of_heads = [held.dofs for held in model._applied.held if isinstance(held.condition, Head)]
    dofs = np.concatenate([np.empty(0, dtype=np.int32), *of_heads])
    dofs = np.setdiff1d(dofs[fixed[dofs]], model._waterless)
    increment = np.zeros_like(model._body.increment.x.array)
    change = model.water.unit_weight * heads[dofs] - model.pressure.x.array[dofs]
    increment[model._pressures[1][dofs]] = (
        np.where(np.abs(change) > model.water.unit_weight * MISSED, change, 0.0) / model._unit
    )
    return increment


def _diffusivity(model: Any) -> NDArray[np.float64]:
    """Tensor of c_v of the cells of this rank [m2/s], (m, D, D); 0 in soil without one."""
    points, dim, count = model.points, model.domain.geometry.dim, owned_cells(model.domain)
    moduli = points.wave_moduli(model._laws)[:, 0].reshape(-1, points.per_cell)
    modulus, tensors = np.zeros(count), np.zeros((count, dim, dim))
    least = UNLOADED * np.array([law.p_wave_modulus for law in model._laws])[points.material]
    stiff = (np.isfinite(moduli) & (moduli > least[:, None])).all(axis=1)
    modulus[points.cells] = np.where(stiff, moduli.mean(axis=1), 0.0)
    for soil, cells in zip(model._soils[0], model._soils[2]):
        if isinstance(soil.retention, AlwaysSaturated):
            tensors[cells[cells < count]] = soil.tensor(soil.conductivity, dim)
    wet = model._wet.x.array[:count] > 0
    return np.where(wet, modulus / model.water.unit_weight, 0.0)[:, None, None] * tensors


def _drained(model: Any, end: float) -> NDArray[np.bool_]:
    """Which dofs of the pressure have a given one at a time [s], or are where water leaves now."""
    fixed, _, upper = model._applied.bounds(end)
    full = model.pressure.x.array >= model.water.unit_weight * (upper - MISSED)
    fluxes = [held.dofs for held in model._applied.held if isinstance(held.condition, Flux)]
    drained = fixed | (np.isfinite(upper) & full)
    for dofs in fluxes:
        drained[dofs] &= fixed[dofs]
    return np.asarray(drained)


def _beside(model: Any, diffusivity: NDArray[np.float64], dofs: NDArray[np.integer]) -> _Cells:
    """The cells of this rank with a facet between these dofs of the pressure."""
    space, dim, count = model._pressures[0], model.domain.geometry.dim, owned_cells(model.domain)
    corners = compat.cell_dofs(space)[:count]
    there = np.zeros(len(model.pressure.x.array), dtype=bool)
    there[dofs] = True
    cells = np.flatnonzero((there[corners].sum(axis=1) == dim) & (np.trace(diffusivity, axis1=1, axis2=2) > 0))
    x = space.tabulate_dof_coordinates()[:, :dim][corners[cells]]
    others = np.swapaxes(np.linalg.inv(x[:, 1:] - x[:, :1]), 1, 2)
    gradients = np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)  # of the shape functions
    across = gradients[np.arange(len(cells)), np.argmin(there[corners[cells]], axis=1)]
    heights = 1 / np.linalg.norm(across, axis=1)
    normals = across * heights[:, None]
    areas = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / (1 if dim == 2 else 2) / heights
    return _Cells(cells, areas, heights, np.einsum("ci,cij,cj->c", normals, diffusivity[cells], normals))
