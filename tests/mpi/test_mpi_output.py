"""Output on several ranks: each writes its share, and an error on one is one on all."""

import h5py
import meshio
import numpy as np
import pytest
from mpm_core.output import MeshOutput, ParticleOutput
from partitions import one_does_all, scattered, spread_box

import mpm_core as mpm
from mpm_core import InputError, RunError


@pytest.mark.parametrize("some", [1, 200_000])  # in files that ranks put together in memory, and in longer ones
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


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("float32", [True, False])
def test_a_models_particles_are_written_as_copies_of_them_are(comm, shared_path, dim, float32):
    owners = scattered if dim == 2 else one_does_all
    counts, sizes = ((6, 4), (3.0, 2.0)) if dim == 2 else ((3, 2, 2), (3.0, 2.0, 2.0))
    mesh = spread_box(counts, sizes, comm, owners)
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=1e3, friction_angle=25.0))
    model.seed(density=2000.0, per_cell=1)
    model.set_gravity((0, -9.81, 0)[:dim])
    *_, report = model.explicit(0.01)
    p = model.particles
    names = ["displacement", "velocity", "stress", "state", "plastic_strain", "volume", "id", "material", "cell"]
    more = {"pore": 2.0 * p.volume, "number": 3 * p.id}
    with ParticleOutput(shared_path / "a", comm, float32) as output:
        output.write(0.0, {name: getattr(p, name) for name in ("position", *names)} | more)
    with ParticleOutput(shared_path / "b", comm, float32) as output:
        output.write_particles(0.0, p, names, more)
        with pytest.raises(InputError, match="particle field is 'weight', which does not exist"):
            output.write_particles(0.0, p, ["weight"])
        with pytest.raises(InputError, match="'traction', but no particle carries one"):
            output.write_particles(0.0, p, ["traction"])
    with h5py.File(shared_path / "a/000000.h5") as one, h5py.File(shared_path / "b/000000.h5") as other:
        assert set(one) == set(other) and len(one["id"]) == report.particles > 0
        for name, values in one.items():
            assert values.dtype == other[name].dtype
            np.testing.assert_array_equal(values[()], other[name][()], err_msg=name)
        assert np.abs(one["displacement"][:, 1]).max() > 0


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
