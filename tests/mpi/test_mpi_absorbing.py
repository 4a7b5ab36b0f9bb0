"""Absorbing sides on several ranks: one run, whatever the partition."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, scattered, spread_box

import mpm_core as mpm


def block(comm, owners_of=bands, **numbering):
    """A block, partly at rest, whose base is shaken and whose sides absorb, with corners shared by ranks."""
    mesh = spread_box((12, 6), (1.2, 0.6), comm, owners_of, diagonals="alternating", **numbering)
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=10)
    model.rest(where=lambda x: x[:, 1] < 0.3)
    model.absorb((1, 2, 3), thickness=10.0)
    model.shake(mpm.Motion([0.0, 0.005, 0.01], [0.0, 1e-3, 0.0]), (1.0, 0.5))
    return model


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_absorbing_sides_on_all_ranks_as_on_one(comm, owners_of):
    model, alone = block(comm, owners_of), block(MPI.COMM_SELF)
    for each in (model, alone):
        each.explicit(0.03, energy_limit=None, conversion=None).last()
    fields = ("velocity", "stress", "displacement")
    assert np.abs(alone.particles.velocity).max() > 1e-6
    assert_same(all_by_id(model, fields), all_by_id(alone, fields))


def test_absorbing_sides_stay_after_a_repartition_and_from_a_file(comm, shared_path):
    model, alone = block(comm, scattered), block(MPI.COMM_SELF)
    for each in (model, alone):
        each.explicit(0.01, energy_limit=None, conversion=None).last()
    model.save(shared_path / "sides.h5")
    resumed = mpm.Model(block(comm, bands, number_of=lambda node: 1000 - node).mesh, model.laws)
    resumed.restore(shared_path / "sides.h5")
    resumed.rebalance()
    for each in (resumed, alone):
        each.explicit(0.02, energy_limit=None, conversion=None).last()
    resumed.save(shared_path / "later.h5")  # nodes that a rank has at its border only have no springs that move
    again = mpm.Model(block(comm, scattered).mesh, model.laws)
    again.restore(shared_path / "later.h5")
    for each in (resumed, again, alone):
        each.explicit(0.03, energy_limit=None, conversion=None).last()
    fields = ("velocity", "stress", "displacement")
    for each in (resumed, again):
        assert_same(all_by_id(each, fields), all_by_id(alone, fields))
