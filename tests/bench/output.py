"""What output and checkpoints cost: processor time of frames over that of the steps between them.

Frames of all fields are written every so many explicit steps of the paper's slope, on one rank. Times are the processor's,
the system's share included.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from mpi4py import MPI
from mpm_core.output import MeshOutput, ParticleOutput
from steps import slope

import mpm_core as mpm

FIELDS = ("displacement", "velocity", "stress", "deviatoric_strain", "plastic_strain", "volume", "id", "material")

ROUNDS = 3
"""The best counts. What a virtual machine takes from its host the first time, such as memory for the file cache, costs several
times the writing."""


def measured(size: float, every: int, frames: int, options: dict[str, object]) -> dict[str, float]:
    """Seconds of processor time that steps, frames and checkpoints take, and the bytes of a frame."""
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
    model = slope(size, soil)
    mesh, p = model.mesh, model.particles
    spent = {"steps": 0.0, "frames": 0.0, "checkpoint": 0.0}
    with tempfile.TemporaryDirectory() as name:
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
                particles.write(report.time, {"position": p.position, **{field: getattr(p, field) for field in FIELDS}})
                nodes.write(
                    report.time, {field: model.nodal(field) for field in ("mass", "velocity", "internal_force")}
                )
                spent["steps"] += stepped - start
                spent["frames"] += time.process_time() - stepped
        size_of = sum(file.stat().st_size for file in folder.iterdir()) / frames
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
    parser.add_argument("--frames", type=int, default=5)
    a = parser.parse_args()
    cases = {"float32": {}, "float64": {"float32": False}, "float32, compressed": {"compression": 1}}
    print(f"one frame in {a.every} steps")
    print(
        f"{'particles':>9} {'stored as':20} {'frames/steps':>12} {'ms per frame':>12} {'MB per frame':>12} {'checkpoint ms':>13}"
    )
    for size in a.sizes:
        for name, options in cases.items():
            m = min(
                (measured(size, a.every, a.frames, options) for _ in range(ROUNDS)),
                key=lambda m: m["frames"] / m["steps"],
            )
            print(f"{m['particles']:9d} {name:20} {m['frames'] / m['steps']:12.1%} {1e3 * m['frames'] / a.frames:12.1f} "
                  f"{m['bytes'] / 1e6:12.2f} {1e3 * m['checkpoint']:13.1f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
