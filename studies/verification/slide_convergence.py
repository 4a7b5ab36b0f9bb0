"""An undamped slide of frictional soil: influence of cells, time steps, particles and mesh on crest and run-out.

The paper's slope slides for two seconds under 60 kN/m³, which is applied at once, without damping, with mixed integration and
averaged strains. In flow without dilation shear bands have no intrinsic width: they become thinner with the cells, and the
slope slides farther, whichever integration is used. Strength that rises with the shear rate gives the bands a width, and the
slide must then converge. Its viscosity here is 1 kPa s, which raises the strength by some kilopascals. There is no reference
solution: each variant is compared with the run that differs from it in one parameter.

On a smooth base the slope slides as one body without shear bands, and the results for the same soil without viscosity converge
as well; they are compared after 0.6 s, also with cells that move with the soil, which no particle crosses. Under 80 kN/m³, with
viscosity and the affine transfer, the results converge without damping while the slope comes to rest; they are compared after 4 s,
and the crest moves by another tenth until 8 s.

Local damping acts on the oscillations of the mesh, so that a slide with it depends on the cells. Forces against the motion of
5 /s times the momentum brake a slide as well, and its crest then does not depend on them; compared after 4 s.

The particles cross cells all the time, which the energy balance shows: if stresses are summed over particles, the crossings
dissipate a part of the energy, which grows as cells become smaller. Implicit steps of second order follow the explicit slide,
with viscosity and without.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from _case import Check, Result
from _plots import save_comparison
from common.slope.case import GRAVITY, SlopeCase, build_slope, slope_options
from common.watch import Watch
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

VISCOUS = ["--material", "viscoplastic", "--viscosity", "1000"]
END, STEP = 2.0, 0.05  # s: of the slide, of the implicit scheme
SMOOTH_END = 0.6  # s: of the slide on a smooth base
HEAVY, REST_END = "80e3", 4.0  # N/m3, s: of the slides that come to rest
BRAKE = mpm.Rayleigh(mass=5.0, plastic_strain=np.inf)  # 1/s: forces against the motion, in yielding soil too
BRAKE_PIC = 0.02  # takes the noise of the particles, which no force at the nodes damps
MIXED, PARTICLES = mpm.Integration.MIXED, mpm.Integration.PARTICLES
CROSSINGS = (
    "Particles that cross cells dissipate energy if stresses are summed over particles; mixed integration avoids this."
)


class Slide(NamedTuple):
    """Displacement of the crest and run-out [m], and the unexplained fraction of the energy [-], at the end."""

    crest: float
    run_out: float
    unexplained: float


def on_smooth_base(case: SlopeCase) -> None:
    """Give a slope that has not moved yet a base on which it slides freely. Collective."""
    model = mpm.Model(case.model.mesh, case.soil)
    model.seed(density=case.args.unit_weight / GRAVITY, per_cell=case.args.particles_per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, normal=(1, 0))
    model.roller(bridge.BASE, normal=(0, 1))
    model.set_gravity((0.0, -GRAVITY))
    case.model = model


def slide(
    cell,
    per_cell=6,
    courant=0.5,
    mesh="crossed",
    integration=MIXED,
    nmd=True,
    implicit=False,
    viscous=True,
    smooth=False,
    to_rest=False,
    moving_cells=False,
    braked=False,
) -> Slide:
    """The slide of one variant; courant: step over the critical one; smooth: the base; to_rest: of heavier soil, longer, by the
    affine transfer; moving_cells: as in `Model.explicit`; braked: heavier soil, longer, with forces against the motion.
    Collective."""
    soil = VISCOUS if viscous else ["--dilation-angle", "0"]
    options = [
        "--unit-weight",
        HEAVY if to_rest or braked else "60e3",
        *soil,
        "--cell-size",
        str(cell),
        "--particles-per-cell",
        str(per_cell),
        "--mesh",
        mesh,
    ]
    case = build_slope(slope_options(options), MPI.COMM_WORLD)
    if smooth:
        on_smooth_base(case)
    watch, end = Watch(case), REST_END if to_rest or braked else SMOOTH_END if smooth else END
    transfer = mpm.Transfer.AFFINE if to_rest else mpm.Transfer.FLIP
    if implicit:
        report = case.model.implicit(end, dt=STEP, second_order=True, nmd=nmd, integration=integration).last()
    else:
        brake = {"rayleigh": BRAKE, "pic": BRAKE_PIC} if braked else {}
        run = case.model.explicit(
            end,
            courant=courant,
            nmd=nmd,
            integration=integration,
            transfer=transfer,
            moving_cells=moving_cells,
            **brake,
        )
        report = run.last()
    return Slide(watch.crest_displacement(), watch.runout(), report.unexplained_fraction)


def alike(name: str, reference: Slide, other: Slide, tolerance: float, of_run_out: float | None = None) -> list[Check]:
    """Checks that a variant slides as far as the reference; the run-out may have a tolerance of its own."""
    source = "reference run, which differs in the named parameter only"
    of_run_out = tolerance if of_run_out is None else of_run_out
    return [
        Check(f"crest, {name}", reference.crest, source, other.crest, tolerance, "m"),
        Check(f"run-out, {name}", reference.run_out, source, other.run_out, of_run_out, "m"),
    ]


def balanced(name: str, slide: Slide, limit: str = "") -> Check:
    """Check of the energy balance."""
    source = "energy balance: works, stored energy and losses add up"
    return Check(
        f"unexplained energy, {name}",
        0.0,
        source,
        abs(slide.unexplained),
        0.01,
        scale=1.0,
        over="the energy at work",
        limit=limit,
    )


def run(quick: bool, folder: Path) -> Result:
    cells = (0.1, 0.05) if quick else (0.1, 0.05, 0.025)
    middle = cells[-2]

    # --- 1. Smaller cells -------------------------------------------------------------------------------------------
    found = {cell: slide(cell) for cell in cells}
    name = f"cells of {middle:g} m against half of that"
    checks = alike(name, found[cells[-1]], found[middle], 0.15 if quick else 0.03)
    checks += [balanced(f"cells of {cell:g} m", one) for cell, one in found.items()]

    # --- 2. Step, particles and mesh --------------------------------------------------------------------------------
    coarse = 4 if quick else 1
    checks += alike("a quarter of the step", found[middle], slide(middle, courant=0.125), 0.01 * coarse)
    checks += alike("twelve particles in a cell for six", found[middle], slide(middle, per_cell=12), 0.03 * coarse)
    checks += alike("unstructured mesh", found[middle], slide(middle, mesh="gmsh"), 0.03 * coarse)

    # --- 3. Implicit steps, whose averaged strains have other forces ------------------------------------------------
    plain = slide(0.1, nmd=False)
    name = f"implicit steps of {STEP:g} s, cells of 0.1 m, no averaging"
    checks += alike(name, plain, slide(0.1, nmd=False, implicit=True), 0.03)
    plain = slide(0.1, per_cell=10, nmd=False, viscous=False)
    implicit = slide(0.1, per_cell=10, nmd=False, viscous=False, implicit=True)
    name = f"no viscosity, implicit steps of {STEP:g} s, cells of 0.1 m, ten particles in each, no averaging"
    checks += alike(name, plain, implicit, 0.015, 0.05)

    # --- 4. A smooth base, without viscosity ------------------------------------------------------------------------
    free = {"viscous": False, "smooth": True}
    reference = slide(middle, **free)
    variants = {
        f"cells of {middle:g} m against half of that": {"cell": cells[-1]},
        "a quarter of the step": {"courant": 0.125},
        "twelve particles in a cell for six": {"per_cell": 12},
        "unstructured mesh": {"mesh": "gmsh"},
        "cells that move with the soil": {"moving_cells": True},
    }
    for name, other in variants.items():
        checks += alike(
            f"smooth base, no viscosity, {name}", reference, slide(**{"cell": middle, **free, **other}), 0.03
        )

    # --- 5. A slide that comes to rest ------------------------------------------------------------------------------
    resting = {cell: slide(cell, to_rest=True) for cell in cells[-2:]}
    name = f"to rest, cells of {middle:g} m against half of that"
    checks += alike(name, resting[cells[-1]], resting[middle], 0.15 if quick else 0.03)
    checks += [balanced(f"to rest, cells of {cell:g} m", one) for cell, one in resting.items()]
    if not quick:
        variants = {"a quarter of the step": {"courant": 0.125}, "twelve particles in a cell for six": {"per_cell": 12},
                    "unstructured mesh": {"mesh": "gmsh"}}  # fmt: skip
        for name, other in variants.items():
            checks += alike(f"to rest, {name}", resting[middle], slide(middle, to_rest=True, **other), 0.03)

    # --- 6. A slide that forces in proportion to momentum brake; its toe moves by a few cells, to half a cell ------------
    braked = {cell: slide(cell, braked=True) for cell in cells}
    variants = {
        f"cells of {middle:g} m against half of that": braked[cells[-1]],
        "a quarter of the step": slide(middle, braked=True, courant=0.125),
        "twelve particles in a cell for six": slide(middle, braked=True, per_cell=12),
        "unstructured mesh": slide(middle, braked=True, mesh="gmsh"),
    }
    for name, other in variants.items():
        checks += alike(f"braked, {name}", other, braked[middle], 0.15 if quick else 0.03)[:1]
    checks += [balanced(f"braked, cells of {cell:g} m", one) for cell, one in braked.items()]

    # --- 7. Sums over particles, for comparison ---------------------------------------------------------------------
    summed = {cell: slide(cell, integration=PARTICLES) for cell in cells}
    checks += [balanced(f"cells of {cell:g} m, sums over particles", one, CROSSINGS) for cell, one in summed.items()]

    # --- 8. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        curves = {}
        for name, runs in (("mixed", found), ("sums over particles", summed)):
            width = np.array(list(runs))
            curves[f"crest, {name}"] = width, np.array([one.crest for one in runs.values()])
            curves[f"run-out, {name}"] = width, np.array([one.run_out for one in runs.values()])
        save_comparison(folder / "cells.png", curves, {}, ("Size of the cells [m]", "Displacement after 2 s [m]"),
                        limits=((0, None), (0, 0.6)), joined=True)  # fmt: skip
    return Result(checks, {"cells.png": "Crest and run-out of an undamped slide over the size of the cells"})
