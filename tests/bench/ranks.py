"""The slope sliding on all ranks that this runs on: seconds of an explicit step, on the clock on the wall. `steps.py` runs
it on one rank and on two, in turns."""

from __future__ import annotations

import sys
from time import perf_counter

from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD


def sliding_slope(cell_size: float) -> tuple[mpm.Model, int]:
    """The paper's slope on all ranks, from zero stress under 80 kN/m3, and its number of particles."""
    mesh = bridge.background_mesh(*bridge.slope_mesh(comm, cell_size=cell_size))
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0))
    particles = model.seed(density=80e3 / 9.81, per_cell=10, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0, -9.81))
    model.rebalance()
    return model, particles


def seconds_per_step(cell_size: float, steps: int, repetitions: int) -> tuple[float, int]:
    """The best of several repetitions, and the number of particles."""
    model, particles = sliding_slope(cell_size)
    dt = 0.5 * model.critical_time_step()
    best = float("inf")
    for _ in range(repetitions):
        comm.barrier()
        start = perf_counter()
        list(model.explicit(model.time + steps * dt, damping=0.75))
        comm.barrier()
        best = min(best, perf_counter() - start)
    return best / steps, particles


if __name__ == "__main__":
    seconds, particles = seconds_per_step(float(sys.argv[1]), int(sys.argv[2]), 3)
    if comm.rank == 0:
        print(seconds, particles)
