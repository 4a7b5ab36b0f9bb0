"""The slope stopped and started again: what was written stays, and the end is the same."""

import contextlib
import csv
import json
import os
import pty
import select
import shlex
import shutil
import signal
import subprocess
import sys
import time

import h5py
import numpy as np
import pytest
from study_main import STUDIES, ended, main

from studies.common.history import History

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
    "--no-pictures",
]


def slope(folder, *options, ranks=1):
    if ranks == 1:
        return ended("slope", folder, *SMALL, *options)
    command = ["mpirun", "-n", str(ranks), "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", sys.executable]
    command += [str(STUDIES / "slope.py"), "--output", str(folder), *SMALL, *options]
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
    second = slope(halves, "--restart", str(halves / "checkpoint.h5"), "--pictures")
    assert second.returncode == 0, second.stderr
    assert (halves / "figure_6_crest.png").exists()
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


def rows_are_there(folder):
    path = folder / "history.csv"
    return path.exists() and path.read_text().count("\n") > 2


@contextlib.contextmanager
def sliding(folder):
    """A run without end, once it slides; it is killed if it is still there."""
    command = [sys.executable, STUDIES / "slope.py", "--output", folder, *SMALL, "--time", "1e4", "--frames", "100000"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    while not rows_are_there(folder) and child.poll() is None:
        time.sleep(0.05)
    try:
        yield child
    finally:
        child.kill()
        child.communicate(timeout=60)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_an_interrupted_slope_leaves_a_checkpoint(tmp_path, number):
    with sliding(tmp_path) as child:
        child.send_signal(number)
        _, err = child.communicate(timeout=60)
    assert child.returncode == 128 + number, err
    assert "--restart" in err and (tmp_path / "checkpoint.h5").exists() and (tmp_path / "summary.json").exists()
    result = slope(tmp_path, "--restart", str(tmp_path / "checkpoint.h5"), "--time", "1e-3")
    assert result.returncode == 2 and "--time is" in result.stderr and "has reached" in result.stderr


def stopped_with_a_checkpoint(folder):
    deadline = time.monotonic() + 60
    while not (folder / "summary.json").exists() and time.monotonic() < deadline:
        time.sleep(0.1)  # a shell may end before the study does
    stopped = json.loads((folder / "summary.json").read_text())["stopped_because"]
    return "interrupted at" in stopped and (folder / "checkpoint.h5").exists()


@pytest.mark.parametrize("ranks", [[], ["--ranks", "2"]], ids=["alone", "ranks"])
def test_ctrl_c_that_ends_the_reader_too_leaves_a_checkpoint(tmp_path, ranks):
    folder = tmp_path / "slope"
    study = shlex.join(
        [str(STUDIES / "run"), *ranks, "slope", "--output", str(folder), *SMALL, "--time", "1e4", "--frames", "1000"]
    )
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
        os.execve(
            study,
            [study, *ranks, "slope", "--output", str(tmp_path), *SMALL, "--time", "1e4", "--frames", "1000"],
            ENVIRONMENT,
        )
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
    for options, message, ranks in [
        (["--restart", checkpoint, "--cohesion", "2e3"], "--cohesion is 2000.0, but the run of checkpoint", 2),
        (["--restart", checkpoint, "--crest", "1.4"], "--crest is 1.4, but the run of checkpoint", 1),
        (["--restart", str(tmp_path / "none.h5")], "No such file or directory", 2),
    ]:
        result = slope(tmp_path / "b", *options, ranks=ranks)
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


# --- options of a restart --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def checkpointed(tmp_path_factory):
    """A run with a checkpoint in its middle."""
    folder = tmp_path_factory.mktemp("checkpointed") / "run"
    assert slope(folder, "--unit-weight", "60e3", "--checkpoint-every", "50").returncode == 0
    return folder


@pytest.mark.parametrize(
    "option", [("--unit-weight", "70e3"), ("--particles-per-cell", "6"), ("--initial", "k0"), ("--paper",)]
)
def test_an_option_that_the_particles_would_not_follow_is_refused(tmp_path, checkpointed, option):
    # Without SMALL: what is not named is that of the checkpoint.
    result = ended("slope", tmp_path, "--restart", checkpointed / "checkpoint.h5", *option)
    assert (
        result.returncode == 2 and f"{option[0]} is " in result.stderr and "but the run of checkpoint" in result.stderr
    )
    assert list(tmp_path.iterdir()) == []


def test_a_restart_keeps_options_and_notes_what_changes(tmp_path, checkpointed):
    folder = tmp_path / "run"
    shutil.copytree(checkpointed, folder)
    restart = ["--restart", folder / "checkpoint.h5"]
    assert main("slope", [*restart, "--damping", "0.5", "--checkpoint-every", "20"]) == 0
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["parameters"]["unit_weight"] == 60e3 and summary["parameters"]["damping"] == 0.5
    (row,) = summary["restarts"]
    assert row["changed"] == "damping 0 to 0.5, checkpoint-every 50 to 20" and 0 < row["time_s"] < 0.6
    assert "damping 0 to 0.5" in (folder / "report.html").read_text()
    assert "changed then: damping 0 to 0.5" in (folder / "parameters.toml").read_text()
    # The run that it went on from is still told of, and so is the change in the next checkpoint.
    assert json.loads((folder / "summary-1.json").read_text())["parameters"]["damping"] == 0
    assert main("slope", restart) == 0
    again = json.loads((folder / "summary.json").read_text())
    assert again["parameters"]["damping"] == 0.5 and [r["changed"] for r in again["restarts"]] == [row["changed"], ""]


def test_a_restart_in_another_folder_has_the_history_of_the_whole_run(tmp_path, checkpointed):
    assert ended("slope", tmp_path, "--restart", checkpointed / "checkpoint.h5").returncode == 0
    begin = json.loads((tmp_path / "summary.json").read_text())["restarts"][0]["time_s"]
    before, whole = (
        np.genfromtxt(folder / "history.csv", delimiter=",", names=True) for folder in (checkpointed, tmp_path)
    )
    kept = before["time_s"] < begin
    assert kept.any() and np.array_equal(whole[: kept.sum()], before[kept]) and whole["time_s"][-1] > begin


def test_a_run_that_is_killed_leaves_its_parameters(tmp_path):
    with sliding(tmp_path) as child:
        child.kill()
    assert "time = 10000.0" in (tmp_path / "parameters.toml").read_text()
    result = slope(tmp_path)
    assert result.returncode == 2 and "holds the results of an earlier run" in result.stderr
    assert slope(tmp_path, "--overwrite").returncode == 0
    assert float(history(tmp_path)[-1]["time_s"]) == 0.6


def test_a_second_run_in_the_folder_is_refused_while_the_first_goes_on(tmp_path):
    with sliding(tmp_path) as first:
        second = slope(tmp_path, "--overwrite", ranks=2)
        assert first.poll() is None
    assert second.returncode == 2 and f"another run writes to {tmp_path}: process {first.pid}" in second.stderr


# --- history ---------------------------------------------------------------------------------------------------------

KILLED_WHILE_IT_REWRITES = """
import os, sys
from mpi4py import MPI
from studies.common.history import History
replace = os.replace
os.replace = lambda *paths: os._exit(9)
History(sys.argv[1], ["time_s", "a"], keep_before=2.0)
"""


def test_rows_survive_a_kill_while_a_restart_rewrites_them(tmp_path):
    path = tmp_path / "history.csv"
    path.write_text("time_s,a\n0,1\n1,2\n")
    killed = subprocess.run([sys.executable, "-c", KILLED_WHILE_IT_REWRITES, path], timeout=60, env=ENVIRONMENT)
    assert killed.returncode == 9 and path.read_text() == "time_s,a\n0,1\n1,2\n"


@pytest.mark.parametrize(
    "end",
    ["2,", "2,3.", "2", "2,x\n", "1,2\n", "1.00000000049,2\n", '2,"'],
    ids=["comma", "digits", "short", "text", "twice", "rounded", "quote"],
)
def test_rows_that_a_kill_left_half_written_or_twice_are_dropped(tmp_path, capsys, end):
    path = tmp_path / "history.csv"
    path.write_text("time_s,a\n0,1\n1,2\n" + end)
    until = 1.0000000005 if end.startswith("1.") else 3.0
    with History(path, ["time_s", "a"], keep_before=until) as rows:
        rows.add(time_s=until, a=4.0)
    kept = [0.0, until] if end.startswith("1.") else [0.0, 1.0, until]
    assert rows["time_s"].tolist() == kept
    assert [float(row["time_s"]) for row in history(tmp_path)] == pytest.approx(kept, rel=1e-8)
    assert end.startswith("1.") or "1 incomplete or repeated row(s) left out" in capsys.readouterr().err
