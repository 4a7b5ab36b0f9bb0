"""Ten years of a consolidating slope by implicit particles in large displacements: what they cost.

    python3 tests/bench/consolidating_slope.py --cell-size 0.2

A slope of soft clay, 5 m high at 30 degrees, in equilibrium with pore pressures that grow with the depth below its surface, gets
a fill of 20 kPa on its crest at once, under which it settles as its water leaves at the surface. Steps grow by a fifth each.
"""

from __future__ import annotations

import argparse
import sys
from time import perf_counter, process_time

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
YEAR, GRAVITY, HEIGHT, CREST, FILL = 365.25 * 86400.0, 9.81, 5.0, 6.0, 20e3  # s, m/s2, m, m, Pa


def slope(cell_size: float, per_cell: int, *, wet: bool = True) -> mpm.Model:
    """The slope at rest, dry or with water that leaves at its surface."""
    mesh = bridge.slope_mesh(comm, height=HEIGHT, angle=30.0, crest=CREST, cell_size=cell_size, kind="fitted")
    clay = mpm.MohrCoulomb(young=3e6, poisson=0.3, cohesion=15e3, friction_angle=25.0, dilation_angle=0.0)
    model = mpm.Model(bridge.background_mesh(*mesh), clay)
    model.seed(density=18e3 / GRAVITY, per_cell=per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY))
    if wet:
        fill_pores(model)
    model.equilibrate(small_displacements=True)
    return model


def fill_pores(model: mpm.Model) -> None:
    """Pressures grow with the depth below the surface."""
    model.add_water(porosity=0.5, conductivity=1e-9, modulus=np.inf, kozeny_carman=True, drained_surface=True)
    surface = lambda x: np.clip(HEIGHT - (x[:, 0] - CREST) * np.tan(np.radians(30.0)), 0.0, HEIGHT)
    model.set_pore_pressure(lambda x: 9810.0 * np.maximum(surface(x) - x[:, 1], 0.0))


def load_crest(model: mpm.Model, cell_size: float, pressure: float) -> None:
    """Put a fill of a pressure [Pa] on the crest."""
    x = model.particles.position
    loaded = (x[:, 1] > HEIGHT - cell_size) & (x[:, 0] < CREST)
    force = np.zeros_like(x)
    force[loaded, 1] = -pressure * CREST / comm.allreduce(int(loaded.sum()))
    model.particles.set("traction", force)


def follow(model: mpm.Model, until: float, first: float, growth: float) -> tuple[int, int, int]:
    """Steps, Newton iterations in all, and shortened steps up to a time [s]."""
    steps = iterations = cuts = 0
    dt = first
    while model.time < until * (1 - 1e-9):
        for report in model.implicit(min(model.time + dt, until), dt=dt, quasi_static=True, every_steps=1):
            steps, iterations, cuts = steps + 1, iterations + report.iterations, cuts + report.cuts
        dt *= growth
    return steps, iterations, cuts


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cell-size", type=float, default=0.12, help="[m]")
    parser.add_argument("--particles-per-cell", type=int, default=3)
    parser.add_argument("--years", type=float, default=10.0)
    a = parser.parse_args()
    model = slope(a.cell_size, a.particles_per_cell)
    load_crest(model, a.cell_size, FILL)
    start, volume = (perf_counter(), process_time()), model.water_volume()
    steps, iterations, cuts = follow(model, a.years * YEAR, 3600.0, 1.2)
    seconds = [perf_counter() - start[0], process_time() - start[1]]
    p = model.particles
    moved = comm.allreduce(float(np.linalg.norm(p.displacement, axis=1).max(initial=0.0)), MPI.MAX)
    excess = comm.allreduce(float(p.pore_pressure.max(initial=0.0)), MPI.MAX)
    n = comm.allreduce(len(p))
    error = model.water_volume() - volume - model.water_inflow()
    if comm.rank == 0:
        print(f"{n} particles in {n // a.particles_per_cell} cells, {a.years:g} years: {steps} steps, {iterations} iterations, "
              f"{cuts} shortened steps; largest displacement {1e3 * moved:.0f} mm, largest pressure {1e-3 * excess:.2f} kPa, "
              f"{-model.water_inflow():.4f} m2 of water left, error of its balance {error:.1e} m2; "
              f"{seconds[0]:.0f} s, processor time {seconds[1]:.0f} s")  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
