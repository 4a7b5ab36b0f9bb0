"""Cells that are deactivated and activated, so that soil is removed from and placed in a body of finite elements.

An inactive cell carries no stress, stiffness or weight; nodes of inactive cells only are fixed. When a configuration changes,
the forces of the present stress no longer balance loads and supports. The out-of-balance force is kept as a force that holds the
body, and released in steps: `Load.held` from 1 to 0. Excavation, fill and changes of supports, laws and pore pressures are thus
the same to Newton's method.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dolfinx import fem, la
from dolfinx.mesh import Mesh
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, real_numbers
from fenics_bridge.fem.loads import LoadVectors
from fenics_bridge.fem.pore_water import prescribed_water, water_forces
from fenics_bridge.fem.supports import Constraints
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.mesh.tagged import owned_cells, tag_values


def switch_off(model: Any) -> None:
    """Deactivate all cells, before the first soil is placed."""
    model.points.assign(np.full(owned_cells(model.domain), -1, dtype=np.int32), len(model.laws))


def reconfigure(
    model: Any,
    off: Any,
    supports: Any,
    pore_pressure: Any,
    stress: Any,
    law: Any,
    members: Any = None,
    parameters: Mapping[str, NDArray[np.float64]] | None = None,
    harden: Callable[[], None] | None = None,
) -> None:
    """Apply the changes of `QuasiStatic.reconfigure`; parameters and harden: as for `take_over`."""
    domain, points, before = model.domain, model.points, model.laws
    off = model.off if off is None else off
    off = tag_numbers(domain.comm, model.cell_tags, off, "off", "cell") if len(off) else ()
    there = cells_there(domain, model.cell_tags, off)
    active = there if off else None
    installed = model.members if members is None else members
    prepared = model._prepared_members(installed, active)
    water = model._water if pore_pressure is None else prescribed_water(domain, pore_pressure, installed, there)
    law = law if law is not None else model.law
    laws = model._materials.laws(law)
    was_off = np.zeros(points.n, dtype=bool)
    was_off[points.off] = True
    new = was_off & np.repeat(there.x.array[points.cells] > 0, points.per_cell)
    given = given_stress(model, stress, new)
    points.assign(np.where(there.x.array[: owned_cells(domain)] > 0, model._materials.number, -1), len(laws))
    take_over(model, new, laws, before, given, parameters, harden)
    model.law, model.off = law, off
    _support(model, model.supports if supports is None else tuple(supports), there, bool(prepared))
    space = model.displacement.function_space
    model._loads = LoadVectors(space, model.facet_tags, model.cell_tags, active=active, radius=model.radius)
    model._change_members(prepared)
    model._water = water
    if water is not None:
        model._loads.constant = water_forces(space, water, there, model.radius)
    old = replace(model._loads.resolved(model.load), displacement=0.0, held=0.0)
    model._loads.held = model._internal_forces() - model._loads.forces(old)
    model.load = replace(old, held=1.0)


def cells_there(domain: Mesh, cell_tags: Any, off: Any) -> Any:
    """Function that is 1 in active cells, including ghost cells, and 0 in those of the tags `off`."""
    there = fem.Function(compat.function_space(domain, "DG", 0), name="active")
    values = tag_values(domain, cell_tags, domain.topology.dim)
    there.x.array[compat.cell_dofs(there.function_space)[:, 0]] = ~np.isin(values, off)
    return there


def given_stress(model: Any, stress: Any, new: Any) -> NDArray[np.float64] | None:
    """Initial stress of the new points: (k, S) [Pa]; None for none."""
    if stress is None:
        return None
    values = stress(model.points.coordinates()[new]) if callable(stress) else stress[new]
    given = real_numbers(model.domain.comm, "stress", values)
    expected = int(new.sum()), model.points.size
    good = given.shape == expected and np.all(np.isfinite(given))
    agree(model.domain.comm, None if good else f"stress has shape {given.shape}, expected finite {expected}")
    return given


def take_over(
    model: Any,
    new: Any,
    laws: Sequence[Any],
    before: Any,
    given: Any,
    parameters: Mapping[str, NDArray[np.float64]] | None = None,
    harden: Callable[[], None] | None = None,
) -> None:
    """Stress and state of the points under the new laws: removed soil has none, new soil starts from its initial state.

    parameters: values (n,) of laws' parameters that vary, by name, which the points have from now on; NaN where they keep theirs
    harden: gives new points the state variables of their history, before their stresses are brought inside of the strength
    """
    points = model.points
    points.stress[points.off], points.state[points.off], points.deviatoric_strain[points.off] = 0.0, 0.0, 0.0
    if given is not None:
        points.stress[new] = given
    of_point = np.repeat(points.material, points.per_cell)
    changed = np.array([one is not other for one, other in zip(laws, before)])
    other = (of_point >= 0) & (new | changed[np.maximum(of_point, 0)])
    points.reset_state(laws, np.flatnonzero(other))
    if harden is not None:
        harden()
    for name, values in (parameters or {}).items():
        points.set_parameter(laws, name, values)
        other |= ~np.isnan(values)
    if model.domain.comm.allreduce(int(other.sum())):
        failure = points.update(laws, np.zeros_like(points.stress))  # brings stresses inside the new strength
        agree(model.domain.comm, f"stress: {failure}" if failure else None)
        points.stress[other], points.state[other] = points.trial_stress[other], points.trial_state[other]


def _support(model: Any, supports: Any, there: Any, reinforced: bool) -> None:
    """Fix the nodes of the supports, and those without an active cell, where they are now; reinforced: as for `_assemble`."""
    space = model.displacement.function_space
    constraints = Constraints(space, model.facet_tags, supports, lonely_nodes(space, there))
    constraints.origin[:] = model.displacement.x.array[constraints.dofs]
    model.supports = supports
    model._assemble(constraints, reinforced)


def lonely_nodes(space: Any, there: Any) -> NDArray[np.int32]:
    """Blocked dofs, including ghosts, that belong to no active cell: (k,) int32. Collective."""
    count = la.vector(space.dofmap.index_map, 1)
    count.array[:] = 0.0
    n = owned_cells(space.mesh)
    on = there.x.array[compat.cell_dofs(there.function_space)[:n, 0]] > 0
    count.array[compat.cell_dofs(space)[:n][on].ravel()] = 1.0
    compat.add_shared(count)
    return np.flatnonzero(count.array == 0).astype(np.int32)


def free_motions(model: Any) -> list[str]:
    """Rigid-body motions that the supports leave free, in words; empty if there are none. Collective."""
    domain, dim = model.domain, model.domain.geometry.dim
    space, dofs = model.displacement.function_space, model._body.constraints.dofs
    owned = dofs[dofs < dim * space.dofmap.index_map.size_local]
    x = space.tabulate_dof_coordinates()[:, :dim]
    node, component = owned // dim, owned % dim
    real = np.isin(node, compat.cell_dofs(space)[model.points.cells[model.points.material >= 0]])
    node, component, x = node[real], component[real], x - x.mean(axis=0)
    axisymmetric = model.radius is not None  # a motion along the radius strains the hoops, and nothing turns
    axes = range(1, 2) if axisymmetric else range(dim)
    modes = [("along " + "xyz"[k], (component == k).astype(float)) for k in axes]
    for a, b in [] if axisymmetric else [(0, 1)] if dim == 2 else [(0, 1), (1, 2), (2, 0)]:
        turning = np.where(component == a, -x[node, b], np.where(component == b, x[node, a], 0.0))
        modes.append(("by turning" if dim == 2 else f"by turning about {'xyz'[3 - a - b]}", turning))
    rows = np.array([mode for _, mode in modes])
    gram = domain.comm.allreduce(rows @ rows.T)
    return [name for k, (name, _) in enumerate(modes) if gram[k, k] <= 1e-12 * max(gram.max(), 1e-300)]
