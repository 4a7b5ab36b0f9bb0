"""Resting cells whose water has a velocity of its own, in explicit steps: nodes cannot tell them from their particles."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

POROSITY, GRAINS, WATER = 0.4, 2650.0, 1000.0
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
GAMMA = 9810.0
SOIL = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=2e3, friction_angle=25.0, dilation_angle=0.0)
ELASTIC = mpm.LinearElastic(young=10e6, poisson=0.3)
PER_CELL = {2: 10, 3: 8}


def flowing(dim, n=4, **water):
    """A block at rest on rollers that drains at its top, with pressures, stresses and velocities of its own."""
    model = mpm.Model(box((n,) * dim, shake=0.2, diagonals="alternating"), SOIL)
    model.seed(density=DENSITY, per_cell=PER_CELL[dim])
    for axis in range(dim):
        model.roller(2 * axis + 1, np.eye(dim)[axis])
    model.add_water(porosity=POROSITY, conductivity=1e-3, modulus=2.2e7, **water)
    model.hold_pore_pressure(2 * dim, 0.0)
    random, cell = np.random.default_rng(3), model.particles.cell
    model.particles.set("pore_pressure", 1e3 * random.random(len(model.mesh.cells))[cell])
    stress = random.standard_normal((len(model.mesh.cells), model.particles.stress.shape[1]))
    model.particles.set("stress", 1e3 * stress[cell])
    model.particles.set("velocity", 0.1 * random.standard_normal((len(model.mesh.cells), dim))[cell])
    assert model.rest() == len(model.mesh.cells)
    return model


def nodal_sums(model):
    model.particles.set("velocity", model.particles.velocity)  # moments of cells are summed anew
    model.out_of_balance()
    mass = model.nodal("mass")
    return mass, mass[:, None] * model.nodal("velocity"), model.nodal("internal_force")


def by_cell(model, weight, values):
    count, cell = len(model.mesh.cells), model.particles.cell
    columns = np.reshape(values, (len(cell), -1)).T
    return np.stack([np.bincount(cell, weight * column, count) for column in columns])


def of_cells(model):
    """Mass and momentum of the water of each cell, and what its pores hold."""
    p = model.particles
    return (by_cell(model, 1.0, p.water_mass), by_cell(model, p.water_mass, p.water_velocity),
            by_cell(model, p.volume, p.pore_pressure), by_cell(model, p.volume, p.porosity))  # fmt: skip


def require_same(ones, others, tolerance):
    for one, other in zip(ones, others, strict=True):
        assert np.abs(other).max() > 0
        np.testing.assert_allclose(one, other, rtol=0, atol=tolerance * np.abs(other).max())


def require_same_steps(make, options):
    """A step of resting cells and one of the particles that they turn into move soil and water alike."""
    found = []
    for converts in (False, True):
        model = make()
        dt = 0.2 * model.critical_time_step()
        options = {"dt": dt, "conversion": None, "energy_limit": None, **options}
        model.explicit(20 * dt, **options).last()
        if converts:
            model.convert()
        report = model.explicit(model.time + dt, **options).last()
        assert report.steps == 21
        found.append((model.nodal("velocity"), model.nodal("acceleration"), *of_cells(model), model.water_inflow()))
    require_same(*found, 1e-10)


@pytest.mark.parametrize("dim", [2, 3])
def test_conversion_in_motion_leaves_soil_and_water_alone(dim):
    model = flowing(dim)
    dt = 0.2 * model.critical_time_step()
    model.explicit(20 * dt, dt=dt, conversion=None, energy_limit=None).last()
    sums, cells, before = nodal_sums(model), of_cells(model), model.report()
    assert model.convert() == 0 and len(model.particles) == PER_CELL[dim] * len(model.mesh.cells)
    require_same(nodal_sums(model), sums, 1e-13)
    require_same(of_cells(model), cells, 1e-13)
    after = model.report()
    for name in ("mass", "kinetic_energy", "stored_energy"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), rel=1e-12)
    spread = np.ptp(model.particles.water_velocity[model.particles.cell == 5], axis=0)
    assert (spread > 1e-3 * np.abs(model.particles.water_velocity).max()).all()


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"nmd": True},
        {"pic": 0.02},
        {"integration": mpm.Integration.MIXED},
        {"rayleigh": mpm.Rayleigh(mass=20.0, stiffness=1e-4, plastic_strain=np.inf), "nmd": True},
    ],
    ids=str,
)
@pytest.mark.parametrize("dim", [2, 3])
def test_a_step_after_conversion_moves_soil_and_water_as_before(dim, options):
    require_same_steps(lambda: flowing(dim, kozeny_carman=True), options)


def test_a_step_after_conversion_under_standing_water_and_through_strata_is_that_before():
    def strata():
        model = flowing(2, anisotropy=[2.0, 0.5], drained_surface=True)
        model.set_gravity((0.0, -9.81))
        model.stand_water(1.5)
        return model

    require_same_steps(strata, {})


@pytest.mark.parametrize("rests", [None, lambda x: x[:, 1] < 0.5], ids=["all", "half"])
def test_a_loaded_column_at_rest_consolidates_as_terzaghi_has_it(rests):
    """As the same column of particles does (`test_two_phase.py`), whose equations are there."""
    cells, load, modulus, conductivity = 20, 10e3, 2.2e7, 2e-4
    size = 2.0 / cells
    model = mpm.Model(box([2, cells], [size, 1.0], diagonals="alternating"), ELASTIC)
    model.seed(density=DENSITY, per_cell=3)
    for side in (1, 2):
        model.roller(side, (1, 0))
    model.fix(3)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
    stiff, oedometer = POROSITY / modulus, ELASTIC.p_wave_modulus
    first = load / (1 + oedometer * stiff)
    model.set_pore_pressure(first)
    model.particles.set(
        "stress", np.tile((first - load) * np.array([3 / 7, 1.0, 3 / 7, 0.0]), (len(model.particles), 1))
    )
    model.press_surface(4, load)
    assert model.rest(where=rests) > 0
    c_v = conductivity / GAMMA / (1 / oedometer + stiff)
    water = inflow = None
    for factor in (0.05, 0.2):
        report = model.explicit(factor / c_v, conversion=None).last()
        m = np.pi * (np.arange(200) + 0.5)
        degree = 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))
        assert -model.water_inflow() / (size * load / oedometer) == pytest.approx(degree, abs=0.01)
        if water is not None:
            assert model.particles.water_mass.sum() - water == pytest.approx(
                WATER * (model.water_inflow() - inflow), rel=1e-9
            )
        water, inflow = model.particles.water_mass.sum(), model.water_inflow()
        assert report.resting_cells > 0 and abs(report.unexplained_energy) < 1e-3 * report.stress_work
