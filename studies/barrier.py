"""A granular flow or a debris flow hits a wall: force on the wall over time, against the balance of momentum.

A layer of sand slides down a plane, whose inclination keeps its velocity constant, and is stopped by a wall at right angles
to the plane. A bore travels back from the wall. The force that follows from the balance of mass and momentum depends on the
pressure within the sand: it lies between that of a fluid of the same density and that of sand under Rankine's passive
pressure. Coordinates are parallel and normal to the plane.

With `--pressure-ratio` the sand is saturated, and water carries a part of its weight, as in a debris flow. Soil and water then have
separate velocities, the plane has friction by the effective stress, and the bore in sand has Rankine's pressure of this
part only (Iverson and Denlinger 2001, Flow of variably fluidized granular masses, J. Geophys. Res. 106).
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common import body_runs
from common.body_runs import BodyRun, follow, mean_force
from common.checkpoint import check_restart
from common.checks import check_cells, check_effect, check_whole, say
from common.figures import Pictures, curve_figure
from common.front import front
from common.history import History
from common.movie import QUANTITIES, WET_QUANTITIES, particle_movie
from common.options import add_number, check, study_parser
from common.plots import CURVES, WATER_PRESSURE, Scene, save_particles
from common.ranks import run_study
from common.results import open_results
from common.runout.impact import bore
from common.scenes import scene_of
from mpi4py import MPI
from mpm_core.input_warnings import in_radians

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
GRAVITY, WATER, GRAINS = 9.81, 1000.0, 2650.0  # m/s2, kg/m3, kg/m3
PIC = 0.0005
"""PIC fraction of saturated flows, whose critical steps are shorter"""
COLUMNS = [
    "time_s",
    "force_factor",
    "impulse_Ns",
    "run_up_m",
    "kinetic_energy_J_per_m",
    "unexplained_fraction_of_energy",
    "dt_s",
]
THROWN = 0.02
"""Part of the sand beside the wall that may be thrown higher than the run-up: single particles rise to the top of the mesh"""
FULL = 0.5
"""Part of the time in which sand rises at the wall, thrown up with the velocity of the flow, until the bore is taken as formed"""

AVERAGED = 2.0
"""Least time over which the force is averaged, in multiples of depth over velocity: sand with a steep front bounces off the wall, and is
back after some 1.7"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--depth", 0.5, "m", "depth of the flow", above=0)
    add_number(p, "--length", None, "-", "ratio of the flow's length to its depth, rounded to whole cells (default: so long that its end is "
               "not felt at the wall)", at_least=4)  # fmt: skip
    add_number(
        p, "--froude", 2.0, "-", "Froude number, the ratio of the flow's velocity to that of shallow waves", at_least=1
    )
    add_number(p, "--slope", 20.0, "degrees", "inclination of the plane", at_least=0, below=45)
    add_number(p, "--base-friction-angle", None, "degrees", "friction angle of the plane (default: that under which "
               "the flow keeps its velocity)", at_least=0, below=80)  # fmt: skip
    add_number(p, "--wall-friction-angle", 0.0, "degrees", "friction angle of the wall", at_least=0, below=60)
    add_number(p, "--front-angle", 25.0, "degrees", "inclination of the front to the plane", above=5, at_most=90)
    add_number(p, "--friction-angle", 30.0, "degrees", "friction angle of the sand", above=0, below=50)
    add_number(p, "--young", 5e6, "Pa", "Young's modulus of the sand", above=0)
    add_number(p, "--density", None, "kg/m3", "density of the sand (default: 1600 dry; saturated, that of grains of 2650 and water)",
               above=0)  # fmt: skip
    add_number(p, "--pressure-ratio", 0.0, "-", "ratio of the pore pressure to the total stress normal to the plane, at the start; "
               "above 0 in saturated sand", at_least=0, below=1)  # fmt: skip
    add_number(p, "--conductivity", 1e-5, "m/s", "saturated sand: hydraulic conductivity", above=0)
    add_number(p, "--porosity", 0.45, "-", "saturated sand: porosity", above=0, below=1)
    add_number(p, "--water-modulus", 2e7, "Pa", "saturated sand: bulk modulus of the water", above=0)
    add_number(p, "--duration", None, "-", "duration of the run, in multiples of depth/velocity (default: twice the square of the Froude number, "
               "in which sand rises at the wall and falls back, 8 at least)", above=0)  # fmt: skip
    add_number(
        p,
        "--cell-size",
        0.125,
        "-",
        "ratio of the side of the squares (two triangles each) to the depth of the flow, 1 over a whole number",
        above=0,
        at_most=0.5,
    )
    body_runs.add_body_run_options(p, damping=0.0, pic=0.05, nmd=True, integration="particles", frames=48)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    say(in_radians("--wall-friction-angle", a.wall_friction_angle))
    say(in_radians("--base-friction-angle", a.base_friction_angle or 0.0))
    if a.duration is None:
        a.duration = max(8.0, 2 * rise(a))
    if a.length is None:
        a.length = float(np.ceil(a.duration * length_of_passage(a)))
    wet = a.pressure_ratio > 0
    check_effect(p, a, wet, ("--conductivity", "--porosity", "--water-modulus"), "--pressure-ratio above 0")
    if a.density is None:
        a.density = (1 - a.porosity) * GRAINS + a.porosity * WATER if wet else 1600.0
    check(p, not wet or a.density > a.porosity * WATER,
          lambda: f"--density is {a.density:g} kg/m3, expected that of saturated sand, above that of the water in it, "
          f"{a.porosity * WATER:g} kg/m3")  # fmt: skip
    if wet and a.pic == p.get_default("pic"):
        a.pic = PIC
    if a.base_friction_angle is None:
        a.base_friction_angle = float(np.degrees(np.arctan(np.tan(np.radians(a.slope)) / (1 - a.pressure_ratio))))
        check(p, a.base_friction_angle < 80,
              lambda: f"--slope is {a.slope:g} degrees, expected a gentler one, on which sand slides steadily with --pressure-ratio "
              f"{a.pressure_ratio:g}, or --base-friction-angle")  # fmt: skip
        say(f"--friction-angle is {a.friction_angle:g} degrees, less than the {a.base_friction_angle:.3g} degrees at which the flow would keep "
            "its velocity on the plane: the sand shears and the flow accelerates" * (a.base_friction_angle > a.friction_angle))  # fmt: skip
    check(p, a.length > 2 / np.tan(np.radians(a.front_angle)),
          lambda: f"--length is {a.length:g}, expected more than twice the front's, "
          f"{1 / np.tan(np.radians(a.front_angle)):.3g}")  # fmt: skip
    least = formed(a) + AVERAGED
    say(f"--length is {a.length:g}, so that the end of the flow is felt before its bore has formed at the wall and pushed for some time: take "
        f"{least * length_of_passage(a):.3g} or more" * (end_felt(a) < least))  # fmt: skip
    say(f"--duration is {a.duration:g}, so that the run ends before the bore has formed at the wall and pushed for some time: take {least:.3g} "
        "or more" * (a.duration < least))  # fmt: skip
    check_whole(p, 1 / a.cell_size, f"--cell-size is {a.cell_size:g}, expected 1 over a whole number, such as 0.125")
    check_cells(p, a, 6 * a.length * (1 + a.froude) / a.cell_size**2, "--cell-size", "--length", "--froude")
    check_restart(p, a, body_runs.MAY_CHANGE)
    return a


# --- 2. Flow and wall ------------------------------------------------------------------------------------------------


def gravity_of(a: Namespace) -> tuple[float, float]:
    """Along the plane, and towards it [m/s2]."""
    slope = np.radians(a.slope)
    return float(GRAVITY * np.sin(slope)), float(GRAVITY * np.cos(slope))


def velocity(a: Namespace) -> float:
    """Velocity of the flow [m/s]."""
    return float(a.froude * np.sqrt(gravity_of(a)[1] * a.depth))


def passage(a: Namespace) -> float:
    """Depth over velocity [s]."""
    return float(a.depth / velocity(a))


def rise(a: Namespace) -> float:
    """Time in which sand rises that is thrown up with the velocity of the flow, u / g, in multiples of depth over velocity [-]."""
    return float(a.froude**2)


def formed(a: Namespace) -> float:
    """Time from which the bore is taken as formed, in multiples of depth over velocity [-]."""
    return float(FULL * rise(a) + 1 / np.tan(np.radians(a.front_angle)))


def length_of_passage(a: Namespace) -> float:
    """Length over depth of the flow that comes to the bore while it moves by its depth, and of that which feels that it ends [-].

    The flow has the velocity u. Its end spreads forwards with that of shallow waves in a fluid, which those of sand do not exceed, and
    the bore goes back with u / (x - 1) at most, x being the depth behind the bore in sand.
    """
    (_, (depth, _)) = bores(a)
    return float(1 + 1 / a.froude + 1 / (depth - 1))


def end_felt(a: Namespace) -> float:
    """Time at which the end of the flow is felt at its bore, at the earliest, in multiples of depth over velocity [-]."""
    return float(a.length / length_of_passage(a))


def unit_force(a: Namespace) -> float:
    """rho g h^2 [N/m]."""
    return float(a.density * gravity_of(a)[1] * a.depth**2)


def at_rest(a: Namespace) -> float:
    """Effective stress on planes at right angles to the base over that on the base, in the flow [-]."""
    return float(1 - np.sin(np.radians(a.friction_angle)))


def with_water(a: Namespace, ratio: float) -> float:
    """Ratio of total stresses, of that of effective stresses."""
    return (1 - a.pressure_ratio) * ratio + a.pressure_ratio


def bores(a: Namespace) -> tuple[tuple[float, float], tuple[float, float]]:
    """Depth and force behind a bore in a fluid, and in sand under passive pressure; over those of the flow."""
    passive = np.tan(np.radians(45 + a.friction_angle / 2)) ** 2
    return bore(a.froude, 1.0, 1.0), bore(a.froude, with_water(a, float(passive)), with_water(a, at_rest(a)))


def build(a: Namespace) -> mpm.Model:
    """The flow, its front at the wall. Collective."""
    h, cell = a.depth, a.cell_size * a.depth
    flow, high = round(a.length * h / cell), round(3 * (1 + a.froude) * h / cell)
    counts = [flow + 2, high + 1]  # the plane and the back lie a cell inside of the mesh
    end = cell * (flow + 1)
    mesh = bridge.box_mesh(comm, np.array(counts) * cell, counts, body=((cell, cell), (end, cell + h)))
    sand = mpm.MohrCoulomb(
        young=a.young, poisson=0.3, cohesion=0.0, friction_angle=a.friction_angle, dilation_angle=0.0
    )
    model = mpm.Model(bridge.background_mesh(*mesh), sand)
    model.outflow((2, 4))  # what splashes over the wall
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=a.density, per_cell=a.particles_per_cell, cell_tag=bridge.BODY)
    x = model.particles.position
    model.remove(x[:, 1] - cell > (end - x[:, 0]) * np.tan(np.radians(a.front_angle)))
    along, down = gravity_of(a)
    model.set_gravity((along, -down))
    particles = model.particles
    weight = np.maximum(a.density * down * (cell + h - particles.position[:, 1]), 0.0)
    effective = -(1 - a.pressure_ratio) * weight[:, None]
    particles.set("stress", effective * [at_rest(a), 1.0, at_rest(a), 0.0])
    if a.pressure_ratio > 0:
        model.add_water(porosity=a.porosity, conductivity=a.conductivity, modulus=a.water_modulus, kozeny_carman=True,
                        suction_limit=0.0)  # fmt: skip
        model.set_pore_pressure(lambda x: a.pressure_ratio * a.density * down * np.maximum(cell + h - x[:, 1], 0.0))
    particles.set("velocity", np.tile([velocity(a), 0.0], (len(particles), 1)))
    # Particles are larger than their distance from the sides of cells.
    foot = cell + model.gap(mpm.Plane((0.0, cell), (0.0, 1.0))) - 1e-9 * h
    face = end - model.gap(mpm.Plane((end, 0.0), (-1.0, 0.0))) + 1e-9 * h
    on_wall, on_plane = np.tan(np.radians([a.wall_friction_angle, a.base_friction_angle]))
    top = counts[1] * cell
    model.add_contact(mpm.Box((face, -cell), (face + 0.3 * h, 0.8 * top)), friction=on_wall)
    model.add_contact(mpm.Plane((0.0, foot), (0.0, 1.0)), friction=on_plane)
    model.rebalance()
    return model


def run_up(a: Namespace, wall: mpm.RigidContact) -> float:
    """Height above the plane of what rises at the wall [m]: of all but a part of the sand beside it. Collective."""
    p, face = wall.model.particles, wall.outline()[0][:, 0].min()
    beside = p.position[:, 0] > face - 0.5 * a.depth
    if comm.allreduce(int(beside.sum())) == 0:
        return 0.0
    return max(front(p.position[beside, 1], p.mass[beside], THROWN) - a.cell_size * a.depth, 0.0)


def row(a: Namespace, wall: mpm.RigidContact, history: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    return {
        "time_s": report.time, "force_factor": mean_force(history, wall, report.time, 0) / unit_force(a),
        "impulse_Ns": wall.impulse[0], "run_up_m": run_up(a, wall),
        "kinetic_energy_J_per_m": report.kinetic_energy, "unexplained_fraction_of_energy": report.unexplained_fraction,
        "dt_s": report.dt,
    }  # fmt: skip


def full_force(a: Namespace, history: History) -> float | None:
    """Mean force over rho g h^2 since the bore has formed, until the end of the flow is felt; None where that is less than `AVERAGED`."""
    time = history["time_s"] / passage(a)
    begin, end = formed(a), min(end_felt(a), time[-1])
    if end - begin < AVERAGED * (1 - 1e-9):
        return None
    return float(history["force_factor"][(time >= begin) & (time <= end)].mean())


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw_force(path: Path, a: Namespace, history: History) -> None:
    """The force over time, with those of the two bores."""
    with curve_figure(path) as axes:
        axes.plot(history["time_s"], 1e-3 * unit_force(a) * history["force_factor"], color=CURVES[0], label="computed")
        for (_, force), name, style in zip(
            bores(a), ("bore in a fluid", "bore in sand, passive"), (":", "--"), strict=True
        ):
            axes.axhline(1e-3 * unit_force(a) * force, color="black", linewidth=0.9, linestyle=style, label=name)
        axes.set(xlabel="Time [s]", ylabel="Force on the wall [kN/m]", xlim=(0, None), ylim=(0, None))
        axes.legend(loc="lower right")


def flow_scene(a: Namespace, model: mpm.Model) -> Scene | None:
    """The mesh for pictures, with the flow at the start, whose front is inclined and cuts cells. Collective."""
    scene = scene_of(model, [bridge.BODY])
    if scene is not None:
        lower, upper = scene.initial_outline.min(axis=(0, 1)), scene.initial_outline.max(axis=(0, 1))
        crest = upper - (a.depth / np.tan(np.radians(a.front_angle)), 0.0)
        corners = np.array([lower, (upper[0], lower[1]), crest, (lower[0], upper[1])])
        scene.initial_outline = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    return scene


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """The force, sand and wall in the end, and a film."""
    title = f"$t$ = {result.history['time_s'][-1]:.2f} s"
    labels = "along the plane [m]", "normal to the plane [m]"
    pictures = body_runs.body_pictures(a, scene, result, folder, title, labels=labels)
    if scene is None or not pictures:
        return {}
    if a.pressure_ratio > 0:
        last = result.frames[-1]
        pictures["pore_pressure"] = partial(
            save_particles, folder / "pore_pressure.png", scene, last["position"], last["volume"], last["pore_pressure"],
            WATER_PRESSURE, title=title, bodies=last.get("bodies"), labels=labels,
        )  # fmt: skip
    return {"force": lambda: draw_force(folder / "force.png", a, result.history), **pictures}


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    model = build(a)
    wall = model.contacts[0]
    result = follow(a, model, a.duration * passage(a), COLUMNS, partial(row, a, wall), folder, shown="force_factor")
    history, scene = result.history, flow_scene(a, model)
    (_, fluid), (_, passive) = bores(a)
    force = full_force(a, history)
    results = {
        "force_N_per_m": None if force is None else force * unit_force(a),
        "force_of_bore_in_fluid_N_per_m": fluid * unit_force(a), "force_of_bore_in_sand_N_per_m": passive * unit_force(a),
        "largest_force_N_per_m": float(history["force_factor"].max()) * unit_force(a), "velocity_m_per_s": velocity(a),
        "largest_run_up_m": float(history["run_up_m"].max()), "outflow_mass_kg": model.report().outflow_mass,
    }  # fmt: skip
    shown = (
        "not known without a bore that has formed and pushed for some time"
        if force is None
        else f"{1e-3 * force * unit_force(a):.2f} kN/m"
    )
    said = (
        f"force of the flow: {shown}; of a bore in a fluid {1e-3 * fluid * unit_force(a):.2f}, in sand under passive pressure "
        f"{1e-3 * passive * unit_force(a):.2f} kN/m"
    )
    return body_runs.write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie("flow and wall", scene, result.frames, QUANTITIES | (WET_QUANTITIES if a.pressure_ratio > 0 else {}))],
        captions={"force": "Force on the wall", "pore_pressure": "Pore pressure in the end"},
        pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
