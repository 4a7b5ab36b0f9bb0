"""Mass, momentum and energy of bodies that nothing holds."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, run, strain_energy
from implicit_cases import slope

import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=200e3, poisson=0.3)
SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.3, cohesion=1e3, friction_angle=25.0)
DENSITY = 2000.0
SCHEMES = [{}, {"pic": 0.1}, {"nmd": True}, {"stress_update": mpm.StressUpdate.FIRST}]


def free_body(dim, law, speed, mean=0.0):
    """A block in the middle of an irregular mesh with random velocities, so fast that particles change their cells."""
    cells = {2: 8, 3: 6}[dim]
    body = (np.full(dim, 0.3), np.full(dim, 0.7))
    model = mpm.Model(box([cells] * dim, shake=0.15, body=body), law)
    model.seed(density=DENSITY, per_cell={2: 3, 3: 4}[dim], cell_tag=1)
    velocity = np.random.default_rng(1).uniform(-speed, speed, model.particles.position.shape) + mean
    model.particles.set("velocity", velocity)
    return model


def change_over_1000_steps(model, **scheme):
    """Relative change of mass and of momentum."""
    start = model.report()
    size = np.sum(model.particles.mass[:, None] * np.abs(model.particles.velocity), axis=0)
    dt = 0.2 * model.critical_time_step()
    report = run(model, 1000 * dt, dt=dt, **scheme)
    assert report.steps == 1000
    momentum = np.abs(np.subtract(report.momentum, start.momentum)) / size
    return abs(report.mass / start.mass - 1), momentum.max()


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("law", [ELASTIC, SOIL], ids=["elastic", "Mohr-Coulomb"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=["MUSL", "PIC fraction", "NMD", "USF"])
def test_mass_and_momentum_of_a_free_body_stay(dim, law, scheme):
    model = free_body(dim, law, speed=0.2, mean=0.05)
    cells = by_id(model, "cell")
    mass, momentum = change_over_1000_steps(model, **scheme)
    assert np.mean(by_id(model, "cell") != cells) > 0.05
    assert np.any(model.particles.plastic_strain > 0) == (law is SOIL)
    assert mass < 1e-12 and momentum < 1e-12


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("law", [ELASTIC, SOIL], ids=["elastic", "Mohr-Coulomb"])
def test_mass_and_momentum_stay_with_stresses_updated_last(dim, law):
    # Slow enough to stay in its cells: where a node carries little mass, USL strains with f_int / m_i and blows up.
    model = free_body(dim, law, speed=2e-3)
    mass, momentum = change_over_1000_steps(model, stress_update=mpm.StressUpdate.LAST, energy_limit=None)
    assert mass < 1e-12 and momentum < 1e-12


def vibrating_block(dim, law, speed):
    """A free block that breathes: v = speed * sin(pi (x - 1/2)) along each axis."""
    model = mpm.Model(box([4] * dim), law)
    model.seed(density=DENSITY, per_cell={2: 6, 3: 10}[dim])
    model.particles.set("velocity", speed * np.sin(np.pi * (model.particles.position - 0.5)))
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_kinetic_and_strain_energy_of_an_elastic_block_exchange(dim):
    model = vibrating_block(dim, ELASTIC, speed=1e-3)
    energy = model.report().kinetic_energy
    strain_fraction = []
    # Velocities are half a step behind stresses: the sum swings by omega dt / 2, so the step is short.
    for report in model.explicit(0.4, dt=0.02 * model.critical_time_step(), every=0.01):
        strain = strain_energy(model, ELASTIC.young, ELASTIC.poisson)
        strain_fraction.append(strain / energy)
        assert report.kinetic_energy + strain == pytest.approx(energy, rel=0.01)
    assert min(strain_fraction) < 0.2 and max(strain_fraction) > 0.8  # it goes to and fro
    assert report.internal_work == pytest.approx(strain, abs=0.01 * energy)


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_work_is_the_change_of_kinetic_energy(dim, damping):
    # MUSL and FLIP: sum m_p |v_p|^2 / 2 grows by sum_i f_i . (v_i before + v_i after) dt / 2 to round-off, also where
    # particles cross cells.
    model = free_body(dim, SOIL, speed=0.2)
    model.set_gravity([0.1] * dim)
    start = model.report()
    report = run(model, 0.5, damping=damping)
    work = report.external_work - report.internal_work - report.damping_work + report.support_work
    scale = start.kinetic_energy + abs(report.external_work) + abs(report.internal_work)
    assert report.kinetic_energy - start.kinetic_energy == pytest.approx(work, abs=1e-12 * scale)
    assert abs(report.support_work) < 1e-12 * scale
    assert (report.damping_work > 0) == (damping > 0)


def test_a_slope_at_rest_is_not_taken_for_one_that_loses_particles():
    # Each report compares the momenta of cells and particles. Those of a body that PIC has brought to rest are the round-off of
    # forces on it, and differ.
    model = slope()
    for report in model.explicit(50.0, every=1.0, damping=0.75, pic=0.1, integration=mpm.Integration.MIXED):
        pass
    assert report.kinetic_energy < 1e-15 * report.external_work
    assert np.abs(model.particles.velocity).max() < 1e-9
