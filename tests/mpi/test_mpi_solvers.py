"""Linear systems by multigrid, and by MUMPS on all ranks: the equilibrium of one rank."""

import numpy as np
import pytest
from mpi4py import MPI
from solver_cases import slope_in_space

import fenics_bridge as bridge
from fenics_bridge.fem import linear_solver

LOAD = bridge.Load(unit_weight=20e3)


@pytest.mark.parametrize("limit", [0, 10**9], ids=["multigrid", "all ranks factorise"])
@pytest.mark.parametrize("nmd", [False, True], ids=["", "averaged"])
def test_equilibrium_is_that_of_one_rank(comm, limit, nmd, monkeypatch):
    alone = slope_in_space(MPI.COMM_SELF, 6, nmd=nmd)
    assert alone.equilibrate(LOAD, tolerance=1e-11).converged
    monkeypatch.setattr(linear_solver, "DIRECT_LIMIT", {3: limit})
    monkeypatch.setattr(linear_solver, "ALONE_LIMIT", {3: 0})
    monkeypatch.setattr(linear_solver, "AVERAGED_LIMIT", limit)
    model = slope_in_space(comm, 6, nmd=nmd)
    assert model.equilibrate(LOAD, tolerance=1e-11).converged
    assert (max(model.linear_iterations) > 1) == (limit == 0)
    n = 200
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(0.05, 1.05, n), rng.uniform(0.02, 0.48, n), rng.uniform(0.02, 0.95, n)])
    found, expected = (m.evaluate_at(points if m is alone or comm.rank == 0 else points[:0]) for m in (model, alone))
    if comm.rank == 0:
        for name in ("displacement", "stress"):
            assert np.abs(found[name] - expected[name]).max() < 1e-8 * np.abs(expected[name]).max(), name
    assert (np.concatenate(comm.allgather(model.points.state[:, 0])) > 0).mean() > 0.05
