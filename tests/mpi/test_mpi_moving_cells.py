"""Cells that move with the body, over several ranks."""

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from mpm_core.output import ModelOutput
from partitions import all_by_id, bands, scattered, spread_box

import mpm_core as mpm

NAMES = ("position", "velocity", "stress")


def cantilever(comm, owners_of=bands):
    """A beam clamped on the left, which swings over several cells of the mesh."""
    mesh = spread_box([10, 16], [2.5, 4.0], comm, owners_of, body=([0, 2], [2, 3]))
    model = mpm.Model(mesh, mpm.Hencky(mpm.LinearElastic(young=5e5, poisson=0.3)))
    model.seed(density=1000.0, per_cell=3, cell_tag=1)
    model.fix(1)
    model.set_gravity((0, -10))
    return model


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_a_beam_swings_alike_on_any_number_of_ranks(comm, owners_of):
    models = cantilever(comm, owners_of), cantilever(MPI.COMM_SELF)
    for model in models:
        model.explicit(0.6, moving_cells=True).last()
    assert np.abs(models[1].particles.displacement).max() > 0.7  # over three cells, and so into those of other ranks
    spread, alone = (all_by_id(model, NAMES) for model in models)
    for name, values in alone.items():
        np.testing.assert_allclose(spread[name], values, atol=1e-9 * np.abs(values).max(), err_msg=name)
    # Particles go to the ranks of the cells where they are now, and none is lost.
    reports = [model.explicit(0.61, energy_limit=None).last() for model in models]
    assert reports[0].particles == reports[1].particles
    assert reports[0].mass == pytest.approx(reports[1].mass, rel=1e-14)


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_a_restart_on_the_same_and_on_other_ranks(comm, shared_path, owners_of):
    never_stopped = cantilever(comm, owners_of)
    never_stopped.explicit(0.3, moving_cells=True).last()
    never_stopped.save(shared_path / "state.h5")
    same, alone = cantilever(comm, owners_of), cantilever(MPI.COMM_SELF)
    for model in (same, alone):
        model.restore(shared_path / "state.h5")
    for model in (never_stopped, same, alone):
        model.explicit(0.6, moving_cells=True).last()
    expected = all_by_id(never_stopped, NAMES)
    for name, values in all_by_id(same, NAMES).items():
        np.testing.assert_array_equal(values, expected[name], err_msg=name)
    for name, values in all_by_id(alone, NAMES).items():
        np.testing.assert_allclose(values, expected[name], atol=1e-9 * np.abs(values).max(), err_msg=name)


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_all_ranks_see_that_the_body_is_about_to_meet_the_boundary(comm, owners_of):
    # The block flies over the cells of other ranks to the right side of the mesh; the time is the same on any number of ranks.
    def thrown(comm, owners_of=bands):
        model = mpm.Model(spread_box([12, 4], [3.0, 1.0], comm, owners_of, body=([0.25, 0.25], [0.75, 0.75])),
                          mpm.LinearElastic(young=200e3, poisson=0.3))  # fmt: skip
        model.seed(density=2000.0, per_cell=3, cell_tag=1)
        p = model.particles
        p.set("velocity", np.broadcast_to([2.0, 0.0], p.velocity.shape))
        with pytest.raises(mpm.RunError, match="about to meet the boundary"):
            model.explicit(5.0, moving_cells=True).last()
        return model.time

    time = thrown(comm, owners_of)
    assert time == pytest.approx(thrown(MPI.COMM_SELF), rel=1e-9)
    assert 0.9 < time < 2.25 / 2.0


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_frames_have_the_nodes_where_they_are(comm, shared_path, owners_of):
    # A block that flies with one velocity: each of its nodes moves by v t.
    mesh = spread_box([8, 8], [2.0, 2.0], comm, owners_of, body=([0.5, 0.5], [1.5, 1.5]))
    model = mpm.Model(mesh, mpm.LinearElastic(young=2e5, poisson=0.3))
    model.seed(density=2000.0, per_cell=3, cell_tag=1)
    velocity = np.array([1.0, 0.5])
    model.particles.set("velocity", np.tile(velocity, (len(model.particles.id), 1)))
    model.report()
    with ModelOutput(model, mesh=shared_path / "mesh", nodal_fields=["velocity"], float32=False) as output:
        output.write()
        for report in model.explicit(0.2, every=0.1, moving_cells=True):
            output.write()
        model.explicit(0.21).last()  # the nodes have gone back
        output.write()
    with h5py.File(shared_path / "mesh/mesh.h5") as file:
        initial, cells, tags = file["points"][:, :2], file["cells"][()], file["tag"][()]
    body = cells[tags == 1]
    assert len(body) == 32
    for frame, time in ((1, 0.1), (2, 0.2)):
        with h5py.File(shared_path / f"mesh/00000{frame}.h5") as file:
            np.testing.assert_allclose(file["points"][:, :2][body], initial[body] + velocity * time, atol=1e-12)
    for frame in (0, 3):
        with h5py.File(shared_path / f"mesh/00000{frame}.h5") as file:
            assert set(file) == {"velocity"}
