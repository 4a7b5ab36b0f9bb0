"""Saturated soil on rigid surfaces, which let no water through, in implicit steps: the contact carries total stresses."""

import numpy as np
import pytest
from consolidation_cases import GRAVITY_OF_WATER
from mpi4py import MPI
from water_particle_cases import ELASTIC

import fenics_bridge as bridge
import mpm_core as mpm


def degree_of_terzaghi(factor):
    """Degree of consolidation of a layer that drains at one side, over the time factor."""
    m = 0.5 * np.pi * (2 * np.arange(400) + 1)
    return 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_column_on_a_plane_consolidates_as_terzaghi_has_it(friction):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (0.2, 1.0), (2, 20))
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), ELASTIC)
    model.seed(density=2000.0, per_cell=3)
    for side in (1, 2):
        model.roller(side, (1, 0))
    gap = model.gap(mpm.Plane((0, 0), normal=(0, 1)))
    base = model.add_contact(mpm.Plane((0, gap - 1e-12), normal=(0, 1)), friction=friction)
    model.add_water(porosity=0.4, conductivity=1e-8, modulus=np.inf)
    load = 10e3
    model.hold_pore_pressure(4, 0.0)
    model.press_surface(4, load)
    period = GRAVITY_OF_WATER / (1e-8 * ELASTIC.p_wave_modulus)
    dt, iterations = 1e-4 * period, []
    for factor in (0.05, 0.2, 0.5):
        while model.time < factor * period * (1 - 1e-9):
            to = min(factor * period, model.time + dt)
            iterations += [report.iterations for report in model.implicit(to, dt=dt, quasi_static=True)]
            dt *= 1.1
        water_out = -model.water_inflow() / (0.2 * load / ELASTIC.p_wave_modulus)
        assert water_out == pytest.approx(degree_of_terzaghi(factor), rel=0.02)
        assert -base.force[1] == pytest.approx(0.2 * load, rel=1e-8)  # effective stress and pore pressure
    assert max(iterations) <= 4


def layer_under_a_plate(water, comm=MPI.COMM_WORLD, law=ELASTIC):
    """A layer between smooth walls on a rough base, under a rough plate that carries a load."""
    domain, _, facet_tags = bridge.box_mesh(comm, (3.0, 2.0), (13, 9))
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), law)
    x = 0.125 * (np.indices((24, 12)).reshape(2, -1).T + 0.5)
    model.seed_points(x, np.full(len(x), 0.125**2), density=1800.0)
    model.add_contact(mpm.Plane((0, 0), normal=(0, 1)), friction=0.5)
    for wall, normal in ((0.0, (1, 0)), (3.0, (-1, 0))):
        model.add_contact(mpm.Plane((wall, 0), normal=normal))
    loaded = mpm.Servo(force=([0.0, 10.0], [(0.0, 0.0), (0.0, -20e3)]), speed=1.0)
    plate = model.add_contact(mpm.Box((1.0, 1.5), (2.0, 1.7)), friction=0.5, body=loaded)
    if water:
        model.add_water(porosity=0.4, conductivity=1e-7, modulus=np.inf, drained_surface=True)
    return model, plate


def test_the_settlement_of_a_loaded_plate_becomes_that_of_drained_soil():
    (dry, on_dry), (wet, on_wet) = layer_under_a_plate(water=False), layer_under_a_plate(water=True)
    dry.implicit(10.0, dt=1.0, quasi_static=True).last()
    at_once = [report.iterations for report in wet.implicit(10.0, dt=1.0, quasi_static=True)]
    first = on_wet.displacement[1]
    assert first > 0.65 * on_dry.displacement[1]  # both downwards: undrained soil is stiffer
    assert wet.particles.pore_pressure.max() > 5e3
    later = [report.iterations for report in wet.implicit(1e6, dt=1e5, quasi_static=True)]
    assert abs(wet.particles.pore_pressure).max() < 20.0
    assert on_wet.force[1] == pytest.approx(20e3, rel=1e-8)
    assert on_wet.displacement[1] == pytest.approx(on_dry.displacement[1], rel=0.02)
    assert max(at_once + later) <= 8


def test_positions_that_are_held_have_no_contact():
    model, _ = layer_under_a_plate(water=True)
    with pytest.raises(mpm.InputError, match="contact with rigid surfaces .* small_displacements does not support"):
        model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True).last()
