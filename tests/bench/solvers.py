"""Linear systems of a slope in three dimensions, by finite elements or implicit particles: iterations, memory and time over the
number of tetrahedra and over the distance to collapse. Runs on as many ranks as mpirun starts.

    python3 tests/bench/solvers.py --cells 10 22
    mpirun -n 2 python3 tests/bench/solvers.py --cells 47 --loads 5 16 20

The slope is 1 m high and wide and inclined at 45 degrees, with the base and the far side fixed, cohesion 1 kPa and friction angle
25 degrees; a side of 1 m has the given number of cubes, each cut in six tetrahedra. Under plane strain the slope collapses at
22.9 kN/m3.
"""

from __future__ import annotations

import argparse
import json
import resource
import sys
from functools import partial
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
SUPPORTS = [(1, (1, 0, 0)), (3, (0, 1, 0)), (4, None), (5, None)]
"""Facet tags of the box with the axis along which they hold, or None where they hold all: symmetry at y = 0, fixed at y = 1 m"""


def slope(cells: int) -> tuple[Any, Any, Any]:
    """A box whose cross-section is made that of the slope: 1.1 m at the crest, 2.1 m at the base."""
    parts = bridge.box_mesh(comm, (1.0, 1.0, 1.0), (round(1.6 * cells), cells, cells))
    x = parts[0].geometry.x
    x[:, 0] *= 2.1 - x[:, 2]
    return parts


def law(dilation: float, elastic: bool) -> Any:
    if elastic:
        return mpm.LinearElastic(young=200e3, poisson=0.33)
    return mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0, dilation_angle=dilation)


class FiniteElements:
    """Load steps of the finite elements."""

    def __init__(self, cells: int, soil: Any, nmd: bool) -> None:
        domain, _, facet_tags = slope(cells)
        held = [bridge.fixed(tag) if axis is None else bridge.roller(tag, axis) for tag, axis in SUPPORTS]
        self._fem = bridge.QuasiStatic(domain, soil, facet_tags, held, degree=1, nmd=nmd)
        self.tetrahedra = domain.topology.index_map(3).size_global
        self.nodes = domain.topology.index_map(0).size_global

    def step(self, unit_weight: float) -> tuple[int, list[int], str]:
        """Newton iterations in all, Krylov iterations of each, and why it failed; the load comes on in parts if it must."""
        before = len(self._fem.linear_iterations)
        steps = self._fem.solve(bridge.Load(unit_weight=unit_weight), first_step=1.0, tolerance=0.1)
        krylov = self._fem.linear_iterations[before:]
        return len(krylov), krylov, "" if self._fem.converged else steps[-1].report.reason


class Particles:
    """Quasi-static steps of particles, one in each cell; with pore water, which leaves on top and at the slope."""

    def __init__(self, cells: int, soil: Any, nmd: bool, conductivity: float | None = None) -> None:
        parts = slope(cells)
        self._model = mpm.Model(bridge.background_mesh(*parts), soil)
        self.tetrahedra = self._model.seed(density=1e3 / 9.81, per_cell=1)
        for tag, axis in SUPPORTS:
            self._model.fix(tag) if axis is None else self._model.roller(tag, axis)
        self.nodes = parts[0].topology.index_map(0).size_global
        if conductivity is not None:
            self._model.add_water(porosity=0.4, conductivity=conductivity, modulus=np.inf)
            for tag in (2, 6):
                self._model.hold_pore_pressure(tag, 0.0)
        self._nmd, self._solver, self._time = nmd, _Watched(), 0.0

    def step(self, unit_weight: float) -> tuple[int, list[int], str]:
        self._solver.krylov.clear()
        self._model.set_gravity((0, 0, -9.81 * unit_weight / 1e3))
        self._time += 1.0
        try:
            *_, report = self._model.implicit(
                self._time, dt=1.0, quasi_static=True, small_displacements=True, nmd=self._nmd, solver=self._solver
            )
        except mpm.RunError as error:
            return len(self._solver.krylov), self._solver.krylov, str(error)
        return report.iterations, list(self._solver.krylov), ""


class _Watched(mpm.Newton):
    """Newton's method that notes the Krylov iterations."""

    krylov: list[int] = []

    def solver(self, comm: MPI.Comm, dim: int) -> Any:
        return _Watching(super().solver(comm, dim), self.krylov)


class _Watching:
    """Its solver."""

    def __init__(self, solver: Any, krylov: list[int]) -> None:
        self._solver, self._krylov = solver, krylov

    def __getattr__(self, name: str) -> Any:
        return getattr(self._solver, name)

    def solve(self, *arguments: Any) -> Any:
        solution = self._solver.solve(*arguments)
        self._krylov.extend(solution.linear_iterations)
        return solution


def rows(kind: Any, cells: int, soil: Any, nmd: bool, loads: list[float]) -> list[dict[str, Any]]:
    """A row for each load; the first one has the set-up in its memory, not in its time."""
    wall = perf_counter()
    body, found = kind(cells, soil, nmd), []
    setup = perf_counter() - wall
    for load in loads:
        wall, cpu = perf_counter(), process_time()
        newton, krylov, reason = body.step(1e3 * load)
        cpu = comm.allreduce(process_time() - cpu, MPI.MAX)
        peak = comm.allreduce(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
        found.append({
            "kind": type(body).__name__, "ranks": comm.size, "tetrahedra": body.tetrahedra, "nodes": body.nodes, "nmd": nmd,
            "unit_weight_kN_per_m3": load, "newton": newton, "krylov_mean": float(np.mean(krylov)) if krylov else 0.0,
            "krylov_most": max(krylov, default=0), "cpu_seconds_per_rank": cpu, "wall_seconds": perf_counter() - wall,
            "setup_wall_seconds": setup, "memory_MB": peak, "reason": reason,
        })  # fmt: skip
        if comm.rank == 0:
            r = found[-1]
            print(f"{r['kind']:15}{' NMD' if nmd else '':4} ranks {r['ranks']}  {r['tetrahedra']:8} tetrahedra  {load:5.1f} "
                  f"kN/m3  Newton {newton:2}  Krylov {r['krylov_mean']:5.1f} (most {r['krylov_most']:3})  {cpu:7.1f} s per rank, "
                  f"{r['wall_seconds']:7.1f} s on the clock  {peak:6.0f} MB  {reason}", flush=True)  # fmt: skip
        if reason:
            break
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cells", type=int, nargs="+", default=[10, 22], help="cubes along a side of 1 m")
    parser.add_argument(
        "--loads", type=float, nargs="+", default=[5.0, 16.0, 20.0], help="unit weights, rising [kN/m3]"
    )
    parser.add_argument("--dilation-angle", type=float, default=25.0, help="[degrees]")
    parser.add_argument("--elastic", action="store_true", help="linear elastic soil")
    parser.add_argument("--nmd", action="store_true", help="average volumetric strains over nodes")
    parser.add_argument("--particles", action="store_true", help="implicit particles in place of finite elements")
    parser.add_argument(
        "--water", type=float, metavar="K", help="with --particles: pore water, and its conductivity [m/s]"
    )
    parser.add_argument("--json", type=Path, help="write the results to this file as well")
    a = parser.parse_known_args()[0]  # others are for PETSc
    soil = law(a.dilation_angle, a.elastic)
    kind = partial(Particles, conductivity=a.water) if a.particles else FiniteElements
    found = [row for n in a.cells for row in rows(kind, n, soil, a.nmd, a.loads)]
    if a.json and comm.rank == 0:
        a.json.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    sys.exit(main())
