"""Cost of an implicit quasi-static step of particles with pore water over that without: both in turns, medians of ratios.

    python3 tests/bench/wet_step.py --cell-size 0.13

The slope of `consolidating_slope.py` under the fill on its crest, and the same slope dry.
"""

from __future__ import annotations

import argparse
import statistics
from time import process_time

from consolidating_slope import FILL, YEAR, load_crest, slope

import mpm_core as mpm

LIMIT = 2.5
STEP = 1e-4 * YEAR


def cost(model: mpm.Model, steps: int) -> tuple[float, float]:
    """Processor time of a step, and Newton iterations in it."""
    start, iterations = process_time(), 0
    for report in model.implicit(model.time + steps * STEP, dt=STEP, quasi_static=True, every_steps=1):
        iterations += report.iterations
    return (process_time() - start) / steps, iterations / steps


def main() -> int:
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--cell-size", type=float, default=0.13, help="[m]")
    p.add_argument("--pairs", type=int, default=7, help="pairs of runs")
    p.add_argument("--steps", type=int, default=3, help="steps of a run")
    a = p.parse_args()
    wet, dry = (slope(a.cell_size, 3, wet=wet) for wet in (True, False))
    ratios, per_iteration = [], []
    for k in range(a.pairs + 1):
        for model in (wet, dry):  # more load each time, so that both have something to do
            load_crest(model, a.cell_size, (0.5 + 0.1 * k) * FILL)
        (wet_time, wet_iterations), (dry_time, dry_iterations) = cost(wet, a.steps), cost(dry, a.steps)
        if k > 0:  # the first one warms up
            ratios.append(wet_time / dry_time)
            per_iteration.append(wet_time / wet_iterations / (dry_time / dry_iterations))
    middle = statistics.median(ratios)
    print(f"{len(wet.particles) // 3} cells: step {middle:.2f} ({min(ratios):.2f} to {max(ratios):.2f}), Newton iteration "
          f"{statistics.median(per_iteration):.2f}, last steps {1e3 * wet_time:.0f} ms of {wet_iterations:.1f} and "
          f"{1e3 * dry_time:.0f} ms of {dry_iterations:.1f} iterations, limit {LIMIT}")  # fmt: skip
    return 0 if middle <= LIMIT else 1


if __name__ == "__main__":
    raise SystemExit(main())
