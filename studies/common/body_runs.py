"""Runs in which a rigid body moves against soil: history, files for ParaView, frames of pictures, checkpoints, restart."""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from mpm_core.output import PARTICLE_FIELDS, ModelOutput
from mpm_core.probes import ProbeFile

import mpm_core as mpm
from particle_player import Movie

from .animation import save_animation
from .checkpoint import Checkpoints, add_checkpoint_options, numbered
from .figures import Pictures
from .history import History
from .interrupt import Interrupt
from .movie import gathered, own_frame
from .options import Options, add_choice, add_count, add_number, add_switch
from .output_options import add_output_options, add_picture_options, check_frames
from .page import Page
from .plots import DISPLACEMENT, SHEAR_STRAIN, WATER_PRESSURE, Quantity, Scene, save_particles
from .progress import Progress
from .schemes import INTEGRATIONS, add_particles_per_cell, add_pic
from .summary import write_summary

FILES_MAY_CHANGE = {"frames", "checkpoint-every", "fields", "float64", "compression", "pictures", "film"}
"""Options that say what is written, with which any run may go on from a checkpoint in another way"""
MAY_CHANGE = FILES_MAY_CHANGE | {"damping", "pic", "integration", "rebalance"}
"""The same of explicit runs, which may step in another way, too"""
SHOWN = {
    "strain": ("shear_strain", SHEAR_STRAIN, "Accumulated plastic shear strain"),
    "displacement": ("displacement", DISPLACEMENT, "Displacement"),
}
"""Pictures of the end: the values of the particles in frames, the quantity, and what captions call it"""
WATER = {"pore_pressure": ("pore_pressure", WATER_PRESSURE, "Pore pressure")}
"""Another one, of soil with pore water"""
COURANT = 0.5
"""That of `Model.explicit`"""


def add_body_run_options(
    p: ArgumentParser, *, damping: float, pic: float, nmd: bool, integration: str = "mixed", frames: int = 60
) -> None:
    """Options of the particles, of their explicit run, of its files and of its checkpoints."""
    run = p.add_argument_group("particles and run")
    add_particles_per_cell(run, 6)
    add_number(run, "--damping", damping, "-", "local damping", at_least=0, below=1)
    add_pic(run, pic)
    add_switch(run, "--nmd", nmd, "average volumetric strains over nodes, against locking")
    add_choice(
        run,
        "--integration",
        integration,
        tuple(INTEGRATIONS),
        "how stresses are integrated over a cell to nodal forces",
    )
    add_number(run, "--rebalance", 1.2, "-",
               "repartition the mesh above this load imbalance: maximum over mean particles per rank", above=1)  # fmt: skip
    add_body_file_options(p, frames)


def add_body_file_options(p: ArgumentParser, frames: int, fields: Sequence[str] = PARTICLE_FIELDS) -> None:
    """Options of the files of a run, and of its checkpoints.

    Args:
        fields: of particles that there are.
    """
    files = p.add_argument_group("frames and pictures")
    add_count(files, "--frames", frames, "number of times at which particles are stored and drawn")
    add_output_options(files, fields)
    add_picture_options(files)
    add_checkpoint_options(p.add_argument_group("checkpoints"))


@dataclass
class BodyRun:
    """Result of a run, on all ranks but for the frames, which the first rank has."""

    history: History
    frames: list[dict] = field(default_factory=list)
    stopped: str | None = None
    interrupted: int = 0
    """Exit code of a run that a signal ended"""
    particle_steps_per_second: float = 0.0


def follow(
    a: Options,
    model: mpm.Model,
    until: float,
    columns: Sequence[str],
    row: Callable[[History, mpm.Report], Mapping[str, float]],
    folder: Path,
    *,
    shown: str,
    since: float = 0.0,
    begin: Callable[..., Iterator[mpm.Report]] | None = None,
) -> BodyRun:
    """Follow particles and bodies until a time [s]. Collective.

    The files of a body are ``body_0.csv`` and so on, in the order of ``Model.contacts``.

    Args:
        a: options, of `add_body_run_options` among them.
        columns: of ``history.csv``; the first is ``time_s``.
        row: the values of a row, from the rows before it and the report; all ranks call it.
        shown: the column that the line of progress shows.
        since: when the run began [s]; a restart needs it.
        begin: begins the run, as `Model.explicit` and `Model.implicit` do; by default the explicit scheme of the options.
    """
    steps = begin or partial(model.explicit, rebalance=a.rebalance, **scheme(a))
    check_frames(model, a, folder)
    if begin is None:
        announce(a.study, model, until)
    again, comm = a.restart is not None, model.comm
    particles, mesh, bodies = (comm.bcast(numbered(folder, name, again)) for name in ("particles", "mesh", "bodies"))
    probes = [ProbeFile(folder / f"body_{k}.csv", contact, keep=again) for k, contact in enumerate(model.contacts)]
    kept: list[dict[str, np.ndarray]] = []
    start, done = perf_counter(), model.report().particle_steps
    with (
        Interrupt(comm) as interrupt,
        History(folder / "history.csv", columns, comm, keep_before=model.time if again else None) as history,
        ModelOutput(model, particles, mesh, a.fields.split(","), float32=not a.float64, compression=a.compression,
                    bodies=bodies if model.contacts else None, background=True) as files,
        Progress(a.study, until, comm) as progress,
    ):  # fmt: skip
        result = BodyRun(history)
        checkpoints = Checkpoints(model, folder, a)

        def look(report: mpm.Report) -> None:
            history.add(**row(history, report))
            files.write()
            for probe in probes:
                probe.record()
            kept.append(own_frame(model, report.time, averaged=begin is None and a.nmd))
            progress.show(report.time, report.steps, **{shown: f"{history[shown][-1]:.4g}"})

        def between_steps() -> bool:
            checkpoints.save_when_due()
            return interrupt.requested()

        try:
            look(model.report())
            for report in steps(until, every=(until - since) / a.frames, since=since, watch=between_steps):
                look(report)
                if interrupt.requested():
                    checkpoints.save()
                    result.stopped = (
                        f"interrupted at {report.time:g} s; --restart {checkpoints.path} continues from there"
                    )
                    break
            files.close()  # waits for the last frame
        except mpm.RunError as error:
            result.stopped = str(error)
        result.particle_steps_per_second = (model.report().particle_steps - done) / (perf_counter() - start)
        for probe in probes:
            probe.close()
        frames = [gathered(comm, frame) for frame in kept]
        result.frames = [frame for frame in frames if frame is not None]
        result.interrupted = interrupt.exit_code
    return result


def announce(study: str, model: mpm.Model, until: float) -> None:
    """Say how large an explicit run will be, since its first report may take long. Collective."""
    particles, steps = model.report().particles, (until - model.time) / (COURANT * model.critical_time_step())
    if model.comm.rank == 0:
        print(f"{study}: {particles} particles, some {max(steps, 1):.1g} steps", file=sys.stderr, flush=True)


def body_pictures(
    a: Namespace,
    scene: Scene | None,
    result: BodyRun,
    folder: Path,
    title: str,
    *,
    shown: Mapping[str, tuple[str, Quantity, str]] = SHOWN,
    **look: Any,
) -> Pictures:
    """Pictures of the end and a film, with the bodies; nothing where there is no scene.

    Args:
        a: options with pictures and film.
        title: stands above all but the film.
        shown: pictures of the end, as in `SHOWN`; the film has the values of the first.
        look: further options of `save_particles` for these.
    """
    if scene is None or not a.pictures:
        return {}
    last = result.frames[-1]
    pictures: dict[str, Callable[[], object]] = {
        name: partial(save_particles, folder / f"{name}.png", scene, last["position"], last["volume"], last[key], quantity,
                      title=title, bodies=last.get("bodies"), **look)
        for name, (key, quantity, _) in shown.items()
    }  # fmt: skip
    if a.film:
        key, quantity, _ = next(iter(shown.values()))
        pictures["film"] = partial(save_animation, folder / "film", scene, result.frames, key, quantity)
    return pictures


def write_results(
    a: Options,
    model: mpm.Model,
    result: BodyRun,
    folder: Path,
    results: Mapping[str, object],
    said: str,
    *,
    begin: float,
    movies: Sequence[Movie],
    captions: Mapping[str, str],
    pictures: Pictures,
) -> int:
    """Write the summary, pictures and page of a run, and say what came of it. Collective.

    Args:
        results: of this study, by name; what all such runs have is added.
        said: the line at the end.
        begin: when the study began, by ``perf_counter`` [s].
        captions: of the study's own pictures.

    Returns:
        The exit code.
    """
    report = model.report()
    summary = {
        "finished_run": result.stopped is None, "stopped_because": result.stopped, "particles": report.particles, **results,
        "time_s": report.time, "steps": report.steps, "unexplained_fraction_of_energy": report.unexplained_fraction,
        "particle_steps_per_second": result.particle_steps_per_second, "wall_seconds": perf_counter() - begin,
    }  # fmt: skip
    ends = {name: f"{what} in the end" for name, (_, _, what) in (SHOWN | WATER).items()}
    page = Page(movies=list(movies), captions=ends | dict(captions))
    code = write_summary(folder, a, summary, model.comm, page, pictures, said)
    return result.interrupted or code


def scheme(a: Namespace) -> dict[str, Any]:
    """Options of the explicit scheme as arguments of ``Model.explicit``."""
    return {"damping": a.damping, "pic": a.pic, "nmd": a.nmd, "integration": INTEGRATIONS[a.integration]}


def mean_force(history: History, body: mpm.RigidContact, time: float, axis: int, column: str = "impulse_Ns") -> float:
    """Mean force along an axis since the row before [N]; the force itself in the first one.

    Single steps would show the noise of cell crossings.

    Args:
        history: with the column ``time_s``.
        column: of the impulse along the axis.
    """
    if len(history) == 0 or time <= history["time_s"][-1]:
        return float(body.force[axis])
    return float((body.impulse[axis] - history[column][-1]) / (time - history["time_s"][-1]))
