"""The paper's slope: initial stresses by FEM, then failure and slide by MPM, explicit or implicit.

Finite elements (DOLFINx) give the elasto-plastic equilibrium of the soil body under its initial unit weight, and its stresses
are transferred to particles. Then the unit weight is raised at once, and the slope slides until its geometry has changed enough
to carry it. The slope is that of section 6 of the paper (Fatemizadeh; see README, Source); its soil also has a viscosity, and
forces in proportion to the momentum brake the slide, so that run-out and crest hardly depend on the size of the cells. Stresses
are integrated over whole cells and strains averaged over nodes, since plain linear cells lock where soil fails without dilation;
--paper repeats the published run instead, without viscosity and with local damping, zero initial stress and a time step of 1e-4
s. With --site a mesh of your own with its soils replaces the slope; it slides when the strength of all soils is divided by
--factor.
"""

from __future__ import annotations

import math
from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter
from typing import Any

from common.checkpoint import Checkpoints, add_checkpoint_options, check_restart, numbered
from common.checks import check_effect, say
from common.ensemble import Ensemble, further_members
from common.history import History
from common.interrupt import Interrupt
from common.lengths import metres
from common.movie import PORE, has_pore_pressure
from common.options import add_choice, add_count, add_flag, add_number, add_switch, check, study_parser
from common.output_options import add_output_options, add_picture_options, check_frames
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.schemes import (
    add_damping,
    add_scheme_options,
    averages_strains,
    check_scheme_options,
    choose_damping,
    run_scheme,
    stable_integration,
)
from common.site.laws import unit_doubt
from common.site.runs import add_site_option, check_site_options
from common.site.slides import add_strength_factor, site_slide
from common.slope.case import (
    GRAVITY,
    SlopeCase,
    add_slope_options,
    build_slope,
    check_slope_options,
    initialise,
    why_ended,
)
from common.slope.results import drawn, page, print_summary, start_line, summarised
from common.soils import check_law_options, law_of
from common.summary import write_summary
from common.watch import Watch
from mpi4py import MPI
from mpm_core.output import PARTICLE_FIELDS, ModelOutput
from mpm_core.probes import ParticleProbe, ProbeFile, SectionProbe, TotalsProbe

import mpm_core as mpm

comm = MPI.COMM_WORLD
COLUMNS = [
    "time_s", "crest_displacement_m", "runout_m", "kinetic_energy_J_per_m", "unexplained_fraction_of_energy",
    "unbalanced_ratio", "plastic_fraction", "dt_s",
]  # fmt: skip
MAY_CHANGE = {
    "time", "dt", "damping", "mass-damping", "pic", "nmd", "solver", "second-order", "integration", "transfer", "frames",
    "frame-steps", "rebalance", "checkpoint-every", "fields", "float64", "compression", "pictures", "film",
}  # fmt: skip
"""Options that a run may go on with from a checkpoint in another way: how it steps and what it writes, not what slides"""
SITE_OPTIONS = {"factor", "particles-per-cell", "time", "frames", "damping", "pic", "nmd", "pictures", "film"}
"""Options that the slide of a site has"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_flag(p, "--paper", "repeat the paper exactly: zero initial stress, time step 1e-4 s")
    add_slope_options(
        p,
        material=None,
        about=" (default: viscoplastic; mohr-coulomb for the paper's run and quasi-static steps)",
        viscosity=None,
        viscosity_about=" (default: 1000 for a height of 1 m under 80 kN/m3, in proportion to height^1.5 and unit weight)",
    )
    start = p.add_argument_group("initial state")
    add_choice(start, "--initial", None, ("fem", "elastic", "k0", "zero"),
               "initial stresses; fem is elasto-plastic (default: fem; zero with --scheme quasi-static)")  # fmt: skip
    add_number(start, "--initial-unit-weight", 18e3, "N/m3", "unit weight that balances the initial stresses", above=0)
    slide = p.add_argument_group("slide")
    add_damping(slide)
    add_switch(slide, "--nmd", None, "average volumetric strains over nodes, against locking (default: where the soil locks: "
               "friction angle 0, undrained, Poisson's ratio above 0.45; dilation angle below the friction angle, for implicit "
               "schemes only if the dilation angle is 0. Not with --paper, and for a site wherever its soils then carry their weight)")  # fmt: skip
    add_number(slide, "--time", None, "s", "duration of the slide (default: 16 for a height of 1 m, in proportion to its square "
               "root; 34.8 for the paper's run, a site and quasi-static steps)",
               above=0)  # fmt: skip
    add_scheme_options(slide, integration=None)
    add_number(slide, "--rebalance", 1.2, "-",
               "repartition the mesh above this load imbalance: maximum over mean particles per rank", above=1)  # fmt: skip
    add_count(slide, "--ensemble", 1,
              "runs with initial states that differ by round-off; mean and standard deviation are reported")  # fmt: skip
    files = p.add_argument_group("frames and pictures")
    add_count(files, "--frames", 120, "number of times at which particles are stored and drawn")
    add_count(
        files, "--frame-steps", None, "store particles every so many steps too, without drawing them (default: not)"
    )
    add_output_options(files, PARTICLE_FIELDS)
    add_picture_options(files)
    add_checkpoint_options(p.add_argument_group("checkpoints"))
    site = p.add_argument_group("a site instead of the slope")
    add_site_option(site)
    add_strength_factor(site)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    if options.site is None:
        check_slope_options(p, options)
        say(unit_doubt(vars(options), "the slope"))
    if options.integration is None:
        stable = stable_integration(options.particles_per_cell, options.cohesion > 0)
        options.integration = "particles" if options.paper else stable
    if options.paper:
        check(
            p, options.initial in (None, "zero"), lambda: f"--initial is {options.initial}, expected zero with --paper"
        )
        check(p, options.dt in (None, 1e-4), lambda: f"--dt is {options.dt:g}, expected 1e-4 s with --paper")
        check(
            p,
            options.integration == "particles",
            lambda: f"--integration is {options.integration}, expected particles with --paper",
        )
        check(p, options.transfer == "flip", lambda: "--transfer is affine, expected flip with --paper")
        check(p, not options.mass_damping or options.restart is not None,
              lambda: f"--mass-damping is {options.mass_damping:g}, expected 0 with --paper")  # fmt: skip
        options.initial, options.dt = "zero", 1e-4
    check(p, options.ensemble == 1 or (options.restart is None and options.site is None),
          lambda: f"--ensemble is {options.ensemble}, expected 1 with --restart or --site")  # fmt: skip
    choose_slide(p, options)
    check_scheme_options(p, options)
    if options.nmd is None and options.site is None:
        options.nmd = not options.paper and averages_strains(options.scheme, [law_of(options)])
    check_restart(p, options, MAY_CHANGE)
    check_law_options(p, options)
    check_site_options(p, options, SITE_OPTIONS)
    check_effect(p, options, options.site is not None, ("--factor",), "--site")
    return options


def choose_slide(p: ArgumentParser, options: Namespace) -> None:
    """Fill in law, damping and duration: those with which the slope comes to rest at a place that hardly depends on the cells
    (docs/run_out.md), or the paper's. Slopes of one shape slide alike, in times in proportion to the square root of
    their height; a viscosity is a stress multiplied by a time.
    """
    slowness = math.sqrt(options.height)  # of the slope relative to one of 1 m
    as_in_paper = options.paper or options.site is not None or options.scheme == "quasi-static"
    if options.material is None:
        options.material = "mohr-coulomb" if as_in_paper else "viscoplastic"
    if options.time is None:
        options.time = 34.8 if as_in_paper else 16.0 * slowness
    if options.viscosity is None:
        options.viscosity = 1e3 * options.unit_weight / 80e3 * options.height * slowness
    if options.site is not None:  # a run-out in earnest, which damping would shorten (docs/howto/switches.md)
        options.damping = 0.01 if options.damping is None else options.damping
        options.pic = 0.002 if options.pic is None else options.pic
    choose_damping(p, options, local=as_in_paper, mass=5.0 / slowness)


# --- 2. The slide ----------------------------------------------------------------------------------------------------


class Files:
    """Particles and background mesh over time, for ParaView, and probes: the particle at the crest, the force across the vertical
    section under its edge, and totals.
    """

    failure: str | None = None
    """Why the files could not be ended, on a disk that is full"""

    def __init__(self, case: SlopeCase, folder: Path) -> None:
        self.model = case.model
        restarted = case.args.restart is not None
        particles, background = (comm.bcast(numbered(folder, name, restarted)) for name in ("particles", "mesh"))
        a = case.args
        self.frames = ModelOutput(
            self.model,
            particles,
            background,
            a.fields.split(","),
            float32=not a.float64,
            compression=a.compression,
            background=True,
        )
        probes = {
            "crest": ParticleProbe(self.model, [(a.crest, a.height)]), "totals": TotalsProbe(self.model),
            "section_crest": SectionProbe(self.model, point=(a.crest, 0.0), normal=(1.0, 0.0)),
        }  # fmt: skip
        self.probes = [ProbeFile(folder / f"{name}.csv", probe, keep=restarted) for name, probe in probes.items()]

    def write(self) -> None:
        """Add a frame. Collective."""
        self.frames.write({PORE: self.model.state(PORE)} if has_pore_pressure(self.model) else None)
        for probe in self.probes:
            probe.record()

    def __enter__(self) -> Files:
        return self

    def __exit__(self, *error: Any) -> None:
        for file in (self.frames, *self.probes):
            try:
                file.__exit__(*error)
            except mpm.RunError as failure:  # on all ranks alike; the results so far are still to be reported
                self.failure = self.failure or str(failure)


def slide(
    case: SlopeCase, watch: Watch, history: History, files: Files, interrupt: Interrupt, checkpoints: Checkpoints
) -> dict:
    """Run to the end or to an interruption, and store frames; returns its results for the summary."""
    a, model = case.args, case.model
    loop = {"seconds": 0.0, "stopped": None}
    report = model.report()
    done_before = report.particle_steps
    drawn = -1  # of the times of --frames, the last one so far; those of --frame-steps are for the files alone

    def look(report: mpm.Report) -> None:
        nonlocal drawn
        crest, runout = watch.crest_displacement(), watch.runout()
        history.add(
            time_s=report.time, crest_displacement_m=crest, runout_m=runout, kinetic_energy_J_per_m=report.kinetic_energy,
            unexplained_fraction_of_energy=report.unexplained_fraction,
            unbalanced_ratio=report.unbalanced_ratio, plastic_fraction=report.plastic_fraction,
            dt_s=report.dt if report.time > 0 else 0.0,  # before the first step it is that of the equilibration
        )  # fmt: skip
        files.write()
        reached = math.floor(report.time * a.frames / a.time + 1e-6)
        if reached > drawn or interrupt.requested():
            watch.keep(report.time)
        drawn = reached
        progress.show(report.time, report.steps, crest=metres(crest))

    def between_steps() -> bool:
        checkpoints.save_when_due()
        return interrupt.requested()

    with Progress("slide", a.time, comm) as progress:
        if a.scheme == "quasi-static":
            model.set_gravity((0.0, -GRAVITY), ramp=a.time)
        run = run_scheme(a, model, a.time / a.frames, between_steps, rebalance=a.rebalance, every_steps=a.frame_steps)
        try:
            look(report)
            started = perf_counter()
            for report in run:
                loop["seconds"] += perf_counter() - started
                look(report)
                if interrupt.requested():
                    checkpoints.save()
                    loop[
                        "stopped"
                    ] = f"interrupted at {report.time:g} s; --restart {checkpoints.path} continues from there"
                    break
                started = perf_counter()
        except mpm.RunError as error:
            loop["stopped"] = why_ended(error, a)
            report = model.report()
    return {**loop, "report": report, "particle_steps": report.particle_steps - done_before}


# --- 3. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    if a.site is not None:
        return site_slide(a)
    clock = {"start": perf_counter()}
    folder = open_results(a, comm)
    case = build_slope(a, comm)
    check_frames(case.model, a, folder)
    clock["mesh_and_particles"] = perf_counter()
    if a.restart is not None:
        case.model.restore(a.restart)
        start = a.notes["start"]
    else:
        start = initialise(case, a.initial, a.initial_unit_weight, a.nmd and a.scheme == "explicit")
    clock["initial_stress"] = perf_counter()
    if comm.rank == 0 and a.restart is not None:
        changed = a.restarts[-1]["changed"]
        print(f"going on from {a.restart} at {case.model.time:g} s" + (f", changed: {changed}" if changed else ""))
    elif comm.rank == 0:
        print(start_line(a, start))

    watch = Watch(case)
    keep_before = case.model.time if a.restart is not None else None
    with Interrupt(comm) as interrupt:
        with (
            History(folder / "history.csv", COLUMNS, comm, keep_before=keep_before) as history,
            Files(case, folder) as files,
        ):
            checkpoints = Checkpoints(case.model, folder, a, start)
            loop = slide(case, watch, history, files, interrupt, checkpoints)
        loop["stopped"] = loop["stopped"] or files.failure
        clock["slide"] = perf_counter()
        summary = summarised(case, start, loop, history, clock)
        ensemble = run_ensemble(case, history, loop, interrupt)
        if ensemble is not None:
            summary["ensemble"] = ensemble.summary()
        frames, scene = watch.frames(), case.scene()
        pictures = drawn(a, scene, frames, history, folder)
        if ensemble is not None and pictures:
            pictures = {**pictures, **ensemble.pictures(folder)}
        write_summary(folder, a, summary, comm, page(case, frames, summary), pictures)
    if comm.rank == 0:
        print_summary(summary, folder)
        if ensemble is not None:
            print(ensemble.text(), flush=True)
    return interrupt.exit_code or (1 if loop["stopped"] else 0)


def run_ensemble(case: SlopeCase, history: History, loop: dict, interrupt: Interrupt) -> Ensemble | None:
    """The further members that are asked for; None without, or where a member is missing. Collective."""
    if case.args.ensemble == 1 or loop["stopped"]:
        return None
    try:
        found = further_members(case, history, interrupt.requested)
    except mpm.RunError as error:
        loop["stopped"] = f"a member of the ensemble ended early: {error}"
        return None
    return None if interrupt.requested() else found


if __name__ == "__main__":
    run_study(main)
