"""Consolidation of ground under a load: pore pressures rise as it is placed, and fall as the water leaves and the ground settles.

The site is a TOML file (`meshes/fill.toml` unless another is given): a mesh of gmsh, soils with laws of effective stress and
conductivities, supports, boundary conditions of the pore water, and loads over time. The ground is first in equilibrium under its
weight and steady flow; from there displacements and pore pressures are computed together, while loads rise, pause and fall, and
soil and structural members come and go in stages. With `--particles`, implicit particles with pore water start from the same equilibrium and
are computed beside the finite elements, with the same steps and small displacements.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.checks import say
from common.consolidation.members import MembersOverTime
from common.consolidation.particles import ParticleGround, near_line
from common.consolidation.plots import (
    EXCESS,
    ExcessPicture,
    by_logarithm,
    end_of_primary,
    save_excess,
    save_excess_film,
    save_isochrones,
    save_over_time,
)
from common.consolidation.site import ConsolidationSite, read_consolidation_site
from common.consolidation.stages import pressures_of
from common.field_files import FieldFiles
from common.field_plots import Field, gathered
from common.figures import Pictures
from common.movie import PORE, particle_movie
from common.options import add_count, add_flag, add_number, add_switch, study_parser
from common.page import Page
from common.plots import DISPLACEMENT, save_particles
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.schemes import add_particles_per_cell
from common.site.flow_doubts import warn_of_later_changes
from common.site.member_results import captions
from common.site.options import add_site_file
from common.summary import write_summary
from common.water.discharge import extent_of
from common.water.site import DAY, time_in_words
from dolfinx import fem
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
SUCTION = 0.05
"""Fall of the pore pressure below that at the beginning, over its largest rise, from which it is drawn: overshoots are smaller"""
ACCURACY = 0.01
"""Error of settlements by the length of time steps, up to which these grow in ground that creeps"""
ELEMENTS = {"P2-P1": water.Element.TAYLOR_HOOD, "P1-P1": water.Element.STABILISED}


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    elements = (
        "P1-P1",
        tuple(ELEMENTS),
        "elements: quadratic displacement (P2-P1), or stabilised linear displacement (P1-P1)",
    )
    add_site_file(p, "fill", "soils, water and pressures", elements)
    p.add_argument(
        "--pressures", nargs="+", default=None, metavar="NAME=ROWS",
        help="pressures on boundaries, in addition to those of the site file or replacing them: NAME=PA, or over time "
        "NAME=DAYS:PA,DAYS:PA,... joined by straight lines, such as footing=0:0,10:20e3,60:20e3,70:40e3; pressures at day 0 "
        "belong to the equilibrium at the beginning",
    )  # fmt: skip
    add_number(p, "--days", 3000.0, "days", "duration of the run", above=0)
    add_number(p, "--first-step", 0.5, "days", "first step, at the beginning and after each change of a load", above=0)
    add_number(
        p,
        "--growth",
        1.15,
        "-",
        "factor by which time steps grow, less where clay creeps and settlements would be wrong by 1 %",
        at_least=1,
    )
    add_count(
        p,
        "--frames",
        5,
        "number of pictures, evenly over the logarithm of time; sites with stages have one at the end of each",
    )
    add_switch(
        p, "--nmd", True, "average volumetric strains of linear elements and particles over nodes, against locking"
    )
    add_switch(
        p, "--film", True, "draw a film of the excess pore pressure and the settlement, with a frame of each step"
    )
    add_flag(p, "--particles", "compute implicit particles as well; the reservoirs must keep the ground under water")
    add_particles_per_cell(p, 3)
    return p


# --- 2. The ground in time -------------------------------------------------------------------------------------------


class Files(FieldFiles):
    """Files that are written during the run: frames for ParaView, and the history of the settlements."""

    def __init__(
        self,
        model: water.Consolidation,
        site: ConsolidationSite,
        folder: Path,
        particles: ParticleGround | None,
        filmed: bool,
    ) -> None:
        self._model, self._names, self.particles = model, list(site.points), particles
        self._extent, self._half = extent_of(model), model.geometry == bridge.Geometry.AXISYMMETRIC
        self.error_column = f"water_error_{self._extent.unit}"
        self.members = MembersOverTime(site.site.members)
        self._places = np.array(list(site.points.values())) if comm.rank == 0 else np.empty((0, 2))
        self._start = model.pressure.x.array.copy()
        self._excess = fem.Function(model.pressure.function_space, name="excess_pore_pressure")
        settlements = (f"settlement_{name}_m" for name in self._names)
        columns = [
            "time_days",
            *settlements,
            "largest_excess_pressure_Pa",
            "least_excess_pressure_Pa",
            self.error_column,
            *self.members.columns,
        ]
        if particles is not None:
            columns += [f"settlement_{name}_particles_m" for name in self._names]
            columns += ["largest_excess_pressure_particles_Pa"]
        super().__init__(model.domain, folder / "consolidation", folder / "history.csv", columns)
        self.pictures: list[ExcessPicture | None] = []
        self.film: list[ExcessPicture | None] = []
        self._filmed, self._framed = filmed, -np.inf

    def row(self, report: water.ConsolidationReport | None = None) -> None:
        """Add settlements, the largest and the least excess pressure to the history. Collective."""
        model = self._model
        self._excess.x.array[:] = model.pressure.x.array - self._start
        largest = comm.allreduce(float(self._excess.x.array.max(initial=-np.inf)), MPI.MAX)
        least = comm.allreduce(float(self._excess.x.array.min(initial=np.inf)), MPI.MIN)
        settled = comm.bcast(-model.evaluate_at(self._places)["displacement"][:, 1])
        values = {f"settlement_{name}_m": value for name, value in zip(self._names, settled)}
        values |= {"largest_excess_pressure_Pa": largest, "least_excess_pressure_Pa": least}
        if self.particles is not None:
            if report is not None:
                self.particles.follow(model.time, report.dt)
            theirs = zip(self._names, self.particles.settlements())
            values |= {f"settlement_{name}_particles_m": value for name, value in theirs}
            values["largest_excess_pressure_particles_Pa"] = self.particles.largest_excess()
        values[self.error_column] = self._extent.factor * report.water_error if report else 0.0
        self.history.add(time_days=model.time / DAY, **values, **self.members.row(model))
        if self._filmed:
            self.film.append(self._picture())

    def frame(self) -> None:
        """Add pressures, displacement and stress to the files for ParaView, and a picture, once at a time. Collective."""
        model = self._model
        if model.time == self._framed:  # a run may end right after a frame
            return
        self._framed = model.time
        stress = model.stress_function(smooth=True)
        there = bridge.evaluate_at(
            self.points, u=model.displacement, p=model.pressure, excess=self._excess, stress=stress
        )
        fields = {"displacement": there["u"], "pore_pressure": there["p"][:, 0], "excess_pore_pressure": there["excess"][:, 0],
                  "effective_stress": there["stress"]}  # fmt: skip
        self.output.write(model.time, fields, {})
        if self.particles is not None:
            self.particles.frame(model.time / DAY)
        self.members.frame(model)
        self.pictures.append(self._picture())

    def _picture(self) -> ExcessPicture | None:
        """Excess pressures and displacements now; None but on the first rank. Collective."""
        excess, soils = self._that_is_there(gathered(self._excess, self._half))
        moved, members = gathered(self._model.displacement), self.members.lines(self._model)
        if excess is None or moved is None:
            return None
        return ExcessPicture(f"After {time_in_words(self._model.time)}", excess, moved.values, members, soils)

    def _that_is_there(self, field: Field | None) -> tuple[Field | None, np.ndarray]:
        """A field on the first rank without the cells of soil that is not there now, and the number of the soil of each cell. Collective."""
        centres = np.empty((0, 2)) if field is None else field.points[field.cells].mean(axis=1)
        number = np.rint(bridge.evaluate_at(centres, number=self._model.material_function())["number"][:, 0])
        there = number >= 0
        return None if field is None else replace(field, cells=field.cells[there]), number[there]


def follow(a: Namespace, site: ConsolidationSite, model: water.Consolidation, files: Files) -> str | None:
    """The ground in time; steps end, and become short again, where loads change. Returns why it ended early, if it did.

    Collective.
    """
    first = dt = DAY * min(a.first_step, a.days)
    ends = [stage.start + stage.duration for stage in site.stages[1:]]
    days = np.geomspace(min(10 * a.first_step, 0.5 * a.days), a.days, a.frames) if a.frames > 1 else [a.days]
    shown = [*(time for time in ends if 0 < time < DAY * a.days), DAY * a.days] if ends else DAY * np.array(days)
    frames, changes = ({float(f"{time:.9g}") for time in times} for times in (shown, site.corners(0.5 * first)))
    accuracy = ACCURACY if site.creeps else None
    with Progress("consolidation", a.days, comm, unit="days") as progress:

        def made(report: water.ConsolidationReport) -> None:
            if report.converged:
                files.row(report)
                progress.show(model.time / DAY, len(files.history))

        begin_stage(site, model, files, 0.0)
        for time in sorted(frames | {change for change in changes if change < max(frames)}):
            try:
                reports = model.run(time, dt, a.growth, progress=made, accuracy=accuracy)
            except mpm.RunError as error:
                files.frame()
                return f"particles from {model.time / DAY:.4g} days on: {error}"
            if not reports[-1].converged:
                files.frame()  # where the settlements and excess pressures are that it fails with
                return without_equilibrium(site, model.time, reports[-1].reason)
            dt = first if time in changes else max(dt, max(report.dt for report in reports))
            if time in frames:
                files.frame()
            if time in changes:
                begin_stage(site, model, files, time)
    return None


def without_equilibrium(site: ConsolidationSite, time: float, reason: str) -> str:
    """What is said of a run that ends at a time [s] for a reason of its last step."""
    said, soils = f"no equilibrium was found from {time / DAY:.4g} days on", site.dilating_little()
    if reason.startswith("it collapses") or not soils:
        return f"{said}, as where ground fails under its load: {reason}"
    return (
        f"{said}: {reason}. Either the ground fails under its load, or it does not and Newton's method only finds no way, as it may where "
        f"{' or '.join(map(repr, soils))} yields, whose dilation angle is below its friction angle: compare a run in which they are equal"
    )


def begin_stage(site: ConsolidationSite, model: water.Consolidation, files: Files, time: float) -> None:
    """Begin the stage of a time [s], if one begins then. Collective."""
    stage = site.stage_at(time)
    if stage is None:
        return
    model.boundary = list(stage.boundary.values())
    if stage.renewed:
        model.reconfigure(off=stage.off, members={k: v for k, v in stage.members.items() if k not in stage.renewed})
    model.reconfigure(off=stage.off, duration=stage.duration, members=dict(stage.members))
    if files.particles is not None:
        files.particles.begin(stage)


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def drawn(site: ConsolidationSite, files: Files, folder: Path) -> Pictures:
    """Excess pressures at the frames and in a film; settlements and the largest excess pressure over time."""
    shown, history = [picture for picture in files.pictures if picture is not None], files.history
    stages = [stage.start / DAY for stage in site.stages[1:] if 0 < stage.start / DAY < history["time_days"][-1]]
    logarithmic = by_logarithm(history["time_days"], stages)
    since = 1 if logarithmic else 0  # the logarithm of time has no beginning
    days = history["time_days"][since:]
    settled = {name: 1e3 * history[f"settlement_{name}_m"][since:] for name in site.points}
    largest = {name: 1e-3 * history[f"{name}_excess_pressure_Pa"][since:] for name in ("largest", "least")}
    falls = largest["least"].min(initial=0.0) < -SUCTION * np.abs(largest["largest"]).max(initial=0.0)
    if not falls:
        del largest["least"]
    primary = end_of_primary(days, largest["largest"]) if site.creeps else None
    x, theirs, settled_theirs, largest_theirs = next(iter(site.points.values()))[0], [], {}, {}
    if files.particles is not None:
        theirs = [frame for frame in files.particles.frames if frame is not None]
        settled_theirs = {name: 1e3 * history[f"settlement_{name}_particles_m"][since:] for name in site.points}
        largest_theirs = {"largest": 1e-3 * history["largest_excess_pressure_particles_Pa"][since:]}
    pictures: Pictures = {
        "excess_pressure.png": lambda: save_excess(folder / "excess_pressure.png", shown),
        "isochrones.png": lambda: save_isochrones(
            folder / "isochrones.png", x, shown, [near_line(frame, x) for frame in theirs]
        ),
        "settlement.png": lambda: save_over_time(
            folder / "settlement.png",
            days,
            settled,
            "Settlement [mm]",
            True,
            settled_theirs,
            stages,
            logarithmic,
            primary,
        ),
        "largest_excess.png": lambda: save_over_time(
            folder / "largest_excess.png",
            days,
            largest,
            "Excess pore pressure [kPa]" if falls else "Largest excess pore pressure [kPa]",
            False,
            largest_theirs,
            stages,
            logarithmic,
            primary,
        ),
    }
    pictures |= files.members.pictures(folder, history, logarithmic, stages)
    moving = [picture for picture in files.film if picture is not None]
    if len(moving) > 1:
        pictures["film"] = lambda: save_excess_film(folder / "film", moving)
    if theirs:
        frame = max(theirs, key=lambda frame: frame[PORE].max())
        pictures["particles_excess.png"] = lambda: save_particles(
            folder / "particles_excess.png", files.particles.scene, frame["position"], frame["volume"], frame[PORE],
            EXCESS, title=f"$t$ = {frame['time']:.3g} days")  # fmt: skip
    return pictures


CAPTIONS = {
    "excess_pressure": "Pore pressure above that at the beginning, on the deformed ground",
    "isochrones": "Excess pore pressure below the first point of the site",
    "settlement": "Settlement of the points of the site over time",
    "largest_excess": "Largest excess pore pressure over time",
    "particles_excess": "Excess pore pressure of the particles when it is largest",
    "axial_forces": "Largest axial force of each member over time; tension is positive",
    "moments": "Largest bending moment of each beam over time",
}


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a: Namespace = parser().parse_args(arguments)
    start = perf_counter()
    site = read_consolidation_site(a.site, comm, a.cell_size, pressures_of(a.pressures or []))
    starts = {stage.name: stage.start for stage in site.stages[1:]}
    warn_of_later_changes(a.days, site.stages[-1].boundary.values(), a.site, site.pressures, starts)
    say("" if site.changes_until(DAY * a.days) else
        f"nothing changes within {a.days:g} days, so that the ground stays in its first equilibrium, which includes pressures that are numbers: "
        "a load that consolidates the ground begins at 0, such as 'top = [[0.0, 0.0], [0.01, 30e3]]' in the file, rows of [days, Pa], "
        "or '--pressures top=0:0,0.01:30e3'")  # fmt: skip
    folder = open_results(a, comm)
    model = site.at_rest(ELEMENTS[a.elements], a.nmd and a.elements == "P1-P1")
    with ExitStack() as stack:
        particles = None
        if a.particles:
            particles = stack.enter_context(ParticleGround(site, model, a.particles_per_cell, a.nmd, folder))
        files = stack.enter_context(Files(model, site, folder, particles, a.film))
        files.row()
        files.members.frame(model)
        stopped = follow(a, site, model, files)
    history = files.history
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped,
        **{f"settlement_{name}_m": history[f"settlement_{name}_m"][-1] for name in site.points},
        "largest_excess_pressure_Pa": history["largest_excess_pressure_Pa"].max(),
        "least_excess_pressure_Pa": history["least_excess_pressure_Pa"].min(),
        f"largest_{files.error_column}": np.abs(history[files.error_column]).max(),
        **files.members.largest(history), "last_time_days": model.time / DAY, "steps": len(history) - 1, "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    movies = []
    if particles is not None:
        summary |= {
            f"settlement_{name}_particles_m": history[f"settlement_{name}_particles_m"][-1] for name in site.points
        }
        summary |= {"particles": particles.count, "largest_newton_iterations_particles": particles.iterations}
        if particles.scene is not None:
            movies = [particle_movie("particles", particles.scene, particles.frames, {"displacement": DISPLACEMENT})]
    files.members.write(folder, comm)
    page = Page(movies=movies, slider=("t", "days"), captions=captions(files.members.frames) | CAPTIONS)
    lines = []
    for name in site.points:
        theirs = f", particles {1e3 * summary[f'settlement_{name}_particles_m']:.4g} mm" if a.particles else ""
        lines.append(f"settlement, {name}: {1e3 * summary[f'settlement_{name}_m']:.4g} mm{theirs}")
    return write_summary(folder, a, summary, comm, page, drawn(site, files, folder), said="\n".join(lines))


if __name__ == "__main__":
    run_study(main)
