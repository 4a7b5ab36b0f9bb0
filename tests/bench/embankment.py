"""Factors of safety of the embankment of docs/factor_of_safety.md: strengths of the fill, dilation angles and cell sizes.

    python3 tests/bench/embankment.py --cell-sizes 0.5 0.25

The site is meshes/embankment.toml, all of it placed at once, with quadratic elements. Runs on as many ranks as mpirun starts.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import tomllib
from mpi4py import MPI

import fenics_bridge as bridge

TOP = Path(__file__).parents[2]
sys.path.insert(0, str(TOP / "studies"))

from common.site.file import site_of  # noqa: E402

comm = MPI.COMM_WORLD
SITE = TOP / "meshes" / "embankment.toml"
EQUILIBRIUM = {"accurate": None, "practice": bridge.PRACTICE}


def embankment(cohesion: float, dilation_angle: float, cell_size: float) -> Any:
    """The site with another strength [Pa] and dilation angle [degrees] of its four layers."""
    table = tomllib.loads(SITE.read_text())
    for soil in table["soils"].values():
        if "cohesion" in soil:
            soil |= {"cohesion": cohesion, "dilation_angle": dilation_angle}
    return site_of(table, SITE, comm, cell_size)


def row(site: Any, equilibrium: str) -> dict[str, Any]:
    """The factor of safety and what it took to find it."""
    fem = site.finite_elements(degree=2, solver=EQUILIBRIUM[equilibrium])
    wall, cpu = perf_counter(), process_time()
    found = bridge.factor_of_safety(fem, site.load())
    return {
        "nodes": fem.displacement.function_space.dofmap.index_map.size_global, "ranks": comm.size,
        "factor_of_safety": found.value, "failed_at": found.failed_at, "failure_shown": found.failed,
        "reason": found.reason, "systems": len(fem.linear_iterations),
        "cpu_seconds_per_rank": comm.allreduce(process_time() - cpu, MPI.MAX), "wall_seconds": perf_counter() - wall,
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cohesions", type=float, nargs="+", default=[0.5e3, 2e3, 5e3, 10e3], help="of the fill [Pa]")
    parser.add_argument("--dilation-angles", type=float, nargs="+", default=[0.0, 5.0, 10.0], help="[degrees]")
    parser.add_argument("--cell-sizes", type=float, nargs="+", default=[0.5], help="[m]")
    parser.add_argument("--equilibrium", choices=EQUILIBRIUM, default="accurate")
    parser.add_argument("--json", type=Path, help="write the results to this file as well")
    a = parser.parse_known_args()[0]  # others are for PETSc
    found = []
    for size, cohesion, angle in [(s, c, d) for s in a.cell_sizes for c in a.cohesions for d in a.dilation_angles]:
        case = {"cell_size_m": size, "cohesion_Pa": cohesion, "dilation_angle": angle}
        found.append(case | row(embankment(cohesion, angle, size), a.equilibrium))
        if comm.rank == 0:
            r = found[-1]
            print(f"{size:g} m, c {cohesion / 1e3:g} kPa, psi {angle:g}: {r['factor_of_safety']:.4f}, "
                  f"{'fails' if r['failure_shown'] else 'undecided'} at {r['failed_at']:.4f}, {r['systems']} systems, "
                  f"{r['cpu_seconds_per_rank']:.1f} s per rank, {r['wall_seconds']:.1f} s on the clock", flush=True)  # fmt: skip
            if a.json:
                a.json.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
