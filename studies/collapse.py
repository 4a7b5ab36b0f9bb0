"""Collapse of the slope: the unit weight that it can just carry, by elasto-plastic FEM against limit analysis.

The unit weight is raised until no equilibrium is found any more, on several meshes. With associated flow (the default) the
result converges from above to that of limit analysis; flow without dilation is reported beside it.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.field_plots import bend, gathered, save_convergence, save_curves, save_mechanism
from common.options import add_switch, check, study_parser
from common.ranks import run_study
from common.slope_fem import (
    add_fem_slope_options,
    check_fem_slope_options,
    flow_name,
    mesh_sizes,
    slope_fem,
    step_line,
    weight,
)
from common.summary import OutputError, results_folder, write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """All options; units stand in the help."""
    p = study_parser(__doc__)
    add_fem_slope_options(p)
    add_switch(p, "--without-dilation", True, "flow without dilation as well, to compare with")
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check_fem_slope_options(p, options)
    check(p, options.friction_angle < options.angle,
          lambda: f"--friction-angle is {options.friction_angle:g}, expected below --angle, {options.angle:g} degrees: "
                  "a slope that is flatter carries any unit weight")  # fmt: skip
    return options


# --- 2. Collapse on each mesh ----------------------------------------------------------------------------------------


def collapse(a: Namespace, cell_size: float, dilation_angle: float, first_step: float) -> bridge.Collapse:
    """Raise the unit weight to the last equilibrium on one mesh."""
    model = slope_fem(a, comm, cell_size, dilation_angle)
    title = f"cells of {cell_size:g} m, dilation angle {dilation_angle:g} degrees"
    return bridge.collapse_load(model, weight, first_step=first_step, progress=step_line(title))


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw(a: Namespace, sizes: list[float], results: dict, spiral: bridge.LogSpiral, folder: Path) -> None:
    """Load-displacement curves, convergence and mechanism. Collective."""
    fields = {angle: gathered(runs[-1].mechanism) for angle, runs in results.items()}
    if comm.rank != 0:
        return
    reference = (spiral.unit_weight / 1e3, "limit analysis, associated flow")
    curves = {f"{size:g} m, {flow_name(a, angle)}": (1e3 * runs[k].curve[:, 1], runs[k].curve[:, 0] / 1e3)
              for k, size in enumerate(sizes) for angle, runs in results.items()}  # fmt: skip
    shown = 1e3 * bend([run.curve for runs in results.values() for run in runs])
    save_curves(folder / "load_displacement.png", curves, ("Largest displacement [mm]", "Unit weight [kN/m$^3$]"),
                reference=reference, limits=((0, shown), (0, None)), per_colour=len(results))  # fmt: skip
    loads = {flow_name(a, angle): [run.value / 1e3 for run in runs] for angle, runs in results.items()}
    save_convergence(folder / "convergence.png", sizes, loads, "Unit weight at collapse [kN/m$^3$]", reference)
    for angle, field in fields.items():
        name = "mechanism" if angle == a.dilation_angle else "mechanism_without_dilation"
        title = f"Collapse at {results[angle][-1].value / 1e3:.2f} kN/m$^3$, {flow_name(a, angle)}"
        save_mechanism(folder / f"{name}.png", field, title, line=spiral.curve, line_name="log-spiral, limit analysis")


def davis_unit_weight(a: Namespace) -> float:
    """Limit analysis with the strength that Davis (1968) gives soil without dilation: tan(phi*) = sin(phi), c* = c cos(phi)."""
    phi = np.radians(a.friction_angle)
    reduced = float(np.degrees(np.arctan(np.sin(phi))))
    return bridge.log_spiral(a.height, a.angle, float(a.cohesion * np.cos(phi)), reduced, a.crest).unit_weight


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    start = perf_counter()
    folder = results_folder("collapse", a.output, comm)
    spiral = bridge.log_spiral(a.height, a.angle, a.cohesion, a.friction_angle, a.crest)
    sizes = mesh_sizes(a)
    angles = list(dict.fromkeys([a.dilation_angle, *([0.0] if a.without_dilation else [])]))
    results = {angle: [collapse(a, size, angle, 0.1 * spiral.unit_weight) for size in sizes] for angle in angles}
    draw(a, sizes, results, spiral, folder)

    limit = spiral.unit_weight
    chosen = results[a.dilation_angle]
    summary = {
        "collapse_unit_weight": chosen[-1].value,
        "failed_at_unit_weight": chosen[-1].failed_at,
        "limit_analysis_unit_weight": limit,
        "relative_difference_to_limit_analysis": chosen[-1].value / limit - 1,
        "stability_number": chosen[-1].value * a.height / a.cohesion,
        "dilation_angle_degrees": a.dilation_angle,
        "collapse_unit_weight_without_dilation": results[0.0][-1].value if 0.0 in results else None,
        "limit_analysis_unit_weight_without_dilation_davis": davis_unit_weight(a),
        "slip_line_starts_on_crest": bool(spiral.curve[0, 0] >= 0),
        "meshes": [
            {"cell_size_m": size, "dilation_angle_degrees": angle, "collapse_unit_weight": run.value,
             "failed_at_unit_weight": run.failed_at, "relative_difference_to_limit_analysis": run.value / limit - 1,
             "largest_displacement_m": run.curve[-1, 1], "steps": len(run.steps)}
            for angle, runs in results.items() for size, run in zip(sizes, runs)
        ],
        "curve_unit_weight": chosen[-1].curve[:, 0],
        "curve_largest_displacement_m": chosen[-1].curve[:, 1],
        "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    write_summary(folder, a, summary, comm)
    if comm.rank == 0:
        tell(a, sizes, results, spiral, folder)
    return 0


def tell(a: Namespace, sizes: list[float], results: dict, spiral: bridge.LogSpiral, folder: Path) -> None:
    print(f"limit analysis: {spiral.unit_weight / 1e3:.2f} kN/m3 with associated flow, {davis_unit_weight(a) / 1e3:.2f} with "
          "Davis' reduced strength without dilation")  # fmt: skip
    if spiral.curve[0, 0] < 0:
        print("its slip line starts behind the mesh: --crest is too short to compare")
    for angle, runs in results.items():
        for size, run in zip(sizes, runs):
            print(f"cells of {size:<7g} m, dilation angle {angle:4g} degrees: {run.value / 1e3:6.2f} kN/m3 "
                  f"({run.value / spiral.unit_weight - 1:+.1%})")  # fmt: skip
    print(f"results in {folder}")


if __name__ == "__main__":
    run_study(main, mpm.InputError, OutputError)
