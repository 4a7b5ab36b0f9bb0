"""Rigid circular footing on clay: the bearing capacity factor N_c, smooth and rough, on finer and finer meshes.

A half section of weightless Tresca soil is loaded by a plate of radius 0.5 m that settles. A smooth plate transfers pressure
only, a rough one also prevents horizontal displacements. It settles, in steps of adaptive length, until the load no longer
rises over the last half of the settlement, so that neither the steps nor the final settlement influence the result. Quadratic
elements, and linear ones with averaged volumetric strains, are too stiff and converge from above. From mesh to mesh the error
is more than halved, at different rates, so nothing is extrapolated.
"""

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from common.files import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

RADIUS, STRENGTH, YOUNG, POISSON = 0.5, 1.0, 1e3, 0.49  # m, Pa, Pa, -
SETTLEMENT, GROWTH = 0.01, 1.6  # m at first, and by how much more until the load stays
EXACT = {"smooth": (5.69, "Cox, Eason and Hopkins 1961"), "rough": (6.05, "Eason and Shield 1960")}
ELEMENTS = {"quadratic": ({"degree": 2}, 0.02), "averaged": ({"degree": 1, "nmd": True}, 0.035)}
"""Options, and the error that is accepted on the finest mesh"""
STEADY = 2e-3
"""Rise of the load over the last half of the settlement at which it counts as that of collapse"""


def ground(size, rough, settlement, options):
    """Unloaded ground; size: of the cells under the footing [m], a quarter of it at the edge."""
    parameters = {"half_width": RADIUS, "width": 2.5, "depth": 1.5, "edge_size": 0.25 * size, "near_size": size,
                  "far_size": 5 * size}  # fmt: skip
    domain, _, facet_tags = bridge.read_mesh(ROOT / "meshes" / "footing.geo", MPI.COMM_WORLD, parameters=parameters)
    law = mpm.tresca(young=YOUNG, poisson=POISSON, shear_strength=STRENGTH)
    supports = [bridge.roller("axis", (1, 0)), bridge.roller("far", (1, 0)), bridge.fixed("base"),
                bridge.prescribed("footing", (0.0 if rough else None, -settlement))]  # fmt: skip
    return bridge.QuasiStatic(domain, law, facet_tags, supports, geometry=bridge.Geometry.AXISYMMETRIC, **options)


def factor(size, rough, options):
    """N_c at collapse, and the curve of settlement over the radius and load over area and strength, (k, 2)."""
    fem, goal, curve = ground(size, rough, SETTLEMENT, options), 1.0, [(0.0, 0.0)]
    area = 0.5 * RADIUS**2  # of one radian

    def look(step):
        if step.converged:
            curve.append(
                (fem.load.displacement * SETTLEMENT / RADIUS, abs(fem.reaction("footing")[1]) / (area * STRENGTH))
            )

    fem.solve(bridge.Load(displacement=goal), first_step=0.2, progress=look)
    while fem.converged:
        settled, load = np.array(curve).T
        if load[-1] - np.interp(0.5 * settled[-1], settled, load) < STEADY * load[-1]:
            return load[-1], np.array(curve)
        goal *= GROWTH
        fem.solve(bridge.Load(displacement=goal), first_step=0.5, progress=look)
    raise mpm.RunError("the footing: no equilibrium under its settlement")


def run(quick: bool, folder) -> Result:
    # --- 1. Both footings by both elements on halved cells ------------------------------------------------------------
    sizes, checks, found, curves = (0.16, 0.08) if quick else (0.16, 0.08, 0.04), [], {}, {}
    for kind, (options, tolerance) in ELEMENTS.items():
        for footing, (exact, source) in EXACT.items():
            name = f"{footing}, {kind}"
            runs = [factor(size, footing == "rough", options) for size in sizes]
            values = found[name] = [value for value, _ in runs]
            if kind == "quadratic":
                curves[name] = runs[-1][1]
            checks.append(
                Check(f"N_c, {name}, cells of {sizes[-1]:g} m", exact, source, values[-1], 0.08 if quick else tolerance)
            )
            checks.append(
                Check(f"N_c, {name}: convergence from above", exact, source, min(values), 0.0, kind=Kind.AT_LEAST)
            )
            ratio = (values[-1] - exact) / (values[-2] - exact)
            checks.append(Check(f"error of N_c over that on cells twice as large, {name}", 0.6,
                                "convergence with the cell size", ratio, 0.0, kind=Kind.AT_MOST))  # fmt: skip

    # --- 2. Pictures -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        ends = np.array([0.0, max(curve[-1, 0] for curve in curves.values())])
        exact = {f"{name}, exact": (ends, np.full(2, value)) for name, (value, _) in EXACT.items()}
        save_comparison(folder / "load.png", {name: tuple(curve.T) for name, curve in curves.items()}, exact,
                        ("Settlement over the radius [-]", "Load over area and $s_u$ [-]"), joined=True)  # fmt: skip
        line = np.array([0.0, max(sizes)])
        save_comparison(folder / "meshes.png", {name: (np.array(sizes), np.array(values)) for name, values in found.items()},
                        {f"{name}, exact": (line, np.full(2, value)) for name, (value, _) in EXACT.items()},
                        ("Size of the cells under the footing [m]", "$N_c$ [-]"), joined=True,
                        limits=((0.0, None), (5.5, None)))  # fmt: skip
    return Result(checks, {
        "load.png": f"Load over the settlement of a circular footing, quadratic elements, cells of {sizes[-1]:g} m",
        "meshes.png": "Bearing capacity factor over the size of the cells, and the exact ones as lines",
    })  # fmt: skip
