"""The mesh is repartitioned while soil slides: ranks have about as many particles, and nothing else changes."""

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from mpm_core.output import MeshOutput, ModelOutput
from mpm_core.partition import PARTICLE_WEIGHT, redistributed, take_partition
from partitions import FIELDS, all_by_id, assert_same, bands, one_does_all, scattered, sliding_slope, spread_box

import mpm_core as mpm

RUN = dict(until=0.5, every=0.1, since=0.0, pic=0.01)


def facets_by_place(mesh):
    """Tagged facets that owned cells have, by the coordinates of their middle; over all ranks."""
    tags = mesh._core.facet_tags
    found = {}
    for c in range(mesh.owned_cells):
        for k in range(mesh.dim + 1):
            if tags[c, k] >= 0:
                found[tuple(mesh.points[np.delete(mesh.cells[c], k)].mean(axis=0).round(9))] = int(tags[c, k])
    return {place: tag for part in mesh.comm.allgather(found) for place, tag in part.items()}


@pytest.mark.parametrize("shape", [((12, 5), (1.2, 0.5)), ((3, 3, 2), (0.3, 0.3, 0.2))])
def test_a_mesh_on_other_ranks_is_the_same_mesh(comm, shape):
    for owners_of in (bands, one_does_all):
        mesh = spread_box(*shape, comm, owners_of)
        ranks = scattered(np.zeros((mesh.cell_numbers, 2)), comm.size)[mesh.global_cells[: mesh.owned_cells]]
        moved = redistributed(mesh, ranks, mesh.global_cells[: mesh.owned_cells])
        assert facets_by_place(moved) == facets_by_place(mesh)

        def corners(of):
            n = of.owned_cells
            mine = (of.global_cells[:n], of.points[of.cells[:n]], of.cell_tags[:n], of.global_nodes[of.cells[:n]])
            parts = comm.allgather(mine)
            order = np.argsort(np.concatenate([part[0] for part in parts]))
            return [np.concatenate(values)[order] for values in zip(*parts)]

        for one, other in zip(corners(mesh), corners(moved)):
            np.testing.assert_array_equal(one, other)
        inner = moved._core.neighbours[: moved.owned_cells]
        whole = spread_box(*shape, MPI.COMM_SELF)
        outer = comm.allreduce(int((inner < 0).sum()))  # each neighbour is there, as an owned cell or as a ghost
        assert outer == int((whole._core.neighbours < 0).sum())


@pytest.mark.parametrize("threshold", [None, 1.2])
@pytest.mark.parametrize("owners_of", [bands, one_does_all])
def test_a_run_that_is_rebalanced_is_the_same_run(comm, owners_of, threshold):
    # Loads too: a rank that had no particles must take in those that carry some.
    model, alone = sliding_slope(comm, owners_of), sliding_slope(MPI.COMM_SELF)
    for each in (model, alone):
        each.traction(3, (0.0, 10.0))
        each.prescribe(2, (0.0, 0.0))
    reports, worst = [], []
    for report in model.explicit(**RUN, rebalance=threshold):
        reports.append(report)
        worst.append(model.imbalance())
    *_, last = alone.explicit(**RUN)
    assert_same(all_by_id(model, (*FIELDS, "traction")), all_by_id(alone, (*FIELDS, "traction")))
    assert reports[-1].steps == last.steps and reports[-1].external_work == pytest.approx(last.external_work, rel=1e-9)
    if comm.size > 1:
        assert (max(worst) < 1.5) == (threshold is not None)  # between two looks particles move on


def test_an_implicit_run_that_is_rebalanced_is_the_same_run(comm):
    model, alone = sliding_slope(comm), sliding_slope(MPI.COMM_SELF)
    options = dict(until=0.2, dt=0.02, damping=0.3, nmd=True, solver=mpm.Newton(tolerance=1e-11))
    reports = [list(model.implicit(**options, rebalance=1.2)), list(alone.implicit(**options))]
    assert [r.iterations for r in reports[0]] == [r.iterations for r in reports[1]]
    assert_same(all_by_id(model), all_by_id(alone), 1e-7)
    assert comm.size == 1 or model.repartitions > 0


def two_soils(comm):
    """The sliding slope, of soft soil on stiff soil that are averaged apart."""
    laws = [mpm.MohrCoulomb(young=e, poisson=0.3, cohesion=1e3, friction_angle=25.0) for e in (4e6, 40e6)]
    model = sliding_slope(comm, laws=laws)
    model.assign((model.particles.position[:, 1] < 0.2).astype(np.int32))
    return model


def test_soils_that_are_averaged_apart_stay_so_when_they_are_rebalanced(comm, shared_path):
    model, alone = two_soils(comm), two_soils(MPI.COMM_SELF)
    for each, threshold in ((model, 1.05), (alone, None)):
        each.explicit(0.2, nmd=True, rebalance=threshold).last()
    assert comm.size == 1 or model.repartitions > 0
    model.save(shared_path / "two_soils.h5")
    resumed = two_soils(comm)
    resumed.restore(shared_path / "two_soils.h5")
    for each in (resumed, alone):
        each.explicit(0.3, nmd=True).last()
        each.implicit(0.34, dt=0.02, nmd=True, solver=mpm.Newton(tolerance=1e-11)).last()
    assert_same(all_by_id(resumed), all_by_id(alone), 1e-7)


def heap(comm):
    """A block of tetrahedra between smooth walls that slides and spreads along its smooth base."""
    mesh = spread_box((12, 3, 4), (1.2, 0.3, 0.4), comm, body=((0, 0, 0), (0.5, 0.3, 0.3)))
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=100.0, friction_angle=20.0))
    model.seed(density=2000.0, per_cell=1, cell_tag=1)
    for wall, normal in ((1, (1, 0, 0)), (3, (0, 1, 0)), (4, (0, 1, 0)), (5, (0, 0, 1))):
        model.roller(wall, normal)
    model.set_gravity((5.0, 0.0, -8.5))
    return model


def test_a_run_of_tetrahedra_that_is_rebalanced_is_the_same_run(comm):
    model, alone = heap(comm), heap(MPI.COMM_SELF)
    explicit = dict(until=0.3, every=0.05, since=0.0, dt=1e-3, pic=0.01)
    for each, threshold in ((model, 1.2), (alone, None)):
        *_, report = each.explicit(**explicit, rebalance=threshold)
    assert report.steps == 300 and (comm.size == 1 or model.repartitions > 1)
    moved = all_by_id(model)
    assert moved["displacement"][:, 0].max() > 0.4
    assert_same(moved, all_by_id(alone))
    implicit = dict(until=0.34, dt=0.02, damping=0.3, solver=mpm.Newton(tolerance=1e-11))
    iterations = [
        [r.iterations for r in each.implicit(**implicit, rebalance=threshold)]
        for each, threshold in ((model, 1.01), (alone, None))
    ]
    assert iterations[0] == iterations[1]
    assert_same(all_by_id(model), all_by_id(alone))


@pytest.mark.parametrize("scheme", ["explicit", "implicit"])
def test_a_restart_after_a_cut_goes_on_to_the_last_bit(comm, shared_path, scheme):
    # Damping makes a difference in the last bit grow.
    options = dict(until=0.4, every=0.1, since=0.0, damping=0.5, rebalance=1.2)
    if scheme == "implicit":
        options["dt"] = 0.02
    never_stopped, model, again = (sliding_slope(comm) for _ in range(3))
    list(getattr(never_stopped, scheme)(**options))
    list(getattr(model, scheme)(**options, watch=lambda: model.time > 0.25))
    model.save(shared_path / "state.h5")
    again.restore(shared_path / "state.h5")
    np.testing.assert_array_equal(again.mesh.global_cells, model.mesh.global_cells)
    list(getattr(again, scheme)(**options))
    for name, values in all_by_id(never_stopped).items():
        np.testing.assert_array_equal(all_by_id(again)[name], values, err_msg=name)

    if scheme == "explicit":  # and on another number of ranks
        alone, goes_on = sliding_slope(MPI.COMM_SELF), sliding_slope(comm)
        goes_on.restore(shared_path / "state.h5")
        alone.restore(shared_path / "state.h5")
        for each in (alone, goes_on):
            list(each.explicit(until=0.3, pic=0.01))
        assert_same(all_by_id(alone), all_by_id(goes_on))


def test_one_cut_twice_is_the_same(comm):
    cells = []
    for _ in range(2):
        model = sliding_slope(comm)
        before = model.imbalance()
        assert model.rebalance() <= before
        in_cells = np.bincount(model.particles.cell, minlength=model.mesh.owned_cells)
        weights = comm.allgather(np.sum(1 + PARTICLE_WEIGHT * in_cells))
        heaviest_cell = 1 + PARTICLE_WEIGHT * comm.allreduce(in_cells.max(initial=0), MPI.MAX)
        assert (
            max(weights) <= np.mean(weights) + heaviest_cell
        )  # cells are not split; seven ranks have six or seven with soil
        cells.append(model.mesh.global_cells)
    np.testing.assert_array_equal(*cells)


def test_supports_and_tags_go_along(comm):
    model = sliding_slope(comm)
    model.outflow(2)
    model.set_gravity((50.0, 0.0))
    start = model.report().particles
    *_, report = model.explicit(until=1.0, rebalance=1.1)
    assert report.outflow_particles + report.particles == start and report.outflow_particles > 0
    model.prescribe(2, (1.0, 0.0))
    assert model.rebalance() >= 1.0


def test_nodal_values_of_a_mesh_cut_anew(comm):
    model = sliding_slope(comm)
    start = model.mesh
    list(model.explicit(0.1))
    model.rebalance()
    function = np.column_stack([model.mesh.points @ [2.0, -1.0], model.mesh.global_nodes])
    np.testing.assert_array_equal(start.nodal_of(model.mesh, function[:, 1]), start.global_nodes)
    found = start.nodal_of(model.mesh, function)
    np.testing.assert_array_equal(found, np.column_stack([start.points @ [2.0, -1.0], start.global_nodes]))
    with pytest.raises(mpm.InputError, match="values has shape"):
        start.nodal_of(model.mesh, function[:-1])
    smaller = spread_box((2, 2), (1.0, 1.0), comm, bands)
    with pytest.raises(
        mpm.InputError, match="other is a mesh without node .*, expected this mesh under another partition"
    ):
        start.nodal_of(smaller, np.zeros(len(smaller.points)))


@pytest.mark.parametrize("compression", [0, 1])  # compressed values are not put together in shared memory
def test_nodal_fields_of_a_model_are_written_as_copies_of_them_are(comm, shared_path, compression):
    model = sliding_slope(comm)
    start = model.mesh
    names = ("mass", "velocity", "internal_force")
    with (
        MeshOutput(
            shared_path / "copies", comm, start.points, start.cells[: start.owned_cells], float32=False
        ) as copies,
        ModelOutput(
            model, mesh=shared_path / "model", nodal_fields=names, float32=False, compression=compression
        ) as output,
    ):
        output.write()  # before the first step
        copies.write(0.0, {name: model.nodal(name) for name in names})
        everything = np.arange(start.cell_numbers)
        cuts = (
            lambda: None,
            model.rebalance,
            lambda: take_partition(model, everything if comm.rank == comm.size - 1 else everything[:0]),
        )
        for cut in cuts:
            cut()
            *_, report = model.explicit(model.time + 0.05)
            copies.write(report.time, {name: start.nodal_of(model.mesh, model.nodal(name)) for name in names})
            output.write()
            assert comm.size == 1 or (model.mesh is start) == (cut is cuts[0])
    for frame in ("000000.h5", "000001.h5", "000002.h5", "000003.h5"):
        with h5py.File(shared_path / "copies" / frame) as one, h5py.File(shared_path / "model" / frame) as other:
            assert set(one) == set(other) == set(names)
            for name in names:
                np.testing.assert_array_equal(one[name][()], other[name][()])
            assert (np.abs(one["velocity"][()]).max() > 0) == (frame != "000000.h5") and one["mass"][()].max() > 0


def test_everything_on_one_rank_and_back(comm):
    # Ranks without cells and nodes.
    model, alone = sliding_slope(comm), sliding_slope(MPI.COMM_SELF)
    everything = np.arange(model.mesh.cell_numbers)
    take_partition(model, everything if comm.rank == comm.size - 1 else everything[:0])
    assert model.imbalance() == comm.size
    for each in (model, alone):
        list(each.explicit(0.1, pic=0.01))
    model.rebalance()
    for each in (model, alone):
        list(each.explicit(0.2, pic=0.01))
    assert_same(all_by_id(model), all_by_id(alone))


@pytest.mark.parametrize("value", [1.0, 0.5, float("nan"), float("inf")])
def test_a_threshold_that_is_none(comm, value):
    with pytest.raises(mpm.InputError, match="rebalance is .*, expected a number above 1"):
        sliding_slope(comm).explicit(0.1, rebalance=value)
