"""Cost of an equilibrium: explicit scheme, transient relaxation and Newton's method, in drained and in undrained soil.

The slope under 20 kN/m3 is brought to an out-of-balance ratio of 1e-6 in two cases. In the drained case it starts from zero
stress. In the undrained case it starts from drained equilibrium under --initial-unit-weight, and the remaining weight is
applied too quickly for the water to drain; pore water makes the soil so stiff that the critical time step is smaller by two
orders of magnitude. The explicit scheme has local damping; the others take quasi-static steps. Each run has a limit of
processor time; if it is reached, the table gives a lower bound. Another table lists the force evaluations of every solver in
one implicit step from zero stress. A run that fails keeps its row, with the reason. The study runs on one rank.
"""

from __future__ import annotations

import csv
import signal
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple

import matplotlib.pyplot as plt
import numpy as np
from common.figures import save_figure
from common.options import add_count, add_number, check, study_parser
from common.page import Page
from common.plots import CURVES, WIDTH, paper_style
from common.ranks import run_study
from common.results import open_results
from common.slope.case import SlopeCase, add_slope_options, build_slope, check_slope_options, solved_fem
from common.summary import write_summary
from mpi4py import MPI

import mpm_core as mpm
from mpm_core import _core

comm = MPI.COMM_WORLD
SOILS = ("drained", "undrained")
SOLVERS: dict[str, Callable[[], Any]] = {
    "Newton": mpm.Newton,
    "viscous relaxation": lambda: mpm.Relaxation(mpm.RelaxationKind.VISCOUS),
    "local relaxation": lambda: mpm.Relaxation(mpm.RelaxationKind.LOCAL),
    "kinetic relaxation": lambda: mpm.Relaxation(mpm.RelaxationKind.KINETIC),
    "Richardson (the paper's)": lambda: mpm.Relaxation(mpm.RelaxationKind.RICHARDSON),
}
LONGEST = 1e4
"""[s] of soil's time that the explicit scheme may take, which no run needs"""
MULTIPLES = (20, 200, 2000)
"""Steps of the second table over the critical one"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_slope_options(p)
    p.set_defaults(unit_weight=20e3, particles_per_cell=3, water_modulus=2.2e9, porosity=0.5)
    add_count(p, "--meshes", 3, "meshes, each with cells half as large as the one before")
    add_number(
        p,
        "--initial-unit-weight",
        19e3,
        "N/m3",
        "unit weight in drained equilibrium, before the undrained load",
        above=0,
    )
    add_number(p, "--damping", 0.75, "-", "local damping of the explicit scheme", at_least=0, below=1)
    add_number(p, "--tolerance", 1e-6, "-", "out-of-balance ratio to reach", above=0, below=1)
    add_number(p, "--limit", 30.0, "s", "processor time of one run", above=0)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check_slope_options(p, options)
    check(p, options.initial_unit_weight < options.unit_weight,
          lambda: f"--initial-unit-weight is {options.initial_unit_weight:g} N/m3, expected below --unit-weight, {options.unit_weight:g} N/m3, the rest of "
          "which is the undrained load")  # fmt: skip
    return options


# --- 2. Runs ---------------------------------------------------------------------------------------------------------


class TimeUp(Exception):
    """The run has used up its processor time."""


class Spent(NamedTuple):
    """How some work went.

    seconds: processor time [s]; reached: whether it came to its end; failure: why it failed, None where it did not, or ran out of time
    """

    seconds: float
    reached: bool
    failure: str | None = None


def limited(work: Callable[[], Any], limit: float) -> Spent:
    """Do some work within a limit of processor time [s]."""

    def end(*_: object) -> None:
        raise TimeUp

    before = signal.signal(signal.SIGPROF, end)
    started = process_time()
    signal.setitimer(signal.ITIMER_PROF, limit)
    try:
        work()
        return Spent(process_time() - started, True)
    except TimeUp:
        return Spent(process_time() - started, False)
    except mpm.RunError as error:
        return Spent(process_time() - started, False, str(error))
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def prepared(a: Namespace, soil: str, stress: np.ndarray | None) -> SlopeCase:
    """The slope with its stresses at the start, out of balance."""
    case = build_slope(Namespace(**{**vars(a), "undrained": soil == "undrained"}), comm)
    if stress is not None:
        case.model.particles.set("stress", stress)
    return case


def initial_stress(a: Namespace, soil: str) -> np.ndarray | None:
    """Stresses of drained equilibrium under the initial unit weight; none where the soil starts without stress.

    Raises:
        InputError: the slope does not carry that weight.
    """
    if soil == "drained":
        return None
    case = prepared(a, "drained", None)
    return solved_fem(case, a.initial_unit_weight).evaluate_at(case.model.particles.position)["stress"]


def settled_explicitly(a: Namespace, model: mpm.Model) -> None:
    """Damped motion until the particles balance their weight; looks after as many steps as a wave takes through the slope."""
    every = 100 * model.critical_time_step()
    for report in model.explicit(LONGEST, every=every, damping=a.damping):
        if report.unbalanced_ratio <= a.tolerance:
            return


def measured(a: Namespace, soil: str, name: str, stress: np.ndarray | None) -> dict[str, object]:
    """A row of the table: the cost of one method to bring the slope to equilibrium."""
    case = prepared(a, soil, stress)
    model, iterations = case.model, [0]
    if name == "explicit":
        spent = limited(lambda: settled_explicitly(a, model), a.limit)
        iterations[0] = model.steps
    else:
        work = lambda: model.equilibrate(solver=SOLVERS[name](), tolerance=a.tolerance, max_steps=100)
        with counted(iterations):
            spent = limited(work, a.limit)
    watched = case.crest_particle()
    particles = model.particles
    crest = float(np.linalg.norm(particles[particles.id == watched].displacement, axis=1).max())
    return {
        "soil": soil, "method": name, "cell_size_m": a.cell_size, "particles": len(particles),
        "cells": len(particles) // a.particles_per_cell, "reached": spent.reached, "cpu_seconds": spent.seconds,
        "force_evaluations": iterations[0], "out_of_balance_ratio": model.out_of_balance(), "crest_displacement_m": crest,
        "failure": spent.failure,
    }  # fmt: skip


@contextmanager
def counted(count: list[int]) -> Iterator[None]:
    """Count the evaluations of forces of all implicit steps in between, also of those that are broken off."""
    step = _core.ImplicitStep2
    trial, relax, start = step.trial, step.relax, step.start_relaxation

    def add(number: int, result: Any) -> Any:
        count[0] += number
        return result

    def counted_relax(self: Any, *arguments: Any) -> Any:
        result = relax(self, *arguments)
        return add(result[0], result)

    step.trial = lambda self, **options: add(1, trial(self, **options))
    step.start_relaxation = lambda self, kind: add(1, start(self, kind))
    step.relax = counted_relax
    try:
        yield
    finally:
        step.trial, step.relax, step.start_relaxation = trial, relax, start


def one_step(a: Namespace, name: str, multiple: float) -> dict[str, object]:
    """Force evaluations and time of one implicit step from zero stress, some multiple of the critical one long."""
    model = prepared(a, "drained", None).model
    dt = multiple * model.critical_time_step()
    reports: list[Any] = []
    count = [0]
    with counted(count):
        spent = limited(lambda: reports.extend(model.implicit(dt, dt=dt, solver=SOLVERS[name]())), a.limit)
    return {
        "method": name, "cell_size_m": a.cell_size, "step_over_critical": multiple, "reached": spent.reached,
        "force_evaluations": count[0], "steps": len(reports), "cpu_seconds": spent.seconds, "failure": spent.failure,
    }  # fmt: skip


# --- 3. Tables and pictures ------------------------------------------------------------------------------------------


def save_table(path: Path, rows: list[dict]) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def save_costs(path: Path, rows: list[dict]) -> None:
    """Time and work over the number of cells; hollow markers with an arrow are lower bounds, and crosses runs that failed."""
    methods = list(dict.fromkeys(row["method"] for row in rows))
    quantities = {"Processor time [s]": lambda r: r["cpu_seconds"],
                  "Force evaluations × particles": lambda r: r["force_evaluations"] * r["particles"]}  # fmt: skip
    with paper_style():
        figure, panels = plt.subplots(2, 2, figsize=(WIDTH, 5.6), sharex=True, sharey="row")
        figure.subplots_adjust(left=0.11, right=0.985, bottom=0.19, top=0.95, wspace=0.05, hspace=0.08)
        for axes, (soil, (label, of)) in zip(panels.T.ravel(), [(s, q) for s in SOILS for q in quantities.items()]):
            for method, colour in zip(methods, CURVES):
                mine = [row for row in rows if row["soil"] == soil and row["method"] == method]
                drawn = [row for row in mine if not row["failure"]]
                axes.loglog(
                    [r["cells"] for r in drawn], [of(r) for r in drawn], color=colour, linewidth=1.1, label=method
                )
                for row in mine:
                    x, y, marker = row["cells"], of(row), "x" if row["failure"] else "o"
                    axes.plot(x, y, marker, color=colour, markersize=4, fillstyle="full" if row["reached"] else "none")
                    if not (row["reached"] or row["failure"]):
                        axes.annotate("", (x, 1.8 * y), (x, y), arrowprops={"arrowstyle": "->", "color": colour})
            every = [of(row) for row in rows if of(row) > 0]  # the clock may measure no time of small meshes
            if every:
                axes.set_ylim(min(every) / 2, 4 * max(every))
            axes.grid(linewidth=0.3, color="#d0d0d0")
            if soil == SOILS[0]:
                axes.set_ylabel(label)
        for axes, soil in zip(panels[0], SOILS):
            axes.set_title(soil.capitalize(), loc="left")
        for axes in panels[1]:
            axes.set_xlabel("Cells of soil")
        handles, names = panels[0][0].get_legend_handles_labels()
        figure.legend(handles, names, loc="lower center", ncols=3)
        save_figure(figure, path)


def speed_up(rows: list[dict]) -> dict[str, float | None]:
    """Least ratio of the time of the explicit scheme to that of Newton's method on the finest mesh, for each soil.

    None where one of them failed, or Newton's method did not come to its end, or in less time than the clock measures.
    """
    finest = max((row["cells"] for row in rows), default=0)
    last = {(row["soil"], row["method"]): row for row in rows if row["cells"] == finest and not row.get("failure")}
    ratios: dict[str, float | None] = {}
    for soil in SOILS:
        explicit, newton = (last.get((soil, method)) for method in ("explicit", "Newton"))
        known = explicit and newton and newton["reached"] and newton["cpu_seconds"] > 0
        ratios[soil] = explicit["cpu_seconds"] / newton["cpu_seconds"] if known else None
    return ratios


def failures_of(rows: list[dict]) -> list[str]:
    """Which runs failed, and why, in words."""
    return [
        f"{row.get('soil') or 'step of {:g} dt_cr'.format(row['step_over_critical'])}, {row['method']}, cells of {row['cell_size_m']:g} m "
        f"failed: {row['failure']}"
        for row in rows
        if row["failure"]
    ]


def print_table(rows: list[dict]) -> None:
    """The rows as text; lower bounds and failures are marked."""
    for row in rows:
        bound = "  " if row["reached"] else "x " if row["failure"] else "> "
        place = row.get("soil", f"{row.get('step_over_critical', 0):g} dt_cr")
        print(f"{place:10} {row['method']:25} h {row['cell_size_m']:<7g} {bound}{row['cpu_seconds']:9.3f} s  "
              f"{row['force_evaluations']:9} evaluations  {row.get('out_of_balance_ratio', 0):.1e}", flush=True)  # fmt: skip


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    if comm.size > 1:
        raise mpm.InputError(f"the study cost measures one processor, but runs on {comm.size} ranks")
    folder = open_results(a, comm)
    rows, steps, unstressed = [], [], []
    for level in range(a.meshes):
        mesh = Namespace(**{**vars(a), "cell_size": a.cell_size / 2**level})
        for soil in SOILS:
            try:
                stress = initial_stress(mesh, soil)
            except mpm.InputError as error:
                unstressed.append(f"{soil}, cells of {mesh.cell_size:g} m: no stresses to begin with: {error}")
                continue
            for name in ("explicit", *SOLVERS):
                rows.append(measured(mesh, soil, name, stress))
                print_table(rows[-1:])
        for multiple in MULTIPLES:
            for name in SOLVERS:
                steps.append(one_step(mesh, name, multiple))
                print_table(steps[-1:])
    save_table(folder / "equilibrium.csv", rows)
    save_table(folder / "steps.csv", steps)
    ratios = speed_up(rows)
    results = {f"explicit_over_newton_{soil}_seconds_ratio": ratio for soil, ratio in ratios.items()}
    failures = [*unstressed, *failures_of(rows), *failures_of(steps)]
    results["failures"] = failures
    captions = {
        "cost": "Cost of equilibrium; hollow markers with an arrow are lower bounds, and crosses runs that failed"
    }
    pictures = {"cost": lambda: save_costs(folder / "cost.png", rows)}
    results |= {"equilibrium": rows, "steps": steps}
    code = write_summary(folder, a, results, comm, Page(captions=captions), pictures, said="\n".join(failures))
    return code or (1 if failures else 0)


if __name__ == "__main__":
    run_study(main)
