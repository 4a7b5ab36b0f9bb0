"""Output over time that cannot be written: errors say why, and what was written before stays."""

import subprocess
import sys
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from mpm_core.output import MeshOutput, ParticleOutput
from output_cases import COMM, SQUARE, TRIANGLES, particle_fields

from mpm_core import InputError, RunError


def test_nothing_is_written_after_the_end(tmp_path):
    output = ParticleOutput(tmp_path / "particles", COMM)
    output.close()
    output.close()
    with pytest.raises(RunError, match=f"cannot write {tmp_path}/particles: it is closed"):
        output.write(0.0, particle_fields(3, 2))


def test_missing_folder_is_named(tmp_path):
    with pytest.raises(RunError, match=f"cannot write {tmp_path}/nowhere/particles: No such file or directory"):
        ParticleOutput(tmp_path / "nowhere" / "particles", COMM)


@pytest.mark.parametrize("rows", [5000, 400_000])
@pytest.mark.parametrize("growing", [True, False])
def test_a_file_that_cannot_be_written_is_named(tmp_path, growing, rows):
    # A limit on the size of files stands for a full disk, which a test cannot make without being root.
    script = f"""
import resource, signal, sys
import numpy as np
from mpi4py import MPI
from mpm_core import RunError
from mpm_core.output import ParticleOutput
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
output = ParticleOutput({str(tmp_path / "particles")!r}, MPI.COMM_WORLD)
try:
    for step in range(4):
        if step == 3:
            resource.setrlimit(resource.RLIMIT_FSIZE, (10 * {rows}, 10 * {rows}))
        output.write(step, {{"position": np.zeros(({f"{rows} + step" if growing else rows}, 3))}})
except RunError as error:
    print(error)
    sys.exit(7)
"""
    refused = subprocess.run([sys.executable, "-c", script], timeout=60, capture_output=True, text=True)
    assert refused.returncode == 7, refused.stderr
    folder = tmp_path / "particles"
    assert refused.stdout.strip() == f"cannot write {folder}/000003.h5: File too large"
    # What was written before is still there, and nothing in part.
    assert sorted(path.name for path in folder.iterdir()) == ["000000.h5", "000001.h5", "000002.h5"]
    with h5py.File(folder / "000002.h5") as file:
        assert len(file["position"]) == (rows + 2 if growing else rows)


FULL_DISKS = [
    ("600k", 2000, {}), ("600k", 2000, {"float32": False}), ("600k", 2000, {"compression": 1}), ("24M", 200_000, {})
]  # fmt: skip


@pytest.mark.parametrize("small_disk, rows, options", FULL_DISKS, indirect=["small_disk"])
def test_a_full_disk_is_named_and_earlier_frames_stay(small_disk, rows, options):
    rng = np.random.default_rng(0)
    n = 40 if rows == 2000 else 8
    frames = [{"position": rng.random((rows, 2)), "velocity": rng.random((rows, 2))} for _ in range(n)]
    with ParticleOutput(small_disk / "particles", COMM, **options) as output:
        written = 0
        with pytest.raises(RunError, match=r"cannot write .*particles(/.*\.h5|\.xdmf): No space left on device"):
            for written, fields in enumerate(frames):
                output.write(float(written), fields)
        assert written > 3
        for number in (1, 2):
            (small_disk / "particles" / f"{number:06d}.h5").unlink()
        for fields in ({"position": np.zeros((0, 2))}, frames[written]):  # and the run may go on
            output.write(float(written), fields)
    kept = sorted((small_disk / "particles").iterdir())
    assert [int(path.stem) for path in kept] == [0, *range(3, written + 2)]
    for number in (0, written - 1, written + 1):
        with h5py.File(small_disk / "particles" / f"{number:06d}.h5") as file:
            expected = frames[min(number, written)]["velocity"]
            np.testing.assert_allclose(file["velocity"][:, :2], expected, rtol=2.0**-24)


def test_a_description_that_cannot_be_renewed_leaves_all_as_it_was(tmp_path):
    aside = tmp_path / "particles.xdmf.part"
    with ParticleOutput(tmp_path / "particles", COMM) as output:
        output.write(0.0, particle_fields(4, 2))
        aside.mkdir()
        with pytest.raises(RunError, match=f"cannot write {aside}: Is a directory"):
            output.write(1.0, particle_fields(4, 2))
        assert len(list((tmp_path / "particles").iterdir())) == 1
        aside.rmdir()
        for later in (1, 2):
            output.write(float(later), particle_fields(4, 2))
    times = [float(t.get("Value")) for t in ElementTree.parse(tmp_path / "particles.xdmf").iter("Time")]
    assert times == [0, 1, 2] and len(list((tmp_path / "particles").iterdir())) == 3


GOOD = particle_fields(3, 2)
BAD_FIELDS = [
    ({"velocity": GOOD["velocity"]}, "expected 'position' among them"),
    ({"position": np.zeros(3)}, r"position has shape \(3,\), expected \(n, 2\) or \(n, 3\)"),
    (GOOD | {"mass": np.zeros(4)}, "mass has 4 rows, expected 3"),
    (GOOD | {"mass": np.array(["a", "b", "c"])}, "mass has dtype <U1, expected numbers"),
    (GOOD | {"mass": np.zeros((3, 2, 2))}, r"mass has shape \(3, 2, 2\)"),
    (GOOD | {"a/b": np.zeros(3)}, "name of a field is 'a/b', expected letters, digits, _ and -"),
]


@pytest.mark.parametrize("fields, message", BAD_FIELDS)
def test_bad_fields_are_named(tmp_path, fields, message):
    with ParticleOutput(tmp_path / "particles", COMM) as output:
        with pytest.raises(InputError, match=message):
            output.write(0.0, fields)
        output.write(0.0, GOOD)


def test_time_must_be_finite(tmp_path):
    with ParticleOutput(tmp_path / "particles", COMM) as output:
        with pytest.raises(InputError, match="time is nan, expected a finite number of seconds"):
            output.write(float("nan"), GOOD)


BAD_MESHES = [
    (SQUARE, TRIANGLES + 2, "cells has node 5, expected numbers from 0 to 3"),
    (SQUARE, TRIANGLES[:, :2], r"cells has shape \(2, 2\)"),
    (SQUARE[:, :1], TRIANGLES, r"points has shape \(4, 1\)"),
]


@pytest.mark.parametrize("points, cells, message", BAD_MESHES)
def test_bad_meshes_are_named(tmp_path, points, cells, message):
    with pytest.raises(InputError, match=message):
        MeshOutput(tmp_path / "mesh", COMM, points, cells)


def test_positions_of_nodes_of_another_mesh_are_named(tmp_path):
    with MeshOutput(tmp_path / "mesh", COMM, SQUARE, TRIANGLES) as output:
        with pytest.raises(InputError, match=r"points has shape \(3, 2\), expected \(4, 2\)"):
            output.write(0.0, {}, points=SQUARE[:3])
        output.write(0.0, {}, points=SQUARE)
