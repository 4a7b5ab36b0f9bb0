"""The damped slope by the explicit and the implicit scheme: where it comes to rest, and the cost.

The full weight of the slope of the paper (Fatemizadeh; see README, Source) acts at once. It slides by the explicit scheme, by
Newton's method with several time steps, and by transient relaxation. A run ends when the slope is at rest: when neither the
out-of-balance ratio nor the kinetic energy over the work of gravity exceeds --rest.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import process_time

import matplotlib.pyplot as plt
import numpy as np
from common.figures import Pictures, curve_figure, save_figure
from common.lengths import metres
from common.movie import particle_movie
from common.options import add_choice, add_count, add_number, add_switch, study_parser
from common.page import Page
from common.plots import (
    CURVES,
    DISPLACEMENT,
    SHEAR_STRAIN,
    VERTICAL_STRESS,
    WIDTH,
    Quantity,
    Scene,
    colour_limits,
    discs,
    draw_bar,
    draw_scene,
    paper_style,
)
from common.progress import Progress
from common.quiet import LOCKS, without_warning
from common.ranks import run_study
from common.results import open_results
from common.schemes import add_discretisation, add_pic, run_scheme
from common.slope.case import add_slope_options, build_slope, check_slope_options, initialise
from common.summary import write_summary
from common.watch import Watch
from matplotlib.colors import Normalize
from mpi4py import MPI

import mpm_core as mpm

comm = MPI.COMM_WORLD
FRAMES = 40
"""Number of frames of each run on the page."""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_slope_options(p)
    add_choice(p, "--initial", "zero", ("fem", "elastic", "k0", "zero"), "initial stresses; fem is elasto-plastic")
    add_number(p, "--initial-unit-weight", 18e3, "N/m3", "unit weight that balances the initial stresses", above=0)
    add_number(p, "--damping", 0.75, "-", "local damping", at_least=0, below=1)
    p.set_defaults(mass_damping=0.0)
    add_pic(p, 0.0)
    add_discretisation(p)
    add_switch(p, "--nmd", False, "average volumetric strains over nodes, against locking")
    add_number(p, "--time", 200.0, "s", "longest duration of a slide", above=0)
    add_number(
        p, "--rest", 1e-3, "-", "out-of-balance ratio and fraction of kinetic energy at which a slide ends", above=0
    )
    add_number(p, "--step", 20.0, "-", "ratio of the shortest step of the implicit runs to the critical one", above=0)
    add_count(
        p,
        "--longer-steps",
        2,
        "number of additional runs by Newton's method, with steps 2.5 and then 5 times as long",
        choices=(1, 2),
    )
    add_count(p, "--frames", 120, "times at which the explicit run records the displacement of the crest")
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check_slope_options(p, options)
    return options


# --- 2. Runs ---------------------------------------------------------------------------------------------------------


@dataclass
class Run:
    """Result of one slide; `curve` has rows of time [s] and displacement of the crest [m]."""

    name: str
    curve: list[tuple[float, float]] = field(default_factory=list)
    frames: list[dict] = field(default_factory=list)
    steps: int = 0
    iterations: int = 0
    cpu_seconds: float = 0.0
    unbalanced_ratio: float = 0.0
    at_rest: bool = False
    stopped: str | None = None

    def summary(self) -> dict[str, object]:
        """Numbers of the run by name."""
        time, crest = np.array(self.curve).T
        return {
            "crest_displacement_m": crest[-1], "at_rest": self.at_rest,
            "time_s": time[-1], "steps": self.steps, "iterations": self.iterations, "cpu_seconds": self.cpu_seconds,
            "unbalanced_ratio": self.unbalanced_ratio, "stopped_because": self.stopped,
        }  # fmt: skip


def slide(a: Namespace, name: str, scheme: str, solver: str, multiple: float | None) -> tuple[Run, Scene | None]:
    """Run one slide; implicit, with steps `multiple` times the critical one at the start. Collective."""
    case = build_slope(a, comm)
    initialise(case, a.initial, a.initial_unit_weight, a.nmd and scheme == "explicit")
    watch, run = Watch(case), Run(name)
    until = a.time
    dt = None if multiple is None else multiple * case.model.critical_time_step()
    options = Namespace(**{**vars(a), "scheme": scheme, "solver": solver, "dt": dt, "time": until})
    run.curve.append((0.0, 0.0))
    watch.keep(0.0)
    kept = 1 / FRAMES
    with Progress(name, until, comm) as progress:
        started = process_time()
        try:
            # A report after each implicit step: a shorter interval would shorten the step.
            for report in run_scheme(options, case.model, dt or until / a.frames, lambda: False):
                run.cpu_seconds += process_time() - started
                run.curve.append((report.time, watch.crest_displacement()))
                run.unbalanced_ratio = report.unbalanced_ratio
                run.iterations += getattr(report, "iterations", 0)
                progress.show(report.time, report.steps, crest=metres(run.curve[-1][1]))
                if run.curve[-1][0] >= kept * until:
                    watch.keep(report.time)
                    kept += 1 / FRAMES
                if report.is_quasi_static(a.rest):
                    run.at_rest = True
                    break
                started = process_time()
        except mpm.RunError as error:
            run.stopped = str(error)
    run.cpu_seconds, run.steps = comm.allreduce(run.cpu_seconds), case.model.steps
    watch.keep(case.model.time)
    run.frames = watch.frames()
    return run, case.scene()


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def in_symbols(name: str) -> str:
    """The name of a run, with the critical time step as a symbol."""
    return name.replace("dt_cr", "$\\Delta t_{cr}$")


def save_pair(path: Path, scene: Scene, runs: list[Run], key: str, quantity: Quantity) -> None:
    """The soil at rest by two schemes, side by side, in one colour scale."""
    last = {run.name: run.frames[-1] for run in runs}
    limits = colour_limits(quantity, [frame[key] for frame in last.values()])
    lower, upper = scene.limits([frame["position"] for frame in last.values()])
    with paper_style():
        figure, panels = plt.subplots(1, len(runs), figsize=(1.3 * WIDTH, 3.1), sharey=True)
        figure.subplots_adjust(left=0.06, right=0.99, bottom=0.27, top=0.95, wspace=0.04)
        for axes, (name, frame) in zip(panels, last.items()):
            axes.set(xlim=(lower[0], upper[0]), ylim=(lower[1], upper[1]), aspect="equal", xlabel="$x$ [m]")
            draw_scene(axes, scene)
            drawn = discs(axes, frame["position"], frame["volume"], cmap=quantity.colours, norm=Normalize(*limits),
                          linewidths=0)  # fmt: skip
            drawn.set_array(quantity.scale * frame[key])
            axes.set_title(f"{in_symbols(name)}, $t$ = {frame['time']:.1f} s", loc="left")
        panels[0].set_ylabel("$y$ [m]")
        draw_bar(figure, figure.add_axes((0.3, 0.12, 0.4, 0.03)), quantity, limits)
        save_figure(figure, path)


def save_crests(path: Path, runs: list[Run]) -> None:
    """Displacement of the crest over time, on a logarithmic axis: one scheme takes ten times as long as the other."""
    with curve_figure(path, (5.2, 3.3)) as axes:
        for k, run in enumerate(runs):
            time, crest = np.array(run.curve)[1:].T
            axes.semilogx(
                time,
                crest,
                color=CURVES[k % len(CURVES)],
                linestyle="--" if k == len(runs) - 1 else "-",
                label=in_symbols(run.name),
            )
        axes.set(xlabel="Time [s]", ylabel="Displacement of the particle at the crest [m]", ylim=(0, None))
        axes.legend(loc="lower right")


def drawn(runs: list[Run], scene: Scene | None, folder: Path) -> Pictures:
    """Draw all pictures."""
    if scene is None:
        return {}
    shown = {"displacement": DISPLACEMENT, "shear_strain": SHEAR_STRAIN, "vertical_stress": VERTICAL_STRESS}
    return {
        **{
            name: partial(save_pair, folder / f"{name}.png", scene, runs[:2], name, quantity)
            for name, quantity in shown.items()
        },
        "crest": lambda: save_crests(folder / "crest.png", runs),
    }


# --- 4. All together -------------------------------------------------------------------------------------------------


# Cells lock in all runs alike, which are compared with each other; implicit steps do not average forces.
@without_warning(LOCKS)
def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    folder = open_results(a, comm)
    wanted = [("explicit", "explicit", "", None)]
    for factor in (1.0, 2.5, 5.0)[: 1 + a.longer_steps]:
        multiple = factor * a.step
        wanted.append((f"implicit, Newton, {multiple:g} dt_cr", "implicit", "newton", multiple))
    wanted.append((f"implicit, relaxation, {a.step:g} dt_cr", "implicit", "relaxation", a.step))
    runs = []
    for each in wanted:
        run, scene = slide(a, *each)
        runs.append(run)
    table = {run.name: run.summary() for run in runs}
    reference = table["explicit"]["crest_displacement_m"]
    for row in table.values():
        row["over_explicit"] = row["crest_displacement_m"] / reference
    names = dict(zip(table, runs))
    movies = [particle_movie(name, scene, run.frames) for name, run in names.items()]
    if comm.rank == 0:
        print_table(table)
    write_summary(folder, a, {"runs": table}, comm, Page(movies=movies[:2]), drawn(runs, scene, folder), said="")
    return 1 if any(run.stopped for run in runs) else 0


def print_table(table: dict[str, dict]) -> None:
    print(f"{'':36} crest [m]  over explicit  ended at [s]           steps  iterations  CPU [s]  out of balance")
    for name, r in table.items():
        state = "at rest" if r["at_rest"] else "moving"
        print(f"{name:36} {r['crest_displacement_m']:9.4f}  {r['over_explicit']:13.3f}  {r['time_s']:12.2f} {state:8}  "
              f"{r['steps']:5}  {r['iterations']:10}  {r['cpu_seconds']:7.2f}  {r['unbalanced_ratio']:14.2e}")  # fmt: skip
        if r["stopped_because"]:
            print(f"  ended early: {r['stopped_because']}", file=sys.stderr)


if __name__ == "__main__":
    run_study(main)
