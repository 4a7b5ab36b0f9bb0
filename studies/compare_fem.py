"""Particles against FEM below collapse: the displacements of both at rest, for several unit weights and mesh sizes.

Particles are loaded by their weight, slowly and with damping, until they are at rest. Quadratic finite elements on the finest
mesh are the reference; the difference of the displacements decreases with the cell size of the particles. The soil is a
hundred times as stiff as in the study slope, so that strains are small, as the finite elements assume. With soft soil
(--young 200e3) a difference of some per cent remains: particles move with the deformed body, and those that cross into other
cells increase the settlement, less so if there are more of them (--particles-per-cell).
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common.checks import say
from common.field_plots import save_log_log, save_side_by_side
from common.figures import Pictures
from common.movie import fem_frame, particle_frame, particle_movie
from common.options import add_choice, add_count, add_number, study_parser
from common.page import Page
from common.plots import Quantity
from common.ranks import run_study
from common.results import open_results
from common.schemes import add_particles_per_cell
from common.slope.case import (
    GRAVITY,
    SUPPORTS,
    SlopeCase,
    add_geometry_options,
    add_soil_options,
    build_slope,
    check_slope_options,
    slope_options,
    soil_of,
)
from common.slope.fem import mesh_sizes, step_line, weight
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
UNIT_WEIGHTS = (5e3, 10e3, 15e3, 20e3)
"""[N/m3]"""
DISPLACEMENT = Quantity("Displacement", "mm", scale=1e3)
AT_REST = 1e-4
"""Out-of-balance over external force at which the particles are at rest."""
SLOWEST = 30.0
"""Crossings of a pressure wave by which the time to come to rest is measured where the weight rises faster: motion takes no less time to die away"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_geometry_options(p, "a twentieth")
    add_count(p, "--meshes", 3, "meshes, each twice as fine as the one before; the last has --cell-size")
    add_particles_per_cell(p, 10)
    add_soil_options(p, dilation_angle=None)
    add_choice(
        p,
        "--scheme",
        "explicit",
        ("explicit", "implicit"),
        "how particles come to rest: by damped motion, or by quasi-static steps",
    )
    add_number(p, "--damping", 0.75, "-", "local damping of the explicit scheme", at_least=0, below=1)
    add_number(p, "--ramp", 30.0, "-", "duration of the rise of the weight in the explicit scheme, in multiples of the time "
               "that a pressure wave takes to cross the height", above=0)  # fmt: skip
    p.set_defaults(young=20e6)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    if options.mesh is None and options.angle in (45, 90):
        options.mesh = "fitted"  # as "crossed", for any cell size
    check_slope_options(p, options, cells=20)
    return options


# --- 2. Both methods -------------------------------------------------------------------------------------------------


def finite_elements(a: Namespace) -> dict[float, bridge.QuasiStatic]:
    """The reference under each unit weight; those beyond collapse are left out."""
    background = bridge.slope_mesh(
        comm, height=a.height, angle=a.angle, crest=a.crest, cell_size=a.cell_size, kind=a.mesh, runout=a.cell_size
    )
    domain, _, facet_tags = bridge.soil_mesh(*background)
    solved = {}
    for unit_weight in UNIT_WEIGHTS:
        fem = bridge.QuasiStatic(domain, soil_of(a), facet_tags, SUPPORTS, degree=2)
        fem.solve(weight(unit_weight), progress=step_line(f"FEM, {unit_weight / 1e3:g} kN/m3"))
        if fem.converged:
            solved[unit_weight] = fem
    if not solved:
        raise mpm.InputError(
            f"the slope carries none of the unit weights {UNIT_WEIGHTS} N/m3; make it stronger or flatter"
        )
    return solved


def particles_at_rest(a: Namespace, cell_size: float, unit_weight: float) -> tuple[SlopeCase, mpm.Report]:
    """Particles of a slope whose weight has risen from nothing, at rest."""
    options = {
        **vars(slope_options([])),
        **vars(a),
        "cell_size": cell_size,
        "unit_weight": unit_weight,
        "runout_length": 4 * cell_size,
    }
    case = build_slope(Namespace(**options), comm)
    if a.scheme == "implicit":
        case.model.set_gravity(case.model.gravity, ramp=1.0)
        for _ in case.model.implicit(1.0, dt=0.1, quasi_static=True):
            pass
        return case, case.model.equilibrate()
    crossing = a.height / wave_speed(a, unit_weight)
    ramp, period = a.ramp * crossing, max(a.ramp, SLOWEST) * crossing
    case.model.set_gravity(case.model.gravity, ramp=ramp)
    for report in case.model.explicit(20 * period, every=0.25 * period, damping=a.damping):
        if report.time > ramp and report.unbalanced_ratio < AT_REST:
            break
    else:
        say(f"particles under {unit_weight:g} N/m3 on cells of {cell_size:g} m are not at rest after {report.time:.3g} s, but out of balance by "
            f"{report.unbalanced_ratio:.1e} of their weight, expected less than {AT_REST:g}: what differs from the finite elements is their motion too")  # fmt: skip
    return case, report


def wave_speed(a: Namespace, unit_weight: float) -> float:
    """Speed of pressure waves in the elastic soil [m/s]."""
    modulus = a.young * (1 - a.poisson) / ((1 + a.poisson) * (1 - 2 * a.poisson))
    return float(np.sqrt(modulus * GRAVITY / unit_weight))


def compared(a: Namespace, fem: bridge.QuasiStatic, cell_size: float, unit_weight: float) -> tuple[dict, SlopeCase]:
    """Numbers of one comparison, and the particles."""
    case, report = particles_at_rest(a, cell_size, unit_weight)
    difference = bridge.compare(fem, case.model)
    crest_id = case.crest_particle()
    row = np.flatnonzero(case.model.particles.id == crest_id)
    moved, off = case.model.particles.displacement[row].sum(axis=0), difference["displacement"].here[row].sum(axis=0)
    moved, off = comm.allreduce(moved), comm.allreduce(off)
    reference = float(np.linalg.norm(moved - off))
    return {
        "unit_weight": unit_weight,
        "cell_size_m": cell_size,
        "displacement_difference_l2": difference["displacement"].l2,
        "displacement_difference_maximum": difference["displacement"].maximum,
        "stress_difference_l2": difference["stress"].l2,
        "crest_displacement_fem_m": reference,
        "crest_displacement_mpm_m": float(np.linalg.norm(moved)),
        "crest_displacement_difference": float(np.linalg.norm(off)) / reference,
        "out_of_balance_ratio": report.unbalanced_ratio,
        "time_s": report.time,
    }, case


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def field_pictures(case: SlopeCase, fem: bridge.QuasiStatic, unit_weight: float, folder: Path) -> Pictures:
    """FEM, particles and their difference side by side. Collective."""
    scene, p = case.scene(), case.model.particles
    here = bridge.compare(fem, case.model)["displacement"].here
    fields = {"finite elements": p.displacement - here, "particles": p.displacement, "difference": here}
    values = {name: np.linalg.norm(field, axis=1) for name, field in fields.items()}
    parts = comm.gather((p.initial_position, p.volume, values))
    if parts is None:
        return {}
    position, volume = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    panels = {name: np.concatenate([part[2][name] for part in parts]) for name in values}
    name, title = (
        f"side_by_side_{unit_weight / 1e3:g}kN",
        f"{unit_weight / 1e3:g} kN/m$^3$, cells of {case.args.cell_size:g} m",
    )
    return {
        name: partial(save_side_by_side, folder / f"{name}.png", scene, position, volume, panels, DISPLACEMENT, title,
                      own=("difference",))  # fmt: skip
    }


def frames_of(case: SlopeCase, fem: bridge.QuasiStatic, unit_weight: float) -> tuple[dict | None, dict | None]:
    """Finite elements and particles for the page, under one unit weight. Collective."""
    return fem_frame(case.model, fem, unit_weight / 1e3), particle_frame(case.model, unit_weight / 1e3)


def convergence_pictures(rows: list[dict], sizes: list[float], folder: Path) -> Pictures:
    """Differences over the mesh size, in logarithmic axes."""
    pictures = {}
    for key, label, name in (
        ()
        if len(sizes) < 2
        else (
            ("displacement_difference_l2", "Difference in displacement, relative $L_2$ norm [-]", "convergence"),
            (
                "crest_displacement_difference",
                "Difference in displacement at the crest, relative [-]",
                "convergence_crest",
            ),
        )
    ):
        curves = {}
        for row in rows:
            curves.setdefault(f"{row['unit_weight'] / 1e3:g} kN/m$^3$", []).append(row[key])
        pictures[name] = partial(save_log_log, folder / f"{name}.png", sizes, curves, label)
    return pictures


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    start = perf_counter()
    folder = open_results(a, comm)
    sizes = mesh_sizes(a)
    fems = finite_elements(a)
    rows, frames, pictures = [], [], {}
    for unit_weight, fem in fems.items():
        for size in sizes:
            row, case = compared(a, fem, size, unit_weight)
            rows.append(row)
            if comm.rank == 0:
                print(line(row), flush=True)
        pictures |= field_pictures(case, fem, unit_weight, folder)
        frames.append(frames_of(case, fem, unit_weight))
    pictures |= convergence_pictures(rows, sizes, folder)
    finest = {f"{row['unit_weight']:g}": row for row in rows if row["cell_size_m"] == sizes[-1]}
    summary = {
        "scheme": a.scheme,
        "beyond_collapse_unit_weights": [unit_weight for unit_weight in UNIT_WEIGHTS if unit_weight not in fems],
        "crest_displacement_difference_on_finest_mesh": {
            key: row["crest_displacement_difference"] for key, row in finest.items()
        },
        "displacement_difference_l2_on_finest_mesh": {
            key: row["displacement_difference_l2"] for key, row in finest.items()
        },
        "comparisons": rows,
        "wall_seconds": perf_counter() - start,
    }
    scene = case.scene() if frames else None
    movies = [particle_movie(name, scene, shown) for name, shown in zip(("FEM", "MPM"), zip(*frames))]
    page = Page(movies=movies, slider=("unit weight", "kN/m\u00b3"))
    return write_summary(folder, a, summary, comm, page, pictures, said="")


def line(row: dict) -> str:
    """A comparison as it is printed."""
    return (
        f"{row['unit_weight'] / 1e3:4g} kN/m3, cells of {row['cell_size_m']:<6g} m: displacement differs by "
        f"{row['displacement_difference_l2']:.2%} (L2), {row['displacement_difference_maximum']:.2%} (largest), at the crest "
        f"{row['crest_displacement_difference']:.2%}; stress {row['stress_difference_l2']:.1%}; out of balance "
        f"{row['out_of_balance_ratio']:.0e}"
    )


if __name__ == "__main__":
    run_study(main)
