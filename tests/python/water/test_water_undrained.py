"""Soil that does not drain, by particles with pore water: bearing capacity and slopes are those of total stresses."""

from pathlib import Path

import numpy as np
import pytest
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.water import VanGenuchten

COHESION = 1e3
CLAY = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=COHESION, friction_angle=0.0)
UNDRAINED = mpm.Undrained(CLAY, water_modulus=2.2e9, porosity=0.4)
FOOTING = Path(__file__).parents[3] / "meshes" / "footing.geo"
AXIS, BASE, FAR, PRESSED = 1, 2, 3, 5
SETTLED, HALF = 0.02, 0.5
"""Of the footing [m], and half its width [m]"""
PART = 0.6
"""Of the settlement, at which the load of soil that does not lock has come to its limit"""


def ground():
    parameters = {"width": 4.0, "depth": 2.0, "edge_size": 0.03, "near_size": 0.12, "far_size": 0.6}
    return bridge.read_mesh(FOOTING, MPI.COMM_WORLD, parameters=parameters)


def bearing_capacity(law, *, nmd, retention=None, until=PART):
    """Mean pressures below a footing over the cohesion, by particles, half-way to and at a part of its settlement."""
    model = mpm.Model(bridge.background_mesh(*ground()), law)
    model.seed(density=2000.0, per_cell=1)
    for tag in (AXIS, FAR):
        model.roller(tag, (1, 0))
    model.fix(BASE)
    model.prescribe(PRESSED, (0.0, -SETTLED))
    if law is CLAY:
        model.add_water(porosity=0.4, conductivity=1e-17, modulus=2.2e9, retention=retention)
    options = {"dt": 0.05, "quasi_static": True, "small_displacements": True, "nmd": nmd}
    works = [0.0] + [report.support_work for report in model.implicit(until, every=0.05, **options)]
    pressures = np.diff(works) / (0.05 * SETTLED * HALF * COHESION)
    return pressures[len(pressures) // 2], pressures[-1]


def quadratic_elements():
    domain, _, facet_tags = ground()
    supports = [bridge.roller(AXIS, (1, 0)), bridge.roller(FAR, (1, 0)), bridge.fixed(BASE),
                bridge.prescribed(PRESSED, (0.0, -SETTLED))]  # fmt: skip
    model = bridge.QuasiStatic(domain, UNDRAINED, facet_tags, supports, degree=2)
    for part in np.arange(0.05, PART + 0.01, 0.05):
        assert model.equilibrate(bridge.Load(displacement=part)).converged
    return model.reaction(PRESSED)[1] / (HALF * COHESION)


def test_a_footing_on_particles_that_do_not_drain_carries_the_load_of_total_stresses():
    """Without averages the skeleton locks, whose own volume each cell has to keep: its load rises without end."""
    before, found = bearing_capacity(CLAY, nmd=True)
    assert found - before < 2e-3 * found  # it has come to a limit
    assert found == pytest.approx(quadratic_elements(), rel=0.02)
    assert found == pytest.approx(bearing_capacity(UNDRAINED, nmd=True)[1], rel=0.01)
    assert 2 + np.pi < found < 1.07 * (2 + np.pi)
    dries = VanGenuchten(alpha=1e-5, n=2.0, air_entry=1e5)  # in suctions that it does not see here
    assert bearing_capacity(CLAY, nmd=True, retention=dries)[1] == pytest.approx(found, rel=5e-3)
    before, locked = bearing_capacity(CLAY, nmd=False, until=1.0)
    assert locked > 1.5 * found and locked - before > 0.04 * locked


DENSITY = 2000.0
"""Of the slope [kg/m3]; its gravity makes the unit weight"""
BORNE = 6.0
"""Unit weight that the slope carries, in multiples of the cohesion over its height"""


def collapse(law):
    """Unit weight at which a slope of cohesive soil collapses, in multiples of the cohesion over its height, to 1 %."""
    model = mpm.Model(bridge.background_mesh(*bridge.slope_mesh(MPI.COMM_WORLD, 1.0, 45.0, 1.1, 0.1)), law)
    model.seed(density=DENSITY, per_cell=1, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    if law is CLAY:
        model.add_water(porosity=0.4, conductivity=1e-17, modulus=2.2e9)
    weight = BORNE
    while weight < 12.0:
        model.set_gravity((0.0, -COHESION / DENSITY * weight))
        try:
            model.implicit(
                model.time + 1.0, dt=1.0, quasi_static=True, small_displacements=True, nmd=True, solver=ONE_TRY
            ).last()
        except mpm.RunError:
            return weight
        weight *= 1.01
    raise AssertionError("the slope does not collapse")


ONE_TRY = mpm.Newton(max_iterations=60)


def test_a_slope_of_particles_that_does_not_drain_collapses_as_that_of_total_stresses():
    found = collapse(CLAY)
    assert found == pytest.approx(collapse(UNDRAINED), rel=0.02) and found > BORNE
