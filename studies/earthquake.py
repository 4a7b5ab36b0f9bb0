"""A slope in an earthquake: from equilibrium by finite elements to the permanent displacement, against Newmark's block.

The slope lies on a stiffer layer over rock. Finite elements give its elasto-plastic equilibrium. In the earthquake the motion
of a rock outcrop enters through the base, which absorbs outgoing waves; free fields are coupled to the sides; resting cells
turn into particles where the soil fails. The displacement of the slope is compared with those of Newmark's sliding block
under the motion of the free field at the levels of toe and crest, and the amplification of a linear column of the ground with
the closed form of layers over a half-space.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path

import numpy as np
from common.animation import save_animation
from common.checks import check_cells, check_two_cells, check_whole, say
from common.earthquake.motions import STEP, accelerations, ricker
from common.earthquake.newmark import sliding_block, yield_acceleration
from common.earthquake.options import add_motion_options, check_motion
from common.earthquake.plots import save_amplification, save_ground, save_motions, save_record
from common.earthquake.response import amplification, spectral_ratio
from common.earthquake.site import (
    FIELDS,
    STIFF,
    band_of,
    column_layers,
    conversion_of,
    damping_of,
    first_frequency,
    laws_of,
    linear_column,
    model_in_equilibrium,
    outcrop_motion,
    rock_impedances,
    too_coarse,
    wave_speeds,
)
from common.figures import Pictures
from common.followed import FollowedNodes, cells_near, mean_displacement, numbers_in
from common.history import History
from common.lengths import metres
from common.movie import gathered, own_frame, particle_movie
from common.options import add_count, add_number, check, study_parser
from common.output_options import add_picture_options
from common.page import Page
from common.plots import DISPLACEMENT, SHEAR_STRAIN
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.scenes import scene_of
from common.schemes import add_particles_per_cell
from common.site.laws import unit_doubt
from common.slope.case import GRAVITY, add_soil_options
from common.summary import write_summary
from mpi4py import MPI
from mpm_core.output import ModelOutput

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
AT_REST = 1e-3
"""Part of the largest velocity with which a column is at rest: the spectrum of one that still vibrates lacks what follows"""
LEAST_SWING = 1e-3
"""Motion to and fro [m] up to which a slope counts as at rest"""
COLUMNS = [
    "time_s", "crest_velocity_m_per_s", "crest_level_velocity_m_per_s", "toe_level_velocity_m_per_s",
    "foot_velocity_m_per_s", "slope_displacement_m", "free_field_displacement_m",
]  # fmt: skip
"""Horizontal; crest, free fields at the levels of crest and toe, and the free field behind the crest at the toe's level"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--height", 10.0, "m", "height of the slope", above=0)
    add_number(p, "--angle", 35.0, "degrees", "inclination of the slope", above=11, at_most=78)
    add_number(p, "--level", 40.0, "m", "length of the level ground on each side of the slope", above=0)
    add_number(p, "--soil-depth", 5.0, "m", "depth below the toe at which the stiffer layer begins", above=0)
    add_number(p, "--stiff-depth", 10.0, "m", "thickness of the stiffer layer", above=0)
    add_number(p, "--cell-size", 1.0, "m", "side of the squares", above=0)
    add_particles_per_cell(p, 10)
    add_number(p, "--unit-weight", 19e3, "N/m3", "unit weight of the soil and of the stiffer layer", above=0)
    add_soil_options(p, dilation_angle=0.0)
    p.set_defaults(young=200e6, poisson=0.3, cohesion=25e3, friction_angle=20.0)
    add_number(p, "--stiff-young", 800e6, "Pa", "Young's modulus of the stiffer layer, which stays elastic", above=0)
    add_motion_options(p)
    add_count(p, "--frames", 40, "times at which particles are drawn")
    add_picture_options(p)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    check(
        p,
        0 < a.friction_angle,
        lambda: "--friction-angle is 0, expected an angle above 0 for the slip line of Newmark's block",
    )
    check(p, a.dilation_angle <= a.friction_angle,
          lambda: f"--dilation-angle is {a.dilation_angle:g}, expected at most --friction-angle, "
                  f"{a.friction_angle:g} degrees")  # fmt: skip
    check_two_cells(p, a, ("height", "soil_depth", "stiff_depth"))
    for name in ("height", "soil_depth", "stiff_depth"):
        check_whole(p, getattr(a, name) / a.cell_size, lambda name=name: f"--cell-size is {a.cell_size:g} m, expected "
                    f"--{name.replace('_', '-')}, {getattr(a, name):g} m, over a whole number")  # fmt: skip
    depth = a.height + a.soil_depth + a.stiff_depth
    length = 2 * a.level + a.height / np.tan(np.radians(a.angle))
    check_cells(
        p,
        a,
        4 * length * depth / a.cell_size**2,
        "--cell-size",
        "--height",
        "--level",
        "--soil-depth",
        "--stiff-depth",
    )
    check_motion(p, a)
    say(unit_doubt(vars(a), "the soil"))
    say(too_coarse(a, min(wave_speeds(a))))
    return a


# --- 2. The earthquake -----------------------------------------------------------------------------------------------


def shaken(a: Namespace, model: mpm.Model, motion: mpm.Motion, folder: Path) -> tuple[History, list, mpm.Report]:
    """Run to the end; history, frames and the last report."""
    until = float(motion.time[-1]) + a.rest
    right = a.level + a.height / np.tan(np.radians(a.angle))
    width = model.comm.allreduce(float(model.mesh.points[:, 0].max()), MPI.MAX)
    nodes = FollowedNodes(model, np.array([(a.level, a.height), (0, a.height), (width, 0), (0, 0)]))
    middle = 0.5 * (a.level + right), 0.5 * a.height
    slope = numbers_in(model, cells_near(model, np.array(middle), 0.4 * a.height, [bridge.SOIL]))
    level = numbers_in(model, cells_near(model, np.array((0.0, 0.0)), 1.5 * a.cell_size, [bridge.SOIL]))
    frames, samples = [frame_at(model, 0.0)], max(a.frames, round(until / (2 * STEP)))
    run = model.explicit(
        until, every=until / samples, rayleigh=damping_of(a), nmd=True, conversion=conversion_of(a, model, motion)
    )
    with (
        History(folder / "history.csv", COLUMNS, comm) as history,
        Progress("earthquake", until, comm) as progress,
        ModelOutput(model, folder / "particles", folder / "mesh", FIELDS) as files,
    ):
        files.write()
        history.add(**dict.fromkeys(COLUMNS, 0.0))
        for k, report in enumerate(run, 1):
            velocity = nodes.velocity()[:, 0]
            moved = [mean_displacement(model, numbers)[0] for numbers in (slope, level)]
            history.add(**dict(zip(COLUMNS, (report.time, *velocity, *moved))))
            if k * a.frames // samples > (k - 1) * a.frames // samples:
                frames.append(frame_at(model, report.time))
                files.write()
            progress.show(report.time, report.steps, displacement=metres(moved[0] - moved[1]))
    return history, frames, report


def frame_at(model: mpm.Model, time: float) -> dict | None:
    """Gather all rows to the first rank, None on the others; resting cells are at their present places. Collective."""
    p = model.particles
    frame = own_frame(model, time, averaged=True)
    frame["position"] = np.where(p.is_resting[:, None], p.position + p.displacement, p.position).astype(np.float32)
    corners = model.mesh.points[model.mesh.cells[p.cell]].reshape(-1, 6).astype(np.float32)
    return gathered(model.comm, {**frame, "resting": p.is_resting.astype(np.float32), "corners": corners})


def yield_of(a: Namespace) -> float:
    """Yield acceleration of the slope [m/s2].

    Raises:
        InputError: the slope does not stand without an earthquake.
    """
    strength = bridge.davis_strength(laws_of(a)[bridge.SOIL])
    begins = yield_acceleration(
        a.height, a.angle, strength.cohesion, strength.friction_angle, a.unit_weight, GRAVITY, a.soil_depth
    )
    if begins <= 0:
        raise mpm.InputError(
            f"--cohesion is {a.cohesion:g} Pa and --friction-angle {a.friction_angle:g} degrees, of which limit analysis finds a factor "
            f"of safety of {static_safety(a):.2f} without an earthquake; expected a slope that is stable then"
        )
    return begins


def newmark(begins: float, history: History) -> dict[str, np.ndarray]:
    """Slips over time [m] of blocks that move with the free field behind the crest.

    At the toe's level that is the ground below the slip, for a mass that moves as one; at the crest's level it has the
    amplification of soil as high as the slope.

    Args:
        begins: yield acceleration of the slope [m/s2].
    """
    motions = {"toe": "foot_velocity_m_per_s", "crest": "crest_level_velocity_m_per_s"}
    return {level: sliding_block(history["time_s"], history[column], begins)[1] for level, column in motions.items()}


def static_safety(a: Namespace) -> float:
    """Factor of safety without an earthquake, by spirals that reach no deeper than the stiffer layer, which stays elastic."""
    soil = bridge.davis_strength(laws_of(a)[bridge.SOIL])
    return bridge.log_spiral_safety(
        a.height, a.angle, soil.cohesion, soil.friction_angle, a.unit_weight, depth=a.soil_depth
    )


# --- 3. What comes out -----------------------------------------------------------------------------------------------


def amplified(a: Namespace, motion: mpm.Motion, history: History) -> tuple[tuple, dict[str, tuple]]:
    """Ratios of spectra to the outcrop: closed form, linear column, and free field and crest as they yielded."""
    band, density = band_of(a), a.unit_weight / GRAVITY
    layers = [(thickness, density * speed**2, density) for thickness, speed in zip(column_layers(a), wave_speeds(a))]

    def ratio(time, velocity, outcrop, smoothing):
        outcrop = np.interp(time, outcrop.time, outcrop.velocity, left=0, right=0)
        return spectral_ratio(time, velocity, outcrop, band, smoothing)

    wavelet = mpm.motion_of_acceleration(*ricker(band[1], 0.1, 3.0 / band[0], STEP / 5))  # energy at all frequencies
    time, velocity = linear_column(a, wavelet, 5.0 / band[0], AT_REST)
    frequency, linear = ratio(time, velocity, wavelet, 0.0)
    exact = abs(amplification(frequency, layers, rock_impedances(a)[1], damping_of(a)))
    time = history["time_s"]
    return (frequency, exact), {
        "linear column of resting cells": (frequency, linear),
        "free field at the crest's level": ratio(time, history["crest_level_velocity_m_per_s"], motion, 0.5),
        "crest": ratio(time, history["crest_velocity_m_per_s"], motion, 0.5),
    }


def drawn(a: Namespace, folder: Path, record: tuple, history: History, slips: dict, ratios: tuple, frames: list,
          scene: object) -> Pictures:  # fmt: skip
    """Draw all pictures and the film, on the first rank."""
    if scene is None:
        return {}
    time, last = history["time_s"], frames[-1]
    shaking = {
        name: accelerations(time, history[column])
        for name, column in (
            ("crest", "crest_velocity_m_per_s"),
            ("free field at its level", "crest_level_velocity_m_per_s"),
        )
    }
    displacements = {
        "slope, relative to the free field": (time, slope_slip(history)),
        **{f"Newmark's block, motion at the {level}'s level": (time, slip) for level, slip in slips.items()},
    }
    pictures = {
        "record": partial(save_record, folder / "record.png", record[0], record[1], record[2].velocity),
        "motions": partial(save_motions, folder / "motions.png", shaking, displacements),
        "amplification": partial(save_amplification, folder / "amplification.png", *ratios),
        "displacement": partial(save_ground, folder / "displacement.png", last, "displacement", DISPLACEMENT),
        "shear_strain": partial(save_ground, folder / "shear_strain.png", last, "shear_strain", SHEAR_STRAIN),
    }  # fmt: skip
    if a.film:
        pictures["earthquake"] = partial(
            save_animation, folder / "earthquake", scene, frames, "shear_strain", SHEAR_STRAIN
        )
    return pictures


def slope_slip(history: History) -> np.ndarray:
    """Displacement of the slope relative to the free field at the toe's level [m]."""
    return history["slope_displacement_m"] - history["free_field_displacement_m"]


def still_moving(a: Namespace, history: History) -> str:
    """The end of a line of results: by how much the slope moves to and fro in a last period of the soil, where that counts, or nothing."""
    slip, period = slope_slip(history), 1 / first_frequency(a)
    swing = float(np.ptp(slip[history["time_s"] >= history["time_s"][-1] - period]))
    if swing <= max(0.1 * abs(slip[-1]), LEAST_SWING):
        return ""
    return f"; the slope still moves, by {metres(swing)} in the last {period:.2g} s: raise --rest for the displacement that stays"


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begins, record = yield_of(a), outcrop_motion(a)
    folder = open_results(a, comm)
    model = model_in_equilibrium(a, record[2])
    history, frames, report = shaken(a, model, record[2], folder)
    slips = newmark(begins, history)
    exact, found = ratios = amplified(a, record[2], history)
    linear = found["linear column of resting cells"][1]
    summary = {
        "yield_acceleration_m_per_s2": begins,
        "factor_of_safety": static_safety(a),
        "slope_displacement_m": slope_slip(history)[-1],
        **{f"newmark_displacement_m_{level}": slip[-1] for level, slip in slips.items()},
        "largest_acceleration_of_outcrop_m_per_s2": np.abs(accelerations(record[2].time, record[2].velocity)[1]).max(),
        "largest_acceleration_of_crest_m_per_s2": np.abs(accelerations(history["time_s"], history["crest_velocity_m_per_s"])[1]).max(),
        "largest_amplification_in_closed_form": exact[1].max(),
        "largest_error_of_linear_amplification": np.abs(linear / exact[1] - 1).max(),
        "converted_fraction": report.converted_cells / (report.converted_cells + report.resting_cells),
        "unexplained_energy_fraction": report.unexplained_fraction,
        "steps": report.steps,
    }  # fmt: skip
    captions = {
        "record": "Motion of the outcrop, as recorded and after the baseline correction",
        "motions": "Accelerations at crest and free field, and displacement of the slope beside Newmark's block",
        "amplification": "Spectra at the surface over that of the outcrop",
        "displacement": "Displacement that stays", "shear_strain": "Plastic shear strain at the end",
    }  # fmt: skip
    scene = scene_of(model, [bridge.SOIL, STIFF])
    page = Page(movies=[particle_movie("slope", scene, frames)], captions=captions)
    pictures = drawn(a, folder, record, history, slips, ratios, frames, scene) if a.pictures else {}
    said = (
        f"slope displaced by {metres(summary['slope_displacement_m'])}, Newmark's blocks by {metres(slips['toe'][-1])} and "
        f"{metres(slips['crest'][-1])}; linear amplification within {summary['largest_error_of_linear_amplification']:.1%} of "
        "the closed form" + still_moving(a, history)
    )
    return write_summary(folder, a, summary, comm, page, pictures, said)


if __name__ == "__main__":
    run_study(main)
