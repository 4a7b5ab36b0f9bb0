"""A slope in wide ground: particles everywhere against resting cells that turn into particles where the soil fails.

Finite elements give the elasto-plastic equilibrium under the initial unit weight. Then the unit weight is raised at once, and
the slope fails. This is computed twice: with particles in all cells, and with resting cells, which remain finite elements
until the soil in them fails.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from contextlib import nullcontext
from pathlib import Path
from time import process_time

import numpy as np
from common.checks import check_cells
from common.figures import Pictures, save_figure
from common.followed import cells_near, mean_displacement, numbers_in
from common.lengths import metres
from common.movie import frame_of, particle_frame, particle_movie
from common.options import add_count, add_number, check, study_parser
from common.page import Page
from common.plots import SHEAR_STRAIN, draw_bar, figure_with_bar, paper_style, save_history
from common.quiet import LOCKS, NOT_REACHED, without_warning
from common.ranks import run_study
from common.results import open_results
from common.scenes import scene_of
from common.schemes import add_particles_per_cell
from common.slope.case import GRAVITY, add_soil_options, soil_of
from common.summary import write_summary
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from mpi4py import MPI
from mpm_core.output import ModelOutput

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
FOLLOWED = 0.2
"""Crest and toe are means over the soil within this distance from them, over the height of the slope"""
KINDS = {"particles": "particles everywhere", "coupled": "resting cells and particles"}
FIELDS = ("displacement", "velocity", "stress", "plastic_strain", "volume", "resting")
"""Fields in the files for ParaView; a threshold on ``resting`` tells resting cells from particles"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--height", 1.0, "m", "height of the slope", above=0)
    add_number(
        p, "--angle", 45.0, "degrees", "inclination of the slope, from 11.4 to 78.6, or 90", above=11, at_most=90
    )
    add_number(p, "--width", 10.0, "-", "ratio of the ground's width to the height of the slope", above=3)
    add_number(
        p, "--depth", 5.0, "-", "ratio of the ground's depth below the crest to the height of the slope", above=1
    )
    add_number(p, "--cell-size", 0.1, "m", "side of the squares", above=0)
    add_particles_per_cell(p, 10)
    add_number(p, "--initial-unit-weight", 15e3, "N/m3", "unit weight that balances the initial stresses", above=0)
    add_number(p, "--unit-weight", 60e3, "N/m3", "unit weight under which the slope fails", above=0)
    add_soil_options(p, dilation_angle=0.0)
    p.set_defaults(young=1e9)
    add_number(p, "--damping", 0.1, "-", "local damping", at_least=0, below=1)
    add_number(p, "--time", 1.5, "s", "duration of the slide", above=0)
    add_count(p, "--frames", 40, "times at which the history is stored")
    add_number(
        p, "--plastic-strain", 0.05, "-", "plastic strain above which a resting cell turns into particles", above=0
    )
    add_number(
        p,
        "--displacement",
        0.015,
        "-",
        "ratio of the displacement to the cell size above which it turns into particles, too",
        above=0,
    )
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    check(
        p,
        options.dilation_angle <= options.friction_angle,
        lambda: f"--dilation-angle is {options.dilation_angle:g}, expected at most --friction-angle, "
        f"{options.friction_angle:g} degrees",
    )
    check(p, options.cell_size <= 0.5 * options.height,
          lambda: f"--cell-size is {options.cell_size:g}, expected at most half of --height")  # fmt: skip
    check(p, 11.4 <= options.angle <= 78.6 or options.angle == 90,
          lambda: f"--angle is {options.angle:g}, expected 11.4 to 78.6, or 90, degrees: squares are stretched to fit the slope")  # fmt: skip
    check(p, level_of(options) > 0,
          lambda: f"--width is {options.width:g} with --angle {options.angle:g}, which leaves no level ground beside the slope, expected more than "
          f"{1 / np.tan(np.radians(options.angle)) + 2 * options.cell_size / options.height:.3g}")  # fmt: skip
    check(p, options.unit_weight > options.initial_unit_weight,
          lambda: f"--unit-weight is {options.unit_weight:g} N/m3, expected above --initial-unit-weight, "
          f"{options.initial_unit_weight:g} N/m3: the slope fails as the unit weight rises")  # fmt: skip
    cells = 4 * options.width * (options.depth + 1) * (options.height / options.cell_size) ** 2
    check_cells(p, options, cells, "--cell-size", "--height", "--width", "--depth")
    return options


# --- 2. The ground, by finite elements and as a model -----------------------------------------------------------------


def level_of(a: Namespace) -> float:
    """Length of the level ground on each side of the slope [m], of whole cells."""
    run = a.height / np.tan(np.radians(a.angle))
    return a.cell_size * round(0.5 * (a.width * a.height - run) / a.cell_size)


def ground(a: Namespace) -> tuple:
    """The mesh with its tags: the slope in the middle of the ground."""
    level = level_of(a)
    return bridge.slope_mesh(
        comm, a.height, a.angle, level, a.cell_size, "fitted", runout=level, depth=(a.depth - 1) * a.height
    )


def equilibrium(a: Namespace, mesh: tuple) -> bridge.QuasiStatic:
    """Finite elements under the initial unit weight; raises InputError where the slope does not carry it."""
    body, _, facet_tags = bridge.soil_mesh(*mesh, tag=bridge.SOIL)
    supports = [bridge.roller(bridge.LEFT, (1, 0)), bridge.roller(bridge.RIGHT, (1, 0)), bridge.fixed(bridge.BASE)]
    fem = bridge.QuasiStatic(body, soil_of(a), facet_tags, supports, degree=1, solver=bridge.Solver(tolerance=1e-10))
    with without_warning(NOT_REACHED):  # said by the error
        fem.solve(bridge.Load(unit_weight=a.initial_unit_weight))
    if not fem.converged:
        raise mpm.InputError(f"--initial-unit-weight is {a.initial_unit_weight:g} N/m3, which the slope does not carry; lower it "
                             "or raise --cohesion")  # fmt: skip
    return fem


def model_of(a: Namespace, mesh: tuple, fem: bridge.QuasiStatic, resting: bool) -> mpm.Model:
    """The ground in equilibrium under the initial unit weight, of particles or at rest, under the full one from here on."""
    model = mpm.Model(bridge.background_mesh(*mesh), fem.laws[0])
    model.seed(density=a.unit_weight / GRAVITY, per_cell=a.particles_per_cell, cell_tag=bridge.SOIL)
    for side in (bridge.LEFT, bridge.RIGHT):
        model.roller(side, normal=(1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY * a.initial_unit_weight / a.unit_weight))
    bridge.initialise(model, fem, count_displacement=False, resting=resting)
    model.set_gravity((0.0, -GRAVITY))
    return model


# --- 3. The slide ----------------------------------------------------------------------------------------------------


def slide(a: Namespace, mesh: tuple, fem: bridge.QuasiStatic, resting: bool, folder: Path) -> dict:
    """Slide to the end; history, time and frames, and files for ParaView of the run with resting cells."""
    model = model_of(a, mesh, fem, resting)
    run = a.height / np.tan(np.radians(a.angle))
    level = level_of(a)
    places = {"crest": np.array([level, a.height]), "toe": np.array([level + run, 0.0])}
    reach = max(FOLLOWED * a.height, a.cell_size)  # the same soil on all meshes, whose results can then be compared
    followed = {
        name: numbers_in(model, cells_near(model, place, reach, [bridge.SOIL])) for name, place in places.items()
    }
    conversion = mpm.Conversion(plastic_strain=a.plastic_strain, displacement=a.displacement)
    output = ModelOutput(model, folder / "particles", folder / "mesh", FIELDS) if resting else nullcontext()
    rows, frames, seconds, started = [(0.0, 0.0, 0.0, 0.0)], [], 0.0, process_time()
    with output as files:
        # By mixed integration the two kinds of runs would differ by 3 % at the toe, see docs/coupling.md.
        options = {"damping": a.damping, "conversion": conversion, "integration": mpm.Integration.PARTICLES}
        for report in model.explicit(a.time, every=a.time / a.frames, **options):
            seconds += process_time() - started
            moved = [float(np.linalg.norm(mean_displacement(model, followed[name]))) for name in ("crest", "toe")]
            rows.append(
                (report.time, *moved, report.converted_cells / max(1, report.converted_cells + report.resting_cells))
            )
            if files is not None:
                files.write()
                frames.append(particle_frame(model, report.time))
            started = process_time()
    if comm.rank == 0:
        print(f"{KINDS['coupled' if resting else 'particles']}: crest {metres(rows[-1][1])}, toe {metres(rows[-1][2])}, "
              f"{seconds:.1f} s", file=sys.stderr, flush=True)  # fmt: skip
    p = model.particles
    corners = model.mesh.points[model.mesh.cells[p.cell]].reshape(-1, 6)
    frame = frame_of(
        model,
        report.time,
        {"position": p.position, "shear_strain": p.plastic_strain, "resting": p.is_resting, "corners": corners},
    )
    return {
        "history": np.array(rows),
        "seconds": seconds,
        "report": report,
        "frame": frame,
        "frames": frames,
        "scene": scene_of(model, [bridge.SOIL]),
    }


# --- 4. Pictures -----------------------------------------------------------------------------------------------------


def save_kinds(path: Path, run: dict) -> None:
    """Resting cells as triangles and particles as points, coloured by plastic shear strain."""
    frame, rest = run["frame"], run["frame"]["resting"].astype(bool)
    strain = frame["shear_strain"]
    norm = Normalize(0, max(1e-6, float(np.quantile(strain, 0.99))))
    with paper_style():
        every = frame["corners"].reshape(-1, 2)
        corners = every.reshape(-1, 3, 2)[rest]
        figure, axes, bar_axes = figure_with_bar(every.min(axis=0), every.max(axis=0))
        axes.add_collection(PolyCollection(corners, facecolor="#e9e2d8", edgecolor="#b8ab98", linewidth=0.25))
        x, y = frame["position"][~rest].T
        axes.scatter(x, y, c=strain[~rest], s=1.2, lw=0, norm=norm, cmap=SHEAR_STRAIN.colours)
        axes.set_title(f"$t$ = {frame['time']:.2f} s", loc="left", pad=4)
        draw_bar(figure, bar_axes, SHEAR_STRAIN, (norm.vmin, norm.vmax))
        save_figure(figure, path)


def drawn(runs: dict[str, dict], folder: Path) -> Pictures:
    """Crest and toe over time for both, the converted part of the cells, and both kinds of cells at the end."""
    time = runs["particles"]["history"][:, 0]
    curves = {f"{name}, {KINDS[kind]}": run["history"][:, column] for column, name in ((1, "crest"), (2, "toe"))
              for kind, run in runs.items()}  # fmt: skip
    highest = max(curve.max() for curve in curves.values())
    converted = 100 * runs["coupled"]["history"][:, 3]
    return {
        "displacement": lambda: save_history(folder / "displacement.png", time, curves, "Displacement [m]",
                                             limits=(0, 1.08 * highest), dashed=[n for n in curves if KINDS["coupled"] in n]),
        "converted": lambda: save_history(folder / "converted.png", time, {"cells that have turned into particles": converted},
                                          "Cells converted to particles [%]", limits=(0, max(1.0, 1.1 * converted.max()))),
        "cells": lambda: save_kinds(folder / "cells.png", runs["coupled"]),
    }  # fmt: skip


# --- 5. All together -------------------------------------------------------------------------------------------------


@without_warning(LOCKS)  # in both runs alike, and they are compared with each other
def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    folder = open_results(a, comm)
    mesh = ground(a)
    fem = equilibrium(a, mesh)
    runs = {kind: slide(a, mesh, fem, kind == "coupled", folder) for kind in KINDS}
    last = {kind: run["history"][-1] for kind, run in runs.items()}
    report = runs["coupled"]["report"]
    summary = {
        **{
            f"{place}_displacement_m_{kind}": last[kind][column]
            for column, place in ((1, "crest"), (2, "toe"))
            for kind in KINDS
        },
        "relative_difference_of_crest": abs(last["coupled"][1] / last["particles"][1] - 1),
        "relative_difference_of_toe": abs(last["coupled"][2] / last["particles"][2] - 1),
        "converted_fraction": last["coupled"][3],
        "soil_cells": report.resting_cells + report.converted_cells,
        **{f"slide_seconds_{kind}": run["seconds"] for kind, run in runs.items()},
        "ratio_of_seconds": runs["coupled"]["seconds"] / runs["particles"]["seconds"],
        "particle_steps": {kind: run["report"].particle_steps for kind, run in runs.items()},
    }  # fmt: skip
    captions = {
        "displacement": "Displacement of the soil at crest and toe", "converted": "Cells that have turned into particles",
        "cells": "Resting cells (triangles) and particles at the end",
    }  # fmt: skip
    movie = particle_movie(KINDS["coupled"], runs["coupled"]["scene"], runs["coupled"]["frames"])
    said = (
        f"crest {summary['relative_difference_of_crest']:.1%} and toe {summary['relative_difference_of_toe']:.1%} apart, in "
        f"{summary['ratio_of_seconds']:.0%} of the time; {summary['converted_fraction']:.0%} of the cells turned into particles"
    )
    return write_summary(folder, a, summary, comm, Page(movies=[movie], captions=captions), drawn(runs, folder), said)


if __name__ == "__main__":
    run_study(main)
