"""A vertical cut in three dimensions: the weight at which a slice of it between smooth planes collapses.

The slice is one cube of cells thick and cannot bulge, so that its limit load is that of plane strain. Limit analysis with
associated flow gives it by the log-spiral (Chen 1975), and without friction by a circle, 3.83 c/γ. Quadratic tetrahedra, and
quadratic triangles on the same squares, raise the weight in steps that begin with c/H and are bisected to 0.5 %. Here the law
is used with general stress states in three dimensions, and without friction with those on the edges of the Mohr-Coulomb
hexagon. Both elements converge from above, and their error decreases with the cell size.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from _case import Check, Kind, Result
from _plots import save_refinement
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, WIDTH, COHESION = 1.0, 1.5, 1e3  # m, m, Pa
PLANE, SLICE = "plane strain", "slice in three dimensions"


def stability_factor(dim: int, friction: float, cells: int) -> float:
    """Weight of the last equilibrium times height over cohesion; cells: over the height. Collective."""
    cell = HEIGHT / cells
    counts = [round(WIDTH / cell), *[1] * (dim - 2), cells]  # weight acts against the last axis
    domain, _, facet_tags = bridge.box_mesh(MPI.COMM_WORLD, [cell * n for n in counts], counts)
    soil = mpm.MohrCoulomb(young=1e6, poisson=0.3, cohesion=COHESION, friction_angle=friction, dilation_angle=friction)
    axes, base = np.eye(dim), 2 * dim - 1
    supports = [bridge.roller(1, axes[0]), bridge.fixed(base)]
    supports += [bridge.roller(tag, axes[1]) for tag in (3, 4)[: 2 * (dim - 2)]]
    model = bridge.QuasiStatic(domain, soil, facet_tags, supports, degree=2)
    load = lambda weight: bridge.Load(unit_weight=weight)  # noqa: E731
    return bridge.collapse_load(model, load, COHESION / HEIGHT, tolerance=5e-3).value * HEIGHT / COHESION


def run(quick: bool, folder: Path) -> Result:
    sizes = (3, 6) if quick else (6, 12)
    checks, errors = [], {}
    for friction in (0.0,) if quick else (0.0, 20.0):
        # --- 1. Both bodies on both meshes, and limit analysis ------------------------------------------------------
        exact = bridge.log_spiral(HEIGHT, 90.0, COHESION, friction).unit_weight * HEIGHT / COHESION
        plane, solid = ([stability_factor(dim, friction, cells) for cells in sizes] for dim in (2, 3))
        for name, found in ((PLANE, plane), (SLICE, solid)):
            errors[f"φ = {friction:g}°, {name}"] = [abs(factor / exact - 1) for factor in found]

        # --- 2. What is expected ------------------------------------------------------------------------------------
        of = f"stability factor, φ {friction:g}°"
        checks.append(
            Check(f"{of}, slice", exact, "limit analysis in plane strain", solid[-1], 0.08 if quick else 0.06)
        )
        checks.append(
            Check(
                f"{of}, slice against plane strain",
                plane[-1],
                "quadratic triangles on the same squares",
                solid[-1],
                0.02,
            )
        )
        fell = abs(solid[-1] - exact) / abs(solid[0] - exact)
        checks.append(Check(f"{of}: error over that on cells twice as large", 0.6, "convergence with the cell size", fell, 0.0,
                            kind=Kind.AT_MOST))  # fmt: skip

    # --- 3. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        panels = {"Stability factor above limit analysis": errors}
        save_refinement(folder / "error.png", sizes, "Squares over the height", panels)
    return Result(checks, {"error.png": "Stability factors above limit analysis over the number of cells"})
