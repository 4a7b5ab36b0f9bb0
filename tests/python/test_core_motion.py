"""Motion without deformation: falling and turning bodies."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id, run

import mpm_core as mpm

ELASTIC = mpm.LinearElastic(young=1e6, poisson=0.3)
DENSITY = 2000.0


def falling_body(dim):
    body = ([0.3] * (dim - 1) + [0.6], [0.7] * (dim - 1) + [0.9])
    model = mpm.Model(box([6] * dim, shake=0.15, body=body), ELASTIC)
    model.seed(density=DENSITY, per_cell={2: 6, 3: 4}[dim], cell_tag=1)
    return model


@pytest.mark.parametrize("dim", DIMS)
@pytest.mark.parametrize(
    "scheme", [{}, {"nmd": True}, {"pic": 0.2}, {"stress_update": mpm.StressUpdate.FIRST}],
    ids=["MUSL", "NMD", "PIC share", "USF"],
)
def test_free_fall_is_exact(dim, scheme):
    model = falling_body(dim)
    gravity = np.array([0.5, -3.0] if dim == 2 else [0.5, 0.2, -3.0])
    model.set_gravity(gravity)
    start = by_id(model, "position")
    steps, dt = 200, 0.4 / 200
    report = run(model, 0.4, dt=dt, **scheme)
    assert report.steps == steps
    assert np.allclose(model.particles.velocity, gravity * 0.4, rtol=0, atol=1e-12)
    # x_n = x_0 + dt sum_{k=1}^{n} (k dt g): velocities first, then positions with them
    fall = gravity * dt**2 * steps * (steps + 1) / 2
    assert np.allclose(by_id(model, "position"), start + fall, rtol=0, atol=1e-12)
    assert np.allclose(by_id(model, "displacement"), fall, rtol=0, atol=1e-12)
    assert np.abs(model.particles.stress).max() < 1e-9 * ELASTIC.young


@pytest.mark.parametrize("dim", DIMS)
def test_gravity_rises_linearly_over_its_ramp(dim):
    model = falling_body(dim)
    gravity = np.array([0.0] * (dim - 1) + [-3.0])
    model.set_gravity(gravity, ramp=0.2)
    ramp_steps, dt = 100, 0.002
    run(model, 0.2, dt=dt)
    # each step takes the gravity at its start: g dt sum_{k=0}^{n-1} k / n
    ramped = gravity * dt * (ramp_steps - 1) / 2
    assert np.allclose(model.particles.velocity, ramped, rtol=0, atol=1e-12)
    run(model, 0.3, dt=dt)
    assert np.allclose(model.particles.velocity, ramped + gravity * 0.1, rtol=0, atol=1e-12)
