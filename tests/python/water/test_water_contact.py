"""Saturated soil on rigid surfaces, which let no water through, in implicit steps: the contact carries total stresses."""

import warnings

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


def column_on_a_plane(width, counts, law=ELASTIC, **plane):
    """A column 1 m high between smooth walls, whose lowest particles touch a plane."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (width, 1.0), counts)
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), law)
    model.seed(density=2000.0, per_cell=3)
    for side in (1, 2):
        model.roller(side, (1, 0))
    gap = model.gap(mpm.Plane((0, 0), normal=(0, 1)))
    return model, model.add_contact(mpm.Plane((0, gap - 1e-12), normal=(0, 1)), **plane)


@pytest.mark.parametrize("friction", [0.0, 0.5])
def test_a_column_on_a_plane_consolidates_as_terzaghi_has_it(friction):
    model, base = column_on_a_plane(0.2, (2, 20), friction=friction)
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


# --- friction: by the effective stress ---------------------------------------------------------------------------------

MU = 0.4


def sliding_base(base):
    """A column 0.4 m wide, 1 m high, between smooth walls on a rough plane that moves sideways at some height of the mesh."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (0.4, 1.2), (4, 12))
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), ELASTIC)
    x = 0.05 * (np.indices((8, 20)).reshape(2, -1).T + 0.5) + (0.0, base)
    model.seed_points(x, np.full(len(x), 0.05**2), density=2000.0)
    for side in (1, 2):
        model.roller(side, (1, 0))
    plane = model.add_contact(mpm.Plane((0, base - 1e-12), normal=(0, 1)), friction=MU, velocity=(1e-4, 0.0))
    model.add_water(porosity=0.4, conductivity=1e-4, modulus=np.inf, drained_surface=True)
    return model, plane


@pytest.mark.parametrize("water", [0.0, 4e3, 9e3, -4e3])
def test_a_surface_rubs_by_the_load_less_the_pore_pressure(water):
    """A total load q on a column with the pore pressure u: the shear stress is mu (q - u), also under suction. The particles
    are not on a grid, and cover only 0.8 of the plane."""
    model, base = column_on_a_plane(0.4, (4, 10), friction=MU, velocity=(1e-4, 0.0))
    model.add_water(porosity=0.4, conductivity=1e-4, modulus=np.inf)
    model.hold_pore_pressure(4, water)
    model.press_surface(4, 10e3)
    reports = list(model.implicit(40.0, dt=4.0, quasi_static=True))
    assert -base.force[1] == pytest.approx(0.4 * 10e3, rel=1e-6)
    assert -base.force[0] == pytest.approx(0.4 * MU * (10e3 - water), rel=1e-3)
    assert max(report.iterations for report in reports) <= 7


@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED])
@pytest.mark.parametrize("base", [0.0, 0.03, 0.06, 0.09])
def test_a_column_under_its_weight_rubs_by_its_submerged_weight(base, integration):
    """Of the weight 20 kPa the water carries 10 kPa at the plane, which need not follow the mesh. The water table is known
    to 5 % of a cell per cell that the surface cuts, 0.5 kPa."""
    model, plane = sliding_base(base)
    model.set_gravity((0.0, -10.0))
    model.implicit(40.0, dt=4.0, quasi_static=True, integration=integration).last()
    normal, shear = -plane.force[1] / 0.4, -plane.force[0] / 0.4
    assert normal == pytest.approx(20e3, rel=1e-3)
    assert normal - shear / MU == pytest.approx(10e3, abs=0.5e3)


def test_water_that_stands_over_the_soil_presses_on_a_surface_without_friction():
    model, plane = sliding_base(0.03)
    model.set_gravity((0.0, -10.0))
    model.stand_water(2.0)
    model.implicit(40.0, dt=4.0, quasi_static=True).last()
    assert model.particles.pore_pressure.max() > 19e3
    assert -plane.force[1] / 0.4 == pytest.approx(10e3, rel=1e-6)  # both sides of the plane are under water
    assert -plane.force[0] / 0.4 == pytest.approx(MU * 10e3, rel=2e-3)


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("load", [0.0, 10e3])
@pytest.mark.filterwarnings("ignore:the pore water needs")
def test_soil_that_does_not_drain_rubs_by_its_effective_stress(load, nmd):
    """A column at rest, 10 kPa of effective stress at its base, on a plane that the mesh follows: a load changes the pore
    pressure only. Both stresses of the cells at the plane must be those of all of the force on it."""
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, (0.4, 1.2), (4, 12))
    model = mpm.Model(bridge.background_mesh(domain, None, facet_tags), ELASTIC)
    column, row = np.indices((12, 30)).reshape(2, -1)
    x = np.column_stack([column + 0.4 + 0.2 * (row % 2), row + 0.5]) / 30  # none on the diagonal of a square
    model.seed_points(x, np.full(len(x), 30.0**-2), density=2000.0)
    for side in (1, 2):
        model.roller(side, (1, 0))
    plane = model.add_contact(mpm.Plane((0, -1e-12), normal=(0, 1)), friction=MU, velocity=(1e-2, 0.0))
    model.add_water(porosity=0.4, conductivity=1e-11, modulus=np.inf, drained_surface=True)
    model.set_gravity((0.0, -10.0))
    model.set_pore_pressure(lambda x: 10e3 * (1.0 - x[:, 1]))
    model.particles.set("stress", -10e3 * (1.0 - x[:, 1, None]) * [0.5, 1.0, 0.5, 0.0])
    model.load_surface(mpm.Plane((0, 1.0), (0, -1)), pressure=load)
    model.implicit(1.0, dt=0.5, quasi_static=True, nmd=nmd, integration=mpm.Integration.MIXED).last()
    assert -plane.force[1] / 0.4 == pytest.approx(20e3 + load, rel=1e-4)
    assert -plane.force[0] / 0.4 == pytest.approx(MU * 10e3, rel=0.02)  # 12.0 to 13.5 kPa with forces at the centres


def test_clay_without_pressure_does_not_sink_into_a_surface():
    """Water carries the load; springs as stiff as ten times the skeleton alone would let particles in by 0.04 of their radius."""
    clay = mpm.CamClay(
        compression=0.2, swelling=0.04, critical_slope=1.0, poisson=0.25, void_ratio=1.0, preconsolidation=100e3, attraction=500.0
    )  # fmt: skip
    load, own = 20e3, 3 * (0.75 / 1.25) * 2.0 * 1e3 / 0.04  # M of the skeleton, whose p is a hundredth of p_c
    model, _ = column_on_a_plane(0.2, (2, 10), law=clay)
    model.add_water(porosity=0.5, conductivity=1e-4, modulus=np.inf)
    model.particles.set("stress", np.tile([-500.0, -500.0, -500.0, 0.0], (len(model.particles), 1)))
    model.set_pore_pressure(load)
    model.hold_pore_pressure(4, load)
    model.press_surface(4, load + 500.0)
    radius = 0.5 * np.sqrt(model.particles.volume.max())
    base = mpm.Plane((0, model.gap(mpm.Plane((0, 0), normal=(0, 1)))), normal=(0, 1))
    model.implicit(10.0, dt=5.0, quasi_static=True).last()
    assert 1e-3 * radius < -model.gap(base) < 0.4 * 0.2 * radius * load / own


def test_a_run_in_which_no_water_flows_through_a_cell_warns_of_its_friction():
    """The time h^2 / c_v of cells of 0.1 m, c_v = k M / gamma_w."""
    model, _ = sliding_base(0.03)
    time = 0.1**2 * GRAVITY_OF_WATER / (1e-4 * ELASTIC.p_wave_modulus)
    with pytest.warns(RuntimeWarning, match=f"needs {time:.3g} s to flow through a cell .* uncertain by half where"):
        model.implicit(0.9 * time, dt=time, quasi_static=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.set_gravity((0.0, -10.0))
        model.implicit(1.1 * time, dt=time, quasi_static=True)


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
    assert at_once[0] <= 9 and max(at_once[1:] + later) <= 8


def test_positions_that_are_held_have_no_contact():
    model, _ = layer_under_a_plate(water=True)
    with pytest.raises(mpm.InputError, match="contact with rigid surfaces .* small_displacements does not support"):
        model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True).last()
