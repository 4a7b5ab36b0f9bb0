"""Collapse of the slope by particles: quasi-static steps under rising unit weight, against finite elements and limit analysis.

Displacements are small: stresses change, but particles keep their positions. The unit weight is raised until no step
converges, on several meshes, with and without nodal mixed discretisation, and by quadratic finite elements on the same
meshes. Flow is associated, as limit analysis assumes, unless --dilation-angle is given. The study runs on one rank.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from time import process_time

import numpy as np
from common.field_plots import bend, save_curves
from common.options import add_number, study_parser
from common.page import Page
from common.ranks import run_study
from common.results import open_results
from common.schemes import add_particles_per_cell
from common.slope.case import GRAVITY, soil_of
from common.slope.fem import add_fem_slope_options, check_fem_slope_options, mesh_sizes, slope_fem, step_line, weight
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
BEYOND = 2.0
"""Unit weight at the end of the ramp over that of limit analysis"""
MAX_ITERATIONS = 15
"""of Newton's method, above which a step counts as failed"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_fem_slope_options(p)
    add_particles_per_cell(p, 1)
    add_number(
        p,
        "--tolerance",
        2e-3,
        "-",
        "relative increment of the unit weight below which a run ends",
        above=0,
        below=1,
    )
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check_fem_slope_options(p, options)
    return options


# --- 2. Runs ---------------------------------------------------------------------------------------------------------


def slope_particles(a: Namespace, cell_size: float, unit_weight: float) -> mpm.Model:
    """The slope without stresses, its unit weight rising over one second to the given one."""
    mesh = bridge.slope_mesh(comm, height=a.height, angle=a.angle, crest=a.crest, cell_size=cell_size, kind=a.mesh,
                             runout=cell_size)  # fmt: skip
    model = mpm.Model(bridge.background_mesh(*mesh), soil_of(a))
    model.seed(density=unit_weight / GRAVITY, per_cell=a.particles_per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, normal=(1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY), ramp=1.0)
    return model


def particle_curve(a: Namespace, cell_size: float, nmd: bool, longest_step: float, end: float) -> np.ndarray:
    """Unit weight [N/m3] and largest displacement of a node [m] at each equilibrium on the way to collapse: (k, 2)."""
    model = slope_particles(a, cell_size, end)
    displacement, curve = np.zeros(model.mesh.points.shape), [(0.0, 0.0)]
    run = model.implicit(
        1.0, dt=longest_step / end, quasi_static=True, small_displacements=True, nmd=nmd,
        solver=mpm.Newton(max_iterations=MAX_ITERATIONS), watch=lambda: model.report().dt < a.tolerance * model.time,
    )  # fmt: skip
    try:
        for report in run:
            displacement += report.dt * model.nodal("velocity")
            curve.append((model.time * end, float(np.linalg.norm(displacement, axis=1).max())))
    except mpm.RunError as error:
        print(f"    {error}", flush=True)
    return np.array(curve)


def runs(a: Namespace, cell_size: float, longest_step: float, end: float) -> dict[str, dict[str, object]]:
    """Collapse load by each method on one mesh: by name, with its curve and processor time [s]."""
    found: dict[str, dict[str, object]] = {}
    for name, nmd in (("particles", False), ("particles, NMD", True)):
        start = process_time()
        curve = particle_curve(a, cell_size, nmd, longest_step, end)
        found[name] = {"curve": curve, "collapse": curve[-1, 0], "cpu_seconds": process_time() - start}
        print(f"{name:20} h {cell_size:<7g} {curve[-1, 0] / 1e3:7.3f} kN/m3", flush=True)
    name, start = f"finite elements, {a.elements}", process_time()
    progress = step_line(f"cells of {cell_size:g} m", "unit weight [N/m3]")
    fem = bridge.collapse_load(
        slope_fem(a, comm, cell_size), weight, longest_step, tolerance=a.tolerance, progress=progress
    )
    found[name] = {"curve": fem.curve, "collapse": fem.value, "cpu_seconds": process_time() - start}
    print(f"{name:20} h {cell_size:<7g} {fem.value / 1e3:7.3f} kN/m3", flush=True)
    return found


# --- 3. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    if comm.size > 1:
        raise mpm.InputError(f"the study collapse_schemes runs on one rank, but was started on {comm.size}")
    folder = open_results(a, comm)
    expected = bridge.log_spiral(a.height, a.angle, a.cohesion, a.friction_angle, a.crest).unit_weight
    longest_step = a.cohesion / a.height  # from the strength alone, so that no step ends at the expected value
    by_size = {size: runs(a, size, longest_step, BEYOND * expected) for size in mesh_sizes(a)}
    rows = [
        {"method": name, "cell_size_m": size, "collapse_unit_weight": run["collapse"], "cpu_seconds": run["cpu_seconds"],
         "relative_difference_to_limit_analysis": run["collapse"] / expected - 1}
        for size, found in by_size.items() for name, run in found.items()
    ]  # fmt: skip
    curves = {f"{size:g} m, {name}": run["curve"] for size, found in by_size.items() for name, run in found.items()}
    shown = {
        name: (1e3 * curve[:, 1], curve[:, 0] / 1e3) for name, curve in curves.items() if not name.endswith("particles")
    }
    pictures = {"load_displacement": lambda: save_curves(
        folder / "load_displacement.png", shown, ("Largest displacement [mm]", "Unit weight [kN/m$^3$]"),
        reference=(expected / 1e3, "limit analysis"), per_colour=2,
        limits=((0, 1e3 * bend(list(curves.values()))), (0, None)),
    )}  # fmt: skip
    captions = {"load_displacement": "Unit weight over displacement on the way to collapse."}
    summary = {"limit_analysis_unit_weight": expected, "runs": rows, "curves": curves}
    return write_summary(folder, a, summary, comm, Page(captions=captions), pictures, said="")


if __name__ == "__main__":
    run_study(main)
