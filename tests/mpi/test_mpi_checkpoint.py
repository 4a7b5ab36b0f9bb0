"""Checkpoints on several ranks: what goes on from one is the run that never stopped."""

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from partitions import FIELDS, all_by_id, assert_same, bands, one_does_all, scattered, sliding_slope, spread_box

import mpm_core as mpm

RUN = dict(until=0.4, every=0.1, since=0.0, pic=0.01)


def slide(model, watch=None, **options):
    """All reports up to the end, and the particles then."""
    return list(model.explicit(**RUN, watch=watch, **options)), all_by_id(model, (*FIELDS, "mass", "cell"))


def saved_midway(model, path, steps=160, **options):
    """Run until a checkpoint is written between two reports."""

    def watch():
        if model._core.steps < steps:
            return False
        model.save(path)
        return True

    *_, report = model.explicit(**RUN, watch=watch, **options)
    assert 0.1 < report.time < 0.3
    return report


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_the_same_ranks_go_on_to_the_last_bit(comm, shared_path, owners_of):
    # Local damping makes a difference in the last bit grow, so that none can hide.
    reports, never_stopped = slide(sliding_slope(comm, owners_of), damping=0.5)
    saved_midway(sliding_slope(comm, owners_of), shared_path / "state.h5", damping=0.5)

    model = sliding_slope(comm, owners_of)
    model.restore(shared_path / "state.h5")
    assert 0.1 < model.time < 0.3
    later, restarted = slide(model, damping=0.5)
    for name, values in never_stopped.items():
        np.testing.assert_array_equal(restarted[name], values, err_msg=name)
    assert later == reports[-len(later) :]


def test_saving_does_not_change_a_run(comm, shared_path):
    def watch():
        model.save(shared_path / "state.h5")
        return False

    model = sliding_slope(comm)
    never_saved = slide(sliding_slope(comm), damping=0.5)
    assert slide(model, watch, damping=0.5)[0] == never_saved[0]


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_another_number_of_ranks_goes_on_up_to_round_off(comm, shared_path, owners_of):
    _, never_stopped = slide(sliding_slope(comm, owners_of))
    saved_midway(sliding_slope(comm, owners_of), shared_path / "state.h5")
    alone = sliding_slope(MPI.COMM_SELF)
    alone.restore(shared_path / "state.h5")
    reports, restarted = slide(alone)
    del never_stopped["cell"]
    assert_same(restarted, never_stopped)

    # And the other way round: a checkpoint of one rank on all.
    if comm.rank == 0:
        saved_midway(sliding_slope(MPI.COMM_SELF), shared_path / "alone.h5")
    comm.barrier()
    model = sliding_slope(comm, owners_of)
    model.restore(shared_path / "alone.h5")
    later, restarted = slide(model)
    assert_same(restarted, never_stopped)
    for name in (
        "particles",
        "mass",
        "external_work",
        "internal_work",
        "stress_work",
        "unexplained_energy",
        "steps",
        "particle_steps",
    ):
        assert getattr(later[-1], name) == pytest.approx(getattr(reports[-1], name), rel=1e-9)


def test_loads_and_supports_come_back(comm, shared_path):
    model = sliding_slope(comm)
    model.prescribe(2, (0.5, 0.0))
    model.outflow(4)
    model.traction(3, (0.0, 10.0))
    model.set_gravity((0.0, -5.0), ramp=0.5)
    *_, report = model.explicit(0.05)
    model.save(shared_path / "state.h5")

    bare = mpm.Model(model.mesh, model.laws)
    bare.restore(shared_path / "state.h5")
    for each in (model, bare):
        each.prescribe(2, (0.6, 0.0))  # replaces the one before
        *_, report = each.explicit(0.2)
    one, other = all_by_id(model, (*FIELDS, "traction")), all_by_id(bare, (*FIELDS, "traction"))
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])
    assert bare._next_id == model._next_id


@pytest.fixture
def checkpoint(comm, shared_path):
    model = sliding_slope(comm)
    model.save(shared_path / "state.h5")
    return shared_path / "state.h5"


def raised_everywhere(comm, kind, match, work):
    with pytest.raises(kind, match=match) as raised:
        work()
    assert len(set(comm.allgather(str(raised.value)))) == 1


def test_a_checkpoint_of_something_else_is_refused(comm, checkpoint):
    soil = mpm.MohrCoulomb(young=4e6, poisson=0.3, cohesion=1e3, friction_angle=26.0)
    model = mpm.Model(sliding_slope(comm).mesh, soil)
    raised_everywhere(comm, mpm.InputError, "state.h5 is of another materials.*angle=25.0.*angle=26.0",
                      lambda: model.restore(checkpoint))  # fmt: skip
    for mesh in (spread_box((24, 6), (2.4, 0.6), comm, body=((0.1, 0), (0.6, 0.4))),
                 spread_box((24, 6), (2.4, 0.6), comm, diagonals="alternating", body=((0.1, 0), (0.6, 0.3)))):  # fmt: skip
        other = mpm.Model(mesh, sliding_slope(comm).laws)
        raised_everywhere(
            comm, mpm.InputError, "is of another background mesh", lambda other=other: other.restore(checkpoint)
        )
    deep = mpm.Model(spread_box((4, 1, 1), (4, 1, 1), comm), sliding_slope(comm).laws)
    raised_everywhere(comm, mpm.InputError, "is of another dimension: it has 2, the model has 3",
                      lambda: deep.restore(checkpoint))  # fmt: skip


def damaged(comm, path, change):
    """A copy of a file with its bytes changed, on one rank."""
    copy = path.with_name("damaged.h5")
    if comm.rank == 0:
        copy.write_bytes(change(bytearray(path.read_bytes())))
    comm.barrier()
    return copy


def flipped(place):
    def change(data):
        data[place] ^= 1
        return data

    return change


DAMAGES = [
    (flipped(3), "signature"),
    (flipped(30), "checksum|truncated"),  # where its first table is
    (lambda data: data[:-100], "truncated"),
    (lambda data: data[:700], "truncated"),
    (lambda data: data[:40], "truncated|read|signature"),
    (lambda data: b"", "signature"),
]


@pytest.mark.parametrize("change, message", DAMAGES)
def test_a_damaged_checkpoint_is_refused_and_the_model_stays(comm, checkpoint, change, message):
    copy = damaged(comm, checkpoint, change)
    model = sliding_slope(comm)
    before = all_by_id(model)
    raised_everywhere(comm, mpm.RunError, f"damaged.h5: .*({message})", lambda: model.restore(copy))
    np.testing.assert_array_equal(all_by_id(model)["position"], before["position"])


def test_no_flipped_bit_gets_into_a_run(comm, checkpoint):
    """Each is found by a checksum, or lies where HDF5 stores nothing."""
    data = checkpoint.read_bytes()
    expected, found = all_by_id(sliding_slope(comm)), 0
    for place in np.random.default_rng(3).integers(0, len(data), 60):
        model = sliding_slope(comm)
        copy = damaged(comm, checkpoint, flipped(int(place)))
        try:
            model.restore(copy)
        except mpm.RunError as error:
            assert "damaged.h5" in str(error) and len(set(comm.allgather(str(error)))) == 1
            found += 1
        else:
            for name, values in all_by_id(model).items():
                np.testing.assert_array_equal(values, expected[name], err_msg=name)
        comm.barrier()
    assert found > 40


@pytest.mark.parametrize(
    "number, message", [(3, "it has format 3, this program reads format 2"), (1, "it has format 1")]
)
def test_another_format_is_named(comm, checkpoint, number, message):
    if comm.rank == 0:
        with h5py.File(checkpoint, "r+") as file:
            file["format"][0] = number
    comm.barrier()
    model = sliding_slope(comm)
    raised_everywhere(comm, mpm.RunError, message, lambda: model.restore(checkpoint))


def test_a_checkpoint_that_cannot_be_written_or_read(comm, shared_path, checkpoint):
    model = sliding_slope(comm)
    raised_everywhere(comm, mpm.RunError, "No such file or directory", lambda: model.restore(shared_path / "none.h5"))
    raised_everywhere(
        comm, mpm.RunError, "No such file or directory", lambda: model.save(shared_path / "none" / "a.h5")
    )
    folder = shared_path / "folder.h5"
    if comm.rank == 0:
        folder.mkdir()
    comm.barrier()
    raised_everywhere(comm, mpm.RunError, "Is a directory", lambda: model.save(folder))
    comm.barrier()
    assert sorted(path.name for path in shared_path.iterdir()) == ["folder.h5", "state.h5"]
    model.restore(checkpoint)


IMPLICIT = dict(until=0.2, dt=0.04, every=0.1, since=0.0, damping=0.3, nmd=True)
FEW = mpm.Newton(max_iterations=3)  # so few that steps are cut, and their length is part of the state


@pytest.mark.parametrize("owners_of", [bands, one_does_all])
def test_an_implicit_run_goes_on_to_the_last_bit(comm, shared_path, owners_of):
    never_stopped = sliding_slope(comm, owners_of)
    reports = list(never_stopped.implicit(**IMPLICIT, solver=FEW))
    assert sum(report.cuts for report in reports) > 0

    model = sliding_slope(comm, owners_of)
    *_, first = model.implicit(**IMPLICIT, solver=FEW, watch=lambda: model.time > 0.13)
    assert 0.13 < first.time < 0.2
    model.save(shared_path / "state.h5")
    again = sliding_slope(comm, owners_of)
    again.restore(shared_path / "state.h5")
    assert again.resumed_dt == 0.04
    *_, last = again.implicit(**IMPLICIT, solver=FEW)
    one, other = all_by_id(never_stopped), all_by_id(again)
    for name in one:
        np.testing.assert_array_equal(one[name], other[name], err_msg=name)
    assert last.steps == reports[-1].steps and last.kinetic_energy == reports[-1].kinetic_energy
