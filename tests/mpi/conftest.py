"""Tests under mpirun: every rank runs every test, and a failure on one rank is a failure on all."""

import sys
from pathlib import Path

import pytest
from mpi4py import MPI

sys.path.insert(0, str(Path(__file__).parents[1] / "python"))  # cases that tests on one rank use too


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    report = outcome.get_result()
    failures = MPI.COMM_WORLD.allgather(str(report.longrepr) if report.failed else None)
    failed = [f"on rank {rank}:\n{text}" for rank, text in enumerate(failures) if text is not None]
    if failed:
        report.outcome = "failed"
        report.longrepr = "\n\n".join(failed)


@pytest.fixture(scope="session")
def comm():
    return MPI.COMM_WORLD


@pytest.fixture
def shared_path(comm, tmp_path):
    """One new folder that is the same on every rank."""
    return comm.bcast(tmp_path, root=0)
