"""Tests under mpirun: every rank runs every test, and a failure on one rank is a failure on all.

Each test has a time limit of its own: a rank that waits for another would wait for ever. Past it, the rank prints where it is,
with the test's name in the list, and ends, upon which mpirun ends the others.
"""

import faulthandler
import gc
import os
import sys
from pathlib import Path

import pytest
from mpi4py import MPI
from petsc4py import PETSc

PYTHON_TESTS = Path(__file__).parents[1] / "python"
sys.path[:0] = [str(PYTHON_TESTS / folder) for folder in (".", "laws", "io")]  # what tests on one rank use too


LIMIT = float(os.environ.get("TALUS_TEST_LIMIT", 300))
"""[s] for one test; far more than any takes on a machine that is busy"""
ERRORS = os.dup(2)  # which pytest does not capture


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_protocol(item):
    # In a thread of C: a rank that waits inside MPI may hold Python's lock.
    faulthandler.dump_traceback_later(LIMIT, exit=True, file=ERRORS)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    report = outcome.get_result()
    failures = MPI.COMM_WORLD.allgather(str(report.longrepr) if report.failed else None)
    failed = [f"on rank {rank}:\n{text}" for rank, text in enumerate(failures) if text is not None]
    if failed:
        report.outcome = "failed"
        report.longrepr = "\n\n".join(failed)


@pytest.fixture(scope="module", autouse=True)
def garbage():
    """Let all ranks drop objects in cycles at the same places.

    PETSc frees a communicator with the last object on it. Where ranks collect garbage at times of their own, the next object is made on
    a new communicator on some of them only, which wait for the others for ever, at the end of the program at the latest.
    """
    gc.disable()
    yield
    gc.collect()
    PETSc.garbage_cleanup()


@pytest.fixture(scope="session")
def comm():
    return MPI.COMM_WORLD


@pytest.fixture
def shared_path(comm, tmp_path):
    """One new folder that is the same on every rank."""
    return comm.bcast(tmp_path, root=0)
