"""Affine transfer over several ranks: particles take the gradients of their velocities along."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, bands, scattered, sliding_slope

import mpm_core as mpm


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_a_slide_is_the_same_on_any_number_of_ranks(comm, owners_of):
    models = sliding_slope(comm, owners_of), sliding_slope(MPI.COMM_SELF)
    options = {"integration": mpm.Integration.MIXED, "nmd": True, "transfer": mpm.Transfer.AFFINE}
    reports = [model.explicit(until=0.3, **options).last() for model in models]
    spread, alone = (all_by_id(model, ("position", "velocity", "velocity_gradient")) for model in models)
    assert np.abs(models[1].particles.displacement).max() > 0.1  # further than a cell
    for name, values in alone.items():
        np.testing.assert_allclose(spread[name], values, atol=1e-7 * np.abs(values).max(), err_msg=name)
    assert reports[0].pic_loss == pytest.approx(reports[1].pic_loss, rel=1e-5)


def test_a_new_partition_changes_no_energy(comm):
    # The kinetic energy of gradients is that of nodes as their supports hold them.
    model, options = sliding_slope(comm), {"integration": mpm.Integration.MIXED, "transfer": mpm.Transfer.AFFINE}
    before = model.explicit(until=0.2, **options).last()
    model.rebalance()
    after = model.report()
    for name in ("kinetic_energy", "pic_loss", "unexplained_energy"):
        assert getattr(after, name) == pytest.approx(getattr(before, name), abs=1e-9 * before.energy_scale)
