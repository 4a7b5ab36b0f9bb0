"""Resting cells: finite elements whose nodes cannot tell them from the particles that they turn into."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, moduli, rollers, run

import mpm_core as mpm

YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
ELASTIC = mpm.LinearElastic(young=YOUNG, poisson=POISSON)
PER_CELL = {2: 10, 3: 8}
GEOMETRIES = [mpm.Geometry.PLANE_STRAIN, mpm.Geometry.AXISYMMETRIC, mpm.Geometry.SOLID]
FIELDS = ("position", "velocity", "stress", "volume", "mass", "displacement", "deviatoric_strain", "state")


def interpolated(model, nodal):
    """Values of a nodal vector field, linear in each cell, at the particles."""
    mesh, particles = model.mesh, model.particles
    corners = mesh.points[mesh.cells[particles.cell]]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    inner = np.linalg.solve(edges, (particles.position - corners[:, 0])[..., None])[..., 0]
    weights = np.column_stack([1 - inner.sum(axis=1), inner])
    return np.einsum("pk,pki->pi", weights, nodal[mesh.cells[particles.cell]])


def nodal_random(model, size, seed=1):
    return size * np.random.default_rng(seed).standard_normal(model.mesh.points.shape)


def shaken(geometry, law=ELASTIC, *, rest=True):
    """A free block of uneven cells in motion, with stresses of its own."""
    dim = 3 if geometry == mpm.Geometry.SOLID else 2
    model = mpm.Model(box((4,) * dim, shake=0.2, diagonals="alternating"), law, geometry=geometry)
    if geometry == mpm.Geometry.AXISYMMETRIC:
        model.roller(1, (1, 0))  # the axis
    model.seed(density=DENSITY, per_cell=PER_CELL[dim])
    model.particles.set("velocity", interpolated(model, nodal_random(model, 0.01)))
    by_cell = np.random.default_rng(2).standard_normal((len(model.mesh.cells), model.particles.stress.shape[1]))
    model.particles.set("stress", 1e2 * by_cell[model.particles.cell])
    if rest:
        assert model.rest() == len(model.mesh.cells) == len(model.particles)
    return model


def nodal_sums(model):
    model.particles.set("velocity", model.particles.velocity)  # moments of cells are summed anew
    model.out_of_balance()
    mass = model.nodal("mass")
    return mass, mass[:, None] * model.nodal("velocity"), model.nodal("internal_force")


def require_same_sums(one, other, tolerance=1e-13):
    for ours, theirs in zip(one, other, strict=True):
        assert np.abs(theirs).max() > 0
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=tolerance * np.abs(theirs).max())


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_conversion_in_motion_changes_neither_nodes_nor_energy(geometry):
    # Nodal sums are linear in the moments of a cell, and those of the rule's points are the row's.
    model = shaken(geometry)
    run(model, 0.01, conversion=None)
    before, energy = nodal_sums(model), model.report()
    assert model.convert() == 0 and not model.particles.is_resting.any()
    assert len(model.particles) == PER_CELL[model.mesh.dim] * len(model.mesh.cells)
    require_same_sums(nodal_sums(model), before)
    after = model.report()
    for name in ("mass", "kinetic_energy", "stored_energy", "momentum"):
        assert getattr(after, name) == pytest.approx(getattr(energy, name), rel=1e-13, abs=1e-13 * energy.mass)


@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_rest_and_conversion_give_back_the_particles(geometry):
    at_rest, particles = shaken(geometry), shaken(geometry, rest=False)
    require_same_sums(nodal_sums(at_rest), nodal_sums(particles))
    at_rest.convert()
    np.testing.assert_array_equal(np.sort(at_rest.particles.id), np.sort(particles.particles.id))
    for name in FIELDS:
        values = by_id(particles, name)
        np.testing.assert_allclose(by_id(at_rest, name), values, rtol=1e-12, atol=1e-13 * abs(values).max(initial=1))


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"nmd": True},
        {"integration": mpm.Integration.MIXED},
        {"pic": 0.01},
        {"stress_update": mpm.StressUpdate.FIRST},
        {"stress_update": mpm.StressUpdate.LAST},
    ],
    ids=str,
)
@pytest.mark.parametrize("geometry", GEOMETRIES)
def test_converted_cells_go_on_as_particles(geometry, options):
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=150.0, friction_angle=20.0)
    model = shaken(geometry, law)
    random = np.random.default_rng(len(options) + sum(map(ord, str(options))))
    for _ in range(3):  # a random part of the cells at a random time
        run(model, model.time + 5e-5 * int(random.integers(1, 30)), dt=5e-5, conversion=None, **options)
        model.convert(where=random.random(len(model.mesh.cells)) < 0.4)
    model.convert()
    particles = mpm.Model(model.mesh, law, geometry=geometry)
    if geometry == mpm.Geometry.AXISYMMETRIC:
        particles.roller(1, (1, 0))
    particles.seed(density=DENSITY, per_cell=PER_CELL[model.mesh.dim])
    particles.place(by_id(model, "position")[np.argsort(np.argsort(particles.particles.id))])
    order = np.argsort(np.argsort(particles.particles.id))
    for name in ("velocity", "stress", "volume", "mass", "initial_position", "deviatoric_strain", "state"):
        particles.particles.set(name, by_id(model, name)[order])
    particles._core.time = model.time
    for each in (model, particles):
        run(each, model.time if each is particles else each.time + 40 * 5e-5, dt=5e-5, energy_limit=None, **options)
    for name in FIELDS:
        values = by_id(particles, name)
        np.testing.assert_allclose(by_id(model, name), values, atol=1e-10 * abs(values).max())


def strain_displacement(mesh):
    """Gradients of the shape functions (cells, D+1, D) and volumes of the cells."""
    corners = mesh.points[mesh.cells]
    edges = corners[:, 1:] - corners[:, :1]
    inner = np.swapaxes(np.linalg.inv(edges), 1, 2)
    return np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1), mesh.cell_volumes


@pytest.mark.parametrize("dim", DIMS)
def test_a_resting_cell_is_a_linear_finite_element(dim):
    model = mpm.Model(box((3,) * dim, shake=0.2), ELASTIC)
    model.seed(density=DENSITY, per_cell=PER_CELL[dim])
    model.particles.set("velocity", interpolated(model, nodal_random(model, 1e-6)))
    model.rest()
    report = run(model, 1e-4, dt=1e-4)
    gradient, volume = strain_displacement(model.mesh)
    moved = 1e-4 * model.nodal("velocity")[model.mesh.cells]  # (cells, D+1, D)
    strain = np.einsum("cki,ckj->cij", moved, gradient)
    strain = 0.5 * (strain + np.swapaxes(strain, 1, 2))
    lame, shear, _ = moduli(YOUNG, POISSON)
    stress = lame * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(dim) + 2 * shear * strain
    force = np.zeros_like(model.mesh.points)
    for vertex in range(dim + 1):
        np.add.at(force, model.mesh.cells[:, vertex], np.einsum("c,cij,cj->ci", volume, stress, gradient[:, vertex]))
    model.out_of_balance()
    np.testing.assert_allclose(model.nodal("internal_force"), force, atol=1e-8 * np.abs(force).max())
    assert report.resting_cells == len(model.mesh.cells) and report.converted_cells == 0


def test_free_vibration_at_rest_keeps_its_energy_and_its_period():
    # A bar between rollers, c = sqrt(M / rho), first mode of a fixed and a free end: the period is 4 L / c.
    wave = np.sqrt(moduli(YOUNG, POISSON)[2] / DENSITY)
    periods, errors = 20, []
    for count in (8, 16):
        model = mpm.Model(box((count, 1), (1.0, 1.0 / count), diagonals="alternating"), ELASTIC)
        model.seed(density=DENSITY)
        shape = np.sin(0.5 * np.pi * model.mesh.points[:, :1]) * [1e-6, 0.0]
        model.particles.set("velocity", interpolated(model, shape))
        rollers(model, axes=[1])
        model.fix(1)
        model.rest()
        start = model.report()
        end = run(model, periods * 4 / wave, conversion=None)
        assert abs(end.unexplained_energy) < 1e-8 * start.kinetic_energy
        # The phase by which the motion is behind, of the velocity and the stress at the end
        mean = np.average(model.particles.velocity[:, 0], weights=model.particles.mass)
        errors.append(1 - mean / np.average(interpolated(model, shape)[:, 0], weights=model.particles.mass))
    assert 0 < errors[1] < 0.1 and errors[0] / errors[1] == pytest.approx(16, rel=0.25)  # 1 - cos(phase), phase ~ h^2


@pytest.mark.parametrize("rests", [None, lambda x: x[:, 0] > 0.5], ids=["all", "half"])
def test_a_bar_vibrates_a_thousand_periods_and_keeps_its_energy(rests):
    # Velocities are half a step away from stresses, so that the sum of their energies swings by w dt / 2 of itself.
    wave, amplitude = np.sqrt(moduli(YOUNG, POISSON)[2] / DENSITY), 1e-3
    model = mpm.Model(box((8, 1), (1.0, 1 / 8), diagonals="alternating"), ELASTIC)
    model.seed(density=DENSITY)
    shape = np.sin(0.5 * np.pi * model.mesh.points[:, :1]) * [amplitude, 0.0]
    model.particles.set("velocity", interpolated(model, shape))
    rollers(model, axes=[1])
    model.fix(1)
    model.rest(where=rests)
    start, period = model.report().kinetic_energy, 4 / wave
    for report in model.explicit(1000 * period, every=100.03 * period, conversion=None):
        swing = np.pi * report.dt / period
        assert abs((report.kinetic_energy + report.stored_energy) / start - 1) < 1.05 * swing < 0.04
        assert abs(report.unexplained_energy) < 1e-6 * start


def pulse(at_rest, amplitude=1e-5):
    """A compression pulse 20 cells long runs along a bar whose right half rests, all of it, or nothing; velocities at the end."""
    count = 100
    model = mpm.Model(box((count, 1), (1.0, 1.0 / count), diagonals="alternating"), ELASTIC)
    model.seed(density=DENSITY)
    wave, modulus = np.sqrt(moduli(YOUNG, POISSON)[2] / DENSITY), moduli(YOUNG, POISSON)[2]

    def shape(x):
        return np.where(np.abs(x - 0.25) < 0.1, np.cos(5 * np.pi * (x - 0.25)) ** 2, 0.0)

    model.particles.set("velocity", interpolated(model, amplitude * shape(model.mesh.points[:, :1]) * [1.0, 0.0]))
    strain = -amplitude / wave * shape(model.particles.position[:, 0])
    lame = moduli(YOUNG, POISSON)[0]
    cells = np.bincount(model.particles.cell, strain) / np.bincount(model.particles.cell)
    model.particles.set("stress", cells[model.particles.cell, None] * [modulus, lame, lame, 0.0])
    rollers(model, axes=[1])
    if at_rest is not None:
        model.rest(where=at_rest)
    run(model, 0.5 / wave, conversion=None)
    model.convert()
    return by_id(model, "velocity")[:, 0], by_id(model, "position")[:, 0], amplitude


def test_a_pulse_passes_from_particles_to_resting_cells_without_reflection():
    half, x, amplitude = pulse(lambda x: x[:, 0] > 0.5)
    everywhere, _, _ = pulse(None)
    assert everywhere[(x > 0.65) & (x < 0.85)].max() > 0.9 * amplitude  # it has arrived
    back = x < 0.5
    assert abs(half - everywhere).max() < 1e-3 * amplitude
    assert abs(half - everywhere)[back].max() < 1e-3 * amplitude


def neighbours(mesh, cells, layers):
    """Whether each cell is among some cells or within so many layers of cells around them, that share a node."""
    near = np.zeros(len(mesh.cells), dtype=bool)
    near[cells] = True
    for _ in range(layers):
        near = np.isin(mesh.cells, mesh.cells[near]).any(axis=1)
    return near


def resting_block(law, count=12):
    model = mpm.Model(box((count, count), diagonals="alternating"), law)
    model.seed(density=DENSITY, per_cell=3)
    rollers(model)
    model.rest()
    return model


@pytest.mark.parametrize("layers", [1, 2, 3])
def test_cells_around_one_that_yields_turn_into_particles(layers):
    model = resting_block(mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=20.0))
    cell, state = 140, model.particles.state.copy()
    state[model.particles.cell == cell, 0] = 0.0401
    model.particles.set("state", state)
    report = run(model, 1e-5, conversion=mpm.Conversion(plastic_strain=0.0402, layers=layers))
    assert report.converted_cells == 0
    report = run(model, 2e-5, conversion=mpm.Conversion(plastic_strain=0.04, layers=layers))
    expected = neighbours(model.mesh, [cell], layers)
    np.testing.assert_array_equal(model.resting_cells, ~expected)
    assert report.converted_cells == expected.sum() and report.resting_cells == (~expected).sum()
    assert report.particles == report.resting_cells + 3 * report.converted_cells
    # A particle that has yielded goes on to do so: nothing more to convert.
    assert (
        run(model, 1e-4, conversion=mpm.Conversion(plastic_strain=0.04, layers=layers)).converted_cells
        == expected.sum()
    )


def test_a_cell_that_moves_too_far_turns_into_particles_and_keeps_its_displacement():
    # Free flight at 1 m/s: the displacement is the same everywhere, so that all cells turn at once.
    model = mpm.Model(box((8, 8), body=((0.0, 0.0), (0.5, 1.0))), ELASTIC)
    model.seed(density=DENSITY, per_cell=3, cell_tag=1)
    model.rest()
    model.particles.set("velocity", np.tile([1.0, 0.0], (len(model.particles), 1)))
    model.particles.set("velocity_gradient", np.zeros((len(model.particles), 4)))
    size, conversion = 1 / 8, mpm.Conversion(displacement=0.1)
    assert run(model, 0.099 * size, conversion=conversion, dt=1e-4).converted_cells == 0
    report = run(model, 0.15 * size, conversion=conversion, dt=1e-4)
    assert report.resting_cells == 0 and report.converted_cells == 64
    flown = np.tile([0.15 * size, 0.0], (len(model.particles), 1))
    np.testing.assert_allclose(model.particles.displacement, flown, rtol=0, atol=1e-12)
    assert report.momentum[0] == pytest.approx(report.mass * 1.0, rel=1e-12)


def test_a_cell_that_a_particle_enters_turns_into_particles_and_mass_and_momentum_stay():
    model = mpm.Model(box((16, 4), (4.0, 1.0), diagonals="alternating"), ELASTIC)
    model.seed(density=DENSITY, per_cell=10)
    model.rest(where=lambda x: x[:, 0] > 2.0)
    still = model.remove((model.particles.position[:, 0] > 1.0) & ~model.particles.is_resting)
    assert still == 10 * 2 * 4 * 4
    velocity = np.where(model.particles.is_resting, 0.0, 4.0)[:, None] * [1.0, 0.0]
    model.particles.set("velocity", velocity)
    model.particles.set(
        "mass", np.where(model.particles.is_resting, 1.0, 10.0) * model.particles.mass
    )  # it is not stopped
    start = model.report()
    rollers(model, axes=[1])
    reports = list(model.explicit(0.32, every=0.04, energy_limit=None, conversion=None))
    assert reports[-1].converted_cells > 4 and reports[-1].resting_cells > 0
    for report in reports:
        assert report.mass == pytest.approx(start.mass, rel=1e-12)
        assert report.momentum[0] == pytest.approx(start.momentum[0], rel=1e-12)
        assert report.particles == report.resting_cells + 10 * (4 * 4 * 2 + report.converted_cells)
    assert not model.resting_cells[model.particles.cell[~model.particles.is_resting]].any()


def test_particles_fly_through_empty_cells_while_others_rest():
    # Cells that particles leave and enter come and go from step to step, also as many at once: none may be forgotten.
    model = mpm.Model(box((16, 8), (4.0, 2.0), diagonals="alternating", body=((0.0, 0.0), (1.0, 1.0))), ELASTIC)
    model.seed(density=DENSITY, per_cell=3, cell_tag=1)
    model.rest(where=lambda x: x[:, 1] < 0.5)
    flies = ~model.particles.is_resting & (model.particles.position[:, 1] > 0.75)
    model.remove(~flies & ~model.particles.is_resting)
    flies = ~model.particles.is_resting
    velocity = np.where(flies, 1.0, 0.0)[:, None] * [1.0, 0.3]
    model.particles.set("velocity", velocity)
    for report in model.explicit(1.2, every=0.4, conversion=None, dt=2e-3):
        model.particles.set("velocity", model.particles.velocity)  # sums of all cells anew, sorted
        v = model.particles.velocity[~model.particles.is_resting]
        np.testing.assert_allclose(v, np.tile([1.0, 0.3], (len(v), 1)), rtol=0, atol=1e-10)
        assert report.converted_cells == 0 and report.resting_cells > 0


def test_a_run_goes_on_from_a_checkpoint_with_both_kinds(tmp_path):
    law = mpm.MohrCoulomb(young=YOUNG, poisson=POISSON, cohesion=1e3, friction_angle=20.0)
    ways = []
    for way in ("whole", "resumed"):
        model = mpm.Model(box((10, 10), body=((0.0, 0.0), (0.5, 0.8))), law)
        model.seed(density=DENSITY, per_cell=10, cell_tag=1)
        model.rest()
        rollers(model)
        model.set_gravity((0.0, -9.81))
        run(model, 0.09, energy_limit=None)
        assert 0 < model.report().converted_cells and model.resting_cells.any()
        if way == "resumed":
            model.save(tmp_path / "both.h5")
            model = mpm.Model(model.mesh, law)
            model.restore(tmp_path / "both.h5")
        ways.append((run(model, 0.14, energy_limit=None), model))
    assert ways[0][0] == ways[1][0]
    for name in (*FIELDS, "velocity_gradient", "displacement_gradient", "resting"):
        np.testing.assert_array_equal(getattr(ways[0][1].particles, name), getattr(ways[1][1].particles, name))


def moved(model):
    model.place(model.particles.position + 1e-3)


def two_fields():
    return mpm.Model(box((2, 2)), [ELASTIC, ELASTIC], velocity_fields=[0, 1])


@pytest.mark.parametrize(
    "model, before, message",
    [
        (None, moved, "is not at its place in the cell"),
        (None, lambda model: model.remove(model.particles.id == 3), "is one of 2 in its cell"),
        (None, lambda model: model.traction(1, (1.0, 0.0)), "carries a traction"),
        (None, lambda model: model.particles.set("mass", 1.0 + np.arange(24.0)), "has another mass"),
        (two_fields, lambda model: None, "a model of 2 velocity fields, expected one"),
    ],
)  # fmt: skip
def test_cells_that_cannot_rest_are_refused(model, before, message):
    made = mpm.Model(box((2, 2)), ELASTIC) if model is None else model()
    made.seed(density=DENSITY, per_cell=3)
    before(made)
    count = len(made.particles)
    with pytest.raises(mpm.InputError, match=message):
        made.rest()
    assert len(made.particles) == count and not made.particles.is_resting.any()


@pytest.mark.parametrize(
    "use, message",
    [
        (moved, r"place\(\) does not support resting cells, of which the model has 8"),
        (lambda model: model.traction(1, (1.0, 0.0)), "facets of resting cells"),
        (
            lambda model: model.particles.set("traction", np.eye(8, 2)),
            "traction would load 2 resting cells, expected particles to carry it: .*by Model.convert",
        ),
        (
            lambda model: model.load_surface(mpm.Box((0.0, 1.0), (1.0, 1.5)), pressure=1e4),
            r"surface Box.* would load [1-9] resting cells, expected particles",
        ),
        (
            lambda model: list(model.explicit(1.0, integration=mpm.Integration.DUAL_DOMAIN)),
            "integration DUAL_DOMAIN does not support",
        ),
        (lambda model: list(model.explicit(1.0, conversion=0.1)), "conversion is 0.1, expected a Conversion or None"),
        (lambda model: model.rest(where=[True]), r"where has shape \(1,\) and dtype bool, expected \(8,\) of bool"),
        (lambda model: model.seed_points([[0.3, 0.2]], [0.01], density=1.0) and model.report(), "is in a resting cell"),
        (lambda model: mpm.Conversion(layers=0), "layers is 0, expected a whole number from 1"),
        (lambda model: mpm.Conversion(displacement=-0.1), "displacement is -0.1"),
    ],
)  # fmt: skip
def test_what_resting_cells_do_not_know_is_refused(use, message):
    model = mpm.Model(box((2, 2)), ELASTIC)
    model.seed(density=DENSITY, per_cell=3)
    assert model.rest() == 8
    with pytest.raises(mpm.InputError, match=message):
        use(model)
