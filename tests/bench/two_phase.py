"""Cost of an explicit step of soil and water over that of soil alone, per particle: both in turns, medians of ratios."""

from __future__ import annotations

import argparse
import statistics
import time

from steps import block, slope

import mpm_core as mpm

LIMIT = 2.2
SOIL = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=10e3, friction_angle=25.0)


def models(dim: int, size: float) -> tuple[mpm.Model, mpm.Model]:
    """The same body, dry and with water."""
    dry, wet = (slope(size, SOIL) if dim == 2 else block(round(1 / size), SOIL) for _ in range(2))
    wet.add_water(porosity=0.4, conductivity=1e-4, modulus=1e6)
    return dry, wet


def seconds(model: mpm.Model, steps: int, nmd: bool) -> float:
    """Processor time of some steps."""
    start = time.process_time()
    for _ in model.explicit(model.time + 1e3, every_steps=steps, nmd=nmd):
        return time.process_time() - start
    raise RuntimeError("no step")


def main() -> int:
    p = argparse.ArgumentParser(description=__doc__)
    p.add_argument("--pairs", type=int, default=9, help="pairs of runs")
    p.add_argument("--steps", type=int, default=40, help="steps of a run")
    a = p.parse_args()
    worst = 0.0
    for dim, size in ((2, 0.025), (3, 0.1)):
        for nmd in (False, True):
            dry, wet = models(dim, size)
            for model in (dry, wet):
                seconds(model, a.steps, nmd)
            ratios = [seconds(wet, a.steps, nmd) / seconds(dry, a.steps, nmd) for _ in range(a.pairs)]
            middle = statistics.median(ratios)
            worst = max(worst, middle)
            print(f"{dim}D{', nmd' if nmd else '':5}: {middle:.2f} ({min(ratios):.2f} to {max(ratios):.2f}), "
                  f"{len(dry.particles)} particles, limit {LIMIT}")  # fmt: skip
    return 0 if worst <= LIMIT else 1


if __name__ == "__main__":
    raise SystemExit(main())
