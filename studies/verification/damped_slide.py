"""The damped slide by explicit and by implicit steps: which part of their difference is due to cell crossings, which to the load.

The paper's slope under 80 kN/m³ with local damping of 0.75, from zero stress, ten particles in cells of 0.1 m, after a minute.
Applied at once, the load causes elastic waves that load the soil beyond its strength: explicit steps resolve them, implicit steps
of twenty critical ones do not. Particles that cross cells add noise, if forces are sums over particles, which explicit steps keep
as motion and implicit steps dissipate. When gravity rises over five seconds, and stresses are integrated over whole cells, neither
is left, and both schemes must come to the same place; on the way, the implicit slide is slower. Strains are not averaged: explicit
steps average by half what implicit ones average in full. The toe is one cell high, so that run-outs are compared by the size of the
cells.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _case import Check, Result
from common.plots import save_history
from common.schemes import IMPLICIT_STEP
from common.slope.case import GRAVITY, build_slope, slope_options
from common.watch import Watch
from mpi4py import MPI

import mpm_core as mpm

DAMPING, RAMP = 0.75, 5.0  # local damping [-]; time in which gravity rises [s]
END = 60.0  # s
MIXED, PARTICLES = mpm.Integration.MIXED, mpm.Integration.PARTICLES
SUDDEN = "the waves of a sudden load strain the soil beyond its strength; steps longer than their periods do not resolve them"
CROSSINGS = f"{SUDDEN}; and implicit steps dissipate the noise of cell crossings"


def slide(cell: float, integration: mpm.Integration, ramp: float, implicit: bool) -> np.ndarray:
    """Time [s], displacement of the crest [m] and run-out [m] of a slide, (k, 3). Collective."""
    options = slope_options(["--mesh", "crossed" if cell == 0.1 else "fitted", "--cell-size", str(cell)])
    case = build_slope(options, MPI.COMM_WORLD)
    model, watch = case.model, Watch(case)
    model.set_gravity((0.0, -GRAVITY), ramp=ramp)
    scheme = {"damping": DAMPING, "integration": integration, "every": 1.0}
    if implicit:
        run = model.implicit(END, dt=IMPLICIT_STEP * model.critical_time_step(), **scheme)
    else:
        run = model.explicit(END, **scheme)
    return np.array([(0.0, 0.0, 0.0), *((r.time, watch.crest_displacement(), watch.runout()) for r in run)])


def run(quick: bool, folder: Path) -> Result:
    cell = 0.2 if quick else 0.1
    variants = {
        "over 5 s, integrated over cells": (MIXED, RAMP, ""),
        "at once, integrated over cells": (MIXED, 0.0, SUDDEN),
        "at once, sums over particles": (PARTICLES, 0.0, CROSSINGS),
    }
    checks, curves = [], {}
    for name, (integration, ramp, limit) in variants.items():
        explicit, implicit = (slide(cell, integration, ramp, which) for which in (False, True))
        source = "the same slide by explicit steps"
        checks += [
            Check(
                f"crest, load {name}",
                explicit[-1, 1],
                source,
                implicit[-1, 1],
                0.05 if quick else 0.03,
                "m",
                limit=limit,
            ),
            Check(
                f"run-out, load {name}",
                explicit[-1, 2],
                source,
                implicit[-1, 2],
                0.1,
                "m",
                scale=cell,
                over="size of a cell",
            ),
        ]
        curves |= {f"explicit, {name}": explicit, f"implicit, {name}": implicit}
    if MPI.COMM_WORLD.rank == 0:
        time = np.arange(0.0, END + 0.5)
        crest = {name: np.interp(time, curve[:, 0], curve[:, 1]) for name, curve in curves.items()}
        save_history(
            folder / "crest.png", time, crest, "Displacement of the particle at the crest [m]", limits=(0, 0.5)
        )
    return Result(checks, {"crest.png": "Crest of a damped slide by explicit and by implicit steps"})
