"""The order of the particles: it changes, and must not matter."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, run

import mpm_core as mpm

SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.3, cohesion=1e3, friction_angle=25.0)
FIELDS = ("position", "velocity", "stress", "volume", "mass", "deviatoric_strain", "state", "initial_position")


def sliding_block(dim, order=None):
    """A block that moves over an irregular mesh while it deforms; its particles are seeded in the given order."""
    mesh = box([8] * dim if dim == 2 else [6] * dim, shake=0.15)
    points = np.random.default_rng(3).uniform(0.2, 0.5, (300, dim))
    order = np.arange(300) if order is None else order
    model = mpm.Model(mesh, SOIL)
    model.seed_points(points[order], np.full(300, 0.3**dim / 300), density=2000.0)
    velocity = np.full((300, dim), 1.0) + np.sin(20 * points)
    model.particles.set("velocity", velocity[order][model.particles.id])
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_seeding_order_does_not_matter(dim):
    order = np.random.default_rng(4).permutation(300)
    straight, mixed = sliding_block(dim), sliding_block(dim, order)
    dt = 0.1 * straight.critical_time_step()
    for model in (straight, mixed):
        assert run(model, 0.25, dt=dt).plastic_fraction > 0
    for name in FIELDS:
        one, other = by_id(straight, name)[order], by_id(mixed, name)
        assert np.allclose(one, other, rtol=0, atol=1e-8 * np.abs(one).max()), name


@pytest.mark.parametrize("dim", DIMS)
def test_sorting_does_not_change_results(dim):
    often, seldom = sliding_block(dim), sliding_block(dim)
    dt = 0.1 * often.critical_time_step()
    for _ in often.explicit(0.24, dt=dt, every=2 * dt, integration=mpm.Integration.PARTICLES):
        often.particles.set("mass", often.particles.mass)  # what Python writes makes the next step sort anew
    for _ in seldom.explicit(0.24, dt=dt, every=2 * dt, integration=mpm.Integration.PARTICLES):
        pass
    assert often._core.sorts > 2 * seldom._core.sorts > 0
    assert np.any(np.diff(seldom.particles.cell) < 0)  # particles that changed cell are out of order
    for name in FIELDS:
        one, other = by_id(often, name), by_id(seldom, name)
        assert np.allclose(one, other, rtol=0, atol=1e-8 * np.abs(one).max()), name


@pytest.mark.parametrize("dim", DIMS)
def test_values_that_were_set_stay_with_their_particles(dim):
    model = sliding_block(dim)
    random = np.random.default_rng(5)
    model.particles.set("traction", random.random((300, dim)))
    written = {}
    for name in (*FIELDS[1:], "traction"):
        values = random.uniform(1, 2, getattr(model.particles, name).shape)
        model.particles.set(name, values)
        written[name] = values[np.argsort(model.particles.id)]
        assert np.array_equal(getattr(model.particles, name), values)
    before = model.particles.id
    kept = {name: by_id(model, name) for name in ("position", "material", "cell")}
    model.critical_time_step()  # sorts
    assert np.any(model.particles.id != before) and np.all(np.diff(model.particles.cell) >= 0)
    for name, values in (written | kept).items():
        assert np.array_equal(by_id(model, name), values), name


def test_attributes_are_copies():
    model = sliding_block(2)
    before = model.particles.position
    kept = before.copy()
    model.particles.set("initial_position", kept + 1.0)
    list(model.explicit(0.01))
    assert np.array_equal(before, kept) and not np.array_equal(model.particles.position, kept)
    assert not before.flags.writeable
