"""Affine transfer: what nodes get back of the velocities that they gave, and what becomes of energy and momentum."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, rollers, run

import mpm_core as mpm

FLIP, AFFINE = mpm.Transfer.FLIP, mpm.Transfer.AFFINE
ELASTIC = mpm.LinearElastic(young=200e3, poisson=0.3)
PER_CELL = {2: 6, 3: 10}


def thrown_block(dim, transfer_of_velocities):
    """A block in the middle of a larger mesh, whose particles have the velocities that a function gives their positions."""
    model = mpm.Model(box([8] * dim, [2.0] * dim, body=([0.5] * dim, [1.0] * dim), shake=0.1), ELASTIC)
    model.seed(density=2000.0, per_cell=PER_CELL[dim], cell_tag=1)
    model.particles.set("velocity", transfer_of_velocities(model.particles.position))
    return model


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("transfer", [FLIP, AFFINE])
def test_nodes_get_an_affine_velocity_back(dim, transfer):
    # sum m_p N_i (v_p + C (x_i - x_p)) = m_i (A x_i + b) where v_p = A x_p + b and C = A. By FLIP a node gets the mean of the
    # particles around it, which at the surface of the block lie on one side.
    gradient, value = np.random.default_rng(1).normal(size=(dim, dim)), np.arange(1.0, dim + 1)
    model = thrown_block(dim, lambda x: x @ gradient.T + value)
    run(model, 1e-10, dt=1e-10, transfer=transfer)
    has_mass = model.nodal("mass") > 0
    expected = model.mesh.points @ gradient.T + value
    error = np.abs(model.nodal("velocity") - expected)[has_mass].max()
    assert error < 1e-9 if transfer == AFFINE else error > 0.05


@pytest.mark.parametrize("dim", DIMS)
def test_a_particle_alone_in_its_cell_begins_without_a_gradient(dim):
    # The velocities of one particle tell nothing of their gradient: its second moment is round-off.
    mesh = box([8] * dim, [0.8] * dim)
    points = 0.025 * (np.indices([32] * dim).reshape(dim, -1).T + 0.5)  # its spread may be below zero
    points = points[np.unique(mesh.cells_of(points), return_index=True)[1]]
    model = mpm.Model(mesh, ELASTIC)
    model.seed_points(points, np.random.default_rng(5).uniform(0.5e-5, 1e-5, len(points)), density=2000.0)
    velocity = np.tile(np.arange(1.0, dim + 1), (len(points), 1))
    model.particles.set("velocity", velocity)
    run(model, 1e-10, dt=1e-10, transfer=AFFINE)
    np.testing.assert_allclose(model.particles.velocity, velocity, rtol=1e-9)
    assert np.abs(model.particles.velocity_gradient).max() < 1e-6


def vibrating_bar(courant, **options):
    """Energy that is left, over that at the start, of the first longitudinal mode after five periods."""
    model = mpm.Model(box([16, 2], [1.0, 0.125]), mpm.LinearElastic(young=200e3, poisson=0.0))
    model.seed(density=2000.0, per_cell=6)
    model.roller(1, normal=(1, 0))
    model.roller(2, normal=(1, 0))
    model.particles.set("velocity", 1e-3 * np.sin(np.pi * model.particles.position) * [1, 0])
    start = model.report().kinetic_energy
    report = run(model, 5 * 2.0 / np.sqrt(200e3 / 2000.0), courant=courant, **options)
    return (report.kinetic_energy + report.stored_energy) / start


def test_what_affine_transfer_takes_out_does_not_grow_with_the_number_of_steps():
    # No particle crosses: nodes get back what they gave, in 300 steps as in 3000. Pure PIC spreads momentum in each step.
    assert vibrating_bar(0.5, transfer=AFFINE) == pytest.approx(1, abs=0.02)
    assert vibrating_bar(0.05, transfer=AFFINE) == pytest.approx(1, abs=0.02)
    assert vibrating_bar(0.5, pic=1.0) < 0.8


def test_pic_takes_as_much_of_an_affine_transfer_as_of_flip():
    # With pic = 1 particles take the velocities of the nodes and no gradient, whichever transfer that began as.
    ends = [vibrating_bar(0.5, pic=1.0, transfer=transfer) for transfer in (FLIP, AFFINE)]
    assert ends[1] == pytest.approx(ends[0], rel=0.02)


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize(
    "scheme", [{}, {"integration": mpm.Integration.MIXED, "nmd": True}], ids=["particles", "mixed"]
)
def test_a_tumbling_block_keeps_its_momentum_and_its_energy_adds_up(dim, scheme):
    # It flies over two cells while it turns and rings; no force acts on it from outside.
    spin = np.zeros((dim, dim))
    spin[0, 1], spin[1, 0] = -1.0, 1.0
    model = thrown_block(dim, lambda x: 1.0 + (x - 0.75) @ spin.T)
    mass = model.particles.mass
    momentum = mass @ model.particles.velocity
    report = run(model, 0.5, courant=0.3, transfer=AFFINE, **scheme)
    assert np.abs(model.particles.displacement).max() > 0.4
    np.testing.assert_allclose(model.particles.mass @ model.particles.velocity, momentum, rtol=1e-12)
    assert abs(report.unexplained_fraction) < 0.01
    # Particles have no motion that nodes do not see; their energy is more by the inertia of short waves.
    assert report.nodal_kinetic_energy == pytest.approx(report.kinetic_energy, rel=0.02)


def test_a_run_goes_on_from_a_file_to_the_last_bit(tmp_path):
    first = thrown_block(2, lambda x: 1.0 + np.sin(3 * x))
    run(first, 0.1, transfer=AFFINE)
    first.save(tmp_path / "state.h5")
    second = thrown_block(2, lambda x: 0 * x)
    second.restore(tmp_path / "state.h5")
    reports = [run(model, 0.2, transfer=AFFINE) for model in (first, second)]
    for name in ("kinetic_energy", "pic_loss", "unexplained_energy"):
        assert getattr(reports[1], name) == pytest.approx(getattr(reports[0], name), abs=1e-9 * reports[0].energy_scale)
    for name in ("position", "velocity", "stress", "velocity_gradient"):
        np.testing.assert_array_equal(by_id(second, name), by_id(first, name))


@pytest.mark.parametrize("dim", DIMS)
def test_soil_moves_the_same_where_each_cell_has_particles_of_two_equal_laws(dim):
    # The particles of a cell are in several parts of memory where they have several laws, as they are where some have come from
    # another cell: all of them together say whether the cell is sparse.
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=200.0, friction_angle=25.0)
    whole = box([10] + [4] * (dim - 1), [2.5] + [1.0] * (dim - 1), shake=0.2, body=([0.0] * dim, [1.0] * dim))
    first, second = (mpm.Model(whole, [soil, soil]) for _ in range(2))
    for model in (first, second):
        model.seed(density=2000.0, per_cell=4, cell_tag=1)
        if model is second:
            model.assign(model.particles.id % 2)
        rollers(model, but=(2, 2 * dim))
        model.set_gravity([0.0] * (dim - 1) + [-9.81])
        run(model, 0.35, transfer=AFFINE, integration=mpm.Integration.MIXED)
    assert np.abs(first.particles.displacement).max() > 0.3  # a cell has 0.25
    for name in ("position", "velocity", "velocity_gradient"):
        expected = by_id(first, name)
        np.testing.assert_allclose(
            by_id(second, name), expected, rtol=0, atol=1e-7 * np.abs(expected).max(), err_msg=name
        )


def test_the_energy_of_a_block_on_supports_is_the_same_after_a_restart(tmp_path):
    # The kinetic energy of gradients is that of nodes as their supports hold them.
    def block():
        model = thrown_block(2, lambda x: 0 * x)
        model.fix(1)
        model.roller(3, (0, 1))
        return model

    first, second = block(), block()
    first.set_gravity((-3.0, -9.81))
    run(first, 0.6, transfer=AFFINE)
    first.save(tmp_path / "state.h5")
    second.restore(tmp_path / "state.h5")
    models = first, second
    reports = [[model.report() for model in models], [run(model, 0.8, transfer=AFFINE) for model in models]]
    for one, other in reports:
        for name in ("kinetic_energy", "pic_loss", "unexplained_energy"):
            assert getattr(other, name) == pytest.approx(getattr(one, name), abs=1e-9 * one.energy_scale)


def test_flip_after_an_affine_run_has_no_gradients():
    # The momentum of the nodes is that of the particles' own velocities again, as in a model that never had gradients.
    models = [thrown_block(2, lambda x: 1.0 + np.sin(3 * x)) for _ in range(2)]
    run(models[0], 1e-10, dt=1e-10, transfer=AFFINE)
    models[1].particles.set("velocity", models[0].particles.velocity[models[0].particles.find(models[1].particles.id)])
    for model in models:
        run(model, model.time + 1e-3, dt=1e-4)
    np.testing.assert_allclose(by_id(models[0], "velocity"), by_id(models[1], "velocity"), rtol=1e-9)
    assert not models[0].particles.velocity_gradient.any()


@pytest.mark.parametrize(
    "options, what",
    [
        ({"stress_update": mpm.StressUpdate.LAST}, "stress_update LAST"),
        ({"integration": mpm.Integration.DUAL_DOMAIN}, "DUAL_DOMAIN"),
        ({"reproducible": True}, "reproducible runs"),
        ({"rayleigh": mpm.Rayleigh(mass=0.1)}, "rayleigh damping"),
    ],
)
def test_what_affine_transfer_does_not_cover_is_refused_by_name(options, what):
    with pytest.raises(mpm.InputError, match=f"transfer is AFFINE.*{what}"):
        run(thrown_block(2, lambda x: x), 0.1, transfer=AFFINE, **options)


@pytest.mark.parametrize("dim", DIMS)
def test_a_particle_alone_on_a_side_of_cells_is_not_shaken_ever_more(dim):
    # Two cells share it, as it goes to and fro, and each of them moves it in a direction of its own. A gradient that it carried
    # from one to the other, where stresses do not resist it, strained it to more than twenty times the energy that it began with.
    h, speed = 0.1, 0.02
    model = mpm.Model(box([4] * dim, [4 * h] * dim, body=([0.0] * dim, [4 * h] * (dim - 1) + [2 * h])), ELASTIC)
    model.seed(density=2000.0, per_cell={2: 6, 3: 4}[dim], cell_tag=1)
    above = np.full(dim, 2 * h) + np.array([1e-8 * (1 + a) for a in range(dim - 1)] + [0.004])
    model.seed_points(above[None], [h**dim / {2: 12, 3: 24}[dim]], density=2000.0)
    alone = np.argmax(model.particles.position[:, -1])
    velocity = np.zeros((len(model.particles), dim))
    velocity[alone] = speed
    model.particles.set("velocity", velocity)
    start = 0.5 * model.particles.mass[alone] * dim * speed**2
    report = run(model, 0.5, transfer=AFFINE, energy_limit=None)
    assert report.kinetic_energy + report.stored_energy < start
    assert abs(report.unexplained_energy) < 0.05 * start


@pytest.mark.parametrize("scheme", [{}, {"integration": mpm.Integration.MIXED}], ids=["particles", "mixed"])
def test_a_spinning_disc_keeps_its_angular_momentum(scheme):
    # One turn without a force from outside. Without the spin of the particles in the sparse cells around it, it loses a third.
    radius, per_side, turn = 0.5, 36, 2 * np.pi
    grid = (np.arange(2 * per_side) + 0.5) / per_side
    points = np.stack(np.meshgrid(grid, grid), axis=-1).reshape(-1, 2)
    points = points[np.linalg.norm(points - 1.0, axis=1) < radius]
    model = mpm.Model(box([24, 24], [2.0, 2.0], diagonals="alternating"), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed_points(points, np.full(len(points), per_side**-2.0), density=1000.0)

    def arms():
        return (model.particles.position - 1.0) @ [[0, 1], [-1, 0]]

    def angular_momentum():
        return model.particles.mass @ np.einsum("pi,pi->p", arms(), model.particles.velocity)

    model.particles.set("velocity", turn * arms())
    start = angular_momentum()
    run(model, 1.0, transfer=AFFINE, energy_limit=None, **scheme)
    assert angular_momentum() == pytest.approx(start, rel=2e-3)
