"""Free fields and Rayleigh damping on several ranks: one run, whatever the partition."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, scattered, spread_box

import mpm_core as mpm


def block(comm, owners_of=bands, rigid=False):
    """A block, partly at rest, between free fields on a base that lets a wave in."""
    mesh = spread_box((12, 6), (1.2, 0.6), comm, owners_of, diagonals="alternating")
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e2, friction_angle=0.0))
    model.seed(density=2000.0, per_cell=10)
    model.rest(where=lambda x: x[:, 1] < 0.3)
    motion = mpm.Motion([0.0, 0.005, 0.01], [0.0, 1e-2, 0.0])
    if rigid:
        model.drive(3, motion, (1.0, 0.0))
    else:
        model.absorb(3, thickness=10.0)
    model.absorb((1, 2), free_field=True, thickness=20.0)
    if not rigid:
        model.shake(motion, (1.0, 0.5))
    return model


OPTIONS = {"energy_limit": None, "conversion": None, "rayleigh": mpm.Rayleigh(2.0, 1e-4)}
FIELDS = ("velocity", "stress", "displacement")


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_free_fields_on_all_ranks_as_on_one(comm, owners_of, rigid):
    model, alone = block(comm, owners_of, rigid), block(MPI.COMM_SELF, rigid=rigid)
    for each in (model, alone):
        each.explicit(0.03, **OPTIONS).last()
    assert np.abs(alone.particles.velocity).max() > 1e-4
    assert alone.particles.plastic_strain.max() > 0
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS))


def test_free_fields_stay_after_a_repartition_in_the_midst_of_a_run_and_from_a_file(comm, shared_path):
    model, alone = block(comm, scattered), block(MPI.COMM_SELF)
    model.explicit(0.01, **OPTIONS, watch=lambda: model.rebalance() and False).last()
    alone.explicit(0.01, **OPTIONS).last()
    model.save(shared_path / "sides.h5")
    resumed = mpm.Model(block(comm, bands).mesh, model.laws)
    resumed.restore(shared_path / "sides.h5")
    for each in (resumed, alone):
        each.explicit(0.03, **OPTIONS).last()
    assert_same(all_by_id(resumed, FIELDS), all_by_id(alone, FIELDS))
