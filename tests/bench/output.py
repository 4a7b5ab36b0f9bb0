"""What output and checkpoints cost: processor time of frames over that of the steps between them.

Frames of all fields are written every so many explicit steps of the paper's slope, on one rank. Times are the processor's,
the system's share included; beside them what the system takes to write as many bytes as a frame in single precision to a plain
file. On a virtual machine that is most of it: memory that the file cache takes from the host costs several times the writing.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from mpi4py import MPI
from mpm_core.output import MeshOutput, ParticleOutput
from steps import slope

import mpm_core as mpm

FIELDS = ("displacement", "velocity", "stress", "deviatoric_strain", "plastic_strain", "volume", "id", "material")

BYTES = 78
"""What a frame in single precision takes for each particle."""

ROUNDS = 3
"""The best counts."""


def write_plainly(path: Path, n_bytes: int) -> float:
    """Seconds of processor time that the system takes to write a file of so many bytes."""
    data = np.ones(n_bytes // 8)
    start = time.process_time()
    with open(path, "wb", buffering=0) as file:
        file.write(data)
    return time.process_time() - start


def measured(size: float, every: int, frames: int, place: Path | None, options: dict[str, object]) -> dict[str, float]:
    """Seconds of processor time that steps, frames and checkpoints take, and the bytes of a frame."""
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
    model = slope(size, soil)
    mesh, p = model.mesh, model.particles
    spent = {"steps": 0.0, "frames": 0.0, "plain": 0.0, "checkpoint": 0.0}
    with tempfile.TemporaryDirectory(dir=place) as name:
        folder = Path(name)
        with (
            ParticleOutput(folder / "particles", MPI.COMM_SELF, **options) as particles,
            MeshOutput(folder / "mesh", MPI.COMM_SELF, mesh.points, mesh.cells, **options) as nodes,
        ):
            run = model.explicit(1e9, every_steps=every, damping=0.75)
            for _ in range(frames):
                start = time.process_time()
                report = next(run)
                stepped = time.process_time()
                particles.write_particles(report.time, p, FIELDS)
                nodes.write(
                    report.time, {field: model.nodal(field) for field in ("mass", "velocity", "internal_force")}
                )
                spent["steps"] += stepped - start
                spent["frames"] += time.process_time() - stepped
                spent["plain"] += write_plainly(folder / f"plain{report.steps}", BYTES * report.particles)
        size_of = sum((folder / file).stat().st_size for file in ("particles.h5", "mesh.h5")) / frames
        start = time.process_time()
        model.save(folder / "checkpoint.h5")
        spent["checkpoint"] = time.process_time() - start
    return {**spent, "bytes": size_of, "particles": report.particles}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--sizes", type=float, nargs="+", default=[0.1, 0.05, 0.025, 0.01], help="sides of the squares [m]"
    )
    parser.add_argument("--every", type=int, default=100, help="steps between frames")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--folder", type=Path, help="where to write, such as /dev/shm (default: the temporary folder)")
    a = parser.parse_args()
    cases = {"float32": {}, "float64": {"float32": False}, "float32, compressed": {"compression": 1}}
    print(f"one frame in {a.every} steps")
    print(
        f"{'particles':>9} {'stored as':20} {'frames/steps':>12} {'ms per frame':>12} {'plain write':>12} {'MB per frame':>12} "
        f"{'checkpoint ms':>13}"
    )
    for size in a.sizes:
        for name, options in cases.items():
            m = min(
                (measured(size, a.every, a.frames, a.folder, options) for _ in range(ROUNDS)),
                key=lambda m: m["frames"] / m["steps"],
            )
            print(f"{m['particles']:9d} {name:20} {m['frames'] / m['steps']:12.1%} {1e3 * m['frames'] / a.frames:12.2f} "
                  f"{1e3 * m['plain'] / a.frames:12.2f} "
                  f"{m['bytes'] / 1e6:12.2f} {1e3 * m['checkpoint']:13.1f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
