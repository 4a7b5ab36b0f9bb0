"""Explicit steps of soil and water with a velocity each: waves, consolidation, gradients, conservation, energy."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm
from fenics_bridge.water import dipping

POROSITY, GRAINS, WATER, GAMMA = 0.4, 2650.0, 1000.0, 9810.0
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
ELASTIC = mpm.LinearElastic(young=10e6, poisson=0.3)
OEDOMETER = ELASTIC.p_wave_modulus
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4


def column(cells, *, conductivity=1e-3, modulus=2.2e8, law=ELASTIC, height=1.0, dim=2, anisotropy=None):
    """A saturated column on a fixed base between rollers, two cells wide."""
    size = 2 * height / cells
    mesh = box(
        [2] * (dim - 1) + [cells], [size] * (dim - 1) + [height], diagonals="alternating" if dim == 2 else "one-way"
    )
    model = mpm.Model(mesh, law)
    model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim])
    for axis in range(dim - 1):
        for end in (1, 2):
            model.roller(2 * axis + end, np.eye(dim)[axis])
    model.fix(2 * dim - 1)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus, anisotropy=anisotropy)
    return model


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


# --- limits -----------------------------------------------------------------------------------------------------------


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
    with pytest.raises(mpm.InputError, match="without Rayleigh damping"):
        model.explicit(1.0, rayleigh=mpm.Rayleigh(mass=1.0))
    column(4).explicit(1e-4, rayleigh=mpm.Rayleigh(plastic_strain=np.inf)).last()  # damping of zero is none
    with pytest.raises(mpm.InputError, match="suction_limit is -1.0 Pa, expected 0 or more"):
        model.add_water(porosity=0.4, conductivity=1e-3, suction_limit=-1.0)
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
