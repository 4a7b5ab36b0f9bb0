"""Collapse of the slope: the largest unit weight that it carries, by elasto-plastic FEM against limit analysis.

The unit weight is raised until there is no equilibrium any more, on several meshes. With associated flow (the default) the
result converges from above to that of limit analysis; results without dilation are reported as well.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from pathlib import Path
from time import perf_counter

import numpy as np
from common.checks import say
from common.collapse_runs import CAPTIONS, CollapseRuns, Target, add_flow_options, dilation_angles
from common.figures import Pictures
from common.options import check, study_parser
from common.page import Page
from common.ranks import run_study
from common.results import open_results
from common.site.file import Site
from common.site.runs import add_site_option, check_site_options, site_study
from common.site.strength import refuse_strength_ratio
from common.slope.fem import (
    add_fem_slope_options,
    add_ground_option,
    check_fem_slope_options,
    mesh_sizes,
    outside_line,
    slope_fem,
    step_line,
    weight,
)
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge

comm = MPI.COMM_WORLD
UNLIKELY = 30.0
"""Factor of the weight of a site, above which its weight is not what makes it fail [-]"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_fem_slope_options(p)
    add_ground_option(p)
    add_flow_options(p)
    add_site_option(p)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    if options.site is None:
        check_fem_slope_options(p, options)
    check(p, options.friction_angle < options.angle,
          lambda: f"--friction-angle is {options.friction_angle:g}, expected below --angle, {options.angle:g} degrees: "
                  "a slope that is flatter carries any unit weight")  # fmt: skip
    check_site_options(p, options, {"meshes", "elements", "equilibrium"})
    return options


# --- 2. Collapse on each mesh ----------------------------------------------------------------------------------------


def target(spiral: bridge.LogSpiral) -> Target:
    """The unit weight at collapse."""
    return Target(
        "collapse_unit_weight", "failed_at_unit_weight", "limit_analysis_unit_weight", spiral.unit_weight,
        title="Collapse at {:.2f} kN/m$^3$", line="{:6.2f} kN/m3", label="Unit weight at collapse [kN/m$^3$]", shown_unit=1e3,
    )  # fmt: skip


def collapse(a: Namespace, cell_size: float, dilation_angle: float) -> bridge.Collapse:
    """Raise the unit weight to the last equilibrium on one mesh; the first step does not depend on the result."""
    model = slope_fem(a, comm, cell_size, dilation_angle, a.depth)
    first_step = a.cohesion / a.height
    progress = step_line(f"cells of {cell_size:g} m, dilation angle {dilation_angle:g} degrees", "unit weight [N/m3]")
    return bridge.collapse_load(model, weight, first_step=first_step, progress=progress)


def davis_unit_weight(a: Namespace) -> float:
    """Limit analysis with the strength that Davis (1968) gives soil without dilation: tan(phi*) = sin(phi), c* = c cos(phi)."""
    phi = np.radians(a.friction_angle)
    reduced = float(np.degrees(np.arctan(np.sin(phi))))
    cohesion = float(a.cohesion * np.cos(phi))
    return bridge.log_spiral(a.height, a.angle, cohesion, reduced, a.crest, depth=a.depth).unit_weight


def weight_factor(site: Site, model: bridge.QuasiStatic, progress: Callable) -> bridge.Collapse:
    """The factor of all unit weights of a site at its collapse; says so where its weight cannot be what makes it fail. Collective."""
    found = bridge.collapse_load(model, site.load, 0.1, progress=progress)
    if found.value > UNLIKELY:
        say(f"the site carries {found.value:.3g} times its weight: its weight hardly makes it fail, as that of level ground or of a pit between "
            "walls does not, and the factor says nothing of its safety")  # fmt: skip
    return found


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def drawn(found: CollapseRuns, spiral: bridge.LogSpiral, folder: Path) -> Pictures:
    """Mechanism, load-displacement curves and convergence. Collective."""
    labels = "Largest displacement [mm]", "Unit weight [kN/m$^3$]"
    return {
        **found.mechanism_pictures(folder, spiral.curve, "log-spiral, limit analysis"),
        **found.curve_pictures(folder, "load_displacement", labels),
    }


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    if a.site is not None:
        return site_study(a, weight_factor, "collapse_weight_factor", "Factor of all unit weights [-]", at_rest=False,
                          require=lambda site: refuse_strength_ratio(site, a.site))  # fmt: skip
    start = perf_counter()
    folder = open_results(a, comm)
    spiral = bridge.log_spiral(a.height, a.angle, a.cohesion, a.friction_angle, a.crest, depth=a.depth)
    sizes = mesh_sizes(a)
    runs = {angle: [collapse(a, size, angle) for size in sizes] for angle in dilation_angles(a)}
    found = CollapseRuns(target(spiral), a.friction_angle, sizes, runs)

    curve = found.finest_curve()
    summary = {
        **found.summary(),
        "stability_number": curve[-1, 0] * a.height / a.cohesion,
        "limit_analysis_unit_weight_without_dilation_davis": davis_unit_weight(a),
        "slip_line_starts_on_crest": bool(spiral.curve[0, 0] >= 0),
        "curve_unit_weight": curve[:, 0],
        "curve_largest_displacement_m": curve[:, 1],
        "wall_seconds": perf_counter() - start,
    }
    said = (
        f"limit analysis: {spiral.unit_weight / 1e3:.2f} kN/m3 with associated flow, {davis_unit_weight(a) / 1e3:.2f} "
        f"with Davis' reduced strength without dilation\n{outside_line(a, spiral.curve)}{found.lines()}"
    )
    write_summary(folder, a, summary, comm, Page(captions=CAPTIONS), drawn(found, spiral, folder), said)
    return found.exit_code()


if __name__ == "__main__":
    run_study(main)
