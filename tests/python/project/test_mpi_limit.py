"""A test under mpirun that hangs is ended by its own time limit, and named."""

import os
import subprocess
import sys
import time
from pathlib import Path

HANGING = """
from mpi4py import MPI

def test_that_is_quick():
    pass

def test_that_waits_for_ever():
    if MPI.COMM_WORLD.rank == 1:
        MPI.COMM_WORLD.recv(source=0)
"""


def test_a_test_that_hangs_is_named(tmp_path):
    (tmp_path / "test_hanging.py").write_text(HANGING)
    environment = {
        **os.environ, "TALUS_TEST_LIMIT": "5", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[2] / "mpi"), os.environ.get("PYTHONPATH", "")]),
    }  # fmt: skip
    start = time.monotonic()
    ended = subprocess.run(["mpirun", "-n", "2", "--oversubscribe", sys.executable, "-m", "pytest", "-p", "conftest",
                            "test_hanging.py"],
                           cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)  # fmt: skip
    assert ended.returncode != 0 and time.monotonic() - start < 100
    assert "in test_that_waits_for_ever" in ended.stderr and "in test_that_is_quick" not in ended.stderr
