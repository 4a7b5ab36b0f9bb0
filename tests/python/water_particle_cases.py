"""Particles whose pores hold water: a column, a layer, and the finite elements that they are compared with."""

from __future__ import annotations

import numpy as np
from consolidation_cases import BASE, GRAVITY_OF_WATER, LEFT, RIGHT, TOP
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

ELASTIC = mpm.LinearElastic(young=10e6, poisson=0.3)


def on_box(lengths, cells, law, comm=MPI.COMM_WORLD, geometry=None, **seeds):
    """Particles that fill a box on rollers at its vertical sides and a fixed base; returns the model and the facet tags."""
    domain, _, facet_tags = bridge.box_mesh(comm, lengths, cells)
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), law, geometry=geometry)
    model.seed(**{"density": 2000.0, "per_cell": 3, **seeds})
    dim = len(lengths)
    for axis in range(dim - 1):
        for end in (1, 2):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    model.fix(2 * dim - 1)
    return model


class Column:
    """A column 1 m high, drained at its top, that carries a load, in multiples of the load; weightless.

    period: H^2 / c_v [s]; settlement: the final one [m]
    """

    width = 0.2

    def __init__(self, cells, dim=2, load=10e3, conductivity=1e-8, modulus=np.inf, comm=MPI.COMM_WORLD, law=ELASTIC):
        self.load, self.oedometer = load, law.p_wave_modulus
        self.model = on_box([self.width] * (dim - 1) + [1.0], [2] * (dim - 1) + [cells], law, comm,
                            per_cell=3 if dim == 2 else 4)  # fmt: skip
        self.model.add_water(porosity=0.4, conductivity=conductivity, modulus=modulus)
        self.top = 2 * dim
        self.model.hold_pore_pressure(self.top, 0.0)
        self.model.press_surface(self.top, load)
        self.area = self.width ** (dim - 1)
        self.period = GRAVITY_OF_WATER / (conductivity * self.oedometer)

    def follow(self, factor, growth=1.1, first=1e-4):
        """Steps to a time factor, each longer than the one before; returns the reports."""
        dt, reports, end = first * self.period, [], factor * self.period
        while self.model.time < end * (1 - 1e-9):
            to = min(end, self.model.time + dt)
            reports += self.model.implicit(to, dt=dt, quasi_static=True, small_displacements=True)
            dt *= growth
        return reports

    def base(self):
        """Pressure at the base over the load, from the particles there and their gradients."""
        p = self.model.particles
        low = p.position[:, -1] == p.position[:, -1].min()
        there = p.pore_pressure[low] - p.pressure_gradient[low, -1] * p.position[low, -1]
        return there.mean() / self.load

    def degree(self):
        """Water that left over that of the final settlement."""
        return -self.model.water_inflow() / (self.area * self.load / self.oedometer)


def layer(law, water_modulus, weight=20e3, anisotropy=None):
    """A layer, 2 m by 1 m, free at its drained right side, as finite elements and as particles at the centroids of their cells.

    The right side is drained, as is the top; water is at rest at the beginning and the effective stresses are those of a
    level layer.
    """
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (2.0, 1.0), (8, 4))
    supports = [bridge.roller(LEFT, (1, 0)), bridge.fixed(BASE)]
    conductivity = 1e-6 if anisotropy is None else 1e-6 * np.asarray(anisotropy)
    fem = water.Consolidation(
        domain, law, water.PorousSoil(conductivity, porosity=0.4), facet_tags, supports,
        [water.Head(TOP, 1.0), water.Head(RIGHT, 1.0)],
        load=bridge.Load(unit_weight=weight), element=water.Element.STABILISED, water_modulus=water_modulus,
    )  # fmt: skip
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), law)
    model.seed(density=weight / 9.81, per_cell=1)
    model.roller(LEFT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-6, modulus=water_modulus, anisotropy=anisotropy)

    def at_rest(x):
        return GRAVITY_OF_WATER * (1.0 - x[:, 1])

    def effective(x):
        return bridge.k0_stress(x, surface=1.0, unit_weight=weight - GRAVITY_OF_WATER, k0=0.5)

    fem.initialise(effective(fem.points.coordinates()), pore_pressure=at_rest)
    model.set_pore_pressure(at_rest)
    model.particles.set("stress", effective(model.particles.position))
    for tag in (TOP, RIGHT):
        model.hold_pore_pressure(tag, level=1.0, presses=False)
    return fem, model
