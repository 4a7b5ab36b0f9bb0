"""Factor of safety of the slope: by what its strength can be divided, by elasto-plastic FEM against limit analysis.

Cohesion and tan(friction angle) are divided by a rising factor until no equilibrium under the unit weight is found any more
(strength reduction), on several meshes. Flow is associated unless a dilation angle is given; flow without dilation is
reported beside it.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.field_plots import bend, gathered, save_convergence, save_curves, save_mechanism
from common.options import add_number, add_switch, study_parser
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
    add_number(p, "--unit-weight", 20e3, "N/m3", "unit weight of the soil", above=0)
    add_number(p, "--start", 0.5, "-", "first factor that is tried; the slope must stand with it", above=0)
    add_switch(p, "--without-dilation", True, "flow without dilation as well, to compare with")
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check_fem_slope_options(p, options)
    return options


# --- 2. Strength reduction on each mesh ------------------------------------------------------------------------------


def safety(a: Namespace, cell_size: float, dilation_angle: float) -> bridge.Collapse:
    """Weaken the soil to the last equilibrium on one mesh."""
    model = slope_fem(a, comm, cell_size, dilation_angle)
    title = f"cells of {cell_size:g} m, dilation angle {dilation_angle:g} degrees"
    return bridge.factor_of_safety(model, weight(a.unit_weight), start=a.start, progress=step_line(title))


def slip_line(a: Namespace, factor: float) -> np.ndarray | None:
    """Slip line of limit analysis with the strength divided by the factor of safety; None where the surface slides."""
    reduced = float(np.degrees(np.arctan(np.tan(np.radians(a.friction_angle)) / factor)))
    return (
        bridge.log_spiral(a.height, a.angle, a.cohesion / factor, reduced, a.crest).curve if reduced < a.angle else None
    )


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw(a: Namespace, sizes: list[float], results: dict, factor: float, folder: Path) -> None:
    """Displacement over the factor, convergence and mechanism. Collective."""
    fields = {angle: gathered(runs[-1].mechanism) for angle, runs in results.items()}
    if comm.rank != 0:
        return
    reference = (factor, "limit analysis, associated flow")
    every = [run.curve for runs in results.values() for run in runs]
    curves = {f"{size:g} m, {flow_name(a, angle)}": (1e3 * runs[k].curve[:, 1], runs[k].curve[:, 0])
              for k, size in enumerate(sizes) for angle, runs in results.items()}  # fmt: skip
    save_curves(folder / "factor_displacement.png", curves,
                ("Largest displacement [mm]", "Factor that divides the strength [-]"), reference=reference,
                limits=((0, 1e3 * bend(every)), (0.98 * a.start, None)), per_colour=len(results))  # fmt: skip
    factors = {flow_name(a, angle): [run.value for run in runs] for angle, runs in results.items()}
    save_convergence(folder / "convergence.png", sizes, factors, "Factor of safety [-]", reference)
    line = slip_line(a, factor)
    for angle, field in fields.items():
        name = "mechanism" if angle == a.dilation_angle else "mechanism_without_dilation"
        title = f"Factor of safety {results[angle][-1].value:.3f}, {flow_name(a, angle)}"
        save_mechanism(folder / f"{name}.png", field, title, line=line, line_name="log-spiral, limit analysis")


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    start = perf_counter()
    folder = results_folder("safety", a.output, comm)
    limit = bridge.log_spiral_safety(a.height, a.angle, a.cohesion, a.friction_angle, a.unit_weight)
    sizes = mesh_sizes(a)
    angles = list(dict.fromkeys([a.dilation_angle, *([0.0] if a.without_dilation else [])]))
    results = {angle: [safety(a, size, angle) for size in sizes] for angle in angles}
    draw(a, sizes, results, limit, folder)

    chosen = results[a.dilation_angle]
    summary = {
        "factor_of_safety": chosen[-1].value,
        "failed_at_factor": chosen[-1].failed_at,
        "limit_analysis_factor_of_safety": limit,
        "relative_difference_to_limit_analysis": chosen[-1].value / limit - 1,
        "factor_of_safety_without_dilation": results[0.0][-1].value if 0.0 in results else None,
        "meshes": [
            {"cell_size_m": size, "dilation_angle_degrees": angle, "factor_of_safety": run.value,
             "failed_at_factor": run.failed_at, "relative_difference_to_limit_analysis": run.value / limit - 1,
             "largest_displacement_m": run.curve[-1, 1], "steps": len(run.steps)}
            for angle, runs in results.items() for size, run in zip(sizes, runs)
        ],
        "curve_factor": chosen[-1].curve[:, 0],
        "curve_largest_displacement_m": chosen[-1].curve[:, 1],
        "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    write_summary(folder, a, summary, comm)
    if comm.rank == 0:
        print(f"limit analysis, associated flow: {limit:.3f}")
        for row in summary["meshes"]:
            print("cells of {cell_size_m:<7g} m, dilation angle {dilation_angle_degrees:4g} degrees: {factor_of_safety:.3f} "
                  "({relative_difference_to_limit_analysis:+.1%})".format(**row))  # fmt: skip
        print(f"results in {folder}")
    return 0


if __name__ == "__main__":
    run_study(main, mpm.InputError, OutputError)
