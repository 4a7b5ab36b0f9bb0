"""Rigid footings pushed into clay by contact with particles: the bearing capacity factor N_c, smooth and rough.

This case runs the study footing_push with stiff clay, so that the soil has yielded all around before the footing is embedded.
The factor is the load over area and shear strength at settlements of 0.6 to 1.2 % of the width for a strip, and of half of
that for a circular footing. Cells at the edge make the footing wider by about half of their size, which is 1 % of the width of
the strip, and 1 % of the area of the circular footing, whose cells are half as large. The rest of the error comes from the
cells below the footing and from the settlement: a strip gains about 1 % when it is embedded by 1 % of its width. The factors
therefore converge from above, and the error decreases with the cell size.
"""

import footing_push
import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from common.body_runs import scheme
from mpi4py import MPI

WIDTH = 1.0
SOURCES = {"strip": "Prandtl 1920", "circular": "slip lines, tests/python/studies/test_circular_footing.py"}
TOLERANCES = {"strip": 0.03, "circular": 0.035}


COARSE, FINE = (("--cell-size", "0.05", "--coarsening", "2"), ("--cell-size", "0.01", "--coarsening", "4"))
FINEST = ("--cell-size", "0.005", "--coarsening", "4", "--particles-per-cell", "3")
PUSHED = {"strip": (2000.0, "5e-4"), "circular": (4000.0, "2.5e-4")}
"""Young's modulus over strength, and speed over that of elastic waves"""


def pushed(shape, base, cells):
    """N_c, and the curve of settlement over width and load factor, (k, 2)."""
    rigidity, speed = PUSHED[shape]
    most = footing_push.COLLAPSE[1] * WIDTH / rigidity
    a = footing_push.parse(["--shape", shape, "--base", base, *cells, "--rigidity", str(rigidity), "--speed", speed,
                            "--penetration", str(most)])  # fmt: skip
    model = footing_push.build(a)
    (body,), rows = model.contacts, []

    def look(report):
        rows.append((report.time, -body.displacement[1], body.impulse[1]))

    look(model.report())
    until = footing_push.duration(a)
    for report in model.explicit(until, every=until / 24, **scheme(a)):
        look(report)
    time, settled, impulse = np.array(rows).T
    factor = np.diff(impulse) / np.diff(time) / footing_push.full_load(a)
    chosen = settled[1:] >= footing_push.COLLAPSE[0] * WIDTH / rigidity * (1 + 1e-6)
    return factor[chosen].mean(), np.column_stack([settled[1:] / WIDTH, factor])


def run(quick: bool, folder) -> Result:
    # --- 1. All footings ---------------------------------------------------------------------------------------------
    kinds = [("strip", "smooth")] if quick else list(footing_push.EXACT)
    checks, curves = [], {}
    for shape, base in kinds:
        exact, source = footing_push.EXACT[shape, base], SOURCES[shape]
        cells = COARSE if quick else FINEST if shape == "circular" else FINE
        found, curves[f"{base} {shape}"] = pushed(shape, base, cells)
        tolerance = 0.15 if quick else TOLERANCES[shape]
        checks.append(Check(f"N_c, {base} {shape} footing", exact, source, found, tolerance))
        checks.append(
            Check(f"N_c, {base} {shape} footing: convergence from above", exact, source, found, 0.0, kind=Kind.AT_LEAST)
        )

    if not quick:
        exact, coarse = footing_push.EXACT["strip", "smooth"], pushed("strip", "smooth", COARSE)[0]
        ratio = (checks[0].computed - exact) / (coarse - exact)
        checks.append(Check("error of N_c, smooth strip footing, over that on cells of 0.1 m", 0.6,
                            "convergence with the cell size", ratio, 0.0, kind=Kind.AT_MOST))  # fmt: skip

    # --- 2. Picture --------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        ends = np.array([0.0, footing_push.COLLAPSE[1] / PUSHED["strip"][0]])
        values = {f"{footing_push.EXACT[kind]:.2f}": np.full(2, footing_push.EXACT[kind]) for kind in kinds}
        save_comparison(folder / "load.png", {name: tuple(curve.T) for name, curve in curves.items()},
                        {f"exact, {name}": (ends, line) for name, line in values.items()},
                        ("Settlement over the width [-]", "Load over area and $s_u$ [-]"), joined=True,
                        limits=((0.0, None), (0.0, None)))  # fmt: skip
    return Result(checks, {"load.png": "Load over the settlement of footings that are pushed into clay"})
