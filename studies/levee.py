"""A levee on sand that liquefies in an earthquake: pore pressures, settlement of the crest, spreading of the toes.

The levee stands on loose saturated sand over stiffer ground, with the water table at the surface of the ground. Finite elements
give the equilibrium. In the earthquake the motion of a rock outcrop enters through the base, which absorbs outgoing waves; free
fields are coupled to the sides. The sand has the law SANISAND. The ground stays in resting cells, which move with their nodes as
finite elements do. By default the sand does not drain. With --conductivity its water flows during the earthquake and in the time
--rest after it, in which the ground settles.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path

import numpy as np
from common.animation import save_animation
from common.checks import check_cells, check_effect, check_two_cells, say
from common.earthquake.motions import STEP, accelerations
from common.earthquake.options import add_motion_options, check_motion
from common.earthquake.plots import save_ground, save_record
from common.earthquake.site import FIELDS, outcrop_motion, too_coarse
from common.figures import Pictures
from common.followed import FollowedNodes, cells_near, numbers_in
from common.history import History
from common.lengths import metres
from common.movie import gathered, own_frame, particle_movie
from common.options import add_count, add_number, check, study_parser
from common.output_options import add_picture_options
from common.page import Page
from common.plots import SHEAR_STRAIN, Quantity
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.scenes import scene_of
from common.schemes import add_particles_per_cell
from common.site.laws import unit_doubt
from common.slope.case import add_soil_options
from common.summary import write_summary
from common.water.levee_plots import save_displacement, save_liquefaction
from common.water.levee_site import (
    SOILS,
    damping_of,
    effective_pressure,
    model_in_equilibrium,
    speed_of_sand,
    too_loose,
    void_ratio_named,
)
from mpi4py import MPI
from mpm_core.output import ModelOutput

import mpm_core as mpm

comm = MPI.COMM_WORLD
RATIO = Quantity("Excess pore pressure ratio $1 - p'/p'_0$ of the sand", "-", colours="viridis")
COLUMNS = [
    "time_s", "crest_settlement_m", "ground_settlement_m", "spreading_of_toes_m",
    "pore_pressure_ratio_free_field", "pore_pressure_ratio_below_toe", "pore_pressure_ratio_below_crest",
]  # fmt: skip
"""The ground settles in the free field; the toes move apart; pore pressures are at the middle of the sand"""
PLACES = ("free_field", "below_toe", "below_crest")


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--height", 4.0, "m", "height of the levee", above=0)
    add_number(p, "--slope", 2.0, "-", "horizontal length of the slopes of the levee over their height", at_least=0.5)
    add_number(p, "--crest", 4.0, "m", "width of the crest", above=0)
    add_number(p, "--sand-depth", 6.0, "m", "thickness of the sand", above=0)
    add_number(p, "--stiff-depth", 4.0, "m", "thickness of the stiffer ground", above=0)
    add_number(p, "--beside", 24.0, "m", "length of the ground beside each toe", above=0)
    add_number(p, "--cell-size", 1.0, "m", "edge of the triangles", above=0)
    add_particles_per_cell(p, 3)
    add_number(p, "--void-ratio", 0.85, "-", "void ratio of the sand", above=0)
    p.add_argument("--sanisand", nargs="*", default=[], metavar="NAME=VALUE",
                   help="parameters of the sand that differ from those of Toyoura sand, such as dilatancy=0.5")  # fmt: skip
    add_number(p, "--unit-weight", 18e3, "N/m3", "unit weight of the levee", above=0)
    add_soil_options(p, dilation_angle=0.0)
    p.set_defaults(young=40e6, poisson=0.3, cohesion=10e3, friction_angle=32.0)
    add_number(p, "--stiff-young", 400e6, "Pa", "Young's modulus of the stiffer ground, which stays elastic", above=0)
    add_number(p, "--conductivity", None, "m/s", "hydraulic conductivity of the sand, whose water flows then (default: none, the sand "
               "does not drain)", above=0)  # fmt: skip
    add_number(p, "--stiff-conductivity", 1e-6, "m/s", "hydraulic conductivity of the stiffer ground", above=0)
    add_motion_options(p)
    p.set_defaults(peak=2.0, rest=2.0)
    add_count(p, "--frames", 40, "times at which the ground is drawn")
    add_picture_options(p)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    check_two_cells(p, a, ("height", "sand_depth", "stiff_depth", "beside"))
    length = 2 * a.beside + 2 * a.slope * a.height + a.crest
    check_cells(p, a, 2.3 * length * (a.height + a.sand_depth + a.stiff_depth) / a.cell_size**2, "--cell-size", "--beside",
                "--sand-depth", "--stiff-depth")  # fmt: skip
    check_motion(p, a)
    say(unit_doubt(vars(a), "the soil"))
    check_effect(p, a, a.conductivity is not None, ("--stiff-conductivity",), "--conductivity")
    given = [word for word in a.sanisand if word.partition("=")[0] == "void_ratio"]
    check(p, not given, lambda: f"--sanisand has '{given[0]}', expected --void-ratio {given[0].partition('=')[2]} in its place, from which the "
          "porosity and the unit weight of the sand follow too")  # fmt: skip
    say(too_loose(a))  # and names what is wrong with the parameters of the sand
    say(too_coarse(a, speed_of_sand(a), "the sand"))
    return a


# --- 2. The earthquake -----------------------------------------------------------------------------------------------


class Followed:
    """What the history follows: nodes at the crest, the surface of the free field and the toes, and sand below. Collective.

    Displacements are those of the surface itself, as velocities of its nodes over time: cells beside it move less than the crest and the toes do.
    """

    def __init__(self, model: mpm.Model, a: Namespace) -> None:
        left, right = a.beside, a.beside + 2 * a.slope * a.height + a.crest
        middle, reach, depth = 0.5 * (left + right), 1.5 * a.cell_size, -0.5 * a.sand_depth

        def near(x: float, y: float, soil: str) -> np.ndarray:
            return numbers_in(model, cells_near(model, np.array((x, y)), reach, model.mesh.tags_of("cell", soil)))

        self._model = model
        surface = np.array([(middle, a.height), (0.25 * a.beside, 0.0), (left, 0.0), (right, 0.0)])
        self._nodes, self._time = FollowedNodes(model, surface), 0.0
        self._moved, self._velocity = np.zeros_like(surface), np.zeros_like(surface)
        self._sand = [near(x, depth, "sand") for x in (0.25 * a.beside, left, middle)]
        self._start = self._pressures()

    def _pressures(self) -> list[float]:
        pressure, means = effective_pressure(self._model), []
        for numbers in self._sand:
            rows = np.isin(self._model.particles.id, numbers)
            total, count = comm.allreduce(np.array([pressure[rows].sum(), rows.sum()]))
            means.append(float(total / count))
        return means

    def row(self, time: float) -> dict[str, float]:
        """Values of the columns at a time [s], after that of the row before or 0."""
        if time > self._time:
            before, self._velocity = self._velocity, self._nodes.velocity()
            self._moved += 0.5 * (time - self._time) * (before + self._velocity)
            self._time = time
        crest, ground, left, right = self._moved
        ratios = [1 - max(now, 0.0) / start for now, start in zip(self._pressures(), self._start)]
        return dict(zip(COLUMNS, (time, -crest[1], -ground[1], right[0] - left[0], *ratios)))


def shaken(a: Namespace, model: mpm.Model, until: float, folder: Path) -> tuple[History, list, mpm.Report]:
    """Run to the end; history, frames and the last report."""
    followed, start = Followed(model, a), effective_pressure(model)
    frames, samples = [frame_at(model, start, 0.0)], max(a.frames, round(until / (2 * STEP)))
    more = ("pore_pressure", "water_velocity") if model.has_water else ("state",)
    run = model.explicit(until, every=until / samples, rayleigh=damping_of(a), nmd=True, conversion=None)
    with (
        History(folder / "history.csv", COLUMNS, comm) as history,
        Progress("levee", until, comm) as progress,
        ModelOutput(model, folder / "particles", folder / "mesh", (*FIELDS, *more)) as files,
    ):
        files.write()
        history.add(**followed.row(0.0))
        for k, report in enumerate(run, 1):
            row = followed.row(report.time)
            history.add(**row)
            if k * a.frames // samples > (k - 1) * a.frames // samples:
                frames.append(frame_at(model, start, report.time))
                files.write()
            progress.show(report.time, report.steps, settlement=metres(row["crest_settlement_m"]))
    return history, frames, report


def frame_at(model: mpm.Model, start: np.ndarray, time: float) -> dict | None:
    """Gather all rows to the first rank, None on the others; cells are at their present places. Collective."""
    p = model.particles
    frame = own_frame(model, time, averaged=True)
    frame["position"] = (p.position + p.displacement).astype(np.float32)
    mesh_corners = model.mesh.points[model.mesh.cells[p.cell]].reshape(-1, 6)
    sand = p.material == len(SOILS)
    ratio = np.where(sand, np.clip(1 - effective_pressure(model) / start, 0.0, 1.0), 0.0)
    more = {
        "resting": np.ones(len(p), np.float32),
        "corners": (mesh_corners + np.tile(p.displacement, 3)).astype(np.float32),
        "mesh_corners": mesh_corners,
        "moved": p.displacement.astype(np.float32),
        "ratio": ratio.astype(np.float32),
        "sand": sand.astype(np.float32),
    }
    return gathered(model.comm, {**frame, **more})


# --- 3. What comes out -----------------------------------------------------------------------------------------------


def drawn(a: Namespace, folder: Path, record: tuple, history: History, frames: list, scene: object) -> Pictures:
    """Draw all pictures and the film, on the first rank."""
    if scene is None:
        return {}
    last = frames[-1]
    pictures = {
        "record": partial(save_record, folder / "record.png", record[0], record[1], record[2].velocity),
        "liquefaction": partial(save_liquefaction, folder / "liquefaction.png", history),
        "pore_pressure": partial(save_ground, folder / "pore_pressure.png", last, "ratio", RATIO, within="sand"),
        "displacement": partial(save_displacement, folder / "displacement.png", last),
        "shear_strain": partial(save_ground, folder / "shear_strain.png", last, "shear_strain", SHEAR_STRAIN),
    }  # fmt: skip
    if a.film:
        pictures["levee"] = partial(save_animation, folder / "levee", scene, frames, "ratio", RATIO)
    return pictures


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    record = outcrop_motion(a)
    folder = open_results(a, comm)
    until = float(record[2].time[-1]) + a.rest
    with void_ratio_named(a):
        model = model_in_equilibrium(a, record[2])
        history, frames, report = shaken(a, model, until, folder)
    largest = {
        f"largest_pore_pressure_ratio_{place}": history[f"pore_pressure_ratio_{place}"].max() for place in PLACES
    }
    shaking = history["time_s"] <= record[2].time[-1] + 1e-9
    summary = {
        "crest_settlement_m": history["crest_settlement_m"][-1],
        "crest_settlement_at_end_of_motion_m": history["crest_settlement_m"][shaking][-1],
        "ground_settlement_m": history["ground_settlement_m"][-1],
        "spreading_of_toes_m": history["spreading_of_toes_m"][-1],
        **largest,
        "largest_acceleration_of_outcrop_m_per_s2": np.abs(accelerations(record[2].time, record[2].velocity)[1]).max(),
        "unexplained_energy_fraction": report.unexplained_fraction,
        "steps": report.steps,
    }  # fmt: skip
    captions = {
        "record": "Motion of the outcrop, as recorded and after the baseline correction",
        "liquefaction": "Excess pore pressures in the middle of the sand, settlement of the crest and spreading of the toes",
        "pore_pressure": "Excess pore pressure ratio at the end",
        "displacement": "Displacement that stays, with the outline before the earthquake",
        "shear_strain": "Plastic shear strain at the end",
    }  # fmt: skip
    scene = scene_of(model, model.mesh.tags_of("cell", SOILS))
    page = Page(movies=[particle_movie("levee", scene, frames)], captions=captions)
    pictures = drawn(a, folder, record, history, frames, scene) if a.pictures else {}
    said = (
        f"crest settled by {metres(summary['crest_settlement_m'])}, toes spread by {metres(summary['spreading_of_toes_m'])}; largest "
        f"excess pore pressure ratio {largest['largest_pore_pressure_ratio_free_field']:.2f} in the free field, "
        f"{largest['largest_pore_pressure_ratio_below_crest']:.2f} below the crest"
    )
    return write_summary(folder, a, summary, comm, page, pictures, said)


if __name__ == "__main__":
    run_study(main)
