"""The state from which a consolidation begins."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI

from fenics_bridge.errors import agree
from fenics_bridge.fem.pore_water import pressures_at
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.water.construction import warn_of_walls
from fenics_bridge.water.seepage import Seepage


def set_initial_state(model: Any, stress: Any, pore_pressure: Any) -> None:
    """Do what `Consolidation.initialise` says."""
    comm, points, solution = model.domain.comm, model.points, model._body.solution
    state, members = None, None
    if isinstance(stress, QuasiStatic):
        agree(
            comm, None if stress.converged else "stress is a QuasiStatic that has not been solved, or did not converge"
        )
        members = _members_of(model, stress)
        stress, state = stress.points.stress, stress.points.state
    pressure = _pressures(model, pore_pressure)
    _require(comm, "stress", stress, points.stress.shape)
    _require(comm, "state", state, points.state.shape)
    _require(comm, "pore_pressure", pressure, model.pressure.x.array.shape)
    points.stress[:] = 0.0 if stress is None else stress
    points.stress[points.off] = 0.0
    points.reset_state(model._laws)
    if state is not None:
        points.state[:] = state
    solution.x.array[:] = 0.0
    if pressure is not None:
        solution.x.array[model._pressures[1]] = pressure / model._unit
        solution.x.array[model._pressures[1][model._waterless]] = 0.0
    model._held, model._holding, model._standing = 0.0, (model.time, 0.0), None
    if members is None:
        model._members.reset()
    else:
        warn_of_walls(comm, members, model.members)
        model._members.change(members, model._own_unknowns())
        model._renew_solver()
    model._read_pressure()


def _members_of(model: Any, fem: QuasiStatic) -> Any:
    """The structural members of finite elements with their forces, for `Members.change`. Collective."""
    absent = [name for name, member in model.members.items() if fem.members.get(name) != member]
    missing = (
        f"stress is a QuasiStatic without the member {absent[0]!r} of this model, expected it there" if absent else None
    )
    agree(model.domain.comm, missing)
    return model._members.taken_over(fem._members, model._there if len(model.off) else None)


def _pressures(model: Any, pore_pressure: Any) -> Any:
    """Pore pressures [Pa] at the nodes: (m,); None for none. Collective."""
    if pore_pressure is None:
        return None
    x = model._pressures[0].tabulate_dof_coordinates()[:, : model.domain.geometry.dim]
    if not isinstance(pore_pressure, Seepage):
        return pressures_at(model.domain.comm, pore_pressure, x)
    search = PointSearch(pore_pressure.domain, x)
    search.require_all("pore_pressure")
    return pore_pressure.unit_weight * search.values(pore_pressure.pressure_head)[:, 0]


def _require(comm: MPI.Comm, name: str, values: Any, shape: Any) -> None:
    good = values is None or (np.shape(values) == shape and np.all(np.isfinite(values)))
    agree(comm, None if good else f"{name} has shape {np.shape(values)}, expected finite values of shape {shape}")
