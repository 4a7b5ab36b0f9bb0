"""Memory of a long run: what each rank holds while the paper's slope slides, with a frame of all fields every 100 steps.

Runs on one rank or under mpirun. Ends with an error where memory grew after the first 100 steps by more than what the allocator
may keep of a frame's temporary arrays: two of them, of one number per particle. The picture and the table go to a folder.
"""

from __future__ import annotations

import argparse
import csv
import resource
import tempfile
import time
from pathlib import Path

import matplotlib
import numpy as np
from mpi4py import MPI
from mpm_core.output import ModelOutput

import fenics_bridge as bridge
import mpm_core as mpm

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

comm = MPI.COMM_WORLD
SETTLED = 100  # steps after which memory is flat
FRAME = 100  # steps between frames


def resident_memory() -> float:
    """What this rank holds in memory now [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def slope(cell_size: float) -> mpm.Model:
    """The slope under 80 kN/m3, from zero stress, 10 particles per triangle."""
    mesh = bridge.background_mesh(*bridge.slope_mesh(comm, cell_size=cell_size, kind="fitted"))
    model = mpm.Model(mesh, mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0))
    model.seed(density=80e3 / 9.81, per_cell=10, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0, -9.81))
    return model


def measured(model: mpm.Model, steps: int, every: int) -> tuple[np.ndarray, float]:
    """Rows of steps done and memory of each rank [MB]; and the processor time of all ranks [s]. Collective."""
    rows = []
    started = time.process_time()
    with tempfile.TemporaryDirectory() as name:
        with ModelOutput(model, Path(comm.bcast(name)) / "particles") as output:
            output.write()
            for report in model.explicit(1e9, every_steps=every, damping=0.75):
                if report.steps % FRAME == 0:
                    output.write()
                rows.append([report.steps, *comm.allgather(resident_memory())])
                if report.steps >= steps:
                    break
        comm.barrier()
    return np.array(rows), comm.allreduce(time.process_time() - started)


def save(folder: Path, rows: np.ndarray, particles: int) -> None:
    """The table and the picture."""
    with open(folder / "memory.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["steps", *(f"rank_{rank}_MB" for rank in range(comm.size))])
        writer.writerows(rows.tolist())
    figure, axes = plt.subplots(figsize=(6, 3.2), layout="constrained")
    for rank in range(comm.size):
        axes.plot(rows[:, 0], rows[:, 1 + rank], label=f"rank {rank}")
    axes.axvline(SETTLED, color="grey", linestyle=":", label=f"step {SETTLED}")
    axes.set(xlabel="explicit steps [-]", ylabel="resident memory [MB]", ylim=(0, 1.15 * rows[:, 1:].max()))
    axes.set_xlim(0, rows[-1, 0])
    axes.set_title(f"{particles:,} particles, a frame every {FRAME} steps", fontsize="medium")
    axes.legend(loc="lower right")
    figure.savefig(folder / "memory.png", dpi=110)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--cell-size", type=float, default=0.008, help="sides of the squares [m]; 0.008: 10^6 particles"
    )
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--every", type=int, default=10, help="steps between looks")
    parser.add_argument("--output", type=Path, default=Path("results/memory"), help="folder for table and picture")
    a = parser.parse_args()
    model = slope(a.cell_size)
    particles = model.report().particles
    rows, seconds = measured(model, a.steps, a.every)
    later = rows[rows[:, 0] >= SETTLED, 1:]
    grown = float((later.max(axis=0) - later[0]).max())
    kept = 1 + 2 * 8e-6 * comm.allreduce(len(model.particles), MPI.MAX)
    if comm.rank == 0:
        a.output.mkdir(parents=True, exist_ok=True)
        save(a.output, rows, particles)
        print(
            f"{particles} particles, {comm.size} rank(s), {int(rows[-1, 0])} steps, {seconds:.1f} s of processor time"
        )
        print(
            f"after step {SETTLED} each rank holds {later.min():.0f} to {later.max():.0f} MB, grown by at most {grown:.1f} MB"
        )
    return int(grown > kept)


if __name__ == "__main__":
    raise SystemExit(main())
