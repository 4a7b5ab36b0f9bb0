"""Cuts in normally consolidated clay, whose undrained strength is a fraction of the vertical effective stress.

Level ground begins at rest with K0 = 0.8, and its undrained strength is S = 0.3 times the vertical effective stress, so that it
grows in proportion to the depth below the surface. It is then cut to a depth of 4.5 m at a slope of 1:1 and 1:1.5, with as much
clay below the floor, and keeps that strength. The factor of safety over S, a stability number, depends on the slope alone
(Gibson and Morgenstern 1962, Géotechnique 12, 212–216), not on the depth of the cut or the unit weight. Undrained flow is
associated, so that the best slip circle, found here, is an upper bound.
Finite elements find the strengths from their stresses: quadratic ones have those of the depth exactly, linear ones that average
strains over nodes by half a percent except next to the surface.
"""


import numpy as np
from _case import Check, Kind, Result
from _slip_surfaces import best_circle
from common.field_plots import mechanism_field, save_mechanism
from common.results import ROOT
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

DEPTH, RATIO, SOILS = 4.5, 0.3, ("ground", "cut 1", "cut 2", "cut 3")  # m, -
TOP = 2 * DEPTH


def cut(slope, degree, cell_size, unit_weight):
    """Finite elements of a cut that ceases to drain before it is dug, and its load, which does not act yet."""
    shape = {
        "slope": slope,
        "cell_size": cell_size,
        "depth": DEPTH,
        "below": DEPTH,
        "half_width": 5.0,
        "width": 17.0 + slope * DEPTH,
    }
    mesh = bridge.read_mesh(ROOT / "meshes" / "excavation.geo", MPI.COMM_WORLD, parameters=shape)
    clay = mpm.Heterogeneous(mpm.tresca(young=10e6, poisson=0.3, shear_strength=1.0), ["cohesion"])
    supports = [bridge.fixed("base"), bridge.roller("axis", (1, 0)), bridge.roller("right", (1, 0))]
    fem = bridge.QuasiStatic(
        mesh[0], dict.fromkeys(SOILS, clay), mesh[2], supports, degree, cell_tags=mesh[1], nmd=degree == 1
    )
    stages = [
        bridge.Stage("level", SOILS, unit_weight=dict.fromkeys(SOILS, unit_weight), k0=dict.fromkeys(SOILS, 0.8),
                     strength_ratio=dict.fromkeys(SOILS, bridge.StrengthRatio(RATIO))),
        bridge.Stage("cut", excavate=SOILS[1:]),
    ]  # fmt: skip
    return fem, bridge.FemSite(fem).place(stages)


def circle_number(slope):
    """Stability number by the best slip circle."""
    surface = np.array([(0.0, TOP), (12.0, TOP), (12.0 + slope * DEPTH, DEPTH), (17.0 + slope * DEPTH, DEPTH)])

    def strength(x, y):
        return RATIO * np.maximum(TOP - y, 0.0)

    return best_circle(surface, strength, 1.0, DEPTH) / RATIO


def run(quick: bool, folder) -> Result:
    checks = []
    for slope in (1.0, 1.5):
        bound = circle_number(slope)
        meshes = (
            [(2, 0.9, 18e3), (1, 0.6, 18e3)]
            if quick
            else [(2, 0.75, 18e3), (2, 0.75, 8e3), (2, 0.4, 18e3), (1, 0.4, 18e3)]
        )
        for degree, cell_size, unit_weight in meshes:
            fem, load = cut(slope, degree, cell_size, unit_weight)
            found = bridge.factor_of_safety(fem, load, start=1.0, tolerance=1e-3)
            kind = "quadratic" if degree == 2 else "averaged linear"
            name = f"1:{slope:g}, {kind} triangles of {cell_size:g} m, {unit_weight / 1e3:g} kN/m³"
            checks.append(Check(name, bound, "best slip circle", found.value / RATIO, 0.01 if quick else 0.005))
            checks.append(Check(f"failure shown, {name}", 1.0, "1 if a mechanism is found", float(found.failed), 0.0))
            if degree == 2:
                shown, finest = found, name
                picture = mechanism_field(found.mechanism, soils=fem.cell_tags, off=fem.off)
        # Elements of displacements find upper bounds, too, which fall with the cells.
        checks.append(Check(f"not above, {finest}", bound, "upper bound by the best slip circle", shown.value / RATIO,
                            0.01 if quick else 0.002, kind=Kind.AT_MOST))  # fmt: skip
    if picture is not None:
        save_mechanism(folder / "cut.png", picture, f"Factor of safety {shown.value:.3f}")
    return Result(
        checks, {"cut.png": "Mechanism of the cut of 1:1.5 at failure, on the finest mesh of quadratic triangles"}
    )
