"""Soil and structural members that are placed and removed while the ground consolidates."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from mpm_core.members import Member
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, is_finite, real_numbers
from fenics_bridge.fem.active_cells import cells_there, given_stress, lonely_nodes, take_over
from fenics_bridge.fem.supports import Constraints
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.mesh.tagged import owned_cells


def reconfigure(
    model: Any,
    off: Sequence[int | str] | None,
    supports: Any,
    pore_pressure: Any,
    stress: Any,
    law: Any,
    duration: float,
    members: dict[str, Member] | None,
) -> None:
    """Apply the changes of `Consolidation.reconfigure`."""
    domain, points, before = model.domain, model.points, model._laws
    off = model.off if off is None else off
    _check(model, off, duration, members_alone=all(each is None for each in (supports, pore_pressure, stress, law)))
    off = tag_numbers(domain.comm, model.cell_tags, off, "off", "cell") if len(off) else ()
    laws = before if law is None else model._materials.laws(law)
    constraints = model._supports if supports is None else Constraints(model._space.sub(0), model._facet_tags, supports)
    there = cells_there(domain, model.cell_tags, off)
    was_there = model._there.x.array > 0
    new = np.repeat((there.x.array > 0)[points.cells] & ~was_there[points.cells], points.per_cell)
    pressures, given = _pressures(model, pore_pressure), given_stress(model, stress, new)
    prepared = model._prepared_members(model.members if members is None else members, there if len(off) else None)
    warn_of_walls(domain.comm, prepared, model.members)
    points.assign(np.where(there.x.array[: owned_cells(domain)] > 0, model._materials.number, -1), len(laws))
    take_over(model, new, laws, before, given)
    model._laws, model.off = laws, off
    if supports is not None:
        constraints.origin[:] = model._body.solution.x.array[constraints.dofs]
        model._supports = constraints
    _place(model, there, was_there)
    had_none = model._waterless
    model._configure()
    _fill_pores(model, had_none, pressures)
    model._change_members(prepared)
    _hold(model, duration, _risen(model, was_there))


def warn_of_walls(comm: Any, members: Any, before: dict[str, Member]) -> None:
    """Warn of members that hold water back, which they do not here.

    Args:
        comm: the ranks.
        members: those that are there from now on, prepared for `Members.change`.
        before: those that were there, by name.
    """
    names = [repr(name) for name, one in members.items() if one.member.impervious and before.get(name) != one.member]
    if names and comm.rank == 0:
        warnings.warn(
            f"water flows through {', '.join(names)} in water.Consolidation, also where a beam is impervious: it holds back water in "
            "water.Seepage, and where pore pressures are prescribed to finite elements",
            RuntimeWarning,
            stacklevel=4,
        )


def lonely_dofs(model: Any) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Degrees of freedom of nodes without soil, of the displacement, and without wet soil, of the pressure. Collective.

    Args:
        model: the Consolidation.

    Returns:
        Those of the mixed space, shape (m, D), and of the pressure's own space, shape (k,), ghosts included.
    """
    (displacements, dofs), dim = model._displacements, model.domain.geometry.dim
    return dofs.reshape(-1, dim)[lonely_nodes(displacements, model._there)], lonely_nodes(
        model._pressures[0], model._wet
    )


def _check(model: Any, off: Any, duration: float, members_alone: bool) -> None:
    comm, refused = model.domain.comm, model.motion is not None and (len(off) or not members_alone)
    agree(comm, "the model has inertia, expected quasi-static steps, or members alone that change" if refused else None)
    good = is_finite(duration) and duration >= 0
    agree(comm, None if good else f"duration is {duration!r} s, expected a number from 0 on")
    missing = len(off) and model.cell_tags is None
    agree(comm, "off names soils, but the model has no cell_tags" if missing else None)


def _place(model: Any, there: Any, was_there: NDArray[np.bool_]) -> None:
    """Mark the cells that are there and wet; strains of new soil count from now on."""
    domain = model.domain
    wet = np.zeros_like(was_there)
    for cells in model._soils[2]:
        wet[cells] = True
    new = np.flatnonzero((there.x.array > 0) & ~was_there).astype(np.int32)
    model._there.x.array[:] = there.x.array
    model._wet.x.array[:] = there.x.array * wet
    placed, moved = model._terms.placed, ufl.split(model._body.solution)[0]
    placed.interpolate(fem.Expression(moved, compat.interpolation_points(placed.function_space)), new)
    agree(
        domain.comm, None if domain.comm.allreduce(int(model._wet.x.array.sum())) else "off: no soil with water is left"
    )


def _pressures(model: Any, pore_pressure: Any) -> NDArray[np.float64]:
    """Pressures [Pa] at all nodes with which new ones come: (m,)."""
    x = model._pressures[0].tabulate_dof_coordinates()[:, : model.domain.geometry.dim]
    values = np.zeros(len(x)) if pore_pressure is None else pore_pressure(x)
    given = real_numbers(model.domain.comm, "pore_pressure", values)
    good = given.shape == (len(x),) and np.all(np.isfinite(given))
    agree(model.domain.comm, None if good else f"pore_pressure has shape {given.shape}, expected finite {(len(x),)}")
    return given


def _fill_pores(model: Any, had_none: NDArray[np.int32], pressures: NDArray[np.float64]) -> None:
    """Give nodes that have come their pressures, and those that are gone none."""
    dofs, solution = model._pressures[1], model._body.solution.x.array
    come = np.setdiff1d(had_none, model._waterless)
    solution[dofs[come]] = pressures[come] / model._unit
    solution[dofs[model._waterless]] = 0.0
    model._active[model._waterless] = False
    model._read_pressure()


def _risen(model: Any, was_there: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Nodal forces of water that stands higher or lower than in the last step, but for nodes of soil that comes or goes. Collective.

    The pores below follow the water at once, and so must its weight. At soil that comes or goes the weight of both changes together.
    """
    rise = np.zeros(len(model._body.solution.x.array))
    if model._standing is None:
        return rise
    changed = fem.Function(model._there.function_space)
    changed.x.array[:] = (model._there.x.array > 0) != was_there
    displacements, dofs = model._displacements
    kept = dofs.reshape(-1, model.domain.geometry.dim)[lonely_nodes(displacements, changed)]
    rise[kept] = (model._reservoirs.forces(model.time) - model._standing + rise)[kept]
    return rise


def _hold(model: Any, duration: float, risen: NDArray[np.float64]) -> None:
    """Hold what is out of balance now, but for the forces of water that has risen; the steps that follow release it."""
    body, dofs = model._body, model._displacements[1]
    body.increment.x.array[:] = 0.0
    if model.motion is not None:
        model.motion.rest_on()
    model._held, model._holding = 0.0, (model.time, duration)
    external = model._external_at(model.time)
    internal = body.internal_forces(model.points.stress).array
    held = np.zeros_like(internal)
    held[dofs] = internal[dofs] - external[dofs]
    model._held, model._external = held + risen, external + held
    model._standing = model._reservoirs.forces(model.time) - risen
