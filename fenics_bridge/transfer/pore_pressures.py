"""Pore pressures prescribed to finite elements, which particles take as pore water or as part of their total stress."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.fem import Function
from dolfinx.mesh import exterior_facet_indices
from numpy.typing import NDArray

import mpm_core as mpm
from fenics_bridge import compat
from fenics_bridge.errors import agree
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.overconsolidation import EXCESS
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.transfer.moved import cell_gradient


def skeleton_of(law: Any) -> Any:
    """The law of the effective stresses: the skeleton of `Undrained`, or the law itself."""
    return law.skeleton if isinstance(law, mpm.Undrained) else law


def takes_pore_pressure(model: mpm.Model, fem: Any) -> bool:
    """Whether particles take the pore pressures that are prescribed to finite elements. Collective.

    They do as pore water (`Model.add_water`), or as part of their total stress where they follow `Undrained`.
    """
    if not _are_prescribed(fem) or _has_undrained(fem):
        return False
    return model._core.water is not None or bool(_undrained(model))


def prescribed_mistake(model: mpm.Model, fem: Any) -> str | None:
    """Why particles cannot take the pore pressures that are prescribed to finite elements, in words; None if they can. Collective."""
    if not _are_prescribed(fem):
        return None
    water, suction = model._core.water, fem.largest_suction()
    if water is not None and water.may_dry and suction > 1e-9 * fem.largest_pore_pressure():
        return (
            f"fem is a QuasiStatic with suction of up to {suction:.4g} Pa that acts on the soil, expected none or a "
            "water.Consolidation, since particles have retention curves, by which suction acts in part only and water is missing"
        )
    return None


def _are_prescribed(fem: Any) -> bool:
    return isinstance(fem, QuasiStatic) and fem._water is not None


def _has_undrained(fem: QuasiStatic) -> bool:
    return any(isinstance(law, mpm.Undrained) for law in fem.laws)


def _undrained(model: mpm.Model) -> set[int]:
    """Numbers of those laws of the particles that are `Undrained`. Collective."""
    used = set().union(*model.comm.allgather(set(np.unique(model.particles.material).tolist())))
    return {number for number in used if isinstance(model.laws[number], mpm.Undrained)}


def set_pore_pressure(model: mpm.Model, pressure: Function, search: PointSearch) -> None:
    """Give pore water of particles the pressures [Pa] of finite elements, a function that is linear in each cell. Collective."""
    model.particles.set("pore_pressure", search.values(pressure)[:, 0])
    model.particles.set("pressure_gradient", search.values(cell_gradient(pressure)))
    model.saturate()


def add_to_stress(
    model: mpm.Model, fem: QuasiStatic, search: PointSearch, smooth: bool, stress: NDArray[Any], state: NDArray[Any]
) -> None:
    """Make total stresses of the effective ones of undrained particles, in place, and keep the pressures as their states.

    Collective. The pressure is the mean of the cell, like the stress, unless `smooth`.

    Raises:
        InputError: particles of other laws are under pore pressures. Raised on all ranks alike, before anything changes.
    """
    water = fem._water.pressure if smooth and fem._water is not None else fem.pore_pressure_function()
    pressure = search.values(water)[:, 0]
    agree(model.comm, _drained_mistake(model, pressure, 1e-6 * fem.largest_pore_pressure()))
    for number, law in enumerate(model.laws):
        if isinstance(law, mpm.Undrained):
            rows = model.particles.material == number
            stress[rows, :3] -= pressure[rows, None]
            state[rows, law.state_names.index(EXCESS)] = pressure[rows]


def _drained_mistake(model: mpm.Model, pressure: NDArray[Any], least: float) -> str | None:
    """What is wrong with particles under pore pressures [Pa] that do not follow `Undrained`; None where there are none."""
    undrained = [isinstance(law, mpm.Undrained) for law in model.laws]
    rows = ~np.array(undrained)[model.particles.material] & (np.abs(pressure) > least)
    if not rows.any():
        return None
    return (
        f"the laws of materials {np.unique(model.particles.material[rows]).tolist()} are not Undrained, but there are pore pressures "
        f"of {np.abs(pressure[rows]).max():.4g} Pa in fem where their particles are; expected Undrained laws, as other particles "
        "have, or no pore pressures there"
    )


def stands_on_surface(fem: QuasiStatic) -> bool:
    """Whether pore pressures act at the boundary where nothing holds the soil, as under free water. Collective."""
    if fem._water is None:
        return False
    domain, water = fem.domain, fem._water.pressure
    at_node = np.zeros(len(domain.geometry.x))
    at_node[compat.cell_nodes(domain)] = water.x.array[compat.cell_dofs(water.function_space)]
    facets = exterior_facet_indices(domain.topology)
    if fem._water.walls is not None:  # which are dry outside
        facets = np.setdiff1d(facets, fem._water.walls.indices)
    for support in fem.supports:
        for number in tag_numbers(domain.comm, fem.facet_tags, support.facet_tag, "supports"):
            facets = np.setdiff1d(facets, fem.facet_tags.find(number))
    highest = at_node[compat.facet_nodes(domain, facets)].min(axis=1).max(initial=0.0) if len(facets) else 0.0
    return bool(max(domain.comm.allgather(highest)) > 1e-3 * fem.largest_pore_pressure())
