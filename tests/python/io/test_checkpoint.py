"""Checkpoint files: their layout as others read it, and that a run may be killed, or the disk may fill up, at any moment."""

import os
import random
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from core_cases import box, by_id

import mpm_core as mpm


def column(counts=(4, 8)):
    model = mpm.Model(box(counts), mpm.LinearElastic(young=1e6, poisson=0.3))
    model.seed(density=2000.0, per_cell=3)
    model.fix(3)
    model.set_gravity((0.0, -9.81))
    return model


def test_h5py_reads_fields_and_totals(tmp_path):
    model = column()
    *_, report = model.explicit(0.01)
    model.save(tmp_path / "state.h5")
    with h5py.File(tmp_path / "state.h5") as file:
        assert set(file["particles"]) == {
            "id", "position", "velocity", "stress", "volume", "mass", "deviatoric_strain", "state", "initial_position",
            "material", "cell",
        }  # fmt: skip
        for name in ("id", "position", "velocity", "stress", "state", "mass", "cell"):
            np.testing.assert_array_equal(file["particles"][name][()].reshape(report.particles, -1),
                                          getattr(model.particles, name).reshape(report.particles, -1))  # fmt: skip
        assert file["ranks/time"][()] == [model.time] and file["ranks/steps"][()] == [report.steps]
        assert file["ranks/external_work"][()] == [report.external_work]
        assert file["ranks/rows_of_particles"][()] == [report.particles]
        description = file["description"][0].decode()
    assert '"units": "SI: m, kg, s, N, Pa' in description and "LinearElastic(" in description


SAVING = """
import sys
sys.path[:0] = {tests!r}
from test_checkpoint import column
model = column((8, 8))
for report in model.explicit(1.0, every=1e-3):
    model.save(sys.argv[1] + "/state.h5")
    if report.steps < 3:
        continue
    print("saved", flush=True)
"""


def started(folder):
    folder.mkdir()
    script = SAVING.format(tests=[str(Path(__file__).parent), str(Path(__file__).parents[1])])
    return subprocess.Popen([sys.executable, "-c", script, folder], stdout=subprocess.PIPE, text=True)


def test_a_usable_checkpoint_is_there_whenever_the_run_is_killed(tmp_path):
    # Twenty runs that do hardly anything but save, each killed at a moment of its own; four at a time.
    random.seed(1)
    model = column((8, 8))
    struck = 0  # runs that were killed while they wrote
    for batch in range(5):
        folders = [tmp_path / f"{batch}_{k}" for k in range(4)]
        children = [started(folder) for folder in folders]
        for child in children:
            assert child.stdout.readline() == "saved\n"
        for child in children:
            time.sleep(random.uniform(0, 0.02))
            child.kill()
        for child, folder in zip(children, folders, strict=True):
            child.wait()
            child.stdout.close()
            struck += (folder / "state.h5.part").exists()
            model.restore(folder / "state.h5")
            assert model.time > 0
            model.save(folder / "state.h5")  # what is left of the last try is no obstacle
            assert not (folder / "state.h5.part").exists()
    assert struck > 2


def test_a_full_disk_is_named_and_the_last_checkpoint_stays(small_disk):
    model = column()
    model.save(small_disk / "state.h5")
    size = (small_disk / "state.h5").stat().st_size
    good = by_id(model, "position")
    *_, report = model.explicit(0.01)
    for share in (0.0, 0.1, 0.3, 0.6, 0.9):  # what there is room for: it fills up in all parts of the file
        (small_disk / "other").write_bytes(bytes(600 * 1024 - int((1 + share) * size) - 4096))
        with pytest.raises(mpm.RunError, match="cannot write .*state.h5.*No space left on device"):
            model.save(small_disk / "state.h5")
        assert sorted(path.name for path in small_disk.iterdir()) == ["other", "state.h5"]
    *_, report = model.explicit(0.02)  # the run may go on
    model.restore(small_disk / "state.h5")
    np.testing.assert_array_equal(by_id(model, "position"), good)
    (small_disk / "other").unlink()
    model.save(small_disk / "state.h5")


def test_a_folder_without_permission_is_named(tmp_path):
    tmp_path.chmod(0o500)
    if os.access(tmp_path, os.W_OK):
        pytest.skip("this user may write everywhere")
    with pytest.raises(mpm.RunError, match="cannot write .*Permission denied"):
        column().save(tmp_path / "state.h5")


@pytest.mark.parametrize("before", [0, 96])
def test_a_model_without_particles_is_saved_and_goes_on(tmp_path, before):
    """Before it is seeded, or after its soil has been removed: new particles are those of the model that was saved."""

    def ground():
        model = mpm.Model(box((4, 4)), mpm.LinearElastic(young=1e6, poisson=0.3))
        model.fix(3)
        return model

    model, again = ground(), ground()
    model.set_gravity((0.0, -9.81))
    if before:
        assert model.seed(density=2000.0, per_cell=3) == before
        model.remove(np.ones(before, dtype=bool))
    model.save(tmp_path / "state.h5")
    again.restore(tmp_path / "state.h5")
    for one in (model, again):
        one.seed(density=2000.0, per_cell=3)
        one.explicit(0.01).last()
    assert model.particles.id.min() == again.particles.id.min() == before
    assert np.array_equal(by_id(model, "stress"), by_id(again, "stress")) and np.abs(model.particles.stress).max() > 0
