"""Hand-over from FEM to particles: the load at which it takes place, and its influence on the final run-out.

The slope is brought to elasto-plastic equilibrium by FEM under a fraction of the unit weight at which it collapses, and its
stresses are transferred to particles. Then the unit weight is raised at once to its full value and the slope slides, as in
the study slope, with stresses integrated over whole cells and strains averaged where linear cells lock. With a fraction of zero
the slide starts from zero stress.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.field_plots import save_curves
from common.figures import Pictures
from common.lengths import metres
from common.movie import fem_frame, particle_frame, particle_movie
from common.options import add_number, add_switch, check, study_parser
from common.page import Page
from common.plots import save_history
from common.quiet import NOT_REACHED, without_warning
from common.ranks import run_study
from common.results import open_results
from common.schemes import averages_strains
from common.slope.case import GRAVITY, SlopeCase, add_slope_options, build_slope, check_slope_options, soil_fem
from common.slope.fem import NO_COHESION, step_line, weight
from common.soils import given_law
from common.summary import write_summary
from common.watch import Watch
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from particle_player import Movie

comm = MPI.COMM_WORLD
FRACTIONS = (0.0, 0.25, 0.5, 0.75, 0.9, 0.98)
"""Fractions of the unit weight at collapse of the finite elements, at which particles take over."""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_slope_options(p)
    add_number(p, "--damping", 0.75, "-", "local damping", at_least=0, below=1)
    add_number(p, "--time", 34.8, "s", "duration of each slide", above=0)
    add_switch(
        p, "--move", False, "move particles with the body's displacement in the FEM; otherwise they stay in place"
    )
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check_slope_options(p, options)
    check(p, options.cohesion > 0, NO_COHESION)
    return options


# --- 2. Hand-over and slide ------------------------------------------------------------------------------------------


def hand_over(case: SlopeCase, unit_weight: float) -> bridge.Handover | None:
    """Give the particles the equilibrium under a unit weight; None for zero, which needs none."""
    if unit_weight == 0:
        return None
    nmd = averages_strains("explicit", case.model.laws)
    case.fem = fem = soil_fem(case, nmd)
    with without_warning(NOT_REACHED):  # said by the error
        fem.solve(weight(unit_weight))
    if not fem.converged:
        raise mpm.RunError(f"the finite elements found no equilibrium under {unit_weight:.5g} N/m3 at once, but under {fem.load.unit_weight:.5g} N/m3 at most, "
                           "although they collapsed above it as the weight rose in steps: there is nothing to hand over")  # fmt: skip
    case.model.set_gravity((0.0, -GRAVITY * unit_weight / case.args.unit_weight))
    report = bridge.initialise(case.model, fem, move=case.args.move, nmd=nmd)
    case.model.set_gravity((0.0, -GRAVITY))
    return report


def unit_weight_at_collapse(a: Namespace) -> float:
    """Unit weight [N/m3] at which the finite elements collapse, all of whose fractions particles take over. Collective.

    Raises:
        InputError: they do not collapse, or under more than the unit weight of the slide, so that the slope would not slide.
    """
    case = build_slope(a, comm)
    fem = soil_fem(case, averages_strains("explicit", case.model.laws))
    found = bridge.collapse_load(fem, weight, first_step=2e3, progress=step_line("collapse", "unit weight [N/m3]"))
    if not found.failed:
        raise mpm.InputError(f"{given_law(a)}, and its slope was not shown to collapse under {found.value:.4g} N/m3 or less, expected soil that can "
                             f"fail: {found.reason}")  # fmt: skip
    if found.value >= a.unit_weight:
        raise mpm.InputError(f"--unit-weight is {a.unit_weight:g} N/m3, under which the slope does not slide; expected more than that at which the finite elements "
                             f"collapse, {found.value:.5g} N/m3")  # fmt: skip
    return float(found.value)


def slide(case: SlopeCase, watch: Watch) -> tuple[np.ndarray, list[dict]]:
    """Slide to the end: (k, 3) of time [s], run-out [m] and displacement of the particle at the crest [m]; and frames."""
    a = case.args
    rows, frames = [(0.0, watch.runout(), watch.crest_displacement())], [particle_frame(case.model, 0.0)]
    nmd = averages_strains("explicit", case.model.laws)
    for report in case.model.explicit(a.time, every=a.time / 60, damping=a.damping, nmd=nmd):
        rows.append((report.time, watch.runout(), watch.crest_displacement()))
        frames.append(particle_frame(case.model, report.time))
    return np.array(rows), frames


def run(a: Namespace, fraction: float, unit_weight: float) -> dict:
    """Compute one hand-over and slide; returns its results for the summary."""
    case = build_slope(a, comm)
    watch = Watch(case)  # of the particles as seeded, before the hand-over may move them
    report = hand_over(case, unit_weight)
    particles = case.model.particles
    undeformed = (
        particles.initial_position if a.move else particles.position
    )  # where the particles are in the FEM's body
    before = fem_frame(case.model, case.fem, 0.0, undeformed) if case.fem else None
    history, frames = slide(case, watch)
    if comm.rank == 0:
        print(f"handed over at {fraction:.0%} of collapse: run-out {metres(history[-1, 1])}, crest {metres(history[-1, 2])}",
              file=sys.stderr, flush=True)  # fmt: skip
    return {"fraction": fraction, "unit_weight": unit_weight, "report": report, "history": history, "frames": frames,
            "before": before, "scene": case.scene()}  # fmt: skip


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def drawn(runs: list[dict], folder: Path) -> Pictures:
    """Run-out over the fraction of the collapse load, and over time."""
    fractions = np.array([run["fraction"] for run in runs])
    final = {"run-out": (100 * fractions, np.array([run["history"][-1, 1] for run in runs])),
             "displacement at the crest": (100 * fractions, np.array([run["history"][-1, 2] for run in runs]))}  # fmt: skip
    crest = {f"{run['fraction']:.0%}": run["history"][:, 2] for run in runs}
    return {
        "runout_over_fraction": lambda: save_curves(
            folder / "runout_over_fraction.png", final, ("Unit weight at hand-over [% of collapse]", "At the end [m]"),
            limits=((-2, 102), (0, None))),
        "crest_over_time": lambda: save_history(
            folder / "crest_over_time.png", runs[0]["history"][:, 0], crest, "Displacement of the particle at the crest [m]",
            limits=(0, 1.08 * max(curve.max() for curve in crest.values()))),
    }  # fmt: skip


def movies(runs: list[dict]) -> list[Movie | None]:
    """The slides from zero stress and from the latest hand-over, and the finite elements at that hand-over."""
    first, last = runs[0], runs[-1]
    return [
        *(
            particle_movie(f"MPM, handed over at {run['fraction']:.0%} of collapse", run["scene"], run["frames"])
            for run in (first, last)
        ),
        particle_movie(f"FEM at {last['fraction']:.0%} of collapse", last["scene"], [last["before"]]),
    ]


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    start = perf_counter()
    collapse = unit_weight_at_collapse(a)
    folder = open_results(a, comm)
    runs = [run(a, fraction, fraction * collapse) for fraction in FRACTIONS]
    runouts = [float(run["history"][-1, 1]) for run in runs]
    summary = {
        "collapse_unit_weight_of_the_finite_elements": collapse,
        "runout_m_by_fraction_of_collapse": {f"{run['fraction']:g}": runout for run, runout in zip(runs, runouts)},
        "largest_relative_change_of_runout": (max(runouts) - min(runouts)) / max(runouts) if max(runouts) > 0 else 0.0,
        "handovers": [row_of(run) for run in runs],
        "wall_seconds": perf_counter() - start,
    }
    page = Page(movies=movies(runs) if comm.rank == 0 else ())
    return write_summary(folder, a, summary, comm, page, drawn(runs, folder), said(summary))


def row_of(run: dict) -> dict:
    """A row of the summary."""
    report = run["report"]
    return {
        "fraction_of_collapse": run["fraction"],
        "unit_weight": run["unit_weight"],
        "out_of_balance_ratio_before": report.unbalanced_ratio if report else None,
        "out_of_balance_ratio_after": report.equilibrated_ratio if report else None,
        "newly_yielded_fraction": report.yielded_fraction if report else None,
        "runout_m": run["history"][-1, 1],
        "crest_displacement_m": run["history"][-1, 2],
    }


def said(summary: dict) -> str:
    """What is printed in the end."""
    lines = [
        f"collapse of the finite elements at {summary['collapse_unit_weight_of_the_finite_elements'] / 1e3:.2f} kN/m3",
        "load   unit weight  out of balance before, after  newly yielded  run-out   crest",
    ]
    for row in summary["handovers"]:
        balance = "          -         -                -   "
        if row["newly_yielded_fraction"] is not None:
            balance = (f"{row['out_of_balance_ratio_before']:13.1e}{row['out_of_balance_ratio_after']:13.1e}"
                       f"{row['newly_yielded_fraction']:17.2%}")  # fmt: skip
        lines.append(f"{row['fraction_of_collapse']:5.0%}{row['unit_weight'] / 1e3:8.2f} kN/m3{balance:>43}"
                     f"{row['runout_m']:9.4f} m{row['crest_displacement_m']:8.4f} m")  # fmt: skip
    return "\n".join([*lines, f"run-out changes by {summary['largest_relative_change_of_runout']:.1%} at most"])


if __name__ == "__main__":
    run_study(main)
