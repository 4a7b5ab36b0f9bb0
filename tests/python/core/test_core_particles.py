"""Particles seen from Python: some of them, and by their numbers."""

import numpy as np
import pytest
from core_cases import DIMS, box

import mpm_core as mpm

LAW = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=20.0)
ATTRIBUTES = [
    name for name, value in vars(mpm.Particles).items() if isinstance(value, property) and name != "is_resting"
]


def seeded(dim, rests=False):
    """Particles whose fields all differ, with a loaded side, and on the other resting cells on request."""
    model = mpm.Model(box([3] * dim), LAW)
    model.seed(density=1500.0, per_cell=4)
    model.traction(2, (1e3, 2e3, 3e3)[:dim])
    if rests:
        model.rest(where=lambda x: x[:, 0] < 0.5)
    model.add_water(porosity=0.4, conductivity=1e-4)
    model._core.split_phases()  # the water's own mass and velocity, which explicit runs give it
    rng = np.random.default_rng(5)
    for name in ("velocity", "stress", "deviatoric_strain", "state", "initial_position"):
        model.particles.set(name, rng.random(getattr(model.particles, name).shape))
    n = len(model.particles)
    for name, shape in {
        "pore_pressure": (n,),
        "pressure_gradient": (n, dim),
        "porosity": (n,),
        "conductivity": (n,),
        "saturation": (n,),
    }.items():
        model.particles.set(name, rng.random(shape))
    return model


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize("name", ATTRIBUTES)
def test_some_particles_have_the_rows_of_all(dim, name):
    particles = seeded(dim, rests=True).particles
    n, every = len(particles), getattr(particles, name)
    assert len(every) == n
    mask = np.random.default_rng(1).random(n) < 0.3
    for rows in (mask, [2, 0, 2, n - 1], np.array([5, 3], np.int32), np.arange(9, dtype=np.uint64)[::-2], []):
        some = particles[rows]
        expected = every[np.asarray(rows, dtype=None if len(rows) else int)]
        assert len(some) == len(expected)
        np.testing.assert_array_equal(getattr(some, name), expected)
        assert getattr(some, name).dtype == every.dtype
    np.testing.assert_array_equal(getattr(particles[np.repeat(mask, 2)[::2]], name), every[mask])


def test_rows_of_resting_cells_are_told_from_particles():
    model = seeded(2, rests=True)
    every = model.particles.is_resting
    assert 0 < every.sum() == model.resting_cells.sum() < len(every)
    np.testing.assert_array_equal(model.particles[[2, 0]].is_resting, every[[2, 0]])
    plain = mpm.Model(box([2, 2]), LAW)
    plain.seed(density=1500.0)
    assert not plain.particles.is_resting.any() and len(plain.particles[[1, 3]].is_resting) == 2


@pytest.mark.parametrize("dim", DIMS)
def test_copies_in_single_precision_have_the_values_of_the_attributes(dim):
    particles = seeded(dim, rests=True).particles
    copies = particles.single(*ATTRIBUTES)
    assert set(copies) == set(ATTRIBUTES)
    for name, copy in copies.items():
        whole = getattr(particles, name)
        np.testing.assert_array_equal(copy, whole if whole.dtype.kind == "i" else whole.astype(np.float32))
    assert set(particles.single()) == {"position"}
    with pytest.raises(mpm.InputError, match="particle field is 'height', which does not exist"):
        particles.single("height")


def test_some_particles_are_read_when_they_are_asked_for():
    model = seeded(2)
    some = model.particles[[3, 1]]
    model.particles.set("velocity", np.full((len(model.particles), 2), 7.0))
    assert np.all(some.velocity == 7.0)


def test_particles_are_found_by_their_numbers():
    particles = seeded(2).particles
    ids = particles.id
    wanted = [int(ids[4]), int(ids.max()) + 1, int(ids[0]), int(ids[4]), -1]
    assert particles.find(wanted).tolist() == [4, -1, 0, 4, -1]
    assert np.array_equal(particles.find(ids), np.arange(len(ids)))
    assert particles.find([]).shape == (0,)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([-1], "rows has -1, expected 0 to 71"),
        ([0, 72], "rows has 72, expected 0 to 71"),
        ([0.5], r"rows has shape \(1,\) and dtype float64, expected whole numbers"),
        (3, r"rows has shape \(\) and dtype int64"),
        ([[1, 2]], r"rows has shape \(1, 2\) and dtype int64"),
        ([True, False], r"rows has shape \(2,\), expected \(72,\)"),
        (["crest"], "rows has shape .* and dtype <U5"),
    ],
)
def test_rows_that_are_not_there_are_named(rows, words):
    particles = seeded(2).particles
    assert len(particles) == 72
    with pytest.raises(mpm.InputError, match=words):
        particles[rows]


@pytest.mark.parametrize(
    ("what", "use"),
    [
        ("set", lambda some: some.set("velocity", np.zeros((2, 2)))),
        ("single", lambda some: some.single("stress")),
        ("find", lambda some: some.find([0])),
        ("choosing rows", lambda some: some[[0]]),
    ],
)
def test_what_is_for_all_particles_says_so(what, use):
    with pytest.raises(mpm.InputError, match=f"{what} is for all particles, not for those in some rows"):
        use(seeded(2).particles[[0, 1]])


def test_rows_of_particles_that_have_gone_are_named():
    model = mpm.Model(box([2, 2]), LAW)
    model.seed(density=1500.0, per_cell=4)
    last = model.particles[[len(model.particles) - 1]]
    model.outflow(2)
    model.particles.set("velocity", np.tile([50.0, 0.0], (len(model.particles), 1)))
    list(model.explicit(until=0.05, every=0.05))
    assert len(model.particles) < 32
    with pytest.raises(mpm.InputError, match="rows has 31, expected 0 to"):
        last.position  # noqa: B018
