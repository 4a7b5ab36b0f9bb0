"""Cook's membrane: a tapered cantilever, sheared at its free end, elastic, plane strain (Cook 1974)."""

from __future__ import annotations

from time import process_time

import numpy as np

import fenics_bridge as bridge
import mpm_core as mpm

from .runs import Found, damped, displacement_at, found, mesh_of, particles_in, quasi_static

NAME = "cook"
TITLE = "Cook's membrane"
QUANTITY = "deflection of the middle of the loaded edge [m]"
POISSON = {"implicit": (1 / 3, 0.49, 0.499, 0.499999975), "explicit": (1 / 3, 0.499)}
DIVISIONS = {"implicit": 8, "explicit": 4}
"""Along each side on the coarsest mesh, by scheme."""
MIXED_FINEST = 64
"""Divisions for Taylor-Hood elements at most."""
EXACT = None

SHEAR = 0.375
"""Shear modulus of the benchmark [Pa]; the same for all Poisson ratios."""
TRACTION = 1 / 16
"""[Pa], along the loaded edge."""
SCALE = 1e-4
"""Factor of the load, so that the displacements stay small; results are divided by it."""
MID_EDGE = (48.0, 52.0)
PRESSURE_UNIT = SHEAR * SCALE, "shear modulus"
CLAMPED, LOADED = 1, 2


def mesh(divisions: int) -> tuple:
    """Domain, cell tags, facet tags. Collective."""
    return mesh_of("cook", divisions)


def cell_size(divisions: int) -> float:
    """[m], along the clamped edge."""
    return 44 / divisions


def young(poisson: float) -> float:
    """Young's modulus [Pa]."""
    return 2 * SHEAR * (1 + poisson)


def taylor_hood(divisions: int, poisson: float) -> float:
    """Deflection by Taylor-Hood elements. Collective."""
    domain, _, facet_tags = mesh(divisions)
    solution = bridge.solve_nearly_incompressible(
        domain, facet_tags, [bridge.fixed(CLAMPED)], young(poisson), poisson, 0.0, traction={LOADED: (0.0, TRACTION)}
    )
    return float(solution.evaluate_at(np.array([MID_EDGE]))["displacement"][0, 1])


def by_particles(divisions: int, poisson: float, nmd: bool, scheme: str) -> Found:
    """Deflection by particles, in one quasi-static step or by damped motion. Collective."""
    start = process_time()
    model = particles_in(mesh(divisions), mpm.LinearElastic(young=young(poisson), poisson=poisson), 1.0)
    model.fix(CLAMPED)
    model.traction(LOADED, (0.0, SCALE * TRACTION))
    if scheme == "implicit":
        quasi_static(model, nmd, steps=1)
    else:
        crossing = 48 / SHEAR**0.5  # of a shear wave, from the clamped to the loaded edge
        damped(model, nmd, time=100 * crossing, at_least=crossing)
    return found(model, float(displacement_at(model, MID_EDGE)[1]) / SCALE, start)
