"""Frames that a thread writes while the run goes on: the same files, and errors that are raised a frame later."""

import h5py
import meshio
import numpy as np
import pytest
from core_cases import box
from mpm_core.output import ModelOutput

import mpm_core as mpm


def falling(n=2):
    """A block of n x n cells in free fall, with a plane below it."""
    model = mpm.Model(box((n, n)), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=1000.0, per_cell=1)
    model.set_gravity((0.0, -9.81))
    return model


def test_the_files_are_those_of_frames_that_are_written_at_once(tmp_path):
    model = falling()
    model.add_contact(mpm.Box((0.1, -0.2), (0.2, -0.1)))
    outputs = []
    for name in ("once", "background"):
        (tmp_path / name).mkdir()
        paths = [tmp_path / name / part for part in ("particles", "mesh")]
        outputs.append(ModelOutput(model, *paths, bodies=tmp_path / name / "bodies", background=name == "background"))
    with outputs[0], outputs[1]:
        for report in model.explicit(0.05, every=0.01):
            number = np.full(len(model.particles), report.time)
            for output in outputs:
                output.write({"time": number})
            number[:] = -1.0  # the frame has the values as they were
    names = sorted(path.relative_to(tmp_path / "once") for path in (tmp_path / "once").rglob("*.*"))
    assert len(names) == 3 * 5 + 1 + 3  # a file for each frame, the mesh, and three XDMF files
    for name in names:
        assert (tmp_path / "once" / name).read_bytes() == (tmp_path / "background" / name).read_bytes(), name
    with h5py.File(tmp_path / "background/particles/000003.h5") as file:
        np.testing.assert_allclose(file["time"], 0.04, rtol=1e-6)


@pytest.mark.parametrize("refused", [0, 2])
def test_an_error_is_raised_by_the_next_frame_and_the_series_goes_on(tmp_path, refused):
    model = falling()
    obstacle = tmp_path / "particles" / f"{refused:06d}.h5"
    with ModelOutput(model, tmp_path / "particles", background=True) as output:
        for step in range(5):
            list(model.explicit(0.01 * (step + 1)))
            if step == refused:
                obstacle.mkdir()
            if step == refused + 1:
                with pytest.raises(mpm.RunError, match=f"cannot write {obstacle}: Is a directory"):
                    output.write()
                obstacle.rmdir()
            else:
                output.write()
    # The frame that failed is missing, and so is the one that raised its error. A new one has the vertices that it had stored.
    with meshio.xdmf.TimeSeriesReader(tmp_path / "particles.xdmf") as reader:
        reader.read_points_cells()
        read = [reader.read_data(k) for k in range(reader.num_steps)]
    kept = [step for step in range(5) if step not in (refused, refused + 1)]
    np.testing.assert_allclose([time for time, *_ in read], [0.01 * (step + 1) for step in kept])
    for time, data, _ in read:
        np.testing.assert_allclose(data["velocity"][:, 1], -9.81 * time, rtol=1e-6)


def test_an_error_of_the_last_frame_is_raised_in_the_end(tmp_path):
    output = ModelOutput(falling(), tmp_path / "particles", background=True)
    (tmp_path / "particles/000000.h5").mkdir()
    output.write()
    with pytest.raises(mpm.RunError, match="cannot write .*/000000.h5: Is a directory"):
        output.close()


@pytest.mark.parametrize("small_disk", ["4M"], indirect=True)
def test_a_full_disk_leaves_whole_frames(small_disk):
    model, frames = falling(20), 0
    more = {"noise": np.random.default_rng(0).random((len(model.particles), 30))}
    with ModelOutput(model, small_disk / "particles", background=True) as output:
        with pytest.raises(mpm.RunError, match="cannot write .*particles.*: No space left on device"):
            while frames < 100:
                output.write(more)
                frames += 1
    files = sorted((small_disk / "particles").iterdir())
    assert len(files) == frames - 1 > 10  # the last one failed, the one before it raised the error
    with meshio.xdmf.TimeSeriesReader(small_disk / "particles.xdmf") as reader:
        assert reader.num_steps == len(files)
        reader.read_points_cells()
        np.testing.assert_allclose(reader.read_data(len(files) - 1)[1]["noise"], more["noise"], rtol=1e-6)


def test_frames_before_an_error_are_named(tmp_path):
    model = falling()
    with pytest.raises(ArithmeticError), ModelOutput(model, tmp_path / "particles", background=True) as output:
        for _ in range(3):
            output.write()
        raise ArithmeticError
    assert (tmp_path / "particles.xdmf").read_text().count("<Time ") == 3
