"""Where two ranks wait in an explicit step: for one that is late, which overlap cannot hide, and for the messages themselves.

python3 tests/bench/waiting.py CELL_SIZE STEPS, with PYTHONPATH=build/python:. and a machine that does nothing else.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
BARRIER, WAITALL, ALLREDUCE = range(3)


def traces(cell_size: str, steps: str) -> list[np.ndarray]:
    """Calls of both ranks (kind, begin, end) between the last two barriers of `ranks.py`: its last repetition."""
    with tempfile.TemporaryDirectory() as folder:
        library, trace = Path(folder) / "waiting.so", Path(folder) / "trace"
        subprocess.run(["mpicc", "-O2", "-shared", "-fPIC", "-o", library, HERE / "waiting.c"], check=True)
        subprocess.run(
            ["mpirun", "-n", "2", "-x", f"LD_PRELOAD={library}", "-x", f"TALUS_TRACE={trace}", sys.executable,
             str(HERE / "ranks.py"), cell_size, steps],
            check=True, env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        calls = [np.fromfile(f"{trace}.{rank}").reshape(-1, 3) for rank in (0, 1)]
    return [rows[slice(*np.flatnonzero(rows[:, 0] == BARRIER)[-2:])] for rows in calls]


def shares(calls: list[np.ndarray], kind: int) -> tuple[float, float]:
    """Shares of the time spent in calls of a kind, mean of both ranks: until the other rank called too, and after that."""
    here, there = (rows[rows[:, 0] == kind, 1:] for rows in calls)
    both = np.maximum(here[:, 0], there[:, 0])
    late = after = 0.0
    for rows, whole in zip((here, there), calls):
        begin, end = rows.T
        taken = 2 * (whole[-1, 2] - whole[0, 2])
        late += (np.minimum(both, end) - begin).sum() / taken
        after += np.maximum(end - both, 0).sum() / taken
    return late, after


if __name__ == "__main__":
    found = traces(*sys.argv[1:3])
    for name, kind in (("messages", WAITALL), ("reductions", ALLREDUCE)):
        late, after = shares(found, kind)
        print(f"{name}: {late:.1%} of the time until the other rank is there, {after:.1%} after that")
