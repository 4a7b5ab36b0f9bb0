"""Output over time: what h5py, meshio and VTK read is what was written."""

import signal
import subprocess
import sys
import time
from xml.etree import ElementTree

import h5py
import meshio
import numpy as np
import pytest
from core_cases import box
from mpm_core.output import MeshOutput, ModelOutput, ParticleOutput
from output_cases import COMM, SQUARE, TRIANGLES, particle_fields

import mpm_core as mpm
from mpm_core import InputError, series


def padded(vectors):
    return np.hstack([vectors, np.zeros((len(vectors), 3 - vectors.shape[1]))])


def stored(fields):
    """The datasets that fields of a frame become."""
    names = ["xx", "yy", "zz", "xy", "yz", "xz"]
    expected = {}
    for name, values in fields.items():
        if values.ndim == 2 and values.shape[1] in (4, 6):
            expected |= {f"{name}_{names[k]}": values[:, k] for k in range(values.shape[1])}
        else:
            expected[name] = padded(values) if values.ndim == 2 and values.shape[1] == 2 else values
    return expected


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("float32", [True, False])
def test_h5py_reads_what_was_written(tmp_path, dimension, float32):
    frames = [particle_fields(n, dimension, seed=n) for n in (7, 7, 5, 0, 1)]
    with ParticleOutput(tmp_path / "particles", COMM, float32) as output:
        for step, fields in enumerate(frames):
            output.write(0.1 * step, fields)
    assert sorted(path.name for path in (tmp_path / "particles").iterdir()) == [f"00000{k}.h5" for k in range(5)]
    for step, fields in enumerate(frames):
        with h5py.File(tmp_path / "particles" / f"00000{step}.h5") as file:
            for name, values in stored(fields).items():
                real = values.dtype.kind == "f"
                assert file[name].dtype == (np.float32 if real and float32 else np.float64 if real else np.int32)
                # float32 keeps 24 binary digits
                np.testing.assert_allclose(file[name][()], values, rtol=2.0**-24 if float32 and real else 0)


def test_positions_on_a_map_are_stored_in_double_precision(tmp_path):
    # Single precision has 24 binary digits: half a metre of a northing of 5335 km, and the particles of a slide are closer.
    fields = particle_fields(7, 2)
    near, far = fields["position"], fields["position"] + [691000.0, 5335000.0]
    for name, position in (("near", near), ("far", far)):
        with ParticleOutput(tmp_path / name, COMM) as output:
            output.write(0.0, fields | {"position": position})
        with MeshOutput(tmp_path / f"{name}_mesh", COMM, position, TRIANGLES) as output:
            output.write(0.0, {}, points=position + 0.25)
        for file, key, shift in ((f"{name}/000000", "position", 0), (f"{name}_mesh/mesh", "points", 0),
                                 (f"{name}_mesh/000000", "points", 0.25)):  # fmt: skip
            with h5py.File(tmp_path / f"{file}.h5") as stored_frame:
                stored_positions = stored_frame[key][()]
                assert stored_positions.dtype == (np.float64 if name == "far" else np.float32)
                np.testing.assert_allclose(
                    stored_positions, padded(position + shift), rtol=1e-15 if name == "far" else 1e-7
                )
                assert name == "near" or "velocity" not in stored_frame or stored_frame["velocity"].dtype == np.float32


def test_meshio_reads_the_particles_over_time(tmp_path):
    frames = [particle_fields(6, 2, seed=step) for step in range(3)]
    with ParticleOutput(tmp_path / "particles.xdmf", COMM, float32=False) as output:
        for step, fields in enumerate(frames):
            output.write(0.5 * step, fields)
    with meshio.xdmf.TimeSeriesReader(tmp_path / "particles.xdmf") as reader:
        points, cells = reader.read_points_cells()
        np.testing.assert_array_equal(points, padded(frames[0]["position"]))
        assert cells[0].type == "vertex" and len(cells[0].data) == 6
        assert reader.num_steps == 3
        for step, fields in enumerate(frames):
            time, data, _ = reader.read_data(step)
            assert time == 0.5 * step
            for name, values in stored(fields).items():
                np.testing.assert_array_equal(data[name], values)


def read_with_vtk(path, time):
    """The data set that VTK's XDMF reader gives for a time."""
    vtk = pytest.importorskip("vtk")
    if not hasattr(vtk, "vtkXdmfReader"):
        pytest.skip("this VTK was built without its XDMF reader")
    reader = vtk.vtkXdmfReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    reader.UpdateTimeStep(time)
    data = reader.GetOutputDataObject(0)
    while data.IsA("vtkMultiBlockDataSet"):
        data = data.GetBlock(0)
    return data


def test_vtk_reads_particles_and_mesh_over_time(tmp_path):
    frames = [particle_fields(n, 2, seed=n) for n in (4, 6)]
    with ParticleOutput(tmp_path / "particles", COMM) as output:
        for step, fields in enumerate(frames):
            output.write(float(step), fields)
            # The series goes on.
            data = read_with_vtk(tmp_path / "particles.xdmf", float(step))
            assert data.GetNumberOfPoints() == len(fields["position"])
    for step, fields in enumerate(frames):
        data = read_with_vtk(tmp_path / "particles.xdmf", float(step))
        n = len(fields["position"])
        assert data.GetNumberOfPoints() == data.GetNumberOfCells() == n
        points = [data.GetPoint(i) for i in range(n)]
        np.testing.assert_allclose(points, padded(fields["position"]), rtol=1e-6)
        stress = data.GetPointData().GetArray("stress_yy")
        np.testing.assert_allclose([stress.GetTuple1(i) for i in range(n)], fields["stress"][:, 1], rtol=1e-6)
        numbers = data.GetPointData().GetArray("id")
        assert [numbers.GetTuple1(i) for i in range(n)] == fields["id"].tolist()
    with MeshOutput(tmp_path / "mesh", COMM, SQUARE, TRIANGLES):
        pass
    assert read_with_vtk(tmp_path / "mesh.xdmf", 0.0).GetNumberOfCells() == 2
    with MeshOutput(tmp_path / "mesh", COMM, SQUARE, TRIANGLES, fixed={"tag": np.array([3, 5])}) as output:
        output.write(0.0)
        output.write(1.0)
    tags = read_with_vtk(tmp_path / "mesh.xdmf", 1.0).GetCellData().GetArray("tag")
    assert [tags.GetTuple1(k) for k in range(2)] == [3, 5]


def test_mesh_without_fields_is_one_grid(tmp_path):
    with MeshOutput(tmp_path / "mesh", COMM, SQUARE, TRIANGLES, float32=False):
        mesh = meshio.read(tmp_path / "mesh.xdmf")
    np.testing.assert_array_equal(mesh.points, padded(SQUARE))
    np.testing.assert_array_equal(mesh.cells_dict["triangle"], TRIANGLES)


def test_mesh_fields_over_time(tmp_path):
    tetrahedron = np.vstack([np.zeros(3), np.eye(3)])
    with MeshOutput(tmp_path / "mesh", COMM, tetrahedron, np.array([[0, 1, 2, 3]]), float32=False) as output:
        for step in range(2):
            output.write(float(step), {"mass": np.arange(4.0) + step}, {"pressure": np.array([10.0 * step])})
    with meshio.xdmf.TimeSeriesReader(tmp_path / "mesh.xdmf") as reader:
        points, cells = reader.read_points_cells()
        np.testing.assert_array_equal(points, tetrahedron)
        assert cells[0].type == "tetra"
        for step in range(2):
            time, at_nodes, in_cells = reader.read_data(step)
            assert time == step
            np.testing.assert_array_equal(at_nodes["mass"], np.arange(4.0) + step)
            np.testing.assert_array_equal(in_cells["pressure"][0], [10.0 * step])


def test_fixed_fields_are_stored_once_and_are_in_every_frame(tmp_path):
    with MeshOutput(tmp_path / "mesh", COMM, SQUARE, TRIANGLES, fixed={"tag": np.array([3, 5])}) as output:
        for step in range(2):
            output.write(float(step), {"mass": np.full(len(SQUARE), step)})
    with h5py.File(tmp_path / "mesh/000001.h5") as frame:
        assert set(frame) == {"mass"}
    with meshio.xdmf.TimeSeriesReader(tmp_path / "mesh.xdmf") as reader:
        reader.read_points_cells()
        for step in range(2):
            _, at_nodes, in_cells = reader.read_data(step)
            np.testing.assert_array_equal(at_nodes["mass"], np.full(len(SQUARE), step))
            np.testing.assert_array_equal(in_cells["tag"][0], [3, 5])
    with pytest.raises(InputError, match="tag has 3 rows, expected 2"):
        MeshOutput(tmp_path / "mesh", COMM, SQUARE, TRIANGLES, fixed={"tag": np.ones(3)})


def test_nodes_that_have_moved_are_stored_with_their_frame(tmp_path):
    moved = SQUARE * np.array([2.0, 0.5])
    with MeshOutput(
        tmp_path / "mesh", COMM, SQUARE, TRIANGLES, float32=False, fixed={"tag": np.array([3, 5])}
    ) as output:
        for step, points in enumerate((None, moved, None)):
            output.write(float(step), {"mass": np.full(len(SQUARE), step)}, points=points)
    frames = ElementTree.parse(tmp_path / "mesh.xdmf").findall(".//Grid[@Name='frame']")
    for frame, expected in zip(frames, (SQUARE, moved, SQUARE), strict=True):
        file, name = frame.find("Geometry/DataItem").text.split(":/")
        with h5py.File(tmp_path / file) as stored_points:
            np.testing.assert_array_equal(stored_points[name], padded(expected))
        assert frame.find("Topology/DataItem").text == "mesh/mesh.h5:/cells"
        assert [field.get("Name") for field in frame.findall("Attribute")] == ["tag", "mass"]


def test_all_files_are_valid_while_the_run_goes_on(tmp_path):
    with ParticleOutput(tmp_path / "particles", COMM) as output:
        for step in range(3):
            output.write(float(step), particle_fields(5, 2))
            tree = ElementTree.parse(tmp_path / "particles.xdmf")
            assert [float(t.get("Value")) for t in tree.iter("Time")] == list(range(step + 1))
            # Another process, as ParaView is.
            read = "import h5py, sys; print([len(h5py.File(path)['position']) for path in sys.argv[1:]])"
            files = sorted((tmp_path / "particles").iterdir())
            lengths = subprocess.run([sys.executable, "-c", read, *files], capture_output=True, text=True, check=True)
            assert lengths.stdout.strip() == str([5] * (step + 1))


def test_a_long_series_is_valid_all_the_time(tmp_path):
    path, n = tmp_path / "particles.xdmf", 400  # frames, more than room is kept for at once
    with ParticleOutput(path, COMM) as output:
        for step in range(n):
            output.write(float(step), {"position": np.full((2, 2), step), "mass": np.full(2, step)})
            if step % 7 == 0 or step > n - 10:
                times = [float(t.get("Value")) for t in ElementTree.parse(path).iter("Time")]
                assert times == list(range(step + 1))
    for step in range(n):
        with h5py.File(tmp_path / "particles" / f"{step:06d}.h5") as file:
            assert file["mass"][1] == step and file["position"][1, 1] == step
    times = [float(t.get("Value")) for t in ElementTree.parse(path).iter("Time")]
    assert times == list(range(n)) and path.read_text().endswith("</Xdmf>\n")


def test_a_long_series_is_not_rewritten_for_each_frame(tmp_path, monkeypatch):
    """Else its bytes would grow with the square of the frames. It is valid at any time, and complete in the end."""
    monkeypatch.setattr(series, "SHORT", 20_000)
    path, n, rewritten, known = tmp_path / "particles.xdmf", 600, [], 0
    replace = series.Series._replace_xdmf
    monkeypatch.setattr(
        series.Series, "_replace_xdmf", lambda self, text: (rewritten.append(text), replace(self, text))
    )
    with ParticleOutput(path, COMM) as output:
        for step in range(n):
            output.write(float(step), {"position": np.full((2, 2), step), "mass": np.full(2, step)})
            if step % 50 == 0:
                times = [float(t.get("Value")) for t in ElementTree.parse(path).iter("Time")]
                assert times == list(range(len(times))) and known <= len(times) <= step + 1
                known = len(times)
    assert [float(t.get("Value")) for t in ElementTree.parse(path).iter("Time")] == list(range(n))
    named = [text.count("<Time ") for text in rewritten]
    short = sum(len(text) < 20_000 for text in rewritten)
    assert named[:short] == list(range(short)) and short > 10
    assert short < len(rewritten) < n / 2 and named[-1] == n
    output.close()  # has nothing left to do


# Frames until it is killed; each field of frame k is k.
WRITES_FOR_EVER = """
import itertools, sys, time
import numpy as np
from mpi4py import MPI
from mpm_core.output import MeshOutput, ParticleOutput
particles = ParticleOutput(sys.argv[1] + "/particles", MPI.COMM_WORLD)
mesh = MeshOutput(sys.argv[1] + "/mesh", MPI.COMM_WORLD, np.array([[0.0, 0], [1, 0], [0, 1]]), np.array([[0, 1, 2]]))
if sys.argv[2] == "background":  # as ModelOutput does
    particles._series.write_in_background()
    mesh._series.write_in_background()
for step in itertools.count():
    particles.write(step, {"position": np.full((1000, 2), step), "mass": np.full(1000, step)})
    mesh.write(step, {"mass": np.full(3, step)})
    print(step, flush=True)
    time.sleep(0.003)
"""


def read_all(folder):
    """Reads both series by meshio and all that h5py finds under the names in the XDMF files; gives the numbers of frames."""
    counts = []
    for name in ("particles", "mesh"):
        with meshio.xdmf.TimeSeriesReader(folder / f"{name}.xdmf") as reader:
            reader.read_points_cells()
            counts.append(reader.num_steps)
            for step in {0, reader.num_steps // 2, reader.num_steps - 1}:
                t, data, _ = reader.read_data(step)
                assert t == step and np.all(data["mass"] == step)
        for step in range(counts[-1]):
            with h5py.File(folder / name / f"{step:06d}.h5") as file:
                assert np.all(file["mass"][()] == step)
    return counts


@pytest.mark.parametrize("how", ["at once", "background"])
def test_series_are_read_while_the_run_goes_on_and_after_a_kill(tmp_path, how):
    for seed in range(4 if how == "at once" else 3):
        random = np.random.default_rng(seed)
        with subprocess.Popen(
            [sys.executable, "-c", WRITES_FOR_EVER, tmp_path, how], stdout=subprocess.PIPE, text=True
        ) as run:
            for line in run.stdout:
                if line == ("1\n" if how == "at once" else "2\n"):
                    break
            first, _ = read_all(tmp_path)
            time.sleep(0.3 * random.random())
            second, _ = read_all(tmp_path)
            run.kill()
        last, _ = read_all(tmp_path)
        assert 2 <= first < second <= last
        assert run.returncode == -signal.SIGKILL


def test_a_reader_that_keeps_all_open_goes_on_reading(tmp_path):
    fields = {"position": np.zeros((2, 2)), "mass": np.zeros(2)}
    with ParticleOutput(tmp_path / "particles", COMM) as output:
        for step in range(20):
            output.write(float(step), {**fields, "mass": np.full(2, step)})
        with meshio.xdmf.TimeSeriesReader(tmp_path / "particles.xdmf") as reader:
            reader.read_points_cells()
            for step in range(20):
                for time_of_writer in (20.0 + 2 * step, 21.0 + 2 * step):
                    output.write(time_of_writer, fields)
                assert np.all(reader.read_data(step)[1]["mass"] == step)


def test_what_an_earlier_series_left_is_removed(tmp_path):
    for n in (3, 2):
        with ParticleOutput(tmp_path / "particles", COMM) as output:
            for step in range(n):
                output.write(float(step), particle_fields(4, 2))
        (tmp_path / "particles" / "notes.txt").write_text("not ours")
    assert sorted(p.name for p in (tmp_path / "particles").iterdir()) == ["000000.h5", "000001.h5", "notes.txt"]


@pytest.mark.parametrize("some", [1, 20_000])
def test_the_same_frames_make_the_same_files(tmp_path, some):
    frames = [particle_fields(n * some, 2, seed=step) for step, n in enumerate((5, 5, 5, 4, 4))]
    for name in ("a", "b"):
        with ParticleOutput(tmp_path / name, COMM) as output:
            for step, fields in enumerate(frames):
                output.write(float(step), fields)
        time.sleep(1.1 if name == "a" else 0.0)  # HDF5 keeps times to a second, unless this is switched off
    for step in range(len(frames)):
        one, other = (tmp_path / name / f"{step:06d}.h5" for name in ("a", "b"))
        assert one.read_bytes() == other.read_bytes()
        with h5py.File(one) as file:
            for name, values in stored(frames[step]).items():
                np.testing.assert_array_equal(file[name][()], values.astype(file[name].dtype))


@pytest.mark.parametrize("wet", [False, True])
def test_a_model_is_written_before_its_first_step_with_its_pore_pressure(tmp_path, wet):
    model = mpm.Model(box([2, 2]), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    if wet:
        model.add_water(porosity=0.4, conductivity=1e-6)
        model.set_pore_pressure(lambda x: 5e3 * x[:, 1])
    with ModelOutput(model, tmp_path / "particles", tmp_path / "mesh") as output:
        output.write()
    with h5py.File(tmp_path / "mesh" / "000000.h5") as file:
        assert file["mass"][()].sum() == pytest.approx(2000.0)
    with h5py.File(tmp_path / "particles" / "000000.h5") as file:
        assert ("pore_pressure" in file) == wet
        if wet:
            np.testing.assert_allclose(file["pore_pressure"][()], 5e3 * model.particles.position[:, 1], rtol=1e-6)
