"""Explicit steps of soil and water with a velocity each: waves, consolidation, gradients, conservation, energy."""

import numpy as np
import pytest
from core_cases import box
from two_phase_cases import BASE, DENSITY, ELASTIC, GAMMA, GRAINS, LEFT, OEDOMETER, POROSITY, RIGHT, TOP, WATER, column

import mpm_core as mpm
from fenics_bridge.water import dipping


# --- consolidation ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim, cells, error, nmd", [(2, 20, 0.02, False), (3, 16, 0.03, False), (2, 20, 0.02, True)])
def test_a_loaded_column_consolidates_as_terzaghi_has_it(dim, cells, error, nmd):
    """With water of compressibility n / K_w beside that of the skeleton 1 / M: c_v = k / gamma_w / (1/M + n/K_w), and the
    pressure begins at 1 / (1 + M n / K_w) of the load. The column begins in that undrained equilibrium, without waves. With
    averaged strains the pressures that act are averages of cells, of which each is that at the centre.
    """
    load, modulus, conductivity = 10e3, 2.2e7, 2e-4
    model = column(cells, conductivity=conductivity, modulus=modulus, dim=dim)
    width = 2.0 / cells
    model.traction(2 * dim, [0.0] * (dim - 1) + [-load])
    stiff = POROSITY / modulus
    first = load / (1 + OEDOMETER * stiff)
    model.set_pore_pressure(first)
    stress = np.zeros(model.particles.stress.shape)
    stress[:, :3], stress[:, dim - 1] = 0.3 / 0.7 * (first - load), first - load
    model.particles.set("stress", stress)
    c_v = conductivity / GAMMA / (1 / OEDOMETER + stiff)
    m = np.pi * (np.arange(200) + 0.5)
    for factor in (0.2, 0.5):
        list(model.explicit(factor / c_v, nmd=nmd))
        acting, particles = model.averaged_pore_pressure(), model.particles
        z, p = particles.position[:, -1], acting if nmd else particles.pore_pressure
        if nmd:
            z = model.mesh.points[model.mesh.cells[particles.cell], -1].mean(axis=1)
        exact = np.sin(m * (1 - z)[:, None]) @ (2 / m * np.exp(-(m**2) * factor)) * first
        assert p == pytest.approx(exact, abs=error * load)
        degree = 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))
        left = -model.water_inflow() / (width ** (dim - 1) * load / OEDOMETER)
        assert left == pytest.approx(degree, abs=error / 2)


@pytest.mark.parametrize(
    "factors", [(1.0, 1.0), (50.0, 0.5), dipping(50.0, 0.5, 35.0)], ids=["isotropic", "level", "dips"]
)
@pytest.mark.parametrize("held", [False, True], ids=["free", "held"])
def test_the_drag_of_a_step_follows_the_direction_of_the_flow(factors, held):
    """Water that moves through soil at rest, everywhere alike: m_s v = dt C (w - v), m_w (w - w_0) = -dt C (w - v), with C the
    inverse of the conductivity; held soil stays."""
    model = mpm.Model(box([2, 2] if not held else [1, 1], [1.0, 1.0]), ELASTIC)
    model.seed(density=DENSITY, per_cell=3)
    model.add_water(porosity=POROSITY, conductivity=2e-4, modulus=2.2e8, anisotropy=factors)
    for side in (LEFT, RIGHT, BASE, TOP) if held else ():
        model.fix(side)
        model.hold_pore_pressure(side, 0.0)
    list(model.explicit(1e-9))
    first, dt = np.array([0.3, -0.1]), 2e-5
    model.particles.set("water_velocity", np.tile(first, (len(model.particles), 1)))
    list(model.explicit(model.time + dt, dt=dt))
    k = 2e-4 * (np.diag(factors) if np.ndim(factors) == 1 else factors)
    drag, soil, wet = POROSITY**2 * GAMMA * np.linalg.inv(k), (1 - POROSITY) * GRAINS, POROSITY * WATER
    relative = np.linalg.solve(np.eye(2) + dt * drag * ((0 if held else 1 / soil) + 1 / wet), first)
    v = np.zeros(2) if held else wet / (soil + wet) * (first - relative)
    p = model.particles
    assert np.linalg.norm(relative) < 0.97 * np.linalg.norm(first)
    np.testing.assert_allclose(p.velocity, np.tile(v, (len(p), 1)), rtol=0, atol=1e-7)
    np.testing.assert_allclose(p.water_velocity - p.velocity, np.tile(relative, (len(p), 1)), rtol=0, atol=1e-6)


def test_a_column_of_level_strata_consolidates_by_the_conductivity_across_them():
    left = []
    for conductivity, anisotropy in ((1e-4, None), (2e-4, (100.0, 0.5))):
        model = column(12, conductivity=conductivity, modulus=2.2e7, anisotropy=anisotropy)
        model.traction(TOP, (0.0, -10e3))
        list(model.explicit(0.2, nmd=True))
        left.append(model.water_inflow())
    assert left[0] < 0 and left[1] == pytest.approx(left[0], rel=1e-3)


# --- waves ------------------------------------------------------------------------------------------------------------


def modes(modulus):
    """Speeds of the slow and the fast compression wave without drag, and their velocities (v, w): det(K - c^2 M) = 0."""
    n, ratio = POROSITY, modulus / POROSITY
    stiffness = np.array([[OEDOMETER + (1 - n) ** 2 * ratio, (1 - n) * modulus], [(1 - n) * modulus, n * modulus]])
    masses = np.array([(1 - n) * GRAINS, n * WATER])
    squared, shapes = np.linalg.eigh(stiffness / np.sqrt(np.outer(masses, masses)))
    return np.sqrt(squared), shapes / np.sqrt(masses)[:, None]


@pytest.mark.parametrize(
    "which, speed, cells, dim", [(0, 73.2, 20, 2), (1, 589.6, 40, 2), (0, 73.2, 12, 3), (1, 589.6, 12, 3)]
)
def test_a_column_without_drag_swings_with_the_speeds_of_both_waves(which, speed, cells, dim):
    """Its first mode with a fixed base and a free top is a quarter of a wave, with the period 4 H / c."""
    speeds, shapes = modes(2.2e8)
    assert speeds[which] == pytest.approx(speed, rel=1e-3)
    model = column(cells, conductivity=1e3, dim=dim)
    list(model.explicit(1e-9))
    p, up = model.particles, np.eye(dim)[dim - 1]
    shape = 1e-4 * np.sin(0.5 * np.pi * p.position[:, -1])[:, None] * up
    p.set("velocity", shapes[0, which] * shape)
    p.set("water_velocity", shapes[1, which] * shape)
    times, swing = [], []
    for report in model.explicit(4.2 / speeds[which], every_steps=1):
        times.append(report.time)
        swing.append((p.mass * p.velocity[:, -1] + p.water_mass * p.water_velocity[:, -1]).sum())
    swing = np.array(swing)
    zero = np.flatnonzero(swing[:-1] * swing[1:] < 0)
    crossings = [times[k] - swing[k] * (times[k + 1] - times[k]) / (swing[k + 1] - swing[k]) for k in zero]
    assert 2 * (crossings[1] - crossings[0]) == pytest.approx(4 / speeds[which], rel=0.01)


def test_a_front_in_undrained_soil_has_its_speed_and_pressure():
    """Soil and water move together: c^2 = (E + K_w / n) / rho, and behind the front p / q = K_w / n / (E + K_w / n)."""
    stiff = 2.2e8 / POROSITY
    speed, ratio = np.sqrt((OEDOMETER + stiff) / DENSITY), stiff / (OEDOMETER + stiff)
    assert (speed, ratio) == (pytest.approx(532.1, rel=1e-3), pytest.approx(0.97611, rel=1e-5))
    model = column(200, conductivity=1e-8)
    model.traction(TOP, (0.0, -10e3))
    fronts = []
    for part in (0.3, 0.7):
        list(model.explicit(part / speed, nmd=True))
        z, p = model.particles.position[:, 1], model.particles.pore_pressure
        fronts.append(1 - z[p > 0.5 * ratio * 10e3].min())
    assert fronts[1] - fronts[0] == pytest.approx(0.4, abs=0.005)  # a cell
    behind = (z > 0.5) & (z < 0.85)
    assert p[behind].mean() == pytest.approx(ratio * 10e3, rel=0.01)


# --- gradients ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fraction", [0.8, 1.2])
def test_soil_rests_below_the_critical_gradient_and_lifts_off_above(fraction):
    """i_c = (G_s - 1) (1 - n): there the flow carries the buoyant weight, and effective stresses vanish."""
    critical = (GRAINS / WATER - 1) * (1 - POROSITY)
    sand = mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=0.0, friction_angle=30.0, dilation_angle=0.0)
    size = 0.1
    mesh = box((2, 15), (2 * size, 1.5), diagonals="alternating", body=((0, 0), (2 * size, 1.0)))
    model = mpm.Model(mesh, sand)
    model.seed(density=DENSITY, per_cell=3, cell_tag=1)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=POROSITY, conductivity=1e-2, modulus=2.2e7)
    head = GAMMA * (1 + fraction * critical)
    model.hold_pore_pressure(BASE, head, presses=False)
    p, z = model.particles, model.particles.position[:, 1]
    model.set_pore_pressure(lambda x: head * (1 - x[:, 1]))
    effective = -min(0.0, fraction - 1) * critical * GAMMA * (1 - z)
    p.set("stress", -effective[:, None] * np.array([0.5, 1.0, 0.5, 0.0]))
    list(model.explicit(0.3, nmd=True))
    rise = p.displacement[:, 1].mean()
    if fraction < 1:
        assert abs(rise) < 1e-3 and p.stress[:, 1].min() < -0.1 * effective.max()
    else:
        assert rise > 5e-3


@pytest.mark.parametrize("fraction", [0.9, 1.1])
def test_fine_sand_on_coarse_sand_lifts_off_above_its_own_critical_gradient(fraction):
    """Gradients are q / k, so that the fine sand becomes critical first. Below that heads are linear in each layer."""
    conductivity, critical = (1e-3, 1e-2), (GRAINS / WATER - 1) * (1 - POROSITY)
    size, gradient = 0.1, fraction * critical
    mesh = box((2, 14), (2 * size, 1.4), diagonals="alternating", body=((0, 0), (2 * size, 1.0)))
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=10e6, poisson=0.3, cohesion=0.0, friction_angle=30.0))
    model.seed(density=DENSITY, per_cell=3, cell_tag=1)
    model.roller(LEFT, (1, 0))
    model.roller(RIGHT, (1, 0))
    model.fix(BASE)
    model.set_gravity((0.0, -9.81))
    model.add_water(porosity=POROSITY, conductivity=lambda x: np.where(x[:, 1] > 0.5, *conductivity), modulus=2.2e7)

    def excess(z):
        below = conductivity[0] / conductivity[1] * np.maximum(0.5 - z, 0)
        return GAMMA * gradient * (np.minimum(1 - z, 0.5) + below)

    model.hold_pore_pressure(BASE, GAMMA + excess(0.0))
    p, z = model.particles, model.particles.position[:, 1]
    effective = np.maximum(0, critical * GAMMA * (1 - z) - excess(z))
    p.set("stress", -effective[:, None] * np.array([0.5, 1.0, 0.5, 0.0]))
    model.set_pore_pressure(lambda x: GAMMA * (1 - x[:, 1]) + 0.9 * excess(x[:, 1]))  # the flow brings it up
    list(model.explicit(2.0, nmd=True, damping=0.5))
    rise = p.displacement[:, 1]
    if fraction > 1:
        lifted = rise[z > 0.6].min()  # the cells at the interface are stretched
        assert lifted > 5e-4 and abs(rise[z < 0.4]).max() < 0.05 * lifted
        return
    row = np.floor(z / size).astype(int)
    found, expected = (
        np.bincount(row, values) / np.bincount(row)
        for values in (model.averaged_pore_pressure() - GAMMA * (1 - z), excess(z))
    )
    assert found == pytest.approx(expected, abs=2e-3 * excess(0.0))
    assert abs(rise).max() < 1e-5


# --- conservation -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
def test_water_is_neither_made_nor_lost(dim):
    """What particles have lost is what flowed over their surface; and what of it has left is there twice: in the masses, and
    in the pores and their pressure, m_w = rho_w n V (1 + p / K_w)."""
    model = column(10, modulus=2.2e7, dim=dim)
    model.set_gravity([0.0] * (dim - 1) + [-9.81])
    p = model.particles
    list(model.explicit(1e-9))
    start = p.water_mass.sum()
    list(model.explicit(0.05, nmd=True))
    assert model.water_inflow() < (-1e-6 if dim == 2 else -1e-7)
    assert p.water_mass.sum() - start == pytest.approx(WATER * model.water_inflow(), abs=1e-10 * start)
    filled = WATER * p.porosity * p.volume * (1 + p.pore_pressure / 2.2e7)
    np.testing.assert_allclose(p.water_mass, filled, rtol=1e-12)
    np.testing.assert_allclose(
        (1 - p.porosity) * p.volume, (1 - POROSITY) * 0.2 ** (dim - 1) / len(p), rtol=1e-12
    )  # of the grains


def test_phases_exchange_momentum_without_making_any():
    """Without weight or boundary conditions, in a motion that is undrained at the nodes but not in the particles."""
    mesh = box((6, 6), (3.0, 3.0), body=((1.0, 1.0), (2.0, 2.0)))
    model = mpm.Model(mesh, ELASTIC)
    model.seed(density=DENSITY, per_cell=1, cell_tag=1)
    model.add_water(porosity=POROSITY, conductivity=1e-2, modulus=2.2e7)
    list(model.explicit(1e-9))
    p = model.particles
    z = p.position - 1.5
    p.set("velocity", np.column_stack([1.0 + z[:, 1], -0.5 + z[:, 0]]))
    p.set("water_velocity", np.column_stack([1.0 - z[:, 1], -0.5 + 0.3 * z[:, 1]]))
    start = p.mass @ p.velocity + p.water_mass @ p.water_velocity
    left, masses = np.zeros(2), p.water_mass
    for _ in model.explicit(2e-3, every_steps=1, nmd=True):
        left += (masses - p.water_mass) @ p.water_velocity  # carried away by water that flows out of particles
        masses = p.water_mass
    now = p.mass @ p.velocity + p.water_mass @ p.water_velocity
    np.testing.assert_allclose(now + left, start, atol=1e-12 * np.abs(start).max())


def test_pore_pressures_can_be_set_between_runs():
    """The mass of the water follows, so that steps go on from them; so it does with the porosity."""
    model = column(4, conductivity=1e-6, modulus=2.2e7)
    list(model.explicit(1e-9))
    p = model.particles
    p.set("pore_pressure", p.pore_pressure + 5e3)
    model.explicit(2e-9).last()
    np.testing.assert_allclose(model.particles.pore_pressure, 5e3, rtol=1e-4)
    p.set("porosity", 0.9 * p.porosity)
    np.testing.assert_allclose(p.water_mass, WATER * (1 + p.pore_pressure / 2.2e7) * p.porosity * p.volume, rtol=1e-14)


def test_saturated_soil_in_free_fall_stays_as_it_is():
    mesh = box((6, 6), (3.0, 3.0), body=((1.0, 1.0), (2.0, 2.0)))
    model = mpm.Model(mesh, ELASTIC)
    model.seed(density=DENSITY, per_cell=6, cell_tag=1)
    model.add_water(porosity=POROSITY, conductivity=1e-4, modulus=2.2e8)
    model.set_gravity((0.0, -9.81))
    *_, report = model.explicit(0.02, nmd=True)
    p = model.particles
    for velocity in (p.velocity, p.water_velocity):
        np.testing.assert_allclose(velocity, np.tile([0.0, -9.81 * 0.02], (len(p), 1)), atol=1e-12)
    np.testing.assert_allclose(p.pore_pressure, 0, atol=1e-6)
    np.testing.assert_allclose(report.momentum, [0.0, -9.81 * 0.02 * DENSITY], rtol=1e-12, atol=1e-9)
    assert abs(report.unexplained_fraction) < 1e-10


@pytest.mark.parametrize("dim", [2, 3])
def test_the_balance_of_energy_is_that_of_a_body_at_rest_while_water_flows_out_of_one_that_moves(dim):
    """Galilei: in a frame that moves with the body water that leaves has no kinetic energy, here it has that of the velocity."""
    lost, unexplained = [], []
    for velocity in (0.0, 30.0):
        model = mpm.Model(box((6,) * dim, (3.0,) * dim, body=((1.0,) * dim, (2.0,) * dim)), ELASTIC)
        model.seed(density=DENSITY, per_cell={2: 6, 3: 4}[dim], cell_tag=1)
        model.add_water(porosity=POROSITY, conductivity=1e-2, modulus=2.2e7)
        model.set_pore_pressure(10e3)
        model.particles.set("velocity", np.full(model.particles.velocity.shape, velocity))
        before = model.report()
        report = model.explicit(3e-4, dt=1e-4).last()
        lost.append(before.mass - report.mass)
        unexplained.append(report.unexplained_energy)
    assert lost[1] == pytest.approx(lost[0], rel=1e-3) and lost[0] > 1e-3  # kg
    carried = 0.5 * lost[0] * dim * 30.0**2
    assert unexplained[1] == pytest.approx(unexplained[0], abs=1e-4 * carried)


def test_energy_that_pic_takes_out_of_soil_and_water_is_booked():
    """Random velocities of both phases, which the nodes hardly see, die out by PIC; a fifth of their energy is the water's."""
    model = column(10, conductivity=1e-2)
    list(model.explicit(1e-9, dt=1e-9))  # from now on water has a velocity of its own
    random = np.random.default_rng(1)
    for name in ("velocity", "water_velocity"):
        model.particles.set(name, random.normal(0.0, 0.1, model.particles.velocity.shape))
    energy = model.report().kinetic_energy
    *_, report = model.explicit(20 * model.critical_time_step(), pic=0.2, energy_limit=None)
    assert report.kinetic_energy < 0.01 * energy and report.pic_loss > 0.9 * energy
    assert abs(report.unexplained_energy) < 0.01 * energy


def test_water_without_a_velocity_of_its_own_is_given_none():
    model = column(4)
    with pytest.raises(mpm.InputError, match="water_velocity cannot be set yet"):
        model.particles.set("water_velocity", np.zeros(model.particles.velocity.shape))
