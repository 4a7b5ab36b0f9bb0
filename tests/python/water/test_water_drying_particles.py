"""Implicit particles in soil that dries, under rain and under standing water whose level changes; the surface cuts cells."""

import numpy as np
import pytest
from consolidation_cases import BASE, GRAVITY_OF_WATER, LEFT, RIGHT, TOP
from core_cases import box
from mpi4py import MPI
from water_particle_cases import ELASTIC, on_box

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

CURVE = water.VanGenuchten(alpha=4e-4, n=2.0, residual=0.1)
POROSITY, CONDUCTIVITY, SATURATED = 0.4, 1e-5, 19e3


def column(curve=CURVE, cells=20, young=5e6, height=1.0, air=0, **options):
    """A column under its own weight, saturated up to its top, above which are ``air`` empty cells, and drained at its base."""
    law = mpm.LinearElastic(young=young, poisson=0.3)
    size = 1.0 / cells
    mesh = box([2, cells + air], [2 * size, 1.0 + air * size], diagonals="alternating")
    model = mpm.Model(mesh, law)
    whole = mpm.Model(mesh, law)
    whole.seed(density=SATURATED / 9.81, per_cell=3)
    points = whole.particles.position[whole.particles.position[:, 1] < height]
    model.seed_points(points, np.full(len(points), size**2 / 6), density=SATURATED / 9.81)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=POROSITY, conductivity=CONDUCTIVITY, retention=curve, **options)
    model.set_pore_pressure(lambda x: GRAVITY_OF_WATER * (height - x[:, 1]))
    depth = height - model.particles.position[:, 1]
    stress = -(SATURATED - GRAVITY_OF_WATER) * depth[:, None] * np.array([3 / 7, 1.0, 3 / 7, 0.0])
    model.particles.set("stress", stress)
    model.hold_pore_pressure(BASE, 0.0)
    return model


def march(model, until, first, growth=1.5, **options):
    """Steps to a time, each longer than the one before; returns the reports."""
    reports, dt = [], first
    while model.time < until * (1 - 1e-9):
        to = min(until, model.time + dt)
        reports += model.implicit(to, dt=dt, quasi_static=True, **options)
        dt *= growth
    return reports


@pytest.mark.parametrize("nmd", [False, True], ids=["", "nmd"])
def test_a_column_that_drains_is_that_of_finite_elements_and_loses_no_water(nmd):
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_SELF, (0.1, 1.0), (2, 20))
    fem = water.Consolidation(
        domain, mpm.LinearElastic(young=5e6, poisson=0.3),
        water.PorousSoil(CONDUCTIVITY, porosity=POROSITY, retention=CURVE), facet_tags,
        [bridge.roller(LEFT, (1, 0)), bridge.roller(RIGHT, (1, 0)), bridge.fixed(BASE)], [water.Head(BASE, 0.0)],
        load=bridge.Load(unit_weight=SATURATED), element=water.Element.STABILISED, water_modulus=np.inf,
    )  # fmt: skip
    depth = 1.0 - fem.points.coordinates()[:, 1]
    fem.initialise(-(SATURATED - GRAVITY_OF_WATER) * depth[:, None] * np.array([3 / 7, 1, 3 / 7, 0]),
                   lambda x: GRAVITY_OF_WATER * (1.0 - x[:, 1]))  # fmt: skip
    model = column(modulus=np.inf)
    held, entered, mass = model.water_volume(), 0.0, model.particles.mass.sum()
    dt = 20.0
    while model.time < 3e5:
        *_, report = model.implicit(model.time + dt, dt=dt, quasi_static=True, nmd=nmd)
        assert fem.advance(dt).converged and report.cuts == 0 and report.iterations <= 8
        now, inflow = model.water_volume(), model.water_inflow()
        assert now - held == pytest.approx(inflow - entered, abs=1e-10 * held)
        held, entered, dt = now, inflow, 1.5 * dt
    p = model.particles
    assert p.mass.sum() - mass == pytest.approx(GRAVITY_OF_WATER / 9.81 * entered, rel=1e-6)  # which is what has left
    np.testing.assert_allclose(p.saturation, CURVE.saturation(np.maximum(-p.pore_pressure, 0)), atol=2e-5)
    there = fem.evaluate_at(p.position)
    inside = (p.position[:, 1] > 0.1) & (p.position[:, 1] < 0.9)
    np.testing.assert_allclose(p.pore_pressure[inside], there["pressure"][inside, 0], atol=0.01 * GRAVITY_OF_WATER)
    np.testing.assert_allclose(p.stress[inside, 1], there["stress"][inside, 1], atol=0.02 * SATURATED)
    assert p.pore_pressure.min() < -0.7 * GRAVITY_OF_WATER and entered / 0.1 == pytest.approx(
        (fem.stored_water() - POROSITY * 0.1) / 0.1, rel=0.02)  # fmt: skip


@pytest.mark.parametrize("part", [0.5, 2.0])
def test_rain_enters_a_surface_that_cuts_cells_as_far_as_the_soil_takes_it(part):
    """Steadily, alpha psi = ln(r + (1 - r) e^(-alpha z)) with r the rain over the conductivity (Srivastava and Yeh 1991); above
    r = 1 the rest runs off, and water stands at the surface without pressure."""
    alpha = 2.0  # 1/m
    model = column(
        water.Gardner(alpha / GRAVITY_OF_WATER), cells=20, height=58 / 60, air=2, young=50e6, drained_surface=True
    )
    model.rain(part * CONDUCTIVITY)
    reports = march(model, 1e7, 100.0, growth=2.0)
    assert max(report.iterations for report in reports) <= 6  # also those in which the surface dries or ponds
    before, time = model.water_inflow(), model.time
    march(model, model.time + 1e6, 1e6)
    assert abs(model.water_inflow() - before) < 1e-6 * part * CONDUCTIVITY * 0.1 * (model.time - time)  # as much leaves
    p = model.particles
    r = min(part, 1.0)
    exact = np.log(r + (1 - r) * np.exp(-alpha * p.position[:, 1])) / alpha
    np.testing.assert_allclose(p.pore_pressure / GRAVITY_OF_WATER, exact, atol=0.01)


def test_a_column_whose_water_falls_smoothly_takes_few_iterations():
    """From the first step on, in which the saturated soil begins to dry."""
    model = column(modulus=np.inf)
    model.hold_pore_pressure(BASE, [(0.0, GRAVITY_OF_WATER), (200.0, 0.0)])
    reports = [*model.implicit(300.0, dt=20.0, quasi_static=True), *march(model, 3e4, 30.0)]
    assert max(report.iterations for report in reports) <= 6
    assert model.particles.pore_pressure.min() < -0.3 * GRAVITY_OF_WATER


def test_without_rain_no_water_enters_a_dry_surface():
    model = column(height=58 / 60, air=2, drained_surface=True)
    march(model, 1e7, 100.0, growth=3.0)
    p = model.particles
    np.testing.assert_allclose(p.pore_pressure, -GRAVITY_OF_WATER * p.position[:, 1], atol=0.01 * GRAVITY_OF_WATER)


# --- standing water ---------------------------------------------------------------------------------------------------


def wedge(density, **water_options):
    """A slope of 27 degrees whose surface cuts the cells, and its height at a position."""
    mesh = box([16, 8], [2.0, 1.0], diagonals="alternating")
    model = mpm.Model(mesh, ELASTIC)
    x, y = (np.arange(64) + 0.5) / 32, (np.arange(32) + 0.5) / 32
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + [1e-3, 2e-3]
    points = points[points[:, 1] < 0.9 - 0.5 * np.minimum(points[:, 0], 1.2)]
    model.seed_points(points, np.full(len(points), 1 / 32**2), density=density)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(**{"porosity": 0.4, "conductivity": 1e-6, "drained_surface": True, **water_options})
    return model


@pytest.mark.parametrize("retention", [None, CURVE], ids=["saturated", "may dry"])
def test_soil_as_heavy_as_water_carries_no_effective_stress_below_it(retention):
    """Whatever the shape of its surface; and when the water rises over it, nothing changes but the pressures."""
    model = wedge(GRAVITY_OF_WATER / 9.81, retention=retention, modulus=np.inf)
    model.set_pore_pressure(lambda x: GRAVITY_OF_WATER * (1.5 - x[:, 1]))
    model.stand_water([(0.0, 1.5), (1e3, 1.5), (2e3, 4.0)])
    list(model.implicit(3e3, dt=500.0, quasi_static=True, solver=mpm.Newton(tolerance=1e-10)))
    p = model.particles
    assert np.abs(p.stress).max() < 1e-5 * GRAVITY_OF_WATER
    np.testing.assert_allclose(p.pore_pressure, GRAVITY_OF_WATER * (4.0 - p.position[:, 1]), rtol=1e-5)
    assert model.water_inflow() == pytest.approx(0.0, abs=1e-3 * model.water_volume())


def test_water_that_falls_beside_a_slope_loads_it_by_its_weight():
    """Slowly: in the end water is at rest under the new level, and soil above it has lost its buoyancy."""
    model = wedge(2000.0, conductivity=1e-3, retention=CURVE)
    model.set_pore_pressure(lambda x: GRAVITY_OF_WATER * (1.0 - x[:, 1]))
    model.stand_water([(0.0, 1.0), (1e4, 0.31)])  # to just above the toe
    model.equilibrate(small_displacements=True)
    high = np.abs(model.particles.stress[:, 1]).max()
    list(model.implicit(2e4, dt=1e3, quasi_static=True))
    low = np.abs(model.particles.stress[:, 1]).max()
    assert low > 1.2 * high  # the soil has lost its buoyancy above the level
    p = model.particles
    np.testing.assert_allclose(
        p.pore_pressure, GRAVITY_OF_WATER * (0.31 - p.position[:, 1]), atol=0.01 * GRAVITY_OF_WATER
    )


def test_a_level_at_facets_follows_its_table():
    model = on_box((1.0, 1.0), (4, 4), ELASTIC, density=GRAVITY_OF_WATER / 9.81)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=0.4, conductivity=1e-9, modulus=np.inf)
    model.set_pore_pressure(lambda x: GRAVITY_OF_WATER * (3.0 - x[:, 1]))
    model.hold_pore_pressure(TOP, level=[(0.0, 3.0), (10.0, 1.5)])
    for time, level in ((5.0, 2.25), (20.0, 1.5)):
        list(model.implicit(time, dt=2.5, quasi_static=True, small_displacements=True))
        p = model.particles
        np.testing.assert_allclose(p.pore_pressure, GRAVITY_OF_WATER * (level - p.position[:, 1]), rtol=1e-8)
        assert np.abs(p.stress).max() < 1e-6 * GRAVITY_OF_WATER  # whatever it conducts


def test_a_restart_knows_curves_levels_and_rain(tmp_path):
    def bank(anisotropy=((5.0, 1.0), (1.0, 0.5))):
        model = column(cells=8, height=0.9, air=2, drained_surface=True, anisotropy=anisotropy)
        model.stand_water([(0.0, 0.5), (500.0, 0.2)])
        model.rain([(0.0, 0.0), (500.0, 2e-6)])
        return model

    whole, half = bank(), bank()
    options = {"dt": 100.0, "quasi_static": True}
    list(whole.implicit(1000.0, **options))
    list(half.implicit(400.0, **options))
    half.save(tmp_path / "half.h5")
    again = bank(anisotropy=None)
    again.restore(tmp_path / "half.h5")
    list(again.implicit(1000.0, **options))
    for name in ("pore_pressure", "saturation", "mass", "stress", "position"):
        assert np.array_equal(getattr(again.particles, name), getattr(whole.particles, name)), name


# --- input ------------------------------------------------------------------------------------------------------------


class Rising:
    def saturation(self, suction):
        return np.where(suction > 1e4, 1.0, 1 - 1e-5 * suction)

    effective = relative_permeability = saturation


class Tight(water.Gardner):
    def relative_permeability(self, suction):
        return np.where(suction > 1e5, 0.0, 1.0)


@pytest.mark.parametrize(
    "call, message",
    [
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, retention=Rising()), "saturation goes.*expected values that"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, retention=Tight(1e-4)), "permeability goes.*more than 0"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, retention=[CURVE, CURVE]), "2 curves, expected one"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, retention=3.0), r"retention is 3.0, which has no saturation\(\)"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, anisotropy=(1.0, 0.0)), "0.0.*expected 2 positive factors"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, anisotropy=[[1.0, 2.0], [2.0, 1.0]]), "positive principal values"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, anisotropy=np.array([[1.0, 0.5], [0.0, 1.0]])), "a symmetric"),
        (lambda m: m.add_water(porosity=0.4, conductivity=1e-6, anisotropy=[None, (1, 1)]), "has 2 entries, expected 2 factors"),
        (lambda m: m.rain(1e-6), "no retention curve"),
        (lambda m: m.stand_water(1.0), "level: the free surface is not drained"),
        (lambda m: m.hold_pore_pressure(TOP, level=[(1.0, 2.0), (1.0, 3.0)]), "level is .*rising times"),
        (lambda m: m.hold_pore_pressure(TOP, float("nan")), "pressure is nan, expected a finite number"),
    ],
)  # fmt: skip
def test_mistakes_are_named(call, message):
    model = on_box((1.0, 1.0), (2, 2), ELASTIC)
    model.add_water(porosity=0.4, conductivity=1e-6)
    with pytest.raises(mpm.InputError, match=message):
        call(model)


def test_steps_that_cannot_dry_soil_refuse_it():
    model = column(cells=4, drained_surface=True)
    with pytest.raises(mpm.InputError, match="rate is -1.0, expected 0 or more"):
        model.rain(-1.0)
    with pytest.raises(mpm.InputError, match="expected an explicit run without retention curves"):
        list(model.explicit(1.0))


@pytest.mark.parametrize("small", [False, True], ids=["", "small"])
@pytest.mark.parametrize("integration", [mpm.Integration.PARTICLES, mpm.Integration.MIXED], ids=["particles", "mixed"])
def test_a_bank_whose_reservoir_falls_loses_the_water_that_leaves_it(small, integration):
    """Its surface cuts cells and dries, its water is compressible: the masses of the particles say what they have lost."""
    background = bridge.slope_mesh(MPI.COMM_SELF, height=4.0, angle=30.0, crest=4.0, cell_size=1.0, kind="fitted")
    soil = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=12e3, friction_angle=28.0, dilation_angle=0.0)
    model = mpm.Model(bridge.background_mesh(*background), soil)
    model.seed(density=SATURATED / 9.81, per_cell=3, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -9.81))
    retention = water.VanGenuchten(alpha=1.5e-4, n=2.0, residual=0.1)
    model.add_water(porosity=POROSITY, conductivity=1e-6, retention=retention, drained_surface=True)
    model.set_pore_pressure(lambda x: GRAVITY_OF_WATER * (3.0 - x[:, 1]))
    model.stand_water([(0.0, 3.0), (1e5, 0.5)])
    model.equilibrate(small_displacements=True, integration=integration)
    model.hold_pore_pressure(bridge.LEFT, level=3.0)
    held, entered, mass = model.water_volume(), 0.0, model.particles.mass.sum()
    options = {"quasi_static": True, "nmd": True, "small_displacements": small, "integration": integration}
    for _ in model.implicit(2e5, dt=2e4, every_steps=1, **options):
        inflow, now = model.water_inflow(), model.particles.mass.sum()
        assert 9.81 / GRAVITY_OF_WATER * (now - mass) == pytest.approx(inflow - entered, abs=1e-10 * held)
        entered, mass = inflow, now
    assert entered < -5e-3 * held
