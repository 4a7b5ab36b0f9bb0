"""Particles on several ranks: the same motion whoever owns the cells, and none lost on the way."""

import numpy as np
import pytest
from mpi4py import MPI
from partitions import all_by_id, assert_same, bands, one_does_all, scattered, sliding_slope, spread_box

import mpm_core as mpm

FLIGHT = dict(lengths=(4.0, 0.4), counts=(40, 4), body=((0.1, 0.1), (0.3, 0.3)))


def block(comm, velocity, owners_of=bands, keep=None):
    """A small block without weight in a long box, all of it with one velocity."""
    mesh = spread_box(FLIGHT["counts"], FLIGHT["lengths"], comm, owners_of, keep, body=FLIGHT["body"])
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=1000.0, per_cell=3, cell_tag=1)
    model.particles.set("velocity", np.tile(velocity, (len(model.particles), 1)).astype(float).reshape(-1, 2))
    return model


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_a_thousand_steps_are_the_same_on_any_partition(comm, owners_of):
    # Sums over particles are taken in another order, and nothing else differs. Without damping round-off does not grow.
    model, alone = sliding_slope(comm, owners_of), sliding_slope(MPI.COMM_SELF)
    for each in (model, alone):
        *_, report = each.explicit(1.0, dt=1e-3, pic=0.01)
    assert report.steps == 1000
    moved = all_by_id(model)
    assert moved["displacement"][:, 0].min() > 0.5 and moved["state"].max() > 0.1
    assert_same(moved, all_by_id(alone))


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_a_damped_slide_is_the_same_on_any_partition(comm, owners_of):
    # Where a node's velocity passes through zero within a step, the damping does so too: its sign is not left to round-off.
    model, alone = sliding_slope(comm, owners_of, per_cell=10), sliding_slope(MPI.COMM_SELF, per_cell=10)
    for each in (model, alone):
        *_, report = each.explicit(1.0, dt=1e-3, damping=0.5)
    assert report.steps == 1000
    moved = all_by_id(model)
    assert moved["displacement"][:, 0].min() > 0.3 and moved["state"].max() > 0.1
    assert_same(moved, all_by_id(alone))


@pytest.mark.parametrize("integration", [mpm.Integration.MIXED, mpm.Integration.DUAL_DOMAIN])
def test_other_integrations_are_the_same_on_any_partition(comm, integration):
    model, alone = sliding_slope(comm, scattered), sliding_slope(MPI.COMM_SELF)
    for each in (model, alone):
        list(each.explicit(0.2, dt=1e-3, pic=0.01, integration=integration))
    assert_same(all_by_id(model), all_by_id(alone))


def test_one_partition_twice_is_the_same_to_the_last_bit(comm):
    results = []
    for _ in range(2):
        model = sliding_slope(comm, scattered)
        *_, report = model.explicit(0.1, dt=1e-3, damping=0.5)
        results.append((all_by_id(model), report))
    for name in results[0][0]:
        np.testing.assert_array_equal(results[0][0][name], results[1][0][name])
    assert results[0][1] == results[1][1]


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
@pytest.mark.parametrize("jump", [0.05, 0.3, 1.1, 3.5])
def test_particles_find_their_owner_however_far_they_jump(comm, owners_of, jump):
    # A body that flies is not strained, so each particle is where its velocity took it.
    dt = 1e-4
    model = block(comm, (jump / dt, 0.1), owners_of)
    start = all_by_id(model)["position"]
    steps = int(3.6 / jump)
    *_, report = model.explicit(steps * dt, dt=dt, allow_unstable=True)
    position = all_by_id(model)["position"]
    np.testing.assert_allclose(position, start + np.array([jump / dt, 0.1]) * steps * dt, atol=1e-8)
    inside = model.mesh.cells_of(model.particles.position)
    np.testing.assert_array_equal(inside < model.mesh.owned_cells, True)
    np.testing.assert_array_equal(inside, model.particles.cell)


def test_a_jump_out_of_the_mesh_stops_all_ranks_with_its_place(comm):
    model = block(comm, (5.0 / 1e-4, 0.0))
    with pytest.raises(mpm.RunError, match=r"particle \d+ at \(5\.\d+, .*left the background mesh") as raised:
        for _ in model.explicit(1e-4, dt=1e-4, allow_unstable=True):
            pass
    assert len(set(comm.allgather(str(raised.value)))) == 1


def test_a_jump_through_an_outflow_on_another_rank_is_counted(comm):
    model = block(comm, (5.0 / 1e-4, 0.0))
    model.outflow(2)
    start = model.report()
    *_, report = model.explicit(1e-4, dt=1e-4, allow_unstable=True)
    assert (report.particles, report.outflow_particles) == (0, start.particles)
    assert report.outflow_mass == pytest.approx(start.mass)


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_a_jump_across_a_gap_in_the_mesh(comm, owners_of):
    # No walk over neighbours leads from one part of the mesh to the other.
    model = block(comm, (3.0 / 1e-4, 0.0), owners_of, keep=lambda centres: abs(centres[:, 0] - 2.0) > 0.5)
    start = all_by_id(model)["position"]
    *_, report = model.explicit(1e-4, dt=1e-4, allow_unstable=True)
    np.testing.assert_allclose(all_by_id(model)["position"], start + np.array([3.0, 0.0]), atol=1e-8)


PHASES = ["mesh", "material", "seed", "state", "run"]


@pytest.mark.parametrize("phase", PHASES)
def test_an_error_on_one_rank_is_raised_on_all(comm, phase):
    # The last rank alone has something wrong in this phase; all must hear of it, and none may wait.
    wrong = comm.rank == comm.size - 1
    expected = {
        "mesh": "is nan at index",
        "material": "material is 9",
        "seed": "density",
        "state": "mass and volume of particle",
        "run": "failed for the strain increment|left the background mesh",
    }
    model = block(comm, (0.0, 0.0), one_does_all)
    with pytest.raises((mpm.InputError, mpm.RunError), match=expected[phase]) as raised:
        if phase == "mesh":
            points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, np.nan if wrong else 1.0]])
            numbers = 3 * comm.rank + np.arange(3)
            mpm.Mesh(points, [[0, 1, 2]], global_nodes=numbers, global_cells=[comm.rank],
                     cell_owners=np.array([comm.rank], dtype=np.int32), comm=comm)  # fmt: skip
        elif phase == "material":
            model.seed(density=1.0, per_cell=3, material=9 if wrong else 0)
        elif phase == "seed":
            model.seed(density=-1.0 if wrong else 1.0, per_cell=3)
        elif phase == "state":
            if wrong:
                model.particles.set("volume", np.full(len(model.particles), -1.0))
            model.report()
        else:
            if wrong:
                model.particles.set("velocity", np.full((len(model.particles), 2), 1e9))
            for _ in model.explicit(1e-4, dt=1e-4, allow_unstable=True):
                pass
    assert len(set(comm.allgather(str(raised.value)))) == 1


def test_a_traction_at_one_end_is_a_column_on_every_rank(comm):
    mesh = spread_box((12, 4), (1.2, 0.4), comm, bands)
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.2))
    model.seed(density=1000.0, per_cell=3)
    assert model.traction(2, (5.0, 0.0)) == pytest.approx(0.4)  # the side at x = 1.2, of the last rank alone
    assert model.particles.traction.shape == (len(model.particles), 2)
    carried = all_by_id(model, ("traction",))["traction"]
    np.testing.assert_allclose(carried.sum(axis=0), (5.0 * 0.4, 0.0), rtol=1e-12)


def test_points_are_seeded_whoever_owns_their_cells(comm):
    x = np.linspace(0.1, 3.9, 20)
    points = np.column_stack([x, np.full(20, 0.21)])
    model = mpm.Model(
        spread_box(FLIGHT["counts"], FLIGHT["lengths"], comm, bands), mpm.LinearElastic(young=1e6, poisson=0.2)
    )
    assert model.seed_points(points, np.full(20, 1e-3), density=1000.0) == 20
    np.testing.assert_array_equal(all_by_id(model, ("position",))["position"], points)
    with pytest.raises(mpm.InputError, match=r"points has \[5\.  0\.1\] at row 1"):
        model.seed_points([[0.5, 0.1], [5.0, 0.1]], [1e-3, 1e-3], density=1000.0)


@pytest.mark.parametrize(
    "distributed", [lambda x, rank: x[rank::2], lambda x, rank: x[: 10 + rank]], ids=["parts", "lengths"]
)
def test_points_that_ranks_share_out_are_refused(comm, distributed):
    # Parts of the same length would be taken row by row, and some soil would be missing without a word.
    if comm.size == 1:
        pytest.skip("one rank has all points")
    model = mpm.Model(block(comm, (0.0, 0.0)).mesh, mpm.LinearElastic(young=1e6, poisson=0.2))
    points = np.column_stack([np.linspace(0.2, 3.8, 20), np.full(20, 0.15)])
    own = distributed(points, comm.rank % 2)
    with pytest.raises(mpm.InputError, match="points are not the same on all ranks, with shape") as raised:
        model.seed_points(own, np.full(len(own), 1e-3), density=1000.0)
    assert len(set(comm.allgather(str(raised.value)))) == 1


@pytest.mark.parametrize("owners_of", [bands, scattered])
def test_points_on_sides_between_cells_are_seeded_once(comm, owners_of):
    mesh = spread_box((8, 8), (1.0, 1.0), comm, owners_of)
    x = np.linspace(0.0, 1.0, 9)
    points = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)  # the nodes
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.2))
    assert model.seed_points(points, np.full(81, 1e-3), density=1000.0) == 81
    np.testing.assert_array_equal(all_by_id(model, ("position",))["position"], points)


def test_an_added_field_follows_its_particles_to_other_ranks(comm):
    model = block(comm, [40.0, 0.0])
    model.add_field("origin", unit="m", meaning="Position at the start", components=2)
    model.particles.set("origin", model.particles.initial_position)
    *_, report = model.explicit(0.08)
    particles = model.particles
    np.testing.assert_array_equal(particles.origin, particles.initial_position)
    assert len(particles) == 0 or particles.displacement[:, 0].min() > 3.0  # across all ranks
    assert report.particles == comm.allreduce(len(particles)) > 0


def test_all_ranks_find_the_same_critical_cell():
    comm = MPI.COMM_WORLD
    model = block(comm, (0.0, 0.0))
    found = mpm.critical_cell(model)
    assert len(set(comm.allgather(found))) == 1
    np.testing.assert_allclose(found.time_step, model.critical_time_step(), rtol=1e-12)
    alone = block(MPI.COMM_SELF, (0.0, 0.0))
    assert found.number in alone.particles.cell
    np.testing.assert_allclose(alone.mesh.points[alone.mesh.cells[found.number]].mean(axis=0), found.centre)


@pytest.mark.parametrize("owners_of", [bands, scattered, one_does_all])
def test_averages_over_nodes_are_the_same_on_any_partition(comm, owners_of):
    found, laws = [], [mpm.LinearElastic(young=e, poisson=0.3) for e in (4e6, 40e6)]
    for model in (sliding_slope(comm, owners_of, laws=laws), sliding_slope(MPI.COMM_SELF, laws=laws)):
        p = model.particles
        model.assign((p.position[:, 1] < 0.2).astype(np.int32))
        averaged = model.average_over_nodes(np.sin(50 * p.position))
        parts = model.comm.allgather((p.id, averaged))
        order = np.argsort(np.concatenate([ids for ids, _ in parts]))
        found.append(np.concatenate([values for _, values in parts])[order])
    assert found[0] == pytest.approx(found[1], abs=1e-13) and np.abs(found[1]).max() > 0.1
    with pytest.raises(mpm.InputError, match="values have shape"):
        model.average_over_nodes([1.0])
