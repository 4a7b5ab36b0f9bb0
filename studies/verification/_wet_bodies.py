"""Bodies of soil and water in small displacements, by finite elements or particles alike."""

from __future__ import annotations

import numpy as np
from common.water.wet_particles import SmallMotion
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
GRAVITY, WATER = 9.81, 9810.0  # m/s2, N/m3
POROSITY = 0.4
PARTICLES = "particles"


def wet(method, mesh, law, conductivity, supports, levels, weight, start=None, modulus=np.inf):
    """A heavy body whose weight comes on in its first step.

    Args:
        method: a `water.Element`, or PARTICLES.
        levels: of the heads at boundaries [m], by tag; those of other sides than the base are of standing water.
        weight: unit weight [N/m3].
        start: level of the hydrostatic pressure at the beginning [m]; none without it.
    """
    kind = WetParticles if method == PARTICLES else WetElements
    pressure = None if start is None else lambda x: WATER * (start - x[:, 1])
    return kind(method, mesh, law, conductivity, supports, levels, weight, pressure, modulus)


class WetElements:
    """Finite elements: see `wet`."""

    def __init__(self, element, mesh, law, conductivity, supports, levels, weight, pressure, modulus):
        domain, _, facet_tags = mesh
        soil = water.PorousSoil(conductivity, porosity=POROSITY)
        boundary = [(water.Head if tag == 3 else water.Reservoir)(tag, level) for tag, level in levels.items()]
        self.model = water.Consolidation(
            domain, law, soil, facet_tags, supports, boundary, load=bridge.Load(unit_weight=weight), element=element,
            water_modulus=modulus,
        )  # fmt: skip
        self.model.initialise(pore_pressure=pressure)

    @property
    def time(self):
        return self.model.time

    def advance(self, dt):
        report = self.model.advance(dt)
        if not report.converged:
            raise mpm.RunError(f"no equilibrium in the step from {self.time:.4g} s: {report.reason}")

    def displacement(self, point):
        """Displacement at a point [m]."""
        own = np.array([point]) if comm.rank == 0 else np.empty((0, 2))
        return comm.bcast(self.model.evaluate_at(own)["displacement"])[0]

    def mean_stress(self):
        """Mean effective stress of the body [Pa], whose cells are of one size."""
        stress = self.model.points.stress
        return mean(stress, np.ones(len(stress)))


class WetParticles:
    """Implicit particles, three per cell: see `wet`."""

    def __init__(self, _, mesh, law, conductivity, supports, levels, weight, pressure, modulus):
        domain, _, facet_tags = mesh
        self.model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), law)
        self.model.seed(density=weight / GRAVITY, per_cell=3)
        bridge.apply_supports(self.model, supports)
        self.model.set_gravity((0.0, -GRAVITY))
        self.model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
        if pressure is not None:
            self.model.set_pore_pressure(pressure)
        for tag, level in levels.items():
            self.model.hold_pore_pressure(tag, level=level, presses=tag != 3)
        self._steps = SmallMotion(self.model)

    @property
    def time(self):
        return self.model.time

    def advance(self, dt):
        for _ in self._steps.advance(self.time + dt, dt):
            pass

    def displacement(self, point):
        """Displacement at a point [m]."""
        return self._steps.at([point])[0][0]

    def mean_stress(self):
        """Mean effective stress of the body [Pa]."""
        return mean(self.model.particles.stress, self.model.particles.volume)


def mean(values, volumes):
    """Mean over all ranks."""
    return comm.allreduce(volumes @ values) / comm.allreduce(volumes.sum())


def dry(mesh, law, supports, weight, point):
    """Displacement [m] at a point of the body without water under its weight, by quadratic elements."""
    domain, _, facet_tags = mesh
    fem = bridge.QuasiStatic(domain, law, facet_tags, supports, 2)
    fem.solve(bridge.Load(unit_weight=weight))
    own = np.array([point]) if comm.rank == 0 else np.empty((0, 2))
    return comm.bcast(fem.evaluate_at(own)["displacement"])[0]
