"""Implicit particles coupled with the flow of their pore water: closed forms, conservation, and the finite elements."""

import numpy as np
import pytest
from consolidation_cases import RIGHT, TOP
from core_cases import box
from water_particle_cases import ELASTIC, Column, layer, on_box

import mpm_core as mpm
from fenics_bridge.water import dipping

PLASTIC = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=6e3, friction_angle=25.0, dilation_angle=5.0)


def terzaghi_degree(factor):
    m = np.pi * (np.arange(200) + 0.5)
    return 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))


def terzaghi_base(factor):
    m = np.pi * (np.arange(200) + 0.5)
    return np.sum(2 / m * np.sin(m) * np.exp(-(m**2) * factor))


# --- the same as finite elements -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "anisotropy", [None, (20.0, 0.5), dipping(20.0, 0.5, 30.0)], ids=["isotropic", "level", "dips"]
)
@pytest.mark.parametrize("law", [ELASTIC, PLASTIC], ids=["elastic", "plastic"])
@pytest.mark.parametrize("modulus", [np.inf, 2.2e8])
def test_particles_at_centroids_are_the_stabilised_finite_elements(law, modulus, anisotropy):
    fem, model = layer(law, modulus, anisotropy=anisotropy)
    for dt in (1.0, 2.0, 4.0, 100.0):
        assert fem.advance(dt).converged
        *_, report = model.implicit(
            model.time + dt, dt=dt, quasi_static=True, small_displacements=True, solver=mpm.Newton(tolerance=1e-11)
        )
        assert report.iterations <= 6 and report.cuts == 0
        there, p = fem.evaluate_at(model.particles.position), model.particles
        tolerance = 1e-12 if law is ELASTIC else 1e-6
        np.testing.assert_allclose(p.pore_pressure, there["pressure"][:, 0], rtol=0, atol=tolerance * 9810)
        np.testing.assert_allclose(p.stress, there["stress"], rtol=0, atol=tolerance * np.abs(there["stress"]).max())
    assert (report.plastic_fraction > 0) == (law is PLASTIC)


# --- Terzaghi ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim, cells, tolerance", [(2, 20, 0.006), (3, 12, 0.02)])
def test_a_loaded_column_consolidates_as_terzaghi_has_it(dim, cells, tolerance):
    column = Column(cells, dim)
    for factor in (0.05, 0.2, 0.5) if dim == 2 else (0.2, 0.5):  # the front has to cross some cells first
        reports = column.follow(factor)
        assert max(report.iterations for report in reports) == 1
        assert column.degree() == pytest.approx(terzaghi_degree(factor), abs=tolerance)
        assert column.base() == pytest.approx(terzaghi_base(factor), abs=tolerance)


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.45])
@pytest.mark.parametrize("cells", [12, 20, 40])  # nearly squares; two and four times as long as high
@pytest.mark.parametrize("ratio", [1e-6, 0.1, 0.5, 1.0, 10.0])
def test_the_first_step_does_not_overshoot(ratio, cells, poisson, nmd):
    column = Column(cells, law=mpm.LinearElastic(young=10e6, poisson=poisson))
    dt = ratio * column.period / cells**2
    list(column.model.implicit(dt, dt=dt, quasi_static=True, small_displacements=True, nmd=nmd))
    pressure = column.model.particles.pore_pressure / column.load
    assert pressure.max() <= 1 + 1e-6 and pressure.min() >= -1e-6


def test_compressible_water_carries_its_part_of_an_undrained_load():
    column = Column(10, modulus=2e6)
    column.model.seal(TOP)
    list(column.model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True))
    stiffness = 2e6 / 0.4
    p = column.model.particles
    middle = (p.position[:, 1] > 0.3) & (p.position[:, 1] < 0.7)
    expected = stiffness / (stiffness + column.oedometer)
    np.testing.assert_allclose(p.pore_pressure[middle] / column.load, expected, rtol=1e-3)


def test_soil_consolidates_under_its_own_weight():
    """Gibson's linear limit: the excess begins as the buoyant weight above, u = weight H sum 2 sin(m) / m^2 sin(m z / H) ..."""
    model = on_box((0.2, 1.0), (2, 20), ELASTIC)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-8, modulus=np.inf)
    model.set_pore_pressure(lambda x: 9810.0 * (1.0 - x[:, 1]))
    model.hold_pore_pressure(TOP, level=1.0)
    weight, oedometer = (2000.0 - 1000.0) * 9.81, ELASTIC.p_wave_modulus
    period, dt, final = 9810.0 / (1e-8 * oedometer), 1e-4, 0.5 * weight / oedometer * 0.2
    m = np.pi * (np.arange(200) + 0.5)
    for factor in (0.1, 0.2, 0.5):
        while model.time < factor * period * (1 - 1e-9):
            step = min(dt * period, factor * period - model.time)
            list(model.implicit(model.time + step, dt=step, quasi_static=True, small_displacements=True))
            dt = min(1.1 * dt, 0.02)
        expected = 1 - np.sum(4 * np.sin(m) / m**3 * np.exp(-(m**2) * factor))
        assert -model.water_inflow() / final == pytest.approx(expected, abs=0.008)


def undrained_motion(law, cells):
    """Displacements of the nodes of a body, free at its right side, when its weight comes on at once."""
    model = on_box((2.0, 1.0), (2 * cells, cells), law)
    model.release(RIGHT)
    model.set_gravity((0.0, -9.81))
    if law is ELASTIC:
        model.add_water(porosity=0.4, conductivity=1e-14, modulus=4e6)
    list(model.implicit(1.0, dt=1.0, quasi_static=True, small_displacements=True))
    return model.nodal("velocity")


def test_soil_that_hardly_drains_is_the_undrained_one():
    """The law of total stress has the water's stiffness in each particle, and u-p pressures at nodes: they converge."""
    differences = []
    for cells in (8, 16):
        one, other = (
            undrained_motion(law, cells) for law in (ELASTIC, mpm.Undrained(ELASTIC, water_modulus=4e6, porosity=0.4))
        )
        differences.append(np.linalg.norm(one - other) / np.linalg.norm(other))
    assert differences[1] < 0.02 and differences[1] < 0.6 * differences[0]


# --- conservation -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("nmd", [False, True])
@pytest.mark.parametrize("quasi_static", [True, False], ids=["quasi-static", "dynamic"])
def test_the_pores_change_by_what_enters(quasi_static, nmd):
    model = on_box((0.2, 1.0), (2, 10), ELASTIC)
    model.add_water(porosity=0.4, conductivity=1e-5, modulus=np.inf, kozeny_carman=True)
    model.hold_pore_pressure(TOP, 0.0)
    model.traction(TOP, (0.0, -500e3))
    model.set_gravity((0.0, -9.81))
    volume, entered = model.water_volume(), 0.0
    for report in model.implicit(0.5, dt=0.05, quasi_static=quasi_static, nmd=nmd, solver=mpm.Newton(tolerance=1e-12)):
        now, inflow = model.water_volume(), model.water_inflow()
        assert now - volume == pytest.approx(inflow - entered, abs=1e-10 * volume)
        assert report.iterations <= 6
        volume, entered = now, inflow
    assert entered < -1e-3 * volume


def test_water_at_rest_stays_at_rest_under_gravity():
    model = on_box((1.0, 1.0), (4, 4), ELASTIC)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-4)
    model.set_pore_pressure(lambda x: 9810.0 * (3.0 - x[:, 1]))
    model.hold_pore_pressure(TOP, level=3.0)
    buoyant = (2000.0 - 1000.0) * 9.81
    stress = np.zeros((len(model.particles), 4))
    stress[:, 1] = -buoyant * (1.0 - model.particles.position[:, 1])
    stress[:, 0] = stress[:, 2] = 0.5 * stress[:, 1]
    model.particles.set("stress", stress)
    before = model.particles.pore_pressure
    *_, report = model.implicit(1000.0, dt=100.0, quasi_static=True, small_displacements=True)
    np.testing.assert_allclose(model.particles.pore_pressure, before, rtol=1e-9)


def test_standing_water_that_falls_over_level_ground_moves_nothing():
    model = on_box((1.0, 1.0), (4, 4), ELASTIC)
    model.add_water(porosity=0.4, conductivity=1e-9, modulus=np.inf)
    model.set_pore_pressure(20e3)
    model.hold_pore_pressure(TOP, 20e3, presses=True)
    model.equilibrate(small_displacements=True, tolerance=1e-10)
    assert np.abs(model.particles.stress).max() < 1e-6
    model.hold_pore_pressure(TOP, 5e3, presses=True)
    list(model.implicit(10.0, dt=1.0, quasi_static=True, small_displacements=True))
    assert np.abs(model.particles.stress).max() < 1e-6 * 20e3
    np.testing.assert_allclose(model.particles.pore_pressure, 5e3, rtol=1e-9)


# --- large strains ----------------------------------------------------------------------------------------------------


def test_a_falling_body_keeps_its_water():
    """In free fall nothing drives the water: no pressure, no flow, though gravity acts."""
    model = mpm.Model(box([4, 4], body=([0.25, 0.25], [0.75, 0.75])), ELASTIC)
    model.seed(density=2000.0, per_cell=3, cell_tag=1)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-2)
    list(model.implicit(0.02, dt=0.01))
    assert np.abs(model.particles.pore_pressure).max() < 1e-6
    np.testing.assert_allclose(model.particles.velocity[:, 1], -9.81 * 0.02, rtol=1e-9)


# --- input ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "given, message",
    [
        ({"conductivity": 0.0}, "conductivity is 0.0 m/s"),
        ({"conductivity": -1e-6}, "conductivity is -1e-06 m/s"),
        ({"porosity": 1.0}, "porosity is 1.0, expected more than 0"),
        ({"porosity": 0.0}, "porosity is 0.0"),
        ({"modulus": 0.0}, "modulus is 0.0 Pa"),
        ({"unit_weight": -1.0}, "unit_weight is -1.0 N/m3"),
    ],
)
def test_soil_that_cannot_hold_water_is_refused(given, message):
    model = on_box((1.0, 1.0), (2, 2), ELASTIC)
    with pytest.raises(mpm.InputError, match=message):
        model.add_water(**{"porosity": 0.4, "conductivity": 1e-6, **given})
    assert model._core.water is None


def test_mistakes_are_named():
    model = on_box((1.0, 1.0), (2, 2), ELASTIC)
    with pytest.raises(mpm.InputError, match="no pore water, expected add_water"):
        model.hold_pore_pressure(TOP, 0.0)
    model.add_water(porosity=0.4, conductivity=1e-6, modulus=np.inf)
    for arguments in ({}, {"pressure": 0.0, "level": 1.0}):
        with pytest.raises(mpm.InputError, match="expected one of them"):
            model.hold_pore_pressure(TOP, **arguments)
    with pytest.raises(mpm.InputError, match="no facet has the tag 17|17"):
        model.hold_pore_pressure(17, level=1.0)
    with pytest.raises(mpm.InputError, match="has no prescribed pore pressure"):
        model.seal(RIGHT)
    model.roller(TOP, (0, 1))
    with pytest.raises(mpm.InputError, match="the pressure is undetermined"):
        list(model.implicit(1.0, dt=1.0, quasi_static=True))
