"""A scheduler ends a study: its signals reach the ranks, which leave a checkpoint, and none stays behind."""

import os
import re
import shlex
import signal
import subprocess
import time
from pathlib import Path

import pytest
from test_study_restart import ENVIRONMENT, SMALL, rows_are_there, stopped_with_a_checkpoint

ROOT = Path(__file__).parents[3]
RECIPE = re.search(r"```bash\n(#!/bin/bash.*?)```", (ROOT / "docs/howto/cluster.md").read_text(), re.DOTALL).group(1)


def job(tmp_path):
    """The recipe of the documentation as a batch script, with a small slope that would take hours; started as Slurm does."""
    script = re.sub(r"^module load.*\n", "", RECIPE, flags=re.MULTILINE)
    script = re.sub(r"--cell-size \S+", f"{' '.join(SMALL)} --time 1e4 --frames 1000", script)
    script = re.sub(r"(?<=\s)studies/run", shlex.quote(f"{ROOT}/studies/run"), script)
    (tmp_path / "job.sh").write_text(script)
    environment = {**ENVIRONMENT, "SLURM_NTASKS": "2", "SCRATCH": str(tmp_path), "OMPI_MCA_mpi_yield_when_idle": "1"}
    # Without what would have mpirun ask Slurm for its hosts.
    batch = subprocess.Popen(["bash", tmp_path / "job.sh"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                             env=environment, start_new_session=True)  # fmt: skip
    deadline = time.monotonic() + 100
    while not rows_are_there(tmp_path / "slope") and batch.poll() is None and time.monotonic() < deadline:
        time.sleep(0.05)
    assert batch.poll() is None, batch.communicate()[0]
    return batch


def processes(session):
    """Numbers of the processes of a session, and of those whose parents are in it."""
    found, parents = set(), {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(entry.name)] = int(fields[1])
            if int(fields[3]) == session and fields[0] != "Z":
                found.add(int(entry.name))
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found


def send(numbers, to):
    for process in to:
        try:
            os.kill(process, numbers)
        except ProcessLookupError:
            pass


@pytest.mark.parametrize("whom", ["the batch shell", "all processes"])
@pytest.mark.parametrize("number", [signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU])
def test_a_signal_in_advance_ends_in_a_checkpoint(tmp_path, whom, number):
    if whom == "the batch shell" and number != signal.SIGUSR1:
        pytest.skip("the recipe asks for SIGUSR1")
    batch = job(tmp_path)
    everything = processes(batch.pid)
    ranks = {p for p in everything if b"slope.py" in Path(f"/proc/{p}/cmdline").read_bytes()}
    send(number, [batch.pid] if whom == "the batch shell" else ranks)
    if whom != "the batch shell":  # mpirun and the shells get it too
        send(signal.SIGUSR1, everything - ranks)
    text, _ = batch.communicate(timeout=60)
    assert stopped_with_a_checkpoint(tmp_path / "slope"), text
    assert "Traceback" not in text


def test_the_end_of_studies_run_by_sigkill_leaves_no_ranks_behind(tmp_path):
    batch = job(tmp_path)
    everything = processes(batch.pid)
    (launcher,) = (p for p in everything if b"-m\0talus.launch" in Path(f"/proc/{p}/cmdline").read_bytes())
    os.kill(launcher, signal.SIGKILL)
    deadline = time.monotonic() + 30
    while any(Path(f"/proc/{p}").exists() for p in everything - {batch.pid}) and time.monotonic() < deadline:
        time.sleep(0.1)
    left = [p for p in everything if Path(f"/proc/{p}").exists() and p != batch.pid]
    send(signal.SIGKILL, left)
    batch.communicate(timeout=60)
    assert left == []
    assert stopped_with_a_checkpoint(tmp_path / "slope")
