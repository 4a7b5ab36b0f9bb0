"""A column of saturated soil that consolidates, and the closed forms of its consolidation."""

from __future__ import annotations

import numpy as np
import pytest
import ufl
from dolfinx import fem
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

GRAVITY_OF_WATER = 9810.0
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
"""Facet tags of a column in two dimensions"""

ELEMENTS = pytest.mark.parametrize("element", list(water.Element), ids=lambda e: e.name.lower())


class Column:
    """A column 1 m high between rollers on an impervious base, in multiples of its load or of its buoyant weight.

    Water stands at its top unless another boundary is given. period: H^2 / c_v [s]; settlement: the final one [m]
    """

    porosity = 0.4

    def __init__(self, element, cells, dim=2, boundary=None, load=10e3, buoyant=0.0, conductivity=1e-8, poisson=0.3,
                 water_modulus=np.inf, comm=MPI.COMM_WORLD, nmd=False, across=2):  # fmt: skip
        self.width, self.size, self.load, self.buoyant = 0.2, load + buoyant, load, buoyant
        side = [self.width] * (dim - 1)
        domain, _, facet_tags = bridge.box_mesh(comm, (*side, 1.0), (*[across] * (dim - 1), cells))
        self.facet_tags = facet_tags
        self.law = mpm.LinearElastic(young=10e6, poisson=poisson)
        self.oedometer = self.law.p_wave_modulus
        self.period = GRAVITY_OF_WATER / (conductivity * self.oedometer)
        self.settlement = (load + 0.5 * buoyant) / self.oedometer
        supports = [bridge.roller(2 * axis + end, np.eye(dim)[axis]) for axis in range(dim - 1) for end in (1, 2)]
        supports.append(bridge.fixed(2 * dim - 1))
        top = 2 * dim
        self.model = water.Consolidation(
            domain,
            self.law,
            water.PorousSoil(conductivity, porosity=self.porosity),
            facet_tags,
            supports,
            [water.Head(top, 1.0)] if boundary is None else boundary,
            load=bridge.Load(unit_weight=GRAVITY_OF_WATER + buoyant, pressure={top: load}),
            element=element,
            nmd=nmd,
            water_modulus=water_modulus,
        )
        self.top, self.base = np.append(side, 1.0), np.append(side, 0.0)
        self.start_again()

    def start_again(self):
        """Put the column back to where nothing has drained or settled yet."""
        self.model.initialise(pore_pressure=self._hydrostatic)

    def _hydrostatic(self, x):
        return GRAVITY_OF_WATER * (1.0 - x[:, -1])

    def excess(self, heights):
        """Excess pore pressures at heights (n,) over the load."""
        points = np.tile(self.base, (len(heights), 1))
        points[:, -1] = heights
        return (self.model.evaluate_at(points)["pressure"][:, 0] - self._hydrostatic(points)) / self.size

    def nodal_excess(self):
        """The same at all nodes."""
        x = self.model.pressure.function_space.tabulate_dof_coordinates()[:, : len(self.top)]
        return (self.model.pressure.x.array - self._hydrostatic(x)) / self.size

    def settled(self):
        """Settlement of the surface over the final one."""
        return -self.model.evaluate_at(self.top[None])["displacement"][0, -1] / self.settlement

    def volume_lost(self):
        """Integral of the settlement over the surface [m2], [m3] in three dimensions."""
        u, dim = self.model.displacement, len(self.top)
        ds = ufl.Measure("ds", domain=self.model.domain, subdomain_data=self.facet_tags)
        lost = fem.assemble_scalar(fem.form(-u[dim - 1] * ds(2 * dim)))
        return self.model.domain.comm.allreduce(lost)

    def stress_at_rest(self):
        """Effective stresses of the buoyant weight (n, S) [Pa]."""
        y, poisson = self.model.points.coordinates()[:, -1], self.law.poisson
        stress = np.zeros_like(self.model.points.stress)
        vertical = -self.buoyant * (1.0 - y)
        stress[:, :3] = (poisson / (1 - poisson) * vertical)[:, None]
        stress[:, len(self.top) - 1] = vertical
        return stress


def layer_excess(height, factor):
    """Excess pressure over the load in a layer drained at its top (height 1) at a time factor c_v t / H^2 (Terzaghi)."""
    m = np.pi * (2 * np.arange(200) + 1) / 2
    return np.sum(2 / m * np.sin(m) * np.cos(np.outer(height, m)) * np.exp(-(m**2) * factor), axis=1)


def layer_settled(factor):
    """Degree of consolidation of that layer."""
    m = np.pi * (2 * np.arange(200) + 1) / 2
    return 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))
