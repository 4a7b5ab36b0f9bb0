"""Particles put elsewhere find the rank that owns their new cell."""

import numpy as np
import pytest
from partitions import all_by_id, bands, one_does_all, scattered, spread_box

import mpm_core as mpm


def block(comm, owners_of=bands):
    mesh = spread_box((40, 4), (4.0, 0.4), comm, owners_of, body=((0.1, 0.1), (0.3, 0.3)))
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=1000.0, per_cell=3, cell_tag=1)
    return model


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
@pytest.mark.parametrize("jump", [0.05, 1.1, 3.5])
def test_however_far(comm, owners_of, jump):
    model = block(comm, owners_of)
    start = all_by_id(model)["position"]
    model.place(model.particles.position + np.array([jump, 0.02]))
    assert np.allclose(all_by_id(model)["position"], start + np.array([jump, 0.02]), atol=1e-14)
    assert np.array_equal(model.mesh.cells_of(model.particles.position), model.particles.cell)
    assert np.all(model.particles.cell < model.mesh.owned_cells)
    assert model.report().particles == len(start)


def test_outside_is_an_error_on_all_ranks(comm):
    model = block(comm)
    before = all_by_id(model)["position"]
    with pytest.raises(mpm.InputError, match="outside of the mesh") as raised:
        model.place(model.particles.position + np.array([5.0, 0.0]))
    assert len(set(comm.allgather(str(raised.value)))) == 1
    assert np.array_equal(all_by_id(model)["position"], before)
