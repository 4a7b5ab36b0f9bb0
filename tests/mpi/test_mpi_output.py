"""Output on several ranks: each writes its particles, and an error on one is one on all."""

import h5py
import meshio
import numpy as np
import pytest
from mpm_core.output import MeshOutput, ModelOutput, ParticleOutput
from partitions import one_does_all, scattered, spread_box

import mpm_core as mpm
from mpm_core import InputError, RunError


@pytest.mark.parametrize("some", [1, 200_000])
def test_shares_are_stored_by_rising_rank(comm, shared_path, some):
    # Rank r has r times some particles, so the first has none; in the second frame all have twice as many, in the third none has
    # any. In the last two there are as many as in the first, where other ranks have them, and the same again.
    rising = [some * rank for rank in range(comm.size)]
    counts = [rising, [2 * some] * comm.size, [0] * comm.size, rising[::-1], rising]
    with ParticleOutput(shared_path / "particles", comm, float32=False) as output:
        for step, count in enumerate(counts):
            n = count[comm.rank]
            position = np.full((n, 3), comm.rank, dtype=float)
            output.write(float(step), {"position": position, "id": 100 * comm.rank + np.arange(n)})
    for step, count in enumerate(counts):
        ranks = np.repeat(np.arange(comm.size), count)
        numbers = np.concatenate([100 * rank + np.arange(count[rank]) for rank in range(comm.size)])
        with h5py.File(shared_path / "particles" / f"00000{step}.h5") as file:
            np.testing.assert_array_equal(file["position"][:, 0], ranks)
            np.testing.assert_array_equal(file["id"][()], numbers)


def test_whole_numbers_are_as_wide_as_those_of_any_rank_need(comm, shared_path):
    last = comm.rank == comm.size - 1
    frames = [{"some": 2**31 if last else -1, "others": -(2**31)}, {"some": 5, "others": -(2**31) - last}]
    with ParticleOutput(shared_path / "particles", comm) as output:
        for step, frame in enumerate(frames):
            fields = {name: np.full(2, value) for name, value in frame.items()}
            output.write(float(step), {"position": np.zeros((2, 2)), **fields})
    for step, widths in enumerate([{"some": 8, "others": 4}, {"some": 4, "others": 8}]):
        with h5py.File(shared_path / "particles" / f"00000{step}.h5") as file:
            for name, width in widths.items():
                assert file[name].dtype.itemsize == width
                expected = np.repeat(comm.allgather(frames[step][name]), 2)
                np.testing.assert_array_equal(file[name][()], expected)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("float32, background", [(True, True), (False, False)])
def test_a_models_particles_are_written_as_copies_of_them_are(comm, shared_path, dim, float32, background):
    owners = scattered if dim == 2 else one_does_all
    counts, sizes = ((6, 4), (3.0, 2.0)) if dim == 2 else ((3, 2, 2), (3.0, 2.0, 2.0))
    mesh = spread_box(counts, sizes, comm, owners)
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0))
    model.seed(density=2000.0, per_cell=1)
    model.set_gravity((0, -9.81, 0)[:dim])
    *_, report = model.explicit(0.01)
    p, own = model.particles, slice(mesh.owned_cells)
    names = ["displacement", "velocity", "stress", "state", "plastic_strain", "volume", "id", "material", "cell"]
    more = {"pore": 2.0 * p.volume, "number": 3 * p.id}
    nodal = ["internal_force", "acceleration"]
    for folder in ("copies", "model"):
        (shared_path / folder).mkdir(exist_ok=True)
    with (
        ParticleOutput(shared_path / "copies/particles", comm, float32) as particles,
        MeshOutput(
            shared_path / "copies/mesh", comm, mesh.points, mesh.cells[own], float32, fixed={"tag": mesh.cell_tags[own]}
        ) as nodes,
    ):
        particles.write(report.time, {name: getattr(p, name) for name in ("position", *names)} | more)
        nodes.write(report.time, {name: model.nodal(name) for name in nodal})
    with ModelOutput(
        model, shared_path / "model/particles", shared_path / "model/mesh", names, nodal, float32, background=background
    ) as output:
        output.write(more)
    for series in ("particles", "mesh"):
        texts = [(shared_path / folder / f"{series}.xdmf").read_text() for folder in ("copies", "model")]
        assert texts[0] == texts[1]
        files = [f"{series}/{name}.h5" for name in ("000000", "mesh")[: 1 if series == "particles" else 2]]
        for name in files:
            with h5py.File(shared_path / "copies" / name) as one, h5py.File(shared_path / "model" / name) as other:
                assert set(one) == set(other)
                for field, values in one.items():
                    assert values.dtype == other[field].dtype
                    np.testing.assert_array_equal(values[()], other[field][()], err_msg=field)
    with h5py.File(shared_path / "model/particles/000000.h5") as file:
        assert len(file["id"]) == report.particles > 0 and np.abs(file["displacement"][:, 1]).max() > 0


@pytest.mark.parametrize("background", [True, False])
def test_a_models_positions_on_a_map_are_stored_in_double_precision(comm, shared_path, background):
    origin = np.array([691000.0, 5335000.0])
    mesh = spread_box((6, 4), (3.0, 2.0), comm, scattered, origin=origin)
    model = mpm.Model(mesh, mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=1)
    model.add_contact(mpm.Disc(centre=origin - 5.0, radius=1.0), friction=0.3)
    model.report()
    paths = [shared_path / name for name in ("particles", "mesh", "bodies")]
    with ModelOutput(model, *paths[:2], bodies=paths[2], background=background) as output:
        output.write()
    assert sum(comm.allgather(len(model.particles))) == 48
    placed = np.concatenate(comm.allgather(model.particles.position))
    with h5py.File(shared_path / "particles/000000.h5") as file:
        np.testing.assert_array_equal(file["position"][:, :2], placed)
        assert file["velocity"].dtype == np.float32
    for name in ("mesh/mesh", "bodies/000000"):
        with h5py.File(shared_path / f"{name}.h5") as file:
            assert file["points"].dtype == np.float64


def small_model(comm):
    model = mpm.Model(spread_box((4, 2), (2.0, 1.0), comm), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=1)
    return model


def test_wrong_fields_of_a_model_are_named_before_files_are_made(comm, shared_path):
    model = small_model(comm)
    particles, mesh = shared_path / "particles", shared_path / "mesh"
    wrong = [
        ({}, "particles, mesh and bodies are None, expected a path for one of them at least"),
        ({"particles": particles, "particle_fields": ["weight"]}, "particle field is 'weight', which does not exist"),
        ({"particles": particles, "particle_fields": ["traction"]}, "'traction', but no particle carries one"),
        ({"mesh": mesh, "nodal_fields": ["weight"]}, "nodal field is 'weight', expected velocity"),
    ]
    if comm.size > 1:
        names = ["mass"] if comm.rank == 0 else ["velocity"]
        wrong.append(
            ({"mesh": mesh, "nodal_fields": names}, "fields are not the same on all ranks; here: .*nodal " + names[0])
        )
    for arguments, message in wrong:
        with pytest.raises(InputError, match=message):
            ModelOutput(model, **arguments)
    comm.barrier()
    assert not list(shared_path.iterdir())


def test_a_further_field_of_wrong_length_on_one_rank_is_raised_on_all(comm, shared_path):
    model = small_model(comm)
    with ModelOutput(model, shared_path / "particles") as output:
        with pytest.raises(InputError, match="pore has [0-9]+ rows, expected"):
            output.write({"pore": np.zeros(len(model.particles) + (comm.rank == comm.size - 1))})
        output.write({"pore": np.zeros(len(model.particles))})


@pytest.mark.parametrize("refused, other", [("particles", "mesh"), ("mesh", "particles")])
@pytest.mark.parametrize("compression", [0, 1])
def test_a_model_is_written_on_after_one_of_its_files_could_not_be(comm, shared_path, refused, other, compression):
    model = small_model(comm)
    model.set_gravity((0.0, -9.81))
    with ModelOutput(model, shared_path / "particles", shared_path / "mesh", compression=compression) as output:
        for step in range(4):
            list(model.explicit(0.01 * (step + 1)))
            if step == 2:  # a folder in the place of the file
                if comm.rank == 0:
                    (shared_path / refused / "000002.h5").mkdir()
                comm.barrier()
                with pytest.raises(RunError, match=f"cannot (write|create) .*/{refused}/000002.h5"):
                    output.write()
                if comm.rank == 0:
                    (shared_path / refused / "000002.h5").rmdir()
            else:
                output.write()
    for series in (refused, other):
        with meshio.xdmf.TimeSeriesReader(shared_path / f"{series}.xdmf") as reader:
            reader.read_points_cells()
            read = [reader.read_data(k) for k in range(reader.num_steps)]
        times = [time for time, *_ in read]
        expected = [0.01, 0.02, 0.04] if series == refused else [0.01, 0.02, 0.03, 0.04]
        np.testing.assert_allclose(times, expected)
        for time, data, _ in read:  # free fall
            assert data["velocity"][:, 1].min() == pytest.approx(-9.81 * time, rel=1e-5)


def test_a_frame_that_fails_in_the_background_is_an_error_on_all_ranks(comm, shared_path):
    model = small_model(comm)
    output = ModelOutput(model, shared_path / "particles", background=True)
    if comm.rank == 0:
        (shared_path / "particles/000000.h5").mkdir()
    comm.barrier()
    output.write()
    with pytest.raises(RunError, match="cannot write .*/particles/000000.h5: Is a directory"):
        output.write()
    if comm.rank == 0:
        (shared_path / "particles/000000.h5").rmdir()
    comm.barrier()
    for _ in range(2):
        output.write()
    output.close()
    assert (shared_path / "particles.xdmf").read_text().count("<Time ") == 2


def large_fields(rank):
    """Fields of 3 MB on each rank that has particles, which the first one has not."""
    n = 100_000 if rank else 0
    values = np.random.default_rng(rank).random((n, 3)).astype(np.float32)
    return {"position": values, "velocity": values + 1, "mass": values[:, 0] + 2}


@pytest.mark.parametrize("background", [True, False])
@pytest.mark.parametrize("compression", [0, 1])
def test_large_fields_are_written_by_several_ranks_and_read_through_the_first_file(
    comm, shared_path, background, compression
):
    with ParticleOutput(shared_path / "particles", comm, compression=compression) as output:
        if background:
            output._series.write_in_background()
        for time in (0.0, 1.0):
            output.write(time, large_fields(comm.rank))
    files = sorted(path.name for path in (shared_path / "particles").iterdir())
    per_frame = min(comm.size, 3)  # one for each field that is larger than 1 MB
    assert len(files) == (2 * per_frame if comm.size > 1 else 2)
    comm.barrier()
    if comm.rank == 0:  # results may be moved
        (shared_path / "moved").mkdir()
        for name in ("particles", "particles.xdmf"):
            (shared_path / name).rename(shared_path / "moved" / name)
    comm.barrier()
    whole = comm.allgather(large_fields(comm.rank))
    expected = {name: np.concatenate([fields[name] for fields in whole]) for name in whole[0]}
    with h5py.File(shared_path / "moved/particles/000001.h5") as file:
        assert set(file) >= set(expected)
        for name, values in expected.items():
            np.testing.assert_array_equal(file[name][()], values)
    with meshio.xdmf.TimeSeriesReader(shared_path / "moved/particles.xdmf") as reader:
        points, _ = reader.read_points_cells()
        assert reader.num_steps == 2
        np.testing.assert_array_equal(points, expected["position"])
        np.testing.assert_array_equal(reader.read_data(1)[1]["velocity"], expected["velocity"])


@pytest.mark.parametrize("background", [True, False])
def test_a_frame_counts_only_if_all_ranks_could_write_their_fields(comm, shared_path, background):
    if comm.size == 1:
        pytest.skip("needs two ranks")
    output = ParticleOutput(shared_path / "particles", comm)
    if background:
        output._series.write_in_background()
    fields, refused = large_fields(comm.rank), shared_path / "particles/000001-1.h5"
    output.write(0.0, fields)
    if comm.rank == 0:
        refused.mkdir()
    comm.barrier()
    with pytest.raises(RunError, match="cannot write .*/particles/000001-1.h5: Is a directory"):
        output.write(1.0, fields)
        output.close()  # else the frame is waited for here
    comm.barrier()
    assert not (shared_path / "particles/000001.h5").exists()
    assert (shared_path / "particles.xdmf").read_text().count("<Time ") == 1
    if background:
        return
    if comm.rank == 0:
        refused.rmdir()
    comm.barrier()
    output.write(2.0, fields)
    output.close()
    assert (shared_path / "particles.xdmf").read_text().count("<Time ") == 2
    with h5py.File(shared_path / "particles/000001.h5") as file:
        assert len(file["mass"]) == 100_000 * (comm.size - 1)


@pytest.mark.parametrize("compression", [1, 9])
def test_compressed_values_come_back(comm, shared_path, compression):
    # Rank r has 100 r particles, so the first has none.
    n = 100 * comm.rank
    position = np.random.default_rng(comm.rank).random((n, 3))
    whole = np.concatenate(comm.allgather(position))
    for name, level in (("plain", 0), ("small", compression)):
        with ParticleOutput(shared_path / name, comm, float32=False, compression=level) as output:
            output.write(0.0, {"position": position, "mass": np.ones(n)})
            output.write(1.0, {"position": position[:0], "mass": np.ones(0)})
    with h5py.File(shared_path / "small/000000.h5") as file:
        np.testing.assert_array_equal(file["position"][()], whole)
        if len(whole):
            assert file["mass"].compression == "gzip" and file["mass"].id.get_storage_size() < 4 * len(whole)
    assert (shared_path / "plain.xdmf").read_text().replace("plain", "small") == (
        shared_path / "small.xdmf"
    ).read_text()


def test_a_wrong_level_of_compression_is_named(comm, shared_path):
    with pytest.raises(InputError, match="compression is 10, expected a whole number from 0 to 9"):
        ParticleOutput(shared_path / "particles", comm, compression=10)


def test_mesh_cells_keep_their_nodes(comm, shared_path):
    # Each rank gives one triangle, moved by its rank along x.
    points = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) + [comm.rank, 0.0]
    with MeshOutput(shared_path / "mesh", comm, points, np.array([[0, 1, 2]])):
        pass
    mesh = meshio.read(shared_path / "mesh.xdmf")
    corners = mesh.points[mesh.cells_dict["triangle"]]
    np.testing.assert_array_equal(corners[:, 0, 0], np.arange(comm.size))
    np.testing.assert_array_equal(corners[:, 1, 0], np.arange(comm.size) + 1)


def test_a_bad_field_on_one_rank_is_raised_on_all(comm, shared_path):
    last = comm.rank == comm.size - 1
    with ParticleOutput(shared_path / "particles", comm) as output:
        with pytest.raises(InputError, match="mass has 3 rows, expected 2"):
            output.write(0.0, {"position": np.zeros((2, 2)), "mass": np.zeros(3 if last else 2)})


def test_an_error_on_one_rank_waits_for_no_other(comm, shared_path):
    with ParticleOutput(shared_path / "particles", comm) as output:
        output.write(0.0, {"position": np.zeros((2, 2))})
        try:
            with output:
                if comm.rank == comm.size - 1:
                    raise ArithmeticError
                comm.barrier()  # whereas the last one is on its way out
        except ArithmeticError:
            comm.barrier()
    assert (shared_path / "particles.xdmf").read_text().endswith("</Xdmf>\n")


def test_different_names_are_refused_on_all_ranks(comm, shared_path):
    if comm.size == 1:
        pytest.skip("needs two ranks")
    name = "mass" if comm.rank == 0 else "volume"
    with ParticleOutput(shared_path / "particles", comm) as output:
        with pytest.raises(InputError, match="fields are not the same on all ranks"):
            output.write(0.0, {"position": np.zeros((2, 2)), name: np.zeros(2)})


def test_a_missing_folder_is_raised_on_all_ranks(comm, shared_path):
    with pytest.raises(RunError, match="No such file or directory"):
        ParticleOutput(shared_path / "nowhere" / "particles", comm)
