"""A slope of sensitive clay: the disturbed toe fails, and the bank fails retrogressively, block by block, on two cell sizes.

The clay is undrained and softens (by default Tresca with a strength that falls with plastic strain, scaled by the cell size,
so that a slip dissipates the same energy on any mesh). Finite elements give the stresses of the intact slope. Then the clay in
a zone around the toe loses strength, and the explicit scheme computes the failure until the slope is at rest, that is, until
its kinetic energy has been below a thousandth of its maximum for two seconds. The results with the given cell size and with
half of it are compared.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from common.animation import save_animation
from common.checks import say
from common.figures import Pictures, curve_figure
from common.front import front
from common.history import History
from common.interrupt import Interrupt
from common.lengths import metres
from common.movie import particle_frame, particle_movie
from common.options import add_choice, add_count, add_number, add_switch, check, study_parser
from common.output_options import add_picture_options
from common.page import Page
from common.plots import DISPLACEMENT, SHEAR_STRAIN, Scene, save_particles
from common.progress import Progress
from common.quiet import NOT_REACHED, without_warning
from common.ranks import run_study
from common.results import open_results
from common.schemes import add_pic
from common.site.laws import unit_doubt
from common.slope.case import SlopeCase, add_slope_options, build_slope, check_slope_options, soil_fem, why_ended
from common.soils import given_law, law_of
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
COLUMNS = [
    "time_s", "retrogression_m", "runout_m", "work_of_stresses_J_per_m", "kinetic_energy_J_per_m", "plastic_fraction", "dt_s",
    "resting_cells",
]  # fmt: skip
MEASURES = {
    "retrogression_m": "Failed length of the crest [m]", "runout_m": "Displacement of the front [m]",
    "work_of_stresses_J_per_m": "Work of the stresses [MJ/m]",
}  # fmt: skip
"""Quantities by which the mesh sizes are compared. Nearly all of the stresses' work is dissipated in the slips: the
elastic energy of the soil changes little."""
DISTURBED = "cohesion_deviation"
"""State of a law by which its strength deviates from that of its parameters"""
AT_REST, STILL, REST = 1e-3, 1e-3, 2.0
"""A slope is at rest when its kinetic energy has stayed below this fraction of its maximum, or its velocity on average (root mean
square) below this one [m/s], for this time [s]: a scarp may stand for a moment before it fails too."""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_slope_options(p)
    p.set_defaults(
        height=6.0, angle=27.0, crest=30.0, runout_length=40.0, cell_size=1.0, particles_per_cell=3, unit_weight=17e3,
        material="softening", young=2e6, poisson=0.45, cohesion=15e3, friction_angle=0.0, residual_cohesion=4e3,
        softening_strain=0.3, reference_length=0.5, tension_cutoff=5e3,
    )  # fmt: skip
    add_number(p, "--disturbed", 4.0, "m", "distance from the toe up to which the clay is disturbed", above=0)
    add_number(
        p, "--disturbed-loss", 0.9, "-", "fraction of its strength that the disturbed clay has lost", above=0, at_most=1
    )
    add_number(p, "--damping", 0.01, "-", "local damping", at_least=0, below=1)
    add_pic(p, 0.002)
    add_number(p, "--time", 60.0, "s", "longest duration of the slide", above=0)
    add_count(p, "--frames", 100, "times at which particles are drawn")
    add_picture_options(p)
    add_choice(p, "--meshes", "two", ("one", "two"), "compute with the given cell size only, or also with half of it")
    add_switch(p, "--nmd", True, "average volumetric strains over nodes, against locking")
    add_switch(
        p, "--coupled", False, "begin with resting cells, which are finite elements until the clay in them fails"
    )
    return p


# --- 2. Start: stresses by finite elements, and a disturbed toe ------------------------------------------------------


def start(case: SlopeCase) -> float:
    """Stresses and states of the intact slope, by elasto-plastic finite elements. Out-of-balance ratio of the particles."""
    fem = soil_fem(case, case.args.nmd)
    with without_warning(NOT_REACHED):  # said by the error
        fem.solve(bridge.Load(unit_weight=case.args.unit_weight))
    if not fem.converged:
        raise mpm.InputError(
            f"--unit-weight is {case.args.unit_weight:g} N/m3, but the intact slope carries only "
            f"{fem.load.unit_weight:g} N/m3"
        )
    resting = case.args.coupled
    handover = bridge.initialise(case.model, fem, count_displacement=False, equilibrate=False, resting=resting)
    return handover.unbalanced_ratio


def disturb(case: SlopeCase) -> None:
    """Take strength from the clay around the toe, cell by cell, so that it is the same in particles and in resting cells."""
    mesh = case.model.mesh
    x = mesh.points[mesh.cells[case.model.particles.cell]].mean(axis=1)
    near = np.hypot(x[:, 0] - case.toe, x[:, 1]) < case.args.disturbed
    case.model.set_state(DISTURBED, np.where(near, -case.args.disturbed_loss, 0.0))


# --- 3. The slide ----------------------------------------------------------------------------------------------------


@dataclass
class Slide:
    """Result of the slide on one mesh size."""

    case: SlopeCase
    cell_size: float
    history: History
    ratio: float
    frames: list[dict] = field(default_factory=list)
    stopped: str | None = None
    at_rest: bool = False

    def look(self, report: mpm.Report) -> None:
        """Note how far the slope has failed back and run out, and keep a frame. Collective."""
        p, a = self.case.model.particles, self.case.args
        moved = np.linalg.norm(p.displacement, axis=1)
        failed = p.initial_position[moved > 0.1 * a.height, 0]
        scarp = comm.allreduce(float(failed.min(initial=np.inf)), MPI.MIN)
        runout = front(p.position[:, 0], p.mass) - front(p.initial_position[:, 0], p.mass)
        self.history.add(
            time_s=report.time, retrogression_m=max(0.0, a.crest - scarp), runout_m=runout,
            work_of_stresses_J_per_m=report.internal_work, kinetic_energy_J_per_m=report.kinetic_energy,
            plastic_fraction=report.plastic_fraction, dt_s=report.dt, resting_cells=report.resting_cells,
        )  # fmt: skip
        frame = particle_frame(self.case.model, report.time)
        if frame is not None:
            self.frames.append(frame)


def is_at_rest(history: History, mass: float) -> bool:
    """Whether the kinetic energy of a slope of a mass [kg/m] has been low for long enough, and has not been growing."""
    time, energy = history["time_s"], history["kinetic_energy_J_per_m"]
    moving = energy >= max(AT_REST * energy.max(), 0.5 * mass * STILL**2)
    moving[energy.argmax()] = True
    return bool(time[-1] - time[np.flatnonzero(moving)[-1]] >= REST)


def slide(args: Namespace, size: float, folder: Path, interrupt: Interrupt) -> Slide:
    """Compute the slide on one mesh size, to rest, to the end of the time or to an interruption."""
    case = build_slope(Namespace(**{**vars(args), "cell_size": size}), comm)
    ratio = start(case)
    disturb(case)
    a, model = case.args, case.model
    with (
        History(folder / f"history_{size:g}.csv", COLUMNS, comm) as history,
        Progress(f"{size:g} m", a.time, comm) as progress,
    ):
        result = Slide(case, size, history, ratio)
        result.look(model.report())
        try:
            for report in model.explicit(a.time, every=a.time / a.frames, damping=a.damping, pic=a.pic, nmd=a.nmd):
                result.look(report)
                progress.show(report.time, report.steps, runout=metres(history["runout_m"][-1]))
                result.at_rest = is_at_rest(history, report.mass)
                if interrupt.requested():
                    result.stopped = f"interrupted at {report.time:g} s"
                if result.at_rest or result.stopped:
                    break
        except mpm.RunError as error:
            result.stopped = why_ended(error, a)
    return result


def reaches_side(result: Slide) -> str:
    """A warning where the slope has failed back to less than its height from the side of the mesh, which holds the soil; else no text."""
    a, failed = result.case.args, result.history["retrogression_m"][-1]
    if a.crest - failed >= a.height:
        return ""
    return (
        f"--crest is {a.crest:g} m, of which {failed:.3g} m have failed with cells of {result.cell_size:g} m: the side of the mesh holds the rest, and the slope "
        f"may fail farther back. Take a --crest that is longer than the failed length by at least --height, {a.height:g} m"
    )


# --- 4. Pictures -----------------------------------------------------------------------------------------------------


def drawn(a: Namespace, result: Slide, scene: Scene | None, folder: Path) -> Pictures:
    """Shear strain at four times, displacement in the end, and a film."""
    if scene is None:
        return {}
    pictures, size = {}, result.cell_size
    shown = np.unique(np.linspace(0, len(result.frames) - 1, 5).astype(int)[1:])
    for k in shown:
        f, name = result.frames[k], f"strain_{size:g}_{k:03d}"
        title = f"$t$ = {f['time']:.1f} s, cells of {size:g} m"
        pictures[name] = partial(save_particles, folder / f"{name}.png", scene, f["position"], f["volume"], f["shear_strain"],
                                 SHEAR_STRAIN, limits=(0, 2), title=title)  # fmt: skip
    last, name = result.frames[-1], f"displacement_{size:g}"
    pictures[name] = partial(save_particles, folder / f"{name}.png", scene, last["position"], last["volume"],
                             last["displacement"], DISPLACEMENT, title=f"$t$ = {last['time']:.1f} s")  # fmt: skip
    if a.film:
        name = f"retrogression_{size:g}".replace(".", "_")  # what follows a point would be taken for the suffix
        pictures[name] = partial(save_animation, folder / name, scene, result.frames, "shear_strain", SHEAR_STRAIN,
                                 limits=(0, 2))  # fmt: skip
    return pictures


def compare(results: list[Slide], folder: Path) -> None:
    """The measures over time on all mesh sizes; on the first rank."""
    with curve_figure(folder / "history.png", (10, 3.2), panels=len(MEASURES)) as axes:
        for ax, (column, label) in zip(axes, MEASURES.items(), strict=True):
            for result, style in zip(results, ("-", "--")):
                values = result.history[column] * (1e-6 if "[MJ" in label else 1.0)
                ax.plot(
                    result.history["time_s"], values, style, color="#1f3b73", label=f"cells of {result.cell_size:g} m"
                )
            ax.set(xlabel="Time [s]", ylabel=label, xlim=(0, None), ylim=(0, None))
        axes[0].legend(frameon=False)


def differences(results: list[Slide]) -> dict[str, float]:
    """Differences of the measures on the two mesh sizes in the end, as fractions of their mean."""
    if len(results) < 2:
        return {}
    ends = {column: [r.history[column][-1] for r in results] for column in MEASURES}
    return {column: float(abs(np.diff(end)[0]) / max(np.mean(end), 1e-300)) for column, end in ends.items()}


# --- 5. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    a = p.parse_args(arguments)
    check_slope_options(p, a)
    say(unit_doubt(vars(a), "the slope"))
    check(p, a.disturbed >= a.cell_size, lambda: f"--disturbed is {a.disturbed:g} m, expected at least --cell-size, {a.cell_size:g} m: the clay "
          "is disturbed cell by cell")  # fmt: skip
    law = law_of(a)
    check(p, DISTURBED in law.state_names, lambda: f"{given_law(a)}, expected --material softening or a law with the state {DISTURBED!r}: the clay around the toe "
          "is disturbed by it")  # fmt: skip
    folder = open_results(a, comm)
    results, movies, pictures = [], [], {}
    with Interrupt(comm) as interrupt:
        for size in [a.cell_size, a.cell_size / 2][: 1 if a.meshes == "one" else 2]:
            if not interrupt.requested():
                results.append(slide(a, size, folder, interrupt))
                say(reaches_side(results[-1]))
                scene = results[-1].case.scene()
                movies.append(particle_movie(f"cells of {size:g} m", scene, results[-1].frames))
                pictures |= drawn(a, results[-1], scene, folder)
    pictures["history"] = lambda: compare(results, folder)
    found = {
        f"{r.cell_size:g}_m": {
            **{column: r.history[column][-1] for column in MEASURES},
            "time_s": r.history["time_s"][-1], "at_rest": r.at_rest, "stopped_because": r.stopped,
            "initial_out_of_balance_ratio": r.ratio, "particles": comm.allreduce(len(r.case.model.particles)),
        }
        for r in results
    }  # fmt: skip
    stopped = "; ".join(f"with cells of {r.cell_size:g} m {r.stopped}" for r in results if r.stopped) or None
    said = "\n".join(
        f"cells of {r.cell_size:g} m: crest retrogressed by {metres(f['retrogression_m'])}, run-out {metres(f['runout_m'])}, work of the "
        f"stresses {f['work_of_stresses_J_per_m'] / 1e6:.3f} MJ/m, {'' if f['at_rest'] else 'not '}at rest after {f['time_s']:.1f} s"
        for r, f in zip(results, found.values())
    )
    summary = {"finished_run": stopped is None, "stopped_because": stopped, "cells": found,
               "difference_between_meshes": differences(results)}  # fmt: skip
    code = write_summary(folder, a, summary, comm, Page(movies=movies), pictures if a.pictures else {}, said)
    return interrupt.exit_code or code


if __name__ == "__main__":
    run_study(main)
