"""Boundary conditions of the water on the degrees of freedom of a pressure space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import ufl
from dolfinx import fem
from mpm_core.input_warnings import warn_of_rain
from numpy.typing import NDArray

from fenics_bridge.compat import facet_nodes
from fenics_bridge.errors import agree
from fenics_bridge.fem.geometry import weighted
from fenics_bridge.fem.supports import tagged_facets
from fenics_bridge.mesh.names import tag_numbers
from fenics_bridge.types import MeshTags
from fenics_bridge.water.boundary import (
    Flux,
    Head,
    Rain,
    Reservoir,
    SeepageFace,
    WaterBoundary,
    mean_over,
    mistake_at,
    mistake_in,
    value_at,
)
from fenics_bridge.water.pieces import pieces_of


class _Held(NamedTuple):
    """A boundary condition where it holds."""

    condition: Any
    """The condition"""
    tags: tuple
    """Numbers of its facets"""
    dofs: np.ndarray
    """Its dofs on this rank"""
    rate: Any = None
    """Prescribed inflow over the unit [-] as a constant; None where there is none"""
    density: Any = None
    """The inflow per area as a UFL expression"""
    total: Any = None
    """Compiled form of the integral of the inflow"""


class AppliedBoundary:
    """The boundary conditions of the water on a scalar space; where conditions meet at a node, a prescribed head holds first.

    Args:
        space: space of the pressure.
        facet_tags: tags of the boundary.
        unit: unit of prescribed inflows in forms [m/s].
        radius: radius of an axisymmetric body, a UFL expression.
        there: function that is 1 in cells that are there and 0 in those that are not; None where all are.
    """

    def __init__(self, space: Any, facet_tags: MeshTags, unit: float, radius: Any = None, there: Any = None) -> None:
        self._space, self._facet_tags, self.unit, self._radius = space, facet_tags, unit, radius
        self._there = there
        self._dim = space.mesh.geometry.dim
        self.height = space.tabulate_dof_coordinates()[:, self._dim - 1]
        """Elevation of the dofs of this rank [m], ghosts included, shape (m,)"""
        highest = space.mesh.comm.allgather(float(np.abs(self.height).max(initial=0.0)))
        self._rounding = 1e-12 * max(highest)  # by which the coordinates of nodes at a level may miss it
        self._pieces: NDArray[np.integer] | None = None
        self.held: list[_Held] = []
        """The conditions where they hold"""

    def take(self, boundary: Sequence[WaterBoundary]) -> bool:
        """Check a list of conditions and find where they hold. Collective.

        Args:
            boundary: the conditions.

        Returns:
            Whether they are other ones than the last time.

        Raises:
            InputError: values out of range, or unknown tags. Raised on all ranks alike.
        """
        held = [one.condition for one in self.held]
        if len(held) == len(boundary) and all(a is b for a, b in zip(held, boundary)):
            return False
        for condition in boundary:
            known = isinstance(condition, (Head, Reservoir, SeepageFace, Flux, Rain))
            problem = mistake_in(condition) if known else "expected Head, Reservoir, SeepageFace, Flux or Rain"
            agree(self._space.mesh.comm, f"boundary: {condition!r}: {problem}" if problem else None)
            if isinstance(condition, Rain) and not callable(condition.rate):
                rates = np.asarray(condition.rate, dtype=float)
                warn_of_rain(
                    self._space.mesh.comm, float(rates.max() if rates.ndim == 0 else rates[:, 1].max()), stacklevel=5
                )
        self.held = [self._where(condition) for condition in boundary]
        return True

    def require_values(self, time: float) -> None:
        """Require that functions of time return numbers that are possible at a time [s]. Collective.

        Raises:
            InputError: one does not. Raised on all ranks alike.
        """
        for held in self.held:
            problem = mistake_at(held.condition, time)
            agree(self._space.mesh.comm, f"boundary: {held.condition!r}: {problem}" if problem else None)

    def _where(self, condition: WaterBoundary) -> Any:
        """Part of the boundary on which a condition holds."""
        domain, dim = self._space.mesh, self._dim
        tags = tag_numbers(domain.comm, self._facet_tags, condition.facet_tag, "boundary")
        domain.topology.create_connectivity(dim - 1, dim)
        facets = tagged_facets(domain.comm, self._facet_tags, condition.facet_tag, "boundary")
        if self._radius is not None:
            _require_off_axis(domain, facets, condition)
        dofs = fem.locate_dofs_topological(self._space, dim - 1, facets)
        if not isinstance(condition, (Flux, Rain)):
            return _Held(condition, tags, dofs)
        rate = fem.Constant(domain, 0.0)
        level = abs(ufl.FacetNormal(domain)[dim - 1]) if isinstance(condition, Rain) else 1.0
        density = weighted(rate * level, self._radius)
        return _Held(condition, tags, dofs, rate, density, fem.form(self._over(density, tags)))

    def _over(self, density: Any, tags: Any) -> Any:
        """Integral over facets at the surface of the soil that is there, inside of the mesh too, as a UFL form."""
        domain, there = self._space.mesh, self._there
        ds, inside = (ufl.Measure(kind, domain=domain, subdomain_data=self._facet_tags)(tags) for kind in ("ds", "dS"))
        if there is None:
            return density * ds
        return there * density * ds + (there("+") - there("-")) ** 2 * density("+") * inside

    def inflow_form(self, test: Any) -> Any:
        """Prescribed inflows over their unit against a test function, as a UFL form; 0 where there are none."""
        return sum(self._over(held.density * test, held.tags) for held in self.held if held.rate is not None)

    def set_time(self, time: float, dt: float = 0.0) -> None:
        """Give the prescribed inflows their values at a time [s], or of tables their means over the dt [s] before it."""
        for held in self.held:
            if held.rate is not None:
                held.rate.value = mean_over(held.condition.rate, time - dt, time) / self.unit

    def bounds(self, time: float) -> tuple[NDArray[np.bool_], NDArray[np.float64], NDArray[np.float64]]:
        """Which dofs have a prescribed pressure head, these heads, and upper bounds of the others [m], at a time [s]."""
        n = len(self.height)
        fixed, values, upper = np.zeros(n, dtype=bool), np.zeros(n), np.full(n, np.inf)
        for condition, dofs in ((held.condition, held.dofs) for held in self.held):
            if isinstance(condition, (Head, Reservoir)):
                level = value_at(condition.level, time)
                below = dofs if isinstance(condition, Head) else dofs[self.height[dofs] <= level + self._rounding]
                free = dofs[~fixed[dofs]] if isinstance(condition, Reservoir) else dofs[:0]
                upper[free] = np.minimum(upper[free], 0.0)
                below = below[~fixed[below]]
                fixed[below], values[below] = True, level - self.height[below]
            elif isinstance(condition, (SeepageFace, Rain)):
                upper[dofs] = np.minimum(upper[dofs], getattr(condition, "ponding", 0.0))
        return fixed, values, upper

    def lowest_outlet(self, time: float) -> float | None:
        """Total head [m] at which water first leaves, where no head is prescribed at a time [s]; None where one is. Collective.

        Raises:
            InputError: the conditions determine no steady pressure: no head is prescribed, and no water enters, or it cannot
                leave. Raised on all ranks alike.
        """
        comm = self._space.mesh.comm
        self.set_time(time)
        fixed, _, upper = self.bounds(time)
        self._require_known_pieces(fixed, upper)
        heads = comm.allgather((bool(fixed.any()), float((self.height + upper).min(initial=np.inf))))
        if any(known for known, _ in heads):
            return None
        lowest = min(head for _, head in heads)
        rates = [fem.assemble_scalar(held.total) for held in self.held if held.rate is not None]
        enters, size = np.sum(comm.allgather((sum(rates), sum(map(abs, rates)))), axis=0)
        problem = ""
        if not np.isfinite(lowest):
            problem = "and water can leave nowhere"
        elif not enters > 1e-9 * size:
            problem = f"and the rates of Flux and Rain add up to {self.unit * enters:.3g} m3/s, expected water that has to leave"
        text = "boundary: the steady pressure is undetermined: no head is prescribed (by Head, or by a Reservoir whose level reaches "
        agree(comm, f"{text}its facets), {problem}" if problem else None)
        return lowest

    def _require_known_pieces(self, fixed: NDArray[np.bool_], upper: NDArray[np.float64]) -> None:
        """Require a head, or water that enters and may leave, in each piece into which walls part the soil. Collective."""
        comm = self._space.mesh.comm
        if self._pieces is None:
            self._pieces = pieces_of(self._space)
        count = 1 + max(comm.allgather(int(self._pieces.max(initial=0))))
        if count == 1:
            return
        enters = np.zeros(len(fixed), dtype=bool)
        for held in self.held:
            if held.rate is not None:
                enters[held.dofs] |= float(held.rate.value) > 0
        ways = [np.bincount(self._pieces[there], minlength=count) > 0 for there in (fixed, enters, np.isfinite(upper))]
        head, inflow, outflow = np.any(comm.allgather(ways), axis=0)
        unknown = ~(head | (inflow & outflow))
        inside = np.flatnonzero(self._pieces == np.argmax(unknown)) if unknown.any() else np.empty(0, dtype=int)
        at = self._space.tabulate_dof_coordinates()[inside, : self._dim].mean(axis=0) if len(inside) else np.zeros(0)
        agree(
            comm,
            f"boundary: the steady pressure is undetermined in the soil about ({', '.join(f'{x:.6g}' for x in at)}) m, which walls part "
            "from all other soil, expected a head there (Head, or a Reservoir whose level reaches its facets), or water that enters "
            "and may leave"
            if len(inside)
            else None,
        )

    def inflow(self, facet_tag: int | str | None, reaction: NDArray[np.float64]) -> float:
        """Water that enters through the facets of a tag. Collective.

        A node where several conditions meet counts for the one that holds its pressure: a head or reservoir before a seepage face or rain, and
        the first of them of the same kind. A flux has what it prescribes.

        Args:
            facet_tag: number or name of the tag; None for all conditions together.
            reaction: inflow at the dofs beside the prescribed rates [m3/s], shape (m,).

        Returns:
            Inflow [m3/s], per metre [m2/s] in plane flow and per radian in axial symmetry (that of the whole body is 2 pi times
            as much); negative where water leaves.

        Raises:
            InputError: no facet has the tag. Raised on all ranks alike.
        """
        comm = self._space.mesh.comm
        numbers = None if facet_tag is None else tag_numbers(comm, self._facet_tags, facet_tag, "facet_tag")
        counted = np.zeros(len(self.height), dtype=bool)
        n, total = self._space.dofmap.index_map.size_local, 0.0
        for held in sorted(self.held, key=lambda held: not isinstance(held.condition, (Head, Reservoir))):
            new = held.dofs[~counted[held.dofs] & (held.dofs < n)]
            if isinstance(held.condition, Flux):
                new = new[:0]
            else:
                counted[held.dofs] = True
            if numbers is not None and set(held.tags).isdisjoint(numbers):
                continue
            total += reaction[new].sum()
            if held.rate is not None:
                total += self.unit * fem.assemble_scalar(held.total)
        return comm.allreduce(float(total))


def _require_off_axis(domain: Any, facets: NDArray[np.int32], condition: WaterBoundary) -> None:
    """Require that no facet of a condition is on the axis of an axisymmetric body, which has no area. Collective."""
    ends = domain.geometry.x[facet_nodes(domain, facets)][:, :, :2]
    length = np.abs(ends[:, 1] - ends[:, 0]).max(axis=1)
    found = bool(np.any(ends[:, :, 0].max(axis=1) <= 1e-9 * length))
    problem = f"boundary: {condition!r} holds on the axis, where the radius is 0 and no water can cross; expected other facets"
    agree(domain.comm, problem if found else None)
