"""Contact with rigid surfaces on several ranks: the motion and the reactions of one."""

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from mpm_core.body_output import BodyOutput
from partitions import FIELDS, all_by_id, assert_same, bands, one_does_all, scattered, spread_box

import mpm_core as mpm


def sliding_block(comm, owners_of=bands):
    """A soft block that slides down a polyline towards a disc, across the borders of the ranks."""
    mesh = spread_box((24, 10), (6.0, 2.5), comm, owners_of, diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    # A particle that enters a cell with a fraction N of its mass at the far node, and finds nobody there, multiplies
    # round-off by up to 1 / N^2. From this place none enters with so small a fraction that it would show.
    grid = 0.0625 * (np.indices((16, 8)).reshape(2, -1).T + 0.5) + (1.013, 1.007)
    model.seed_points(grid, np.full(len(grid), 0.0625**2), density=1000.0)
    model.set_gravity((4.0, -9.0))
    ground = model.add_contact(mpm.Polyline([(0.5, 0.99), (3.0, 0.95), (5.5, 0.7)]), friction=[0.25, 0.15], drag=0.02)
    disc = model.add_contact(mpm.Disc((3.2, 1.2), 0.3), friction=0.4, velocity=(-0.5, 0.0))
    return model, ground, disc


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_motion_and_reactions_are_the_same_on_any_partition(comm, owners_of):
    runs = [sliding_block(comm, owners_of), sliding_block(MPI.COMM_SELF)]
    for model, *_ in runs:
        list(model.explicit(0.8, dt=1e-3))
    names = (*FIELDS, "contact_slip_0", "contact_slip_1")
    assert_same(all_by_id(runs[0][0], names), all_by_id(runs[1][0], names))
    for one, other in zip(runs[0][1:], runs[1][1:], strict=True):
        for name in ("force", "impulse", "moment", "displacement"):
            value = getattr(other, name)
            assert getattr(one, name) == pytest.approx(value, rel=1e-8, abs=1e-8 * np.abs(value).max())
    assert runs[0][2].impulse[0] > 0  # the disc was hit


def bodies_on_a_block(comm, owners_of=bands):
    """A spinning disc falls on a sliding block, a stone on the disc, and a servo presses a plate on the block."""
    mesh = spread_box((24, 10), (6.0, 2.5), comm, owners_of, diagonals="alternating")
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    grid = 0.0625 * (np.indices((32, 8)).reshape(2, -1).T + 0.5) + (1.003, 1.007)
    model.seed_points(grid, np.full(len(grid), 0.0625**2), density=1000.0)
    model.set_gravity((4.0, -9.0))
    model.add_contact(mpm.Plane((0.0, 1.0), (0, 1)), friction=0.2)
    disc = model.add_contact(
        mpm.Disc((1.6, 1.84), 0.3), friction=0.4, adhesion=50.0, spin=5.0, body=mpm.FreeBody(mass=40.0)
    )
    servo = mpm.Servo(force=(0.0, -300.0), speed=1.0)
    plate = model.add_contact(mpm.Box((2.3, 1.52), (2.7, 1.7)), friction=0.3, velocity=(1.0, 0.0), body=servo)
    stone = model.add_contact(mpm.Disc((1.65, 2.4), 0.2), body=mpm.FreeBody(mass=20.0))
    stone.add_collision(disc, friction=0.3, restitution=0.4)
    return model, disc, plate, stone


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_bodies_move_alike_on_any_partition(comm, owners_of, shared_path):
    (model, *bodies), (alone, *references) = (
        bodies_on_a_block(comm, owners_of),
        bodies_on_a_block(MPI.COMM_SELF),
    )
    for each in (model, alone):
        list(each.explicit(0.2, dt=1e-3))
    model.save(shared_path / "bodies.h5")
    other = bodies_on_a_block(MPI.COMM_SELF)[0]
    other.restore(shared_path / "bodies.h5")
    for each in (model, alone, other):
        list(each.explicit(0.4, dt=1e-3))
    assert_same(all_by_id(model, FIELDS), all_by_id(alone, FIELDS))
    for one, again, reference in zip(bodies, other.contacts[1:], references, strict=True):
        assert reference.impulse[1] > 0 or reference.collision_impulse[1] > 0  # it has touched
        for name in (
            "force",
            "impulse",
            "moment",
            "displacement",
            "velocity",
            "angle",
            "spin",
            "rotation",
            "collision_impulse",
        ):
            value = getattr(reference, name)
            for found in (getattr(one, name), getattr(again, name)):
                assert found == pytest.approx(value, rel=1e-8, abs=1e-8 * np.abs(value).max()), name


def test_files_of_bodies_are_those_of_one_rank(comm, shared_path):
    (model, *_), (alone, *_) = sliding_block(comm), sliding_block(MPI.COMM_SELF)
    for each, path in ((model, shared_path / "many"), (alone, shared_path / f"one-{comm.rank}")):
        with BodyOutput(each, path, float32=False) as output:
            list(each.explicit(0.2, dt=1e-3))
            output.write()
    comm.Barrier()
    with (
        h5py.File(shared_path / "many" / "000000.h5") as many,
        h5py.File(shared_path / f"one-{comm.rank}" / "000000.h5") as one,
    ):
        assert sorted(many) == sorted(one)
        for name in many:
            np.testing.assert_allclose(many[name][()], one[name][()], rtol=1e-8, atol=1e-10)
    assert np.array_equal(model.contacts[0].outline()[0], alone.contacts[0].outline()[0])


def test_an_overlap_on_one_rank_is_refused_on_all(comm):
    model, *_ = sliding_block(comm)
    with pytest.raises(mpm.InputError, match="overlaps the soil by"):
        model.add_contact(mpm.Disc((2.0, 2.0), 0.55))


def test_a_run_goes_on_after_a_repartition_and_on_other_ranks(comm, shared_path):
    path = shared_path / "there.h5"
    model, *_ = sliding_block(comm)
    list(model.explicit(0.3, dt=1e-3))
    model.save(path)
    model.rebalance()
    alone = sliding_block(MPI.COMM_SELF)[0]
    alone.restore(path)
    for each in (model, alone):
        list(each.explicit(0.8, dt=1e-3))
    names = (*FIELDS, "contact_slip_0", "contact_slip_1")
    assert_same(all_by_id(model, names), all_by_id(alone, names))
    for one, other in zip(model.contacts, alone.contacts, strict=True):
        assert one.impulse == pytest.approx(other.impulse, rel=1e-8, abs=1e-8 * np.abs(other.impulse).max())
