"""Particles put elsewhere by anything but a step."""

import numpy as np
import pytest
from core_cases import DIMS, box, by_id

import mpm_core as mpm


def block(dim):
    """A box whose low half, along the first axis, is filled."""
    half = (np.zeros(dim), np.r_[0.5, np.ones(dim - 1)])
    model = mpm.Model(box([4] * dim, body=half), mpm.LinearElastic(young=1e5, poisson=0.3))
    model.seed(cell_tag=1, density=1000.0, per_cell=1)
    return model


@pytest.mark.parametrize("dim", DIMS)
def test_particles_keep_all_else_and_their_cells_are_found_anew(dim):
    model = block(dim)
    start = by_id(model, "position")
    rng = np.random.default_rng(1)
    model.particles.set("velocity", rng.normal(size=start.shape))
    velocity = by_id(model, "velocity")
    jump = np.r_[0.5, np.zeros(dim - 1)]
    model.place(model.particles.position + jump)
    assert np.array_equal(by_id(model, "position"), start + jump)
    assert np.allclose(by_id(model, "displacement"), jump)
    assert np.array_equal(by_id(model, "velocity"), velocity)
    assert np.array_equal(model.particles.cell, model.mesh.cells_of(model.particles.position))
    assert model.report().mass == pytest.approx(500.0)  # and the sums over cells agree with it


def test_a_position_outside_is_named_and_nothing_moves():
    model = block(2)
    start = model.particles.position
    wrong = start.copy()
    wrong[3, 0] = 1.5
    with pytest.raises(mpm.InputError, match=r"position of particle 3 is \(1.5, .*outside of the mesh"):
        model.place(wrong)
    assert np.array_equal(model.particles.position, start)
    with pytest.raises(mpm.InputError, match="position has shape"):
        model.place(start[1:])


def test_gravity_can_be_read():
    model = block(2)
    model.set_gravity((0.0, -9.81), ramp=2.0)
    assert model.gravity.tolist() == [0.0, -9.81]
