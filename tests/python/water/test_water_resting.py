"""Resting cells whose pores hold water, in implicit steps: they stand for particles with the same water."""

import numpy as np
import pytest
from water_particle_cases import ELASTIC, Column, on_box

import mpm_core as mpm
from fenics_bridge.water import VanGenuchten

GEOMETRIES = [mpm.Geometry.PLANE_STRAIN, mpm.Geometry.AXISYMMETRIC, mpm.Geometry.SOLID]
SOIL = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=6e3, friction_angle=25.0, dilation_angle=0.0)


def terzaghi_degree(factor):
    m = np.pi * (np.arange(200) + 0.5)
    return 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))


@pytest.mark.parametrize("rests", [None, lambda x: x[:, 1] < 0.5], ids=["all", "half"])
def test_a_loaded_column_at_rest_consolidates_as_terzaghi_has_it(rests):
    column = Column(20)
    column.model.rest(where=rests)
    for factor in (0.05, 0.2, 0.5):
        *_, report = column.follow(factor)
        assert column.degree() == pytest.approx(terzaghi_degree(factor), abs=0.006)
    assert report.resting_cells > 0 and report.converted_cells == 0


def soaked(geometry, modulus, steep=True, n=4):
    """A block that rests and drains at its top; steep, it yields beside its right side."""
    dim = 3 if geometry == mpm.Geometry.SOLID else 2
    model = on_box((1.0,) * dim, (n,) * dim, SOIL, geometry=geometry, per_cell=3 if dim == 2 else 4)
    if steep:
        model.release(2)  # the right side
    model.add_water(porosity=0.4, conductivity=1e-6, modulus=modulus)
    model.hold_pore_pressure(2 * dim, 0.0)
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    model.rest()
    return model


def by_cell(model, name):
    """Means over the particles of each cell; as long as these lie symmetrically, what the resting cell has at its centre."""
    p, count = model.particles, len(model.mesh.cells)
    return np.bincount(p.cell, getattr(p, name), count) / np.bincount(p.cell, minlength=count)


@pytest.mark.parametrize("options", [{}, {"quasi_static": True}, {"nmd": True}], ids=lambda o: ",".join(o) or "default")
@pytest.mark.parametrize("modulus", [np.inf, 1e7])
@pytest.mark.parametrize("geometry", GEOMETRIES, ids=lambda g: g.name)
def test_a_step_after_conversion_moves_soil_and_water_as_before(geometry, modulus, options):
    """Neither nodes nor energies can tell a cell from its particles, whose pressures differ within the cell."""
    found = []
    options = {"dt": 0.02, "conversion": None, "solver": mpm.Newton(tolerance=1e-12), **options}
    for converts in (False, True):
        model = soaked(geometry, modulus)
        before = model.implicit(0.06, **options).last()
        if converts:
            assert model.convert() == 0
            report = model.report()
            for name in ("kinetic_energy", "stored_energy", "mass"):
                assert getattr(report, name) == pytest.approx(getattr(before, name), rel=1e-12, abs=1e-12)
            assert np.ptp(model.particles.pore_pressure[model.particles.cell == 0]) > 0
        report = model.implicit(0.08, **options).last()
        found.append((model.nodal("velocity"), by_cell(model, "pore_pressure"), by_cell(model, "porosity"), model.water_inflow(),
                      report.unexplained_energy))  # fmt: skip
    assert model.particles.plastic_strain.max() > 0
    for one, other in zip(*found, strict=True):
        scale = max(np.abs(one).max(), 1e-9)
        assert np.abs(one - other).max() < 1e-8 * scale


def test_water_is_conserved_at_rest_and_in_conversion():
    """Pores grow by the water that enters, whichever kind the cells are."""
    model = soaked(mpm.Geometry.PLANE_STRAIN, np.inf, steep=False, n=8)

    def water():
        return np.sum(model.particles.volume * model.particles.porosity)

    start = water()
    model.implicit(0.15, dt=0.05).last()
    model.convert(where=lambda x: x[:, 1] > 0.5)
    report = model.implicit(0.3, dt=0.05).last()
    assert report.converted_cells == report.resting_cells == 64
    assert water() - start == pytest.approx(model.water_inflow(), abs=1e-9 * start)
    assert abs(model.water_inflow()) > 1e-6 * start


def test_a_model_at_rest_finds_the_equilibrium_of_its_particles():
    found = []
    for rest in (False, True):
        model = on_box((0.5, 1.0), (2, 6), ELASTIC, per_cell=1)  # so that both are integrated at the centres of cells
        model.set_gravity((0.0, -9.81))
        model.add_water(porosity=0.4, conductivity=1e-4, modulus=2.2e9)
        model.set_pore_pressure(lambda x: 9810.0 * (1.0 - x[:, 1]))
        model.hold_pore_pressure(4, 0.0)
        if rest:
            model.rest()
        assert model.equilibrate(small_displacements=True).unbalanced_ratio < 1e-6
        found.append(model.particles.stress.copy())
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-3)
    assert np.abs(found[0][:, 1]).max() > 8e3


CURVE = VanGenuchten(alpha=4e-4, n=2.0, residual=0.1)


def drying(per_cell, rest, n=10, young=5e6):
    """A column that is saturated at first and drains at its base."""
    model = on_box((0.2, 1.0), (2, n), mpm.LinearElastic(young=young, poisson=0.3), per_cell=per_cell)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-5, retention=CURVE, modulus=np.inf)
    model.set_pore_pressure(lambda x: 9810.0 * (1.0 - x[:, 1]) - 3e3)
    model.hold_pore_pressure(3, 0.0)
    if rest:
        assert model.rest() == len(model.mesh.cells)
    return model


@pytest.mark.parametrize("nmd", [False, True])
def test_soil_that_dries_at_rest_is_that_of_one_particle_in_each_cell(nmd):
    found = []
    for rest in (False, True):
        model = drying(1, rest, young=5e10)  # so that particles stay where they are
        for dt in (50.0, 100.0, 200.0, 400.0):
            model.implicit(
                model.time + dt, dt=dt, quasi_static=True, nmd=nmd, solver=mpm.Newton(tolerance=1e-11)
            ).last()
        p = model.particles
        found.append((p.pore_pressure, p.saturation, p.mass, p.stress[:, 1], np.array([model.water_inflow()])))
    assert found[0][1].min() < 0.8 and np.ptp(found[0][1]) > 0.1
    for one, other in zip(*found, strict=True):
        assert np.abs(one - other).max() < 1e-6 * np.abs(one).max()


@pytest.mark.parametrize("nmd", [False, True])
def test_no_water_is_lost_where_drying_soil_comes_to_rest_and_turns_into_particles(nmd):
    """Pressures differ within a cell, and saturation is not linear in them: particles get those by which they hold its water."""
    model = drying(10, False)
    law = CURVE.saturation
    pores, held = 0.4 * model.particles.volume, model.water_volume()
    assert model.rest() == len(model.mesh.cells)
    assert model.water_volume() == pytest.approx(held, rel=1e-13)
    entered, mass = model.water_inflow(), model.particles.mass.sum()
    for converts in (None, lambda x: x[:, 1] > 0.5, lambda x: x[:, 1] > 0.0):
        if converts is not None:
            p = model.particles
            before = model.water_volume(), p.mass.sum(), (p.mass[:, None] * p.velocity).sum(axis=0)
            model.convert(where=converts)
            after = model.water_volume(), p.mass.sum(), (p.mass[:, None] * p.velocity).sum(axis=0)
            for one, other in zip(before, after, strict=True):
                np.testing.assert_allclose(one, other, rtol=1e-13, atol=1e-13)
            particles = ~p.is_resting
            pores = p.volume * p.porosity * particles
            own = law(np.maximum(-p.pore_pressure, 0))
            assert np.abs(own - p.saturation)[particles].max() > 1e-4  # each has its own
            assert np.sum(pores * own) == pytest.approx(
                np.sum(pores * p.saturation), rel=1e-7
            )  # the core has a table of it
        for dt in (100.0, 200.0):
            model.implicit(
                model.time + dt, dt=dt, quasi_static=True, nmd=nmd, solver=mpm.Newton(tolerance=1e-11)
            ).last()
            now, inflow = model.water_volume(), model.water_inflow()
            assert now - held == pytest.approx(inflow - entered, abs=1e-10 * held)
            held, entered = now, inflow
    assert model.particles.saturation.min() < 0.9
    assert model.particles.mass.sum() - mass == pytest.approx(1000 * entered, rel=1e-6)
