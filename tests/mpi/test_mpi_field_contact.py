"""Contact between velocity fields on several ranks: the motion and the forces of one."""

import pytest
from field_contact_cases import block_on_layer
from mpi4py import MPI
from partitions import FIELDS, all_by_id, assert_same, bands, one_does_all, scattered, spread_box


def block(comm, owners_of):
    """A block that slides over a layer, whose interface cuts the cells, across the borders of the ranks."""
    mesh = spread_box((28, 14), (1.4, 0.7), comm, owners_of, diagonals="alternating")
    return block_on_layer(35.0, 0.3, mesh=mesh, shift=0.0171, adhesion=200.0)


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_bodies_touch_alike_on_any_partition(comm, owners_of):
    runs = [block(comm, owners_of), block(MPI.COMM_SELF, one_does_all)]
    reports = [list(model.explicit(0.1, dt=1e-4, pic=0.05))[-1] for model, _ in runs]
    assert_same(all_by_id(runs[0][0], FIELDS), all_by_id(runs[1][0], FIELDS))
    here, there = (contact.values() for _, contact in runs)
    assert there["force_y_N"] > 0 and here["nodes"] == there["nodes"] > 5
    for name in ("force_x_N", "force_y_N", "impulse_x_N.s", "impulse_y_N.s"):
        assert here[name] == pytest.approx(there[name], rel=1e-8)
    assert reports[0].friction_work == pytest.approx(reports[1].friction_work, rel=1e-8)
