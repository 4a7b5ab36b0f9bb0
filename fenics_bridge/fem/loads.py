"""Loads of a quasi-static analysis."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.input_warnings import UNIT_WEIGHTS, is_unit_weight
from numpy.typing import ArrayLike, NDArray

from fenics_bridge import compat
from fenics_bridge.errors import agree, real_numbers
from fenics_bridge.fem.fields import assembled
from fenics_bridge.fem.geometry import weighted
from fenics_bridge.mesh.names import by_number, group_label, label, tag_numbers
from fenics_bridge.mesh.tagged import numbered_anew
from fenics_bridge.types import MeshTags
from mpm_core import checks


@dataclass(frozen=True)
class Load:
    """Loads on the body at the end of a stage."""

    unit_weight: float | dict[int | str | None, float] = 0.0
    """Unit weight [N/m3], against the last axis; or by cell tag or name, where cells of other tags have none"""
    pressure: dict[int | str, float] = field(default_factory=dict)
    """Pressure [Pa] by facet tag or name, compression positive, along the normal of the undeformed boundary"""
    displacement: float = 0.0
    """Fraction of the displacements that the supports prescribe [-], for `prescribed` supports"""
    held: float = 0.0
    """Fraction of the forces that were out of balance when the present stage began and are still held [-], see `Stage`"""
    traction: dict[int | str, Sequence[float]] = field(default_factory=dict)
    """Force per area [Pa], shape (D,), by facet tag or name, on the undeformed outer boundary, for instance shear"""
    body_force: dict[int | str | None, Sequence[float]] = field(default_factory=dict)
    """Force per volume [N/m3], shape (D,), beside the weight, by cell tag or name; by None in the cells of all other tags. Inertia
    forces of an earthquake, for instance: `pseudo_static`"""

    def __repr__(self) -> str:
        units = {
            "unit_weight": "N/m3",
            "body_force": "N/m3",
            "pressure": "Pa",
            "traction": "Pa",
            "displacement": "of it",
            "held": "of it",
        }
        shown = (f"{name}={getattr(self, name)} {unit}" for name, unit in units.items() if getattr(self, name))
        return f"Load({', '.join(shown)})"

    def towards(self, other: Load, fraction: float) -> Load:
        """The load at a fraction of the way from this one to another.

        Args:
            other: load at the end of the way.
            fraction: from 0, this load, to 1, the other one [-].
        """

        def between(a: Any, b: Any) -> Any:
            return a + fraction * (b - a)

        def between_tags(a: Any, b: Any) -> Any:
            return {tag: between(a.get(tag, a.get(None, 0.0)), b.get(tag, b.get(None, 0.0))) for tag in {*a, *b}}

        def between_vectors(name: str) -> Any:
            ends = (_arrays(name, getattr(load, name)) for load in (self, other))
            return {tag: tuple(vector) for tag, vector in between_tags(*ends).items()}

        weights = self.unit_weight, other.unit_weight
        by_tag = any(isinstance(weight, dict) for weight in weights)
        return Load(
            between_tags(*map(weight_by_tag, weights)) if by_tag else between(*weights),
            between_tags(self.pressure, other.pressure),
            between(self.displacement, other.displacement),
            between(self.held, other.held),
            between_vectors("traction"),
            between_vectors("body_force"),
        )


def require_finite(comm: MPI.Comm, load: Load) -> None:
    """Raise InputError on all ranks if a load has a value that is not finite on any. Collective."""
    problem = None
    by_tag = {"pressure": "facet", "traction": "facet", "body_force": "cell"}
    for name in ("unit_weight", "pressure", "traction", "body_force", "displacement", "held"):
        value = getattr(load, name)
        if name in by_tag and not isinstance(value, dict):
            problem = f"{name} is {value!r}, expected a dictionary by {by_tag[name]} tag or name"
            continue
        scalar = name not in ("traction", "body_force")
        wrong = [v for v in (value.values() if isinstance(value, dict) else [value]) if not _is_finite(v, scalar)]
        if wrong:
            problem = f"{name} is {wrong[0]!r}, expected finite numbers"
    agree(comm, problem)


def _is_finite(value: Any, scalar: bool) -> bool:
    numbers = np.asarray(value)
    return not (scalar and numbers.ndim) and numbers.dtype.kind in "iuf" and bool(np.isfinite(numbers).all())


def _arrays(name: str, vectors: Any) -> Any:
    return {tag: checks.real_numbers(name, vector) for tag, vector in vectors.items()}


def warn_of_weight(comm: MPI.Comm, load: Load, cell_tags: MeshTags | None = None) -> None:
    """Warn of a unit weight that no soil has, such as one in kN/m3 or one that acts upwards; none is fine."""
    weights = [
        (float(weight), "" if tag is None else f" of {group_label(cell_tags, tag)}")
        for tag, weight in weight_by_tag(load.unit_weight).items()
    ]
    odd = [(weight, of) for weight, of in weights if weight and not is_unit_weight(abs(weight))]
    upwards = [(weight, of) for weight, of in weights if weight < 0]
    texts = []
    if upwards:
        texts.append(
            f"the unit weight{upwards[0][1]} is {upwards[0][0]:.4g} N/m3, so that it acts upwards, expected a number from 0 on: a positive one acts "
            "against the last axis"
        )
    if odd:
        texts.append(
            f"the unit weight{odd[0][1]} is {odd[0][0]:.4g} N/m3, expected from {UNIT_WEIGHTS[0]:g} to {UNIT_WEIGHTS[1]:g} N/m3 for a soil: unit "
            "weights are in N/m3, 20e3 for most soils, and n times that in a centrifuge under n g"
        )
    for text in texts if comm.rank == 0 else ():
        warnings.warn(text, RuntimeWarning, stacklevel=3)


def weight_by_tag(unit_weight: Any) -> Any:
    """Unit weights by cell tag; None stands for the cells of all other tags."""
    return unit_weight if isinstance(unit_weight, dict) else {None: unit_weight}


def pressing(domain: Mesh, pressure: Any, test: Any, facet_tags: MeshTags, tags: Any, there: Any) -> Any:
    """Work of a pressure against the surface of the soil that is there, as a UFL form.

    Args:
        domain: the mesh.
        pressure: pressure [Pa], UFL, times the radius in axisymmetric bodies.
        test: test function of the displacement, continuous.
        facet_tags: tags of the facets.
        tags: numbers of those that it presses on; where soil ends inside of the mesh, facets in there too.
        there: function that is 1 in cells that are there and 0 in those that are not; None where all are.
    """
    pressed = numbered_anew(domain, facet_tags, [np.atleast_1d(tags)])
    normal, ds = ufl.FacetNormal(domain), ufl.Measure("ds", domain=domain, subdomain_data=pressed)(1)
    if there is None:
        return -pressure * ufl.inner(normal, test) * ds
    acting, inside = there * pressure, ufl.Measure("dS", domain=domain, subdomain_data=pressed)(1)
    outward = acting("+") * normal("+") + acting("-") * normal("-")  # between two cells that are there it cancels
    within = ufl.inner(outward, test("+")) * inside
    return -there * pressure * ufl.inner(normal, test) * ds - within


class LoadVectors:
    """Nodal forces of loads on a displacement space; each kind of load is assembled once.

    Args:
        space: space of the unknowns.
        facet_tags: tags of the boundary.
        cell_tags: tags of the cells; None where no load is given by cell tag.
        test: test function of the displacement, where it is only a part of the space.
        active: function that is 1 in cells that are there and 0 in those that are not; the others neither weigh nor are pressed.
        radius: radius of an axisymmetric body, a UFL expression; forces are then those of one radian.
    """

    def __init__(
        self,
        space: Any,
        facet_tags: MeshTags,
        cell_tags: MeshTags | None = None,
        test: Any = None,
        active: fem.Function | None = None,
        radius: Any = None,
    ) -> None:
        self.active: Any = active
        """Function that is 1 in cells that are there and 0 in others; None where all are"""
        self._radius = radius
        self.constant: Any = 0.0
        """Forces that always act, an array like `forces`, or 0"""
        self.held: Any = 0.0
        """Forces of which the fraction `Load.held` acts, an array like `forces`, or 0"""
        self._space, self._facet_tags, self._cell_tags = space, facet_tags, cell_tags
        self._test = ufl.TestFunction(space) if test is None else test
        self._body_force: dict[tuple[int | None, int], NDArray[np.float64]] = {}
        self._upwards = space.mesh.geometry.dim - 1
        self._unit_body_force(None, self._upwards)
        extent = np.ptp(space.mesh.geometry.x, axis=0).max() if len(space.mesh.geometry.x) else 0.0
        self._size = space.mesh.comm.allreduce(float(extent), MPI.MAX) ** (space.mesh.geometry.dim - 1)
        self._pressure: dict[int, NDArray[np.float64]] = {}
        self._traction: dict[int, list[NDArray[np.float64]]] = {}

    def forces(self, load: Load) -> NDArray[np.float64]:
        """External forces of a load, ghosts up to date.

        Args:
            load: the load.

        Returns:
            Array over local unrolled dofs [N] ([N/m] in plane strain, [N] per radian).

        Raises:
            InputError: a tag does not exist, a value is not finite, or a traction has not D components. Raised on all ranks
                alike.

        Note:
            Collective.
        """
        load = self.resolved(load)
        by_tag = weight_by_tag(load.unit_weight)
        elsewhere = by_tag.get(None, 0.0)
        forces = -elsewhere * self._unit_body_force(None, self._upwards)
        for tag in sorted(tag for tag in by_tag if tag is not None):
            forces = forces - (by_tag[tag] - elsewhere) * self._unit_body_force(tag, self._upwards)
        everywhere = np.zeros(self._space.mesh.geometry.dim)
        for tag in sorted(load.body_force, key=lambda tag: (tag is not None, tag or 0)):
            vector = _vector(self._space.mesh, load.body_force[tag], "body_force")
            beside = vector - everywhere
            everywhere = vector if tag is None else everywhere
            for axis, component in enumerate(beside):
                forces = forces + component * self._unit_body_force(tag, axis)
        for tag, pressure in load.pressure.items():
            forces = forces + pressure * self._unit_pressure(tag)
        for tag, traction in load.traction.items():
            for component, unit in zip(_vector(self._space.mesh, traction), self._unit_tractions(tag)):
                forces = forces + component * unit
        return forces + self.constant + load.held * self.held

    def resolved(self, load: Load) -> Load:
        """The load with numbers for the names of tags.

        Args:
            load: the load.

        Raises:
            InputError: as for `forces`. Raised on all ranks alike.

        Note:
            Collective.
        """
        comm = self._space.mesh.comm
        agree(comm, None if isinstance(load, Load) else f"load is {load!r}, expected a Load")
        weight = load.unit_weight
        require_finite(comm, load)
        if isinstance(weight, dict):
            weight = by_number(comm, self._cell_tags, weight, "unit_weight", "cell")
        pressure = by_number(comm, self._facet_tags, load.pressure, "pressure")
        traction = by_number(comm, self._facet_tags, load.traction, "traction")
        body_force = by_number(comm, self._cell_tags, load.body_force, "body_force", "cell")
        for name, vectors in (("traction", traction), ("body_force", body_force)):
            for vector in vectors.values():
                _vector(self._space.mesh, vector, name)
        return replace(load, unit_weight=weight, pressure=pressure, traction=traction, body_force=body_force)

    def require_acting(self, load: Load, before: Load) -> None:
        """Require that pressures and tractions that a load brings in act on the surface of the soil.

        Args:
            load: the load, resolved or not.
            before: the load so far, whose pressures may by now be inside of the soil, where they vanish.

        Raises:
            InputError: none of the facets of a tag is there. Raised on all ranks alike.

        Note:
            Collective.
        """
        comm, load, before = self._space.mesh.comm, self.resolved(load), self.resolved(before)
        for name, unit in (("pressure", self._unit_pressure), ("traction", self._unit_tractions)):
            given, there = getattr(load, name), getattr(before, name)
            for tag in sorted(tag for tag, value in given.items() if np.any(value) and tag not in there):
                force = comm.allreduce(float(np.abs(unit(tag)).max(initial=0.0)), MPI.MAX)
                text = f"{name}: no facet with the tag {label(self._facet_tags, tag)} is on the surface of the soil, expected one there"
                agree(comm, text if force <= 1e-12 * self._size else None)

    def _unit_body_force(self, tag: int | None, axis: int) -> NDArray[np.float64]:
        """Nodal forces of 1 N/m3 along an axis in the cells of a tag, or in all for None."""
        if (tag, axis) not in self._body_force:
            domain, dx = self._space.mesh, ufl.dx
            if tag is not None:
                of_tag = numbered_anew(domain, self._cell_tags, [[tag]])
                dx = ufl.Measure("dx", domain=domain, subdomain_data=of_tag)(1)
            along = fem.Constant(domain, np.eye(domain.geometry.dim)[axis])
            there = 1.0 if self.active is None else self.active
            form = fem.form(weighted(there * ufl.inner(along, self._test), self._radius) * dx)
            self._body_force[tag, axis] = assembled(form, self._space).array.copy()
        return self._body_force[tag, axis]

    def _unit_pressure(self, tag: Any) -> Any:
        if tag not in self._pressure:
            domain = self._space.mesh
            unit = weighted(fem.Constant(domain, 1.0), self._radius)
            form = pressing(domain, unit, self._test, self._facet_tags, tag, self.active)
            self._pressure[tag] = assembled(fem.form(form), self._space).array.copy()
        return self._pressure[tag]

    def _unit_tractions(self, tag: Any) -> Any:
        """Nodal forces of 1 Pa along each axis."""
        if tag not in self._traction:
            domain = self._space.mesh
            of_tag = numbered_anew(domain, self._facet_tags, [[tag]])
            ds = ufl.Measure("ds", domain=domain, subdomain_data=of_tag)(1)
            there = 1.0 if self.active is None else self.active
            self._traction[tag] = [
                assembled(
                    fem.form(weighted(there * ufl.inner(fem.Constant(domain, axis), self._test), self._radius) * ds),
                    self._space,
                ).array.copy()
                for axis in np.eye(domain.geometry.dim)
            ]
        return self._traction[tag]


def elastic_load(
    test: Any,
    domain: Mesh,
    facet_tags: MeshTags,
    unit_weight: float,
    traction: Mapping[int | str, ArrayLike],
    body_force: Callable[[NDArray[np.float64]], ArrayLike] | None = None,
    radius: Any = None,
) -> Any:
    """Work of weight, tractions and a body force on a test displacement, as a UFL form.

    Args:
        test: test displacement.
        domain: mesh of the body.
        facet_tags: tags of the boundary.
        unit_weight: unit weight [N/m3], against the last axis.
        traction: force per area [Pa], shape (D,), by facet tag.
        body_force: as for `solve_elastic`.
        radius: radius of an axisymmetric body, a UFL expression; the work is then that of one radian.

    Raises:
        InputError: a facet tag does not exist, or a traction is not D finite numbers. Raised on all ranks alike.

    Note:
        Collective.
    """
    down = [0.0] * (domain.geometry.dim - 1) + [-float(unit_weight)]
    work = weighted(ufl.inner(fem.Constant(domain, np.array(down)), test), radius) * ufl.dx
    if body_force is not None:
        # Cubic: its error is far below that of linear and quadratic displacements
        force = fem.Function(compat.function_space(domain, "Lagrange", 3, domain.geometry.dim))
        force.interpolate(lambda x: body_force(x[: domain.geometry.dim]))
        work += weighted(ufl.inner(force, test), radius) * ufl.dx
    for tag, value in traction.items():
        ds = ufl.Measure("ds", domain=domain, subdomain_data=facet_tags)
        numbers = tag_numbers(domain.comm, facet_tags, tag, "traction")
        work += weighted(ufl.inner(fem.Constant(domain, _vector(domain, value)), test), radius) * ds(numbers)
    return work


def _vector(domain: Mesh, given: ArrayLike, name: str = "traction") -> NDArray[np.float64]:
    """A traction [Pa] or body force [N/m3], (D,). Collective."""
    vector, dim = real_numbers(domain.comm, name, given), domain.geometry.dim
    good = vector.shape == (dim,) and bool(np.isfinite(vector).all())
    agree(domain.comm, None if good else f"{name} is {given!r}, expected {dim} finite numbers")
    return vector
