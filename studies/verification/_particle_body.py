"""A body of weightless soil and water as implicit particles, with the problems that finite elements solve beside it."""

from __future__ import annotations

import numpy as np
from common.water.wet_particles import SmallMotion
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD


class ParticleBody:
    """Three particles per cell, in small displacements, drained at parts of the surface.

    Loads are pressures on facets, or a function of the time that has a factor on the prescribed displacements of supports.

    period: length^2 / c_v [s], of the oedometric modulus
    """

    def __init__(self, mesh, supports, drained, load, law, mobility, length, geometry=None, weight=1e-3, nmd=False):
        """mesh, supports, load: as for `water.Consolidation`; drained: tags; mobility: k / gamma_w [m2/(Pa s)]
        weight: of the pore water under 9.81 m/s2 [N/m3]; nmd: average volumetric strains over nodes
        """
        domain, _, facet_tags = mesh
        self.law, self.period = law, length**2 / (mobility * law.p_wave_modulus)
        self.model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), law, geometry=geometry)
        self.model.seed(density=2000.0, per_cell=3)
        bridge.apply_supports(self.model, [support for support in supports if not any(support.displacement or ())])
        self._plates = {s.facet_tag: s.displacement for s in supports if any(s.displacement or ())}
        self.model.add_water(porosity=0.4, conductivity=mobility * weight, modulus=np.inf, density=weight / 9.81)
        self.drain(drained)
        self._motion = (lambda time: load(time).displacement) if callable(load) else lambda time: 0.0
        for tag, pressure in ({} if callable(load) else load.pressure).items():
            self.model.press_surface(tag, pressure)
        self._steps, self._factor, self.plate_force = SmallMotion(self.model, nmd), 0.0, 0.0

    def drain(self, tags):
        """Let water leave at these parts of the surface."""
        for tag in tags:
            self.model.hold_pore_pressure(tag, 0.0)

    def follow(self, factor, first=1e-4, growth=1.1):
        """Go to a time factor, with steps that grow with the time."""
        start = self.model.time
        dt = max(first * self.period, 0.08 * start)
        while self.model.time < factor * self.period * (1 - 1e-9):
            self.advance(min(dt, factor * self.period - self.model.time))
            dt = min(dt * growth, 0.04 * self.period)

    def advance(self, dt):
        """Take one step of dt [s], or several shorter ones."""
        more = self._move_plates(dt)
        before = self.model.report().support_work
        *_, report = self._steps.advance(self.model.time + dt, dt)
        if more:
            self.plate_force = (report.support_work - before) / more

    def _move_plates(self, dt):
        """Prescribe what supports move in the next step; returns how far that is in all [m].

        The work of the supports over this is the force on them.
        """
        factor = self._motion(self.model.time + dt)
        change, self._factor = factor - self._factor, factor
        for tag, whole in self._plates.items():
            self.model.prescribe(tag, [None if part is None else change * part / dt for part in whole])
        return change * sum(abs(part) for whole in self._plates.values() for part in whole if part)

    def at(self, point):
        """Displacement [m] (1, D), and pore pressure [Pa] (1,), at a point."""
        return self._steps.at([point])

    def pressures(self, points):
        """Pore pressures at points [Pa], shape (n,)."""
        return self._steps.at(points)[1]
