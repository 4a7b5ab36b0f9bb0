"""Loads of a quasi-static analysis."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import ufl
from dolfinx import fem

from fenics_bridge import compat
from fenics_bridge.fields import assembled
from fenics_bridge.supports import require_facet_tag


@dataclass(frozen=True)
class Load:
    """What acts on the body at the end of a stage.

    unit_weight: [N/m3], against the last axis
    pressure: [Pa] by facet tag, compression positive, along the normal of the undeformed boundary
    displacement: share of the displacements that the supports prescribe [-], for `prescribed` supports
    """

    unit_weight: float = 0.0
    pressure: dict = field(default_factory=dict)
    displacement: float = 0.0

    def towards(self, other, share):
        """The load a share of the way (0 to 1) from this one to another."""

        def between(a, b):
            return a + share * (b - a)

        tags = {*self.pressure, *other.pressure}
        pressure = {tag: between(self.pressure.get(tag, 0.0), other.pressure.get(tag, 0.0)) for tag in tags}
        return Load(
            between(self.unit_weight, other.unit_weight), pressure, between(self.displacement, other.displacement)
        )


class LoadVectors:
    """Nodal forces of loads on a displacement space; each kind of load is assembled once."""

    def __init__(self, space, facet_tags, test=None):
        """test: test function of the displacement, where it is only a part of the space."""
        self._space, self._facet_tags = space, facet_tags
        domain, dim = space.mesh, space.mesh.geometry.dim
        self._test = ufl.TestFunction(space) if test is None else test
        down = fem.Constant(domain, np.array([0.0] * (dim - 1) + [-1.0]))
        self._weight = assembled(fem.form(ufl.inner(down, self._test) * ufl.dx), space).array.copy()
        self._pressure = {}

    def forces(self, load):
        """External forces, ghosts up to date: array over local unrolled dofs [N] ([N/m] in plane strain).

        Collective; raises InputError, on all ranks, for a facet tag that does not exist.
        """
        forces = load.unit_weight * self._weight
        for tag, pressure in load.pressure.items():
            forces = forces + pressure * self._unit_pressure(tag)
        return forces

    def _unit_pressure(self, tag):
        if tag not in self._pressure:
            domain = self._space.mesh
            require_facet_tag(domain.comm, self._facet_tags, tag, "pressure")
            ds = ufl.Measure("ds", domain=domain, subdomain_data=self._facet_tags)
            form = -ufl.inner(ufl.FacetNormal(domain), self._test) * ds(tag)
            self._pressure[tag] = assembled(fem.form(form), self._space).array.copy()
        return self._pressure[tag]


def elastic_load(test, domain, facet_tags, unit_weight, traction, body_force=None):
    """Work of weight, tractions and a body force on a test displacement, as a UFL form.

    unit_weight: [N/m3], against the last axis; traction: (D,) [Pa] by facet tag; body_force: as for `solve_elastic`
    Collective; raises InputError, on all ranks, for a facet tag that does not exist.
    """
    down = [0.0] * (domain.geometry.dim - 1) + [-float(unit_weight)]
    work = ufl.inner(fem.Constant(domain, np.array(down)), test) * ufl.dx
    if body_force is not None:
        # Cubic: its error is far below that of linear and quadratic displacements
        force = fem.Function(compat.function_space(domain, "Lagrange", 3, domain.geometry.dim))
        force.interpolate(lambda x: body_force(x[: domain.geometry.dim]))
        work += ufl.inner(force, test) * ufl.dx
    for tag, value in traction.items():
        require_facet_tag(domain.comm, facet_tags, tag, "traction")
        ds = ufl.Measure("ds", domain=domain, subdomain_data=facet_tags)
        work += ufl.inner(fem.Constant(domain, np.array(value, dtype=float)), test) * ds(tag)
    return work
