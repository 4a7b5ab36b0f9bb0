"""The slope stopped and started again: what was written stays, and the end is the same."""

import csv
import json
import os
import pty
import select
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

STUDIES = Path(__file__).parents[2] / "studies"
# Python's own copy, without what MPI adds to it in this process.
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
SMALL = [
    "--initial",
    "zero",
    "--cell-size",
    "0.2",
    "--crest",
    "1.2",
    "--particles-per-cell",
    "3",
    "--frames",
    "6",
    "--time",
    "0.6",
]


def slope(folder, *options, ranks=1):
    command = [sys.executable, str(STUDIES / "slope.py"), "--output", str(folder), *SMALL, *options]
    if ranks > 1:
        command = ["mpirun", "-n", str(ranks), "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", *command]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=ENVIRONMENT)


def history(folder):
    with open(folder / "history.csv", newline="") as file:
        return list(csv.DictReader(file))


def final_particles(path):
    with h5py.File(max(path.iterdir())) as last:
        order = np.argsort(last["id"][()])
        return {name: last[name][()][order] for name in ("id", "position", "velocity", "plastic_strain")}


def test_a_restarted_slope_ends_as_the_one_that_never_stopped(tmp_path):
    whole, halves = tmp_path / "whole", tmp_path / "halves"
    assert slope(whole).returncode == 0
    first = slope(halves, "--checkpoint-every", "40")
    assert first.returncode == 0, first.stderr
    second = slope(halves, "--restart", str(halves / "checkpoint.h5"))
    assert second.returncode == 0, second.stderr
    assert "going on from" in second.stdout
    one, other = final_particles(whole / "particles"), final_particles(halves / "particles-2")
    for name in one:
        np.testing.assert_array_equal(one[name], other[name])
    assert (halves / "particles").exists()
    assert history(whole)[-1] == history(halves)[-1]
    assert history(whole)[0] == history(halves)[0]
    times = [float(row["time_s"]) for row in history(halves)]
    assert times == sorted(times) and len(times) >= len(history(whole))


def test_a_restart_on_two_ranks(tmp_path):
    # Without damping, which makes round-off grow.
    assert slope(tmp_path / "a", "--damping", "0", "--checkpoint-every", "40").returncode == 0
    result = slope(tmp_path / "b", "--damping", "0", "--restart", str(tmp_path / "a" / "checkpoint.h5"), ranks=2)
    assert result.returncode == 0, result.stderr
    one, other = final_particles(tmp_path / "a" / "particles"), final_particles(tmp_path / "b" / "particles")
    np.testing.assert_array_equal(one["id"], other["id"])
    for name in ("position", "velocity", "plastic_strain"):  # stored in single precision
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=2e-7 * np.abs(one[name]).max())


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_an_interrupted_slope_leaves_a_checkpoint(tmp_path, number):
    command = [sys.executable, str(STUDIES / "slope.py"), "--output", str(tmp_path), *SMALL, "--time", "1e4"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not (tmp_path / "history.csv").exists() and child.poll() is None:
        time.sleep(0.05)
    time.sleep(0.3)
    child.send_signal(number)
    out, err = child.communicate(timeout=60)
    assert child.returncode == 128 + number, err
    assert "--restart" in err and (tmp_path / "checkpoint.h5").exists() and (tmp_path / "summary.json").exists()
    result = slope(tmp_path, "--restart", str(tmp_path / "checkpoint.h5"), "--time", "1e-3")
    assert result.returncode == 2 and "a time not before the present" in result.stderr


def rows_are_there(folder):
    path = folder / "history.csv"
    return path.exists() and path.read_text().count("\n") > 2


def stopped_with_a_checkpoint(folder):
    deadline = time.monotonic() + 60
    while not (folder / "summary.json").exists() and time.monotonic() < deadline:
        time.sleep(0.1)  # a shell may end before the study does
    stopped = json.loads((folder / "summary.json").read_text())["stopped_because"]
    return "interrupted at" in stopped and (folder / "checkpoint.h5").exists()


@pytest.mark.parametrize("ranks", [[], ["--ranks", "2"]], ids=["alone", "ranks"])
def test_ctrl_c_that_ends_the_reader_too_leaves_a_checkpoint(tmp_path, ranks):
    folder = tmp_path / "slope"
    study = shlex.join([str(STUDIES / "run"), *ranks, "slope", "--output", str(folder), *SMALL, "--time", "1e4"])
    shell = subprocess.Popen(["bash", "-o", "pipefail", "-c", f"{study} 2>&1 | tee '{tmp_path}/log'"],
                             stdout=subprocess.PIPE, text=True, start_new_session=True, env=ENVIRONMENT)  # fmt: skip
    while not rows_are_there(folder) and shell.poll() is None:
        time.sleep(0.05)
    os.killpg(shell.pid, signal.SIGINT)
    shell.communicate(timeout=60)
    assert "results in" not in (tmp_path / "log").read_text()
    assert stopped_with_a_checkpoint(folder)


@pytest.mark.parametrize("ranks", [[], ["--ranks", "2"]], ids=["alone", "ranks"])
def test_the_end_of_the_terminal_leaves_a_checkpoint(tmp_path, ranks):
    child, terminal = pty.fork()
    if child == 0:
        study = str(STUDIES / "run")
        os.execve(study, [study, *ranks, "slope", "--output", str(tmp_path), *SMALL, "--time", "1e4"], ENVIRONMENT)
    deadline = time.monotonic() + 60
    while not rows_are_there(tmp_path) and time.monotonic() < deadline:
        if select.select([terminal], [], [], 0.05)[0]:
            os.read(terminal, 4096)  # so that the study is not held up; fails if it has ended
    os.close(terminal)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 128 + (signal.SIGUSR1 if ranks else signal.SIGHUP)
    assert stopped_with_a_checkpoint(tmp_path)


def test_a_restart_from_something_else_is_refused_on_all_ranks(tmp_path):
    assert slope(tmp_path / "a", "--checkpoint-every", "40").returncode == 0
    checkpoint = str(tmp_path / "a" / "checkpoint.h5")
    for options, message in [
        (["--restart", checkpoint, "--cohesion", "2e3"], "is of another materials"),
        (["--restart", checkpoint, "--crest", "1.4"], "is of another background mesh"),
        (["--restart", str(tmp_path / "none.h5")], "No such file or directory"),
    ]:
        result = slope(tmp_path / "b", *options, ranks=2)
        assert result.returncode == 2, result.stderr
        assert message in result.stderr


@pytest.mark.parametrize("value", ["0", "-5", "5 hours", "min", "0.5"])
def test_bad_intervals_are_named(tmp_path, value):
    result = slope(tmp_path, f"--checkpoint-every={value}")
    assert result.returncode == 2
    assert "expected a number of steps such as 500, or of minutes such as 5min" in result.stderr


BARE = """
from mpi4py import MPI
from studies.common.ranks import end_all_on_error
end_all_on_error()
assert MPI.COMM_WORLD.rank == 0, "this rank fails"
MPI.COMM_WORLD.barrier()
"""
SLIDING = """
import sys
sys.path.insert(0, {studies!r})
import slope
add = slope.History.add
def fail(history, time_s, **values):
    assert time_s < 0.2 or slope.comm.rank == 0, "this rank fails"
    add(history, time_s=time_s, **values)
slope.History.add = fail
slope.run_study(lambda: slope.main({options!r}))
"""


@pytest.mark.parametrize("script", [BARE, SLIDING], ids=["bare", "sliding"])  # in the latter files are open
def test_an_error_that_nothing_catches_ends_all_ranks(tmp_path, script):
    script = script.format(studies=str(STUDIES), options=[*SMALL, "--output", str(tmp_path / "slope")])
    result = subprocess.run(["mpirun", "-n", "2", "--oversubscribe", sys.executable, "-c", script],
                            capture_output=True, text=True, timeout=60, env=ENVIRONMENT)  # fmt: skip
    assert result.returncode != 0
    assert "error on rank 1" in result.stderr and "this rank fails" in result.stderr
