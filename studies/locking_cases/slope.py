"""An undrained slope (friction angle 0) under its weight, shortly before it fails."""

from __future__ import annotations

from time import process_time

import numpy as np

import fenics_bridge as bridge
import mpm_core as mpm

from .runs import Found, damped, displacement_at, found, mesh_of, particles_in, quasi_static

NAME = "slope"
TITLE = "Undrained slope"
QUANTITY = "settlement of the shoulder times Young's modulus over cohesion [m]"
POISSON = {"implicit": (0.4999,), "explicit": (0.4995,)}
DIVISIONS = {"implicit": 4, "explicit": 4}
"""Over the height on the coarsest mesh, by scheme."""
MIXED_FINEST = 32
"""Divisions for Taylor-Hood elements at most."""
EXACT = None

COHESION, STIFFNESS = 1e3, 1e5
"""[Pa]; Young's modulus over cohesion, so large that the displacements are small."""
UNIT_WEIGHT = 5e3
"""[N/m3]; limit analysis (`bridge.log_spiral`) gives collapse at 5.87 cohesion over height."""
GRAVITY = 9.81
RISE = 40.0
"""Time in which the weight rises in explicit runs, in times a shear wave takes over the height. The faster it rises, the
more soil yields on the way: on a mesh of 8 divisions the shoulder settles by 1.9, 1.0 and 0.1 % more than in the quasi-static
run for 20, 40 and 80."""
SHOULDER = (1.1, 1.0)
PRESSURE_UNIT = COHESION, "cohesion"
LEFT, BASE = 1, 2


def mesh(divisions: int) -> tuple:
    """Domain, cell tags, facet tags. Collective."""
    return mesh_of("bank", divisions)


def cell_size(divisions: int) -> float:
    """[m], over the height of 1 m."""
    return 1 / divisions


def soil(poisson: float) -> mpm.MohrCoulomb:
    """Soil with a friction angle of 0."""
    return mpm.tresca(young=STIFFNESS * COHESION, poisson=poisson, shear_strength=COHESION)


def taylor_hood(divisions: int, poisson: float) -> float:
    """Settlement by Taylor-Hood elements. Collective."""
    domain, _, facet_tags = mesh(divisions)
    supports = [bridge.roller(LEFT, (1, 0)), bridge.fixed(BASE)]
    fem = bridge.MixedQuasiStatic(domain, soil(poisson), facet_tags, supports)
    fem.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    if not fem.converged:
        return float("nan")
    return -STIFFNESS * float(fem.evaluate_at(np.array([SHOULDER]))["displacement"][0, 1])


def by_particles(divisions: int, poisson: float, nmd: bool, scheme: str) -> Found:
    """Settlement by particles whose weight rises, in quasi-static steps or slowly with damping. Collective."""
    start = process_time()
    model = particles_in(mesh(divisions), soil(poisson), UNIT_WEIGHT / GRAVITY)
    model.roller(LEFT, (1, 0))
    model.fix(BASE)
    if scheme == "implicit":
        model.set_gravity((0.0, -GRAVITY), ramp=1.0)
        quasi_static(model, nmd, steps=10)
    else:
        shear_wave = (STIFFNESS * COHESION / (2 * (1 + poisson)) * GRAVITY / UNIT_WEIGHT) ** 0.5
        model.set_gravity((0.0, -GRAVITY), ramp=RISE / shear_wave)
        damped(model, nmd, time=200 / shear_wave, at_least=RISE / shear_wave)
    return found(model, -STIFFNESS * float(displacement_at(model, SHOULDER)[1]), start)
