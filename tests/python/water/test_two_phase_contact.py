"""Explicit steps of soil and water with a velocity each on rigid surfaces, which let no water through."""

import numpy as np
import pytest
from core_cases import box

import mpm_core as mpm

POROSITY, GRAINS, WATER, GAMMA = 0.4, 2650.0, 1000.0, 9810.0
DENSITY = (1 - POROSITY) * GRAINS + POROSITY * WATER
ELASTIC = mpm.LinearElastic(young=10e6, poisson=0.3)
OEDOMETER = ELASTIC.p_wave_modulus
LEFT, RIGHT, BASE, TOP = 1, 2, 3, 4
MU = 0.4


def column(cells, size, base, top, **plane):
    """Saturated particles, 16 in a square of the mesh, from a plane at some height of it up to another, between smooth walls."""
    model = mpm.Model(box(cells, size * np.array(cells), diagonals="alternating"), ELASTIC)
    step = size / 4
    i, j = np.indices((4 * cells[0], round((top - base) / step))).reshape(2, -1)
    x = np.column_stack([step * (i + 0.3 + 0.4 * (j % 2)), base + step * (j + 0.5)])  # none on a diagonal
    model.seed_points(x, np.full(len(x), step**2), density=DENSITY)
    for side in (LEFT, RIGHT):
        model.roller(side, (1, 0))
    return model, model.add_contact(mpm.Plane((0, base - 1e-12), normal=(0, 1)), **plane)


def under(model, pressure, effective):
    """Particles under a pore pressure and a vertical effective stress, at rest laterally, of functions of the height."""
    stress = np.zeros(model.particles.stress.shape)
    stress[:, 1] = -effective(model.particles.position[:, 1])
    stress[:, [0, 2]] = 0.3 / 0.7 * stress[:, [1]]
    model.particles.set("stress", stress)
    model.set_pore_pressure(lambda x: pressure(x[:, 1]))


@pytest.mark.parametrize("cut", [0.0, 0.25, 0.5])
@pytest.mark.parametrize("nmd", [False, True])
def test_a_column_on_a_plane_consolidates_as_terzaghi_has_it(cut, nmd):
    """On a plane that follows the mesh or cuts its cells, whose force is the total stress. Without a plane the water that has
    left is 2.7 and 1.3 % too little, since pressures are uniform in the cells at the drained surface."""
    load, modulus, conductivity, size = 10e3, 2.2e7, 2e-4, 1 / 24
    model, plane = column([2, 24], size, cut * size, 1.0)
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=modulus)
    model.traction(TOP, (0.0, -load))
    first = load / (1 + OEDOMETER * POROSITY / modulus)
    under(model, lambda y: first + 0 * y, lambda y: load - first)
    height = 1.0 - cut * size
    c_v = conductivity / GAMMA / (1 / OEDOMETER + POROSITY / modulus) / height**2
    m = np.pi * (np.arange(200) + 0.5)
    for factor, error in ((0.05, 0.05), (0.2, 0.03)):
        model.explicit(factor / c_v, nmd=nmd, damping=0.2).last()
        degree = 1 - np.sum(2 / m**2 * np.exp(-(m**2) * factor))
        assert -model.water_inflow() / (2 * size * height * load / OEDOMETER) == pytest.approx(degree, rel=error)
        assert -plane.force[1] == pytest.approx(2 * size * load, rel=1e-3)


@pytest.mark.parametrize("conductivity", [1e-2, 1e-4])
@pytest.mark.parametrize("base, nmd", [(0.0, False), (0.0, True), (0.03, False), (0.03, True)])
def test_a_surface_rubs_by_the_effective_stress(base, nmd, conductivity):
    """Of the weight of a column with its water, 20 kPa, the water carries 9.8 kPa at the plane, which moves sideways."""
    model, plane = column([4, 12], 0.1, base, base + 1.0, friction=MU, velocity=(0.1, 0.0))
    model.add_water(porosity=POROSITY, conductivity=conductivity, modulus=2.2e7)
    model.set_gravity((0.0, -GAMMA / WATER))
    under(model, lambda y: GAMMA * (base + 1 - y), lambda y: (DENSITY / WATER - 1) * GAMMA * (base + 1 - y))
    model.explicit(0.5, nmd=nmd, damping=0.2).last()
    normal, shear = -plane.force[1] / 0.4, -plane.force[0] / 0.4
    assert normal == pytest.approx(DENSITY * GAMMA / WATER, rel=5e-3)
    assert normal - shear / MU == pytest.approx(GAMMA, rel=0.1)


@pytest.mark.parametrize("base", [0.06, 0.08])
def test_a_surface_that_leaves_little_of_its_cells_rubs_by_the_effective_stress(base):
    """Two fifths and a fifth; their triangles are not filled evenly."""
    model, plane = column([4, 12], 0.1, base, base + 1.0, friction=MU, velocity=(0.1, 0.0))
    model.add_water(porosity=POROSITY, conductivity=1e-2, modulus=2.2e7, suction_limit=0.0)
    model.set_gravity((0.0, -GAMMA / WATER))
    buoyant = (DENSITY / WATER - 1) * GAMMA
    under(model, lambda y: GAMMA * (base + 1 - y), lambda y: buoyant * (base + 1 - y))
    model.explicit(0.3, nmd=True, damping=0.2, energy_limit=None).last()  # hardly any energy is at work
    assert -plane.force[0] / 0.4 == pytest.approx(MU * buoyant, rel=0.2)


@pytest.mark.parametrize("nmd", [False, True])
def test_no_water_leaves_at_a_surface_that_few_particles_touch(nmd):
    """Particles at random distances from a plane, of which the first ones carry the soil: between them the water rests, too."""
    model = mpm.Model(box([8, 14], [0.4, 0.7], diagonals="alternating"), ELASTIC)
    squares = np.indices((32, 46)).reshape(2, -1).T
    points = 0.0125 * (squares + np.random.default_rng(1).uniform(0.1, 0.9, squares.shape)) + (0, 0.006)
    model.seed_points(points, np.full(len(points), 0.0125**2), density=DENSITY)
    for side in (LEFT, RIGHT):
        model.roller(side, (1, 0))
    model.add_contact(mpm.Plane((0, 0.006 - 0.005 - 1e-9), normal=(0, 1)))
    model.add_water(porosity=POROSITY, conductivity=1e-3, modulus=2e7, suction_limit=0.0)
    model.set_gravity((0.0, -GAMMA / WATER))
    under(model, lambda y: GAMMA * (0.581 - y), lambda y: (DENSITY / WATER - 1) * GAMMA * (0.581 - y))
    model.explicit(0.5, nmd=nmd, damping=0.3).last()
    p = model.averaged_pore_pressure() if nmd else model.particles.pore_pressure
    height = np.asarray(model.mesh.points)[model.mesh.cells[model.particles.cell], 1].mean(axis=1)
    inner = (height > 0.1) & (height < 0.5)
    assert p[inner] == pytest.approx(GAMMA * (0.581 - height[inner]), abs=0.075 * GAMMA)


def test_liquefied_soil_slides_without_friction():
    """The water carries the whole weight, and cannot leave."""
    model, plane = column([4, 12], 0.1, 0.0, 1.0, friction=MU, velocity=(0.1, 0.0))
    model.add_water(porosity=POROSITY, conductivity=1e-9, modulus=2.2e7)
    model.set_gravity((0.0, -GAMMA / WATER))
    under(model, lambda y: DENSITY / WATER * GAMMA * (1 - y), lambda y: 0 * y)
    model.explicit(0.02, nmd=True, damping=0.2).last()
    assert -plane.force[1] > 0.5 * 0.4 * DENSITY * GAMMA / WATER
    assert abs(plane.force[0]) < 0.03 * MU * abs(plane.force[1])


def test_water_that_stands_over_the_soil_does_not_press_on_a_surface():
    """It presses on both sides of it, so that what is left is the buoyant weight, with its friction."""
    model, plane = column([4, 12], 0.1, 0.03, 1.03, friction=MU, velocity=(0.1, 0.0))
    model.add_water(porosity=POROSITY, conductivity=1e-2, modulus=2.2e7, suction_limit=0.0, drained_surface=True)
    model.set_gravity((0.0, -GAMMA / WATER))
    model.stand_water(2.0)
    buoyant = (DENSITY / WATER - 1) * GAMMA
    under(model, lambda y: GAMMA * (2 - y), lambda y: buoyant * (1.03 - y))
    model.explicit(0.5, nmd=True, damping=0.2).last()
    assert -plane.force[1] / 0.4 == pytest.approx(buoyant, rel=2e-3)
    assert -plane.force[0] / 0.4 == pytest.approx(MU * buoyant, rel=0.02)


@pytest.mark.parametrize("nmd", [False, True])
def test_momentum_of_soil_and_water_is_that_of_gravity_and_contact(nmd):
    """A block that falls on an incline, from which it slides; no water leaves it, with its momentum."""
    mesh = box([12, 10], [1.2, 1.0], body=((0.45, 0.55), (0.75, 0.85)))
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=2e6, poisson=0.3, cohesion=2e3, friction_angle=30.0))
    model.seed(density=DENSITY, per_cell=6, cell_tag=1)
    incline = model.add_contact(mpm.Plane((0.6, 0.35), normal=(0.3, 1.0)), friction=MU)
    model.add_water(porosity=POROSITY, conductivity=1e-12, modulus=2.2e7)
    model.set_gravity((0.0, -9.81))
    momenta, mass = [], model.report().mass
    for _ in model.explicit(0.25, every=0.05, nmd=nmd):
        p = model.particles
        momenta.append(
            p.mass @ p.velocity + p.water_mass @ p.water_velocity + incline.impulse - (0, -9.81 * mass * model.time)
        )
    assert incline.impulse[1] < -10
    assert np.abs(momenta).max() < 1e-9 * 9.81 * mass * model.time
