"""What output and checkpoints cost: the fraction of frames in the time of a run, on all ranks that this runs on.

Frames of all fields are written every so many explicit steps of the paper's slope. Beside them stands what the system takes to
write as many bytes as a frame in single precision to a new plain file. On a virtual machine that can be nearly all of it: memory
that the file cache takes from the host for the first time costs several times the writing.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, thread_time

import numpy as np
from mpi4py import MPI
from mpm_core.output import ModelOutput
from ranks import sliding_slope

COMM = MPI.COMM_WORLD

BYTES = 78
"""What a frame in single precision takes for each particle."""

CASES = {
    "float32": {}, "background": {"background": True}, "float64": {"float32": False}, "compressed": {"compression": 1}
}  # fmt: skip

ROUNDS = 3
"""The best counts."""


def measured(
    size: float, every: int, frames: int, folder: Path, options: dict[str, object], clock: Callable[[], float]
) -> dict[str, float]:
    """Seconds that steps, frames and checkpoints take, and the bytes of a frame."""
    model, n = sliding_slope(size)
    plain = np.ones(BYTES * n // COMM.size // 8)
    spent = dict.fromkeys(("steps", "frames", "plain", "checkpoint"), 0.0)
    start = clock()

    def lap(what: str) -> None:
        nonlocal start
        COMM.barrier()
        spent[what] += clock() - start
        start = clock()

    with ModelOutput(model, folder / "particles", folder / "mesh", **options) as output:
        run = model.explicit(1e9, every_steps=every, damping=0.75)
        next(run)
        COMM.barrier()
        start = clock()
        for frame in range(frames):
            next(run)
            lap("steps")
            output.write()
            lap("frames")
            with open(folder / f"plain-{COMM.rank}-{frame}", "wb", buffering=0) as file:
                file.write(plain)
            lap("plain")
    size_of = sum(path.stat().st_size for path in folder.glob("*/*.h5")) / frames
    start = clock()
    model.save(folder / "checkpoint.h5")
    lap("checkpoint")
    return {**spent, "bytes": size_of, "particles": n}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--sizes", type=float, nargs="+", default=[0.1, 0.05, 0.025, 0.01], help="sides of the cells [m]"
    )
    parser.add_argument("--every", type=int, default=100, help="steps between frames")
    parser.add_argument("--frames", type=int, default=50)
    parser.add_argument("--stored-as", nargs="+", choices=CASES, default=list(CASES), help="how values are stored")
    parser.add_argument("--folder", type=Path, help="where to write, such as /dev/shm (default: the temporary folder)")
    parser.add_argument(
        "--cpu",
        action="store_true",
        help="processor time of the first rank, without its other threads, in place of time on the wall",
    )
    a = parser.parse_args()
    first = COMM.rank == 0

    def say(text: str) -> None:
        if first:
            print(text, flush=True)

    say(f"one frame in {a.every} steps, {COMM.size} rank(s)")
    say(
        f"{'particles':>9} {'stored as':10} {'of the run':>12} {'ms per frame':>12} {'plain write':>12} {'MB per frame':>12} "
        f"{'checkpoint ms':>13}"
    )
    with tempfile.TemporaryDirectory(dir=a.folder) as own:
        place = Path(COMM.bcast(own))
        rounds = 0
        for size in a.sizes:
            for name in a.stored_as:
                best = {"frames": np.inf, "steps": 1.0}
                for _ in range(ROUNDS):
                    rounds += 1
                    folder = place / str(rounds)
                    if first:
                        folder.mkdir()
                    COMM.barrier()
                    m = measured(size, a.every, a.frames, folder, CASES[name], thread_time if a.cpu else perf_counter)
                    best = min(best, m, key=lambda m: m["frames"] / m["steps"])
                    COMM.barrier()
                    if first:  # a disk is slow to make files where many have just been removed
                        for path in filter(Path.is_file, folder.glob("**/*")):
                            os.truncate(path, 0)
                say(f"{best['particles']:9d} {name:10} {best['frames'] / (best['steps'] + best['frames']):12.1%} "
                     f"{1e3 * best['frames'] / a.frames:12.2f} {1e3 * best['plain'] / a.frames:12.2f} "
                     f"{best['bytes'] / 1e6:12.2f} {1e3 * best['checkpoint']:13.1f}")  # fmt: skip
        COMM.barrier()


if __name__ == "__main__":
    main()
