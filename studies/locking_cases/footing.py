"""A rough, rigid strip footing that is pressed into undrained, weightless ground (friction angle 0)."""

from __future__ import annotations

from time import process_time

import numpy as np

import fenics_bridge as bridge
import mpm_core as mpm

from .runs import COURANT, DAMPING, Found, found, mesh_of, nodal_sum, particles_in, quasi_static

NAME = "footing"
TITLE = "Strip footing"
QUANTITY = "pressure below the footing over cohesion [-]"
POISSON = {"implicit": (0.4999, 0.49), "explicit": (0.49,)}
DIVISIONS = {"implicit": 2, "explicit": 2}
"""Below half of the footing on the coarsest mesh, by scheme."""
MIXED_FINEST = 8
"""Divisions for Taylor-Hood elements at most: Newton's method takes minutes beyond."""
EXACT = 2 + np.pi
"""Prandtl (1920), smooth or rough."""

COHESION, STIFFNESS = 1e3, 1e5
"""[Pa]; Young's modulus over cohesion, so large that the settlement is a small part of a cell."""
SETTLEMENT = 1e-3
"""Settlement of the footing over half of its width: ten times the one at which the ground without locking yields."""
DENSITY = 2000.0
PRESSURE_UNIT = COHESION, "cohesion"
AXIS, BASE, FAR, FOOTING = 1, 2, 3, 5


def mesh(divisions: int) -> tuple:
    """Domain, cell tags, facet tags. Collective."""
    return mesh_of("ground", divisions)


def cell_size(divisions: int) -> float:
    """[m]; half of the footing is 1 m wide."""
    return 1 / divisions


def soil(poisson: float) -> mpm.MohrCoulomb:
    """Soil with a friction angle of 0."""
    return mpm.tresca(young=STIFFNESS * COHESION, poisson=poisson, shear_strength=COHESION)


def taylor_hood(divisions: int, poisson: float) -> float:
    """Pressure by Taylor-Hood elements; nan where it was not reached. Collective.

    They yield at a tenth of the particles' settlement and keep their pressure; two tenths are enough.
    """
    domain, _, facet_tags = mesh(divisions)
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE),
                bridge.prescribed(FOOTING, (0.0, -0.2 * SETTLEMENT))]  # fmt: skip
    fem = bridge.MixedQuasiStatic(domain, soil(poisson), facet_tags, supports)
    fem.solve(bridge.Load(displacement=1.0), first_step=0.25, tolerance=0.1)
    return float(fem.reaction(FOOTING)[1]) / COHESION if fem.load.displacement >= 0.5 else float("nan")


def by_particles(divisions: int, poisson: float, nmd: bool, scheme: str) -> Found:
    """Pressure by particles, in quasi-static steps or by slow, damped motion. Collective."""
    start = process_time()
    model = particles_in(mesh(divisions), soil(poisson), DENSITY)
    model.roller(AXIS, (1, 0))
    model.roller(FAR, (1, 0))
    model.fix(BASE)
    if scheme == "implicit":
        model.prescribe(FOOTING, (0.0, -SETTLEMENT))
        quasi_static(model, nmd, steps=20)
    else:
        shear_wave = (STIFFNESS * COHESION / (2 * (1 + poisson)) / DENSITY) ** 0.5
        time = 200 / shear_wave
        model.prescribe(FOOTING, (0.0, -SETTLEMENT / time))
        for _ in model.explicit(time, damping=DAMPING, nmd=nmd, courant=COURANT):
            pass
    force = nodal_sum(model, "internal_force", (0.0, 0.0), (1.0, 0.0))
    return found(model, -float(force[1]) / COHESION, start)
