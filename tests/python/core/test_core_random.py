"""Models drawn at random: meshes, clouds of particles, materials and options. Nothing may crash, and sums must hold."""

import numpy as np
import pytest
from core_cases import DIMS, by_id
from hypothesis import given, settings
from hypothesis import strategies as st
from test_core_search import delaunay_mesh

import mpm_core as mpm

FEW = settings(max_examples=40, deadline=None, derandomize=True)


@st.composite
def laws(draw):
    young, poisson = 10 ** draw(st.floats(4, 8)), draw(st.floats(-0.2, 0.495))
    if draw(st.booleans()):
        return mpm.LinearElastic(young=young, poisson=poisson)
    friction = draw(st.floats(0, 50))
    return mpm.MohrCoulomb(
        young=young, poisson=poisson, cohesion=10 ** draw(st.floats(1, 5)), friction_angle=friction,
        dilation_angle=friction * draw(st.floats(0, 1)),
    )  # fmt: skip


@st.composite
def models(draw):
    """A model on Delaunay's mesh of random points, with a cloud of particles of any size at any place in it."""
    dim, seed = draw(st.sampled_from(DIMS)), draw(st.integers(0, 10**6))
    mesh = delaunay_mesh(dim, seed, draw(st.sampled_from([1.0, 0.1, 30.0])))
    materials = draw(st.lists(laws(), min_size=1, max_size=3))
    model = mpm.Model(mesh, materials)
    random = np.random.default_rng(seed)
    points = random.uniform(mesh.points.min(axis=0), mesh.points.max(axis=0), (draw(st.integers(1, 60)), dim))
    points = points[mesh.cells_of(points) >= 0]
    if len(points) == 0:
        points = mesh.points[mesh.cells[:1]].mean(axis=1)
    for k in range(len(materials)):
        share = points[k :: len(materials)]
        if len(share):
            volumes = 10 ** random.uniform(-8, 0, len(share))
            model.seed_points(share, volumes, density=10 ** draw(st.floats(-3, 4)), material=k)
    model.particles.set("velocity", random.normal(0, 1e-3, (len(model.particles), dim)))
    return model


def momentum(model):
    return model.particles.mass @ model.particles.velocity


@FEW
@given(model=models(), pic=st.sampled_from([0.0, 0.3, 1.0]), nmd=st.booleans(),
       update=st.sampled_from([mpm.StressUpdate.FIRST, mpm.StressUpdate.LAST, mpm.StressUpdate.MODIFIED_LAST]))  # fmt: skip
def test_mass_and_momentum_hold_whatever_the_model_is(model, pic, nmd, update):
    # Without supports and loads nothing from outside acts, and shape functions add up to one.
    before, mass = momentum(model), model.particles.mass.sum()
    scale = model.particles.mass @ np.linalg.norm(model.particles.velocity, axis=1)
    dt = 0.1 * model.critical_time_step()
    reports = list(model.explicit(20 * dt, dt=dt, pic=pic, nmd=nmd, stress_update=update))
    assert reports[-1].mass == pytest.approx(mass, rel=1e-12) and reports[-1].steps == 20
    speeds = np.linalg.norm(model.particles.velocity, axis=1)
    assert np.isfinite(speeds).all()
    np.testing.assert_allclose(momentum(model), before, rtol=0, atol=1e-9 * max(scale, model.particles.mass @ speeds))
    assert (np.asarray(model.particles.volume) > 0).all()


@FEW
@given(model=models(), weight=st.floats(-3, 6))
def test_the_impulse_of_gravity_is_the_change_of_momentum(model, weight):
    gravity = np.zeros(model.mesh.dim)
    gravity[-1] = -(10**weight)
    before, mass = momentum(model), model.particles.mass.sum()
    dt = 0.1 * model.critical_time_step()
    model.set_gravity(gravity)
    try:
        list(model.explicit(5 * dt, dt=dt))
    except mpm.RunError as error:
        assert "left the background mesh" in str(error)
        return
    scale = np.abs(before).max() + mass * 10**weight * 5 * dt
    np.testing.assert_allclose(momentum(model), before + mass * gravity * 5 * dt, rtol=0, atol=1e-8 * scale)


@FEW
@given(model=models(), steps=st.integers(1, 40))
def test_a_checkpoint_of_any_model_comes_back(tmp_path_factory, model, steps):
    path = tmp_path_factory.mktemp("random") / "state.h5"
    dt = 0.1 * model.critical_time_step()
    list(model.explicit(steps * dt, dt=dt, energy_limit=None))
    model.save(path)
    other = mpm.Model(model.mesh, model.laws)
    other.restore(path)
    for each in (model, other):
        list(each.explicit(2 * steps * dt, dt=dt, energy_limit=None))
    for name in ("id", "position", "velocity", "stress", "state", "volume"):
        np.testing.assert_array_equal(by_id(other, name), by_id(model, name))
