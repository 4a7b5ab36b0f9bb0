"""Pore water whose pressures are prescribed to finite elements: its forces on the soil, on supports and on walls that hold it back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh, exterior_facet_indices, meshtags
from mpi4py import MPI
from mpm_core.members import Member
from numpy.typing import NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, real_numbers
from fenics_bridge.fem.fields import assembled, cell_function
from fenics_bridge.fem.geometry import weighted
from fenics_bridge.fem.loads import pressing
from fenics_bridge.fem.supports import held_components
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.mesh.walls import edges_on, require_along
from fenics_bridge.types import MeshTags, OfPosition

INSIDE = 1e-6
"""How far inside of a cell a pressure beside a wall is taken: part of the way from its node to the middle of the cell"""


class PrescribedWater(NamedTuple):
    """Prescribed pore pressures."""

    pressure: fem.Function
    """Pressure [Pa], linear in each cell; it jumps at walls that hold water back"""
    walls: MeshTags | None
    """The facets of these walls, tagged 1; None without any"""


class WetBody:
    """The part of `QuasiStatic` that concerns prescribed pore pressures."""

    domain: Any
    _water: PrescribedWater | None

    def pore_pressure_function(self) -> fem.Function:
        """Prescribed pore pressure [Pa] as a function that is constant in each cell; zero without water. Collective."""
        if self._water is None:
            return fem.Function(compat.function_space(self.domain, "DG", 0, 1), name="pore_pressure")
        return cell_function(self.domain, ufl.as_vector([self._water.pressure]), 0, "pore_pressure")

    def largest_pore_pressure(self) -> float:
        """Largest pore pressure at a node [Pa]; 0 without water. Collective."""
        return self._largest_at_nodes(1)

    def largest_suction(self) -> float:
        """Largest suction at a node [Pa], as far as it acts on the soil; 0 without any. Collective."""
        return self._largest_at_nodes(-1)

    def _largest_at_nodes(self, sign: int) -> float:
        nodal = np.zeros(0) if self._water is None else sign * self._water.pressure.x.array
        return max(self.domain.comm.allgather(float(nodal.max(initial=0.0))))


def prescribed_water(
    domain: Mesh, pore_pressure: OfPosition, members: Mapping[str, Member], there: fem.Function
) -> PrescribedWater:
    """Pore pressures from a function of positions, with a jump at members that hold water back. Collective.

    Args:
        domain: mesh of the body.
        pore_pressure: function of positions (n, D) [m] that returns pressures (n,) [Pa]. Beside a wall it is asked for the pressures
            on both sides of it, also where there is no soil: water that stands there presses on the wall. Outside of the mesh a wall
            is dry.
        members: the structural members that are there, by name.
        there: function that is 1 in cells that are there and 0 in others.

    Raises:
        InputError: values of another shape or not finite, or a wall that the mesh does not follow. Raised on all ranks alike.
    """
    problem = f"pore_pressure is {pore_pressure!r}, expected a function of positions, such as hydrostatic(2.0)"
    agree(domain.comm, None if callable(pore_pressure) else problem)
    walls = _wall_facets(domain, members, there)
    if walls is None:
        p = fem.Function(compat.function_space(domain, "Lagrange", 1), name="pore_pressure")
        x = p.function_space.tabulate_dof_coordinates()[:, : domain.geometry.dim]
    else:
        p = fem.Function(compat.function_space(domain, "DG", 1), name="pore_pressure")
        corners = _corners(domain)
        x = (corners + INSIDE * (corners.mean(axis=1, keepdims=True) - corners)).reshape(-1, domain.geometry.dim)
        x = x[np.argsort(compat.cell_dofs(p.function_space).ravel())]
    p.x.array[:] = pressures_at(domain.comm, pore_pressure, x)
    return PrescribedWater(p, walls)


def pressures_at(
    comm: MPI.Comm, pressure: OfPosition, x: NDArray[np.float64], name: str = "pore_pressure"
) -> NDArray[np.float64]:
    """Pressures (n,) [Pa] at positions (n, D) [m]; raises InputError, on all ranks, for other values. Collective."""
    given = real_numbers(comm, name, pressure(x))
    good = given.shape in ((), (len(x),))
    agree(comm, None if good else f"{name} gives values of shape {given.shape}, expected ({len(x)},)")
    agree(comm, None if np.all(np.isfinite(given)) else f"{name} gives values that are not finite")
    return np.broadcast_to(given, len(x))


def water_forces(space: Any, water: PrescribedWater, there: fem.Function, radius: Any) -> NDArray[np.float64]:
    """Forces -grad p of the pore water on the skeleton; by them water also presses on the surface where it stands on it.

    By Gauss' theorem: the integral of p div v over the active cells, less that of p n v over their surface. Suction does not pull
    at the surface, so that its part of the second integral is taken out again. At a wall it is the pressures on both sides that act,
    that of the pores from within the soil: on the side without soil, water stands only where the pressure there says so. A pressure
    that jumps elsewhere in the soil, as below a wall, has its whole gradient at the border of two cells.
    """
    domain, p = space.mesh, water.pressure
    test, normal, suction = ufl.TestFunction(space), ufl.FacetNormal(domain), ufl.min_value(p, 0.0)
    surface = _on_both_sides(there * suction, normal)  # between two cells that are there it cancels
    # Since DOLFINx 0.8 all facets of a form must have the same tags, those of the walls.
    ds, inside = (ufl.Measure(kind, domain=domain, subdomain_data=water.walls) for kind in ("ds", "dS"))
    form = -weighted(there * ufl.inner(ufl.grad(p), test), radius) * ufl.dx
    form += weighted(there * suction * ufl.inner(normal, test), radius) * ds
    if water.walls is None:
        form += weighted(ufl.inner(surface, test("+")), radius) * inside
    else:
        jump, both = _on_both_sides(p, normal), there("+") * there("-")
        form += weighted(ufl.inner(both * jump + (1 - both) * surface, test("+")), radius) * inside
        beside = (1 - both) * (ufl.max_value(there("+"), there("-")) * jump - surface)
        form += weighted(there * (p - suction) * ufl.inner(normal, test), radius) * ds(1)
        form += weighted(ufl.inner(beside, test("+")), radius) * inside(1)
    return assembled(fem.form(form), space).array.copy()


def water_on_supports(model: Any, facet_tag: int | str) -> NDArray[np.float64]:
    """Force (D,) of the pore water on the supports at the facets of a tag, in the components that they hold. Collective."""
    domain, space, water = model.domain, model.displacement.function_space, model._water
    dim, own, force = domain.geometry.dim, space.dofmap.index_map.size_local, np.zeros(domain.geometry.dim)
    if water is None:
        return force
    held = held_components(domain, model.facet_tags, model.supports)
    pressure, test = weighted(ufl.max_value(water.pressure, 0.0), model.radius), ufl.TestFunction(space)
    wet = _without_dry_walls(model.facet_tags, water)
    for number in tag_numbers(domain.comm, model.facet_tags, facet_tag, "facet_tag"):
        if number in held:
            form = pressing(domain, pressure, test, wet, number, model._loads.active)
            force -= held[number] * assembled(fem.form(form), space).array.reshape(-1, dim)[:own].sum(axis=0)
    return domain.comm.allreduce(force)


def _without_dry_walls(facet_tags: MeshTags, water: PrescribedWater) -> MeshTags:
    """Tags of a boundary without its facets along walls, outside of which there is no water: the soil's own presses on these."""
    if water.walls is None:
        return facet_tags
    domain = water.pressure.function_space.mesh
    dry = np.intersect1d(water.walls.indices, exterior_facet_indices(domain.topology))
    kept = ~np.isin(facet_tags.indices, dry)
    return meshtags(domain, facet_tags.dim, facet_tags.indices[kept], facet_tags.values[kept])


def _on_both_sides(value: Any, normal: Any) -> Any:
    """A scalar times the outward normal of each cell beside an interior facet, summed over both, as a UFL expression."""
    return value("+") * normal("+") + value("-") * normal("-")


def _wall_facets(domain: Mesh, members: Mapping[str, Member], there: fem.Function) -> MeshTags | None:
    """Facets along members that hold water back, tagged 1; None without any such member. Collective."""
    walls = {name: np.array(member.points) for name, member in members.items() if member.impervious}
    if not walls:
        return None
    comm, dim, corners, lines = domain.comm, domain.topology.dim, _corners(domain), list(walls.values())
    active = there.x.array[compat.cell_dofs(there.function_space)[:, 0]] > 0
    named = {f"members: the impervious wall {name!r}": line for name, line in walls.items()}
    require_along(comm, corners[active], named)
    domain.topology.create_connectivity(dim, dim - 1)
    facets = domain.topology.connectivity(dim, dim - 1).array.reshape(-1, dim + 1)
    along = np.unique(facets[edges_on(corners, lines)]).astype(np.int32)
    return meshtags(domain, dim - 1, along, np.ones(len(along), dtype=np.int32))


def _corners(domain: Mesh) -> NDArray[np.float64]:
    """Corners of the cells on this rank, ghosts too: (m, D + 1, D) [m]."""
    return domain.geometry.x[compat.cell_nodes(domain), : domain.geometry.dim]
