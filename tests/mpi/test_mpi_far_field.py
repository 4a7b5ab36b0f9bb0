"""A far field on several ranks: the same as on one, also after a repartition and from a checkpoint of other ranks."""

import numpy as np
import pytest
from far_field_cases import LOADED, footing
from mpi4py import MPI
from partitions import all_by_id, assert_same

FIELDS = ("position", "velocity", "stress", "displacement")


def loaded_footing(comm):
    model, far = footing(comm, 20, 10, reach=(5.0, 4.0), gravity=(0.0, -1.0))
    model.traction(LOADED, (300.0, -1000.0))
    return model, far


@pytest.mark.parametrize("quasi_static", [True, False])
@pytest.mark.parametrize("rebalance", [False, True])
def test_a_far_field_is_the_same_on_all_ranks_as_on_one(comm, quasi_static, rebalance):
    (model, _), (alone, _) = loaded_footing(comm), loaded_footing(MPI.COMM_SELF)
    for each in (model, alone):
        list(each.implicit(0.02, dt=0.01, quasi_static=quasi_static))
    if rebalance:
        model.rebalance()
        assert model.repartitions == (1 if comm.size > 1 else 0)
    for each in (model, alone):
        list(each.implicit(0.04, dt=0.01, quasi_static=quasi_static))
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS))
    moved, expected = model.far_field_displacement, alone.far_field_displacement
    assert np.abs(moved - expected).max() < 1e-8 * np.abs(expected).max()


def test_a_checkpoint_goes_on_on_other_ranks(comm, shared_path):
    path = shared_path / "border.h5"
    alone, _ = loaded_footing(MPI.COMM_SELF)
    list(alone.implicit(0.02, dt=0.01))
    if comm.rank == 0:
        alone.save(path)
    comm.Barrier()
    list(alone.implicit(0.04, dt=0.01))
    resumed, _ = loaded_footing(comm)
    resumed.restore(path)
    list(resumed.implicit(0.04, dt=0.01))
    assert_same(all_by_id(resumed, FIELDS), all_by_id(alone, FIELDS))


def test_displacements_of_the_ground_do_not_depend_on_the_ranks(comm):
    found = []
    for each in (comm, MPI.COMM_SELF):
        model, far = loaded_footing(each)
        list(model.implicit(0.01, dt=0.01, quasi_static=True))
        moved = far.displacement(model)
        n = moved.function_space.dofmap.index_map.size_local * 2
        found.append(each.allreduce(float(np.sum(moved.x.array[:n] ** 2))))
    assert found[0] == pytest.approx(found[1], rel=1e-9)
