"""Limits of soil and water with a velocity each: no flow, water at rest, pores that run empty, and input that is refused."""

import numpy as np
import pytest
from core_cases import box
from two_phase_cases import BASE, DENSITY, ELASTIC, GAMMA, LEFT, POROSITY, RIGHT, WATER, column

import mpm_core as mpm


def test_without_flow_the_soil_is_that_of_the_undrained_law():
    """A square that hangs over its base under suddenly applied weight swings as with total stresses of the undrained law."""
    soil, modulus, moved = mpm.LinearElastic(young=2e6, poisson=0.3), 2.2e7, []
    for law in (soil, mpm.Undrained(soil, water_modulus=modulus, porosity=POROSITY)):
        mesh = box((12, 10), (1.5, 1.25), diagonals="alternating", body=((0, 0), (1.0, 1.0)))
        model = mpm.Model(mesh, law)
        model.seed(density=DENSITY, per_cell=3, cell_tag=1)
        model.roller(LEFT, (1, 0))
        model.fix(BASE)
        model.set_gravity((0.0, -9.81))
        if law is soil:
            model.add_water(porosity=POROSITY, conductivity=1e-10, modulus=modulus)
        *_, report = model.explicit(0.05, nmd=True)
        assert report.unexplained_fraction > -1e-3  # no energy from nothing
        moved.append(model.particles.displacement[np.argsort(model.particles.id)])
    assert np.abs(moved[0] - moved[1]).max() <= 0.02 * np.abs(moved[1]).max()


def test_soil_at_rest_under_water_has_its_buoyant_weight():
    model = column(10, conductivity=1e-1, modulus=2.2e7)
    model.set_gravity((0.0, -9.81))
    list(model.explicit(1.0, nmd=True, damping=0.5))
    p, z = model.particles, model.particles.position[:, 1]
    row = np.floor(5 * z).astype(int)  # averages of alternating diagonals tell pairs of rows apart only
    for column_of, weight in ((-p.stress[:, 1], (DENSITY - WATER) * 9.81), (p.pore_pressure, GAMMA)):
        means = np.bincount(row, column_of) / np.bincount(row)
        np.testing.assert_allclose(means, weight * (1 - 0.2 * (np.arange(5) + 0.5)), atol=0.01 * weight)


@pytest.mark.parametrize("nmd", [False, True])
def test_water_rests_between_particles_that_are_not_spread_evenly(nmd):
    """Places by chance, 16 in a square and so 4 to 12 in a triangle: forces of a pressure are those of whole cells. As sums over the
    particles they are no equilibrium, and with averages the pressure would fall, as water flowed without end."""
    model = mpm.Model(box([4, 10], [0.4, 1.0], diagonals="alternating"), ELASTIC)
    squares = np.indices((16, 40)).reshape(2, -1).T
    points = 0.025 * (squares + np.random.default_rng(1).uniform(0.05, 0.95, squares.shape))
    model.seed_points(points, np.full(len(points), 0.025**2), density=DENSITY)
    for side in (LEFT, RIGHT):
        model.roller(side, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=POROSITY, conductivity=1e-2, modulus=2.2e7, suction_limit=0.0)
    model.set_pore_pressure(lambda x: GAMMA * (1 - x[:, 1]))
    vertical = (DENSITY / WATER - 1) * GAMMA * (points[:, 1:] - 1)
    model.particles.set("stress", vertical * [3 / 7, 1.0, 3 / 7, 0.0])
    model.explicit(0.3, nmd=nmd, damping=0.1).last()
    p = model.averaged_pore_pressure() if nmd else model.particles.pore_pressure
    height = np.asarray(model.mesh.points)[model.mesh.cells[model.particles.cell], 1].mean(axis=1)
    assert p == pytest.approx(GAMMA * (1 - height), abs=0.03 * GAMMA)


def test_averaged_pressures_balance_the_weight_of_water_among_uneven_triangles():
    """A square grid, whose particles on diagonals belong to one of two triangles, which have 6 and 10. Pressures and flow are
    averaged by the same volumes: otherwise pressures rise by 0.04 m of head everywhere, and water flows without end."""
    model = mpm.Model(box([8, 16], [0.4, 0.8], diagonals="alternating"), mpm.LinearElastic(young=5e6, poisson=0.3))
    points = 0.0125 * (np.indices((32, 46)).reshape(2, -1).T + 0.5)
    model.seed_points(points, np.full(len(points), 0.0125**2), density=DENSITY)
    for side, normal in ((LEFT, (1, 0)), (RIGHT, (1, 0)), (BASE, (0, 1))):
        model.roller(side, normal)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=POROSITY, conductivity=1e-3, modulus=2e7, suction_limit=0.0)
    model.set_pore_pressure(lambda x: GAMMA * (0.575 - x[:, 1]))
    vertical = (DENSITY / WATER - 1) * GAMMA * (points[:, 1:] - 0.575)
    model.particles.set("stress", vertical * [3 / 7, 1.0, 3 / 7, 0.0])
    model.explicit(1.0, nmd=True, damping=0.3, energy_limit=None).last()  # hardly any energy is at work
    height = np.asarray(model.mesh.points)[model.mesh.cells[model.particles.cell], 1].mean(axis=1)
    inner = (height > 0.1) & (height < 0.5)
    p = model.averaged_pore_pressure()[inner]
    assert p == pytest.approx(GAMMA * (0.575 - height[inner]), abs=0.02 * GAMMA)


@pytest.mark.parametrize("evenly", [True, False])
@pytest.mark.parametrize("suction_limit", [np.inf, 0.0])
def test_water_that_stands_over_a_slope_carries_soil_as_heavy_as_itself(suction_limit, evenly):
    """Whatever the shape of its surface, which cuts cells: no effective stress, no motion, the pressures of the water. Energy
    is complete where the triangles within the soil are filled evenly, since its pressures are integrated over whole cells.
    """
    mesh = box([16, 8], [2.0, 1.0], diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=10e6, poisson=0.3))
    x, y = (np.arange(64) + 0.5) / 32, (np.arange(32) + 0.5) / 32
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2) + [1e-3, 2e-3]
    if evenly:
        points += np.where(np.rint(points[:, 1:] * 32 - 0.5) % 2, 6e-3, -6e-3) * [1, 0] - [
            1e-3,
            2e-3,
        ]  # none on a diagonal
    points = points[points[:, 1] < 0.9 - 0.5 * np.minimum(points[:, 0], 1.2)]
    model.seed_points(points, np.full(len(points), 1 / 32**2), density=1000.0)
    model.roller(1, (1, 0))
    model.roller(2, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(
        porosity=POROSITY, conductivity=1e-3, modulus=2.2e7, drained_surface=True, suction_limit=suction_limit
    )
    model.set_pore_pressure(lambda x: 9810.0 * (1.5 - x[:, 1]))
    model.stand_water(1.5)
    report = model.explicit(0.3, nmd=True).last()
    p = model.particles
    moved = np.linalg.norm(p.displacement, axis=1).max()
    assert np.abs(p.stress).max() < 0.02 * 9810.0 and moved < 1e-5
    height = np.asarray(model.mesh.points)[model.mesh.cells[p.cell], 1].mean(axis=1)
    # to two thirds of the height of a cell: a single particle may be so far from its centre
    assert model.averaged_pore_pressure() == pytest.approx(9810.0 * (1.5 - height), abs=9810.0 / 12 + 50.0)
    assert abs(model.water_inflow()) < 1e-4 * model.water_volume()
    assert not evenly or report.unexplained_fraction == pytest.approx(
        0.0, abs=3e-5
    )  # of water at fixed nodes, whose particles move
    model.stand_water(-1.0)  # without it the weight of the soil acts
    model.explicit(0.4, nmd=True).last()
    assert np.linalg.norm(p.displacement, axis=1).max() > 10 * moved


# --- pores that run empty ---------------------------------------------------------------------------------------------


def test_a_column_drains_at_its_base_by_its_conductivity():
    """Without suction water falls by its weight alone, with the gradient 1, as long as pores at the base are full: k t leave
    the column there, none enters at its top, and none is lost."""
    conductivity, until = 2e-2, 2.0
    model = column(10, conductivity=conductivity, modulus=2.2e7, height=1.0)
    model.set_gravity((0.0, -9.81))
    p = model.particles
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=2.2e7, suction_limit=0.0)
    model.hold_pore_pressure(BASE, 0.0)
    p.set("stress", DENSITY * 9.81 * (p.position[:, 1] - 1)[:, None] * np.array([3 / 7, 1.0, 3 / 7, 0.0]))
    list(model.explicit(1e-9))
    start = p.water_mass.sum()
    list(model.explicit(until, nmd=True, damping=0.2))
    assert -model.water_inflow() == pytest.approx(0.2 * conductivity * until, rel=0.05)
    assert start - p.water_mass.sum() == pytest.approx(-WATER * model.water_inflow(), abs=1e-10 * start)
    full = p.water_mass / (WATER * p.porosity * p.volume)
    z = p.position[:, 1]
    assert full[z > 0.9].max() < 0.8 and full[z < 0.2].min() > 0.99


def test_moist_soil_has_no_pore_pressure_until_its_pores_have_closed_so_far_that_water_fills_them():
    """Soil that is compressed by 10 in a second, much faster than waves come in from its surface. The upper half is moist."""
    rate, stiffness, filled = 10.0, 2e3, 0.97
    model = mpm.Model(box((2, 16), (0.125, 1.0)), mpm.LinearElastic(young=1e3, poisson=0.3))
    model.seed(density=DENSITY, per_cell=3)
    for side in (LEFT, RIGHT):
        model.roller(side, (1, 0))
    at_first = model.particles.volume
    moist = model.particles.position[:, 1] > 0.5
    model.add_water(
        porosity=POROSITY,
        conductivity=1e-9,
        modulus=stiffness,
        suction_limit=0.0,
        saturation=np.where(moist, filled, 1.0),
    )
    model.particles.set("velocity", -rate * model.particles.position * [0, 1])
    inner = abs(model.particles.position[:, 1] - 0.5) < 0.4
    for report in model.explicit(2e-3, every=2e-4, damping=0.0):
        p = model.particles
        assert p.mass + p.water_mass == pytest.approx(DENSITY * at_first, rel=1e-5)
        full = WATER * np.where(moist, filled, 1.0) * POROSITY * at_first
        assert p.water_mass[inner] == pytest.approx(full[inner], rel=1e-4)
        pores = POROSITY * at_first - (at_first - p.volume)
        pressure = np.maximum(0.0, stiffness * (np.where(moist, filled, 1.0) * POROSITY * at_first / pores - 1))
        assert p.pore_pressure[inner] == pytest.approx(pressure[inner], abs=1e-3 * stiffness)
        closed = 1 - np.exp(-rate * report.time) > POROSITY * (1 - filled)
        assert (p.pore_pressure[inner & moist] > 0).all() == closed
    assert closed


def half_moist(density=DENSITY, porosity=POROSITY, filled=0.25):
    """A column at rest, whose upper half is moist."""
    model = mpm.Model(box((2, 4)), ELASTIC)
    model.seed(density=density, per_cell=3)
    moist = model.particles.position[:, 1] > 0.5
    model.add_water(porosity=porosity, conductivity=1e-9, suction_limit=0.0, saturation=np.where(moist, filled, 1.0))
    return model, moist


def test_the_volume_of_water_is_that_of_the_pores_which_it_fills():
    model, _ = half_moist()
    for _ in range(2):  # before and after the water has a mass of its own
        assert model.water_volume() == pytest.approx(POROSITY * (0.5 * 0.25 + 0.5), rel=1e-6)
        model.explicit(1e-6).last()


def test_moist_soil_may_be_lighter_than_its_pores_full_of_water():
    """As peat is: 700 kg/m3 with pores of 0.85 that hold 0.85 * 0.25 * 1000 = 212.5 kg/m3 of water."""
    model = mpm.Model(box((2, 4)), ELASTIC)
    model.seed(density=700.0, per_cell=3)
    model.add_water(porosity=0.85, conductivity=1e-9, suction_limit=0.0, saturation=0.25)
    model.explicit(1e-6).last()
    p = model.particles
    assert p.water_mass / p.volume == pytest.approx(212.5, rel=1e-6)
    assert p.mass / p.volume == pytest.approx(700.0 - 212.5, rel=1e-6)
    model, _ = half_moist(density=700.0, porosity=0.85)
    with pytest.raises(mpm.InputError, match="density of a particle is 700 kg/m3, expected more than.* 850 kg/m3"):
        model.explicit(1e-6)


def test_moist_soil_keeps_its_pressure_where_pressures_are_given():
    model, moist = half_moist()
    model.set_pore_pressure(lambda x: GAMMA * (1.5 - x[:, 1]))
    p = model.particles
    assert not p.pore_pressure[moist].any() and not p.pressure_gradient[moist].any()
    assert p.pore_pressure[~moist] == pytest.approx(GAMMA * (1.5 - p.position[~moist, 1]))


def test_soil_whose_water_has_a_mass_does_not_become_moist():
    model, _ = half_moist(filled=1.0)
    model.explicit(1e-6).last()
    with pytest.raises(mpm.InputError, match="saturation is 0.5 after explicit\\(\\), .* expected it before the first"):
        model.add_water(porosity=POROSITY, conductivity=1e-3, suction_limit=0.0, saturation=0.5)


# --- input ------------------------------------------------------------------------------------------------------------


def test_input_that_explicit_water_cannot_work_with():
    model = column(4)
    with pytest.raises(mpm.InputError, match="modulus of the pore water is infinite"):
        still = column(4, modulus=np.inf)
        still.explicit(1.0)
    with pytest.raises(mpm.InputError, match="expected more than that of the water in its pores"):
        light = column(4)
        light.particles.set("mass", 0.1 * light.particles.mass)
        light.explicit(1.0)
    with pytest.raises(mpm.InputError, match="without DUAL_DOMAIN integration"):
        model.explicit(1.0, integration=mpm.Integration.DUAL_DOMAIN)
    column(4).explicit(1e-4, rayleigh=mpm.Rayleigh(plastic_strain=np.inf)).last()  # damping of zero is none
    with pytest.raises(mpm.InputError, match="suction_limit is -1.0 Pa, expected 0 or more"):
        model.add_water(porosity=0.4, conductivity=1e-3, suction_limit=-1.0)
    for saturation, limit in ((0.0, 0.0), (1.1, 0.0), (np.nan, 0.0), (0.5, np.inf)):
        with pytest.raises(mpm.InputError, match=f"saturation is {saturation}"):
            model.add_water(porosity=0.4, conductivity=1e-3, saturation=saturation, suction_limit=limit)
    with pytest.raises(
        mpm.InputError, match="saturation is less than 1 in parts of the soil, which implicit\\(\\) does not"
    ):
        model.add_water(porosity=0.4, conductivity=1e-3, saturation=0.5, suction_limit=0.0)
        model.implicit(1.0, dt=0.1)
    model.add_water(porosity=0.4, conductivity=1e-3)  # full again
    assert model.particles.saturation.min() == 1
    with pytest.raises(mpm.InputError, match="above the critical time step"):
        list(model.explicit(1.0, dt=1.1 * model.wave_speeds().fast))
    with pytest.raises(mpm.InputError, match="which implicit\\(\\) does not support"):
        model.implicit(1.0, dt=0.1)


def test_the_step_is_that_of_the_fast_wave():
    model = column(20, modulus=2.2e9)
    waves = model.wave_speeds()
    assert waves == (pytest.approx(1664.5, rel=1e-3), pytest.approx(1857, rel=1e-3))  # Verruijt's formulae, by hand
    list(model.explicit(1e-9))
    altitude = 0.05 / np.sqrt(2)  # of a square of 0.05 m cut in two
    assert model.critical_time_step() == pytest.approx(altitude / waves.fast, rel=1e-6)
    found = mpm.critical_cell(model)
    assert (found.altitude, found.wave_speed) == pytest.approx((altitude, waves.fast), rel=1e-6)
