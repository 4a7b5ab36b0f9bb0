"""A granular flow hits a wall: force on the wall over time, against the balance of momentum.

A layer of sand slides down a plane, whose inclination keeps its velocity constant, and is stopped by a wall at right angles
to the plane. A bore travels back from the wall. The force that follows from the balance of mass and momentum depends on the
pressure within the sand: it lies between that of a fluid of the same density and that of sand under Rankine's passive
pressure. Coordinates are parallel and normal to the plane.
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
from common.checks import check_cells, check_whole
from common.figures import Pictures, curve_figure
from common.flow_impact import bore
from common.history import History
from common.movie import particle_movie
from common.options import add_number, check, study_parser
from common.plots import CURVES, Scene
from common.ranks import run_study
from common.results import open_results
from common.scenes import scene_of
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
GRAVITY = 9.81
COLUMNS = [
    "time_s",
    "force_factor",
    "impulse_Ns",
    "run_up_m",
    "kinetic_energy_J_per_m",
    "unexplained_fraction_of_energy",
    "dt_s",
]
FULL = 2.0
"""Times of passage, depth over velocity, after the front has passed, until the bore is taken as formed"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--depth", 0.5, "m", "depth of the flow", above=0)
    add_number(p, "--length", 14.0, "-", "ratio of the flow's length to its depth, rounded to whole cells", at_least=4)
    add_number(
        p, "--froude", 2.0, "-", "Froude number, the ratio of the flow's velocity to that of shallow waves", at_least=1
    )
    add_number(p, "--slope", 20.0, "degrees", "inclination of the plane", at_least=0, below=45)
    add_number(p, "--base-friction-angle", None, "degrees", "friction angle of the plane (default: its inclination)", at_least=0,
               below=60)  # fmt: skip
    add_number(p, "--wall-friction-angle", 0.0, "degrees", "friction angle of the wall", at_least=0, below=60)
    add_number(p, "--front-angle", 25.0, "degrees", "inclination of the front to the plane", above=5, at_most=90)
    add_number(p, "--friction-angle", 30.0, "degrees", "friction angle of the sand", above=0, below=50)
    add_number(p, "--young", 5e6, "Pa", "Young's modulus of the sand", above=0)
    add_number(p, "--density", 1600.0, "kg/m3", "density of the sand", above=0)
    add_number(p, "--duration", 8.0, "-", "duration of the run, in multiples of depth/velocity", above=0)
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
    if a.base_friction_angle is None:
        a.base_friction_angle = a.slope
    check(p, a.length > 2 / np.tan(np.radians(a.front_angle)),
          lambda: f"--length is {a.length:g}, expected more than twice the front's, "
          f"{1 / np.tan(np.radians(a.front_angle)):.3g}")  # fmt: skip
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


def unit_force(a: Namespace) -> float:
    """rho g h^2 [N/m]."""
    return float(a.density * gravity_of(a)[1] * a.depth**2)


def at_rest(a: Namespace) -> float:
    """Pressure on planes at right angles to the base over that on the base, in the flow [-]."""
    return float(1 - np.sin(np.radians(a.friction_angle)))


def bores(a: Namespace) -> tuple[tuple[float, float], tuple[float, float]]:
    """Depth and force behind a bore in a fluid, and in sand under passive pressure; over those of the flow."""
    passive = np.tan(np.radians(45 + a.friction_angle / 2)) ** 2
    return bore(a.froude, 1.0, 1.0), bore(a.froude, float(passive), at_rest(a))


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
    model.outflow(4)
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=a.density, per_cell=a.particles_per_cell, cell_tag=bridge.BODY)
    x = model.particles.position
    model.remove(x[:, 1] - cell > (end - x[:, 0]) * np.tan(np.radians(a.front_angle)))
    along, down = gravity_of(a)
    model.set_gravity((along, -down))
    particles = model.particles
    stress = np.zeros((len(particles), 4))
    stress[:, 1] = np.minimum(a.density * down * (particles.position[:, 1] - cell - h), 0.0)
    stress[:, [0, 2]] = at_rest(a) * stress[:, 1:2]
    particles.set("stress", stress)
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


def row(a: Namespace, wall: mpm.RigidContact, history: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    x, face = wall.model.particles.position, wall.outline()[0][:, 0].min()
    near = x[x[:, 0] > face - 0.5 * a.depth, 1].max(initial=0.0)
    return {
        "time_s": report.time, "force_factor": mean_force(history, wall, report.time, 0) / unit_force(a),
        "impulse_Ns": wall.impulse[0], "run_up_m": max(comm.allreduce(float(near), MPI.MAX) - a.cell_size * a.depth, 0.0),
        "kinetic_energy_J_per_m": report.kinetic_energy, "unexplained_fraction_of_energy": report.unexplained_fraction,
        "dt_s": report.dt,
    }  # fmt: skip


def full_force(a: Namespace, history: History) -> float | None:
    """Mean force over rho g h^2 since the bore has formed; None where the run ended before."""
    start = (FULL + 1 / np.tan(np.radians(a.front_angle))) * passage(a)
    chosen = history["time_s"] >= start
    return float(history["force_factor"][chosen].mean()) if chosen.any() else None


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


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """The force, sand and wall in the end, and a film."""
    title = f"$t$ = {result.history['time_s'][-1]:.2f} s"
    labels = "along the plane [m]", "normal to the plane [m]"
    pictures = body_runs.body_pictures(a, scene, result, folder, title, labels=labels)
    return {"force": lambda: draw_force(folder / "force.png", a, result.history), **pictures} if pictures else {}


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    model = build(a)
    wall = model.contacts[0]
    result = follow(a, model, a.duration * passage(a), COLUMNS, partial(row, a, wall), folder, shown="force_factor")
    history, scene = result.history, scene_of(model, [bridge.BODY])
    (_, fluid), (_, passive) = bores(a)
    force = full_force(a, history)
    results = {
        "force_N_per_m": None if force is None else force * unit_force(a),
        "force_of_bore_in_fluid_N_per_m": fluid * unit_force(a), "force_of_bore_in_sand_N_per_m": passive * unit_force(a),
        "largest_force_N_per_m": float(history["force_factor"].max()) * unit_force(a), "velocity_m_per_s": velocity(a),
        "largest_run_up_m": float(history["run_up_m"].max()), "outflow_mass_kg": model.report().outflow_mass,
    }  # fmt: skip
    shown = "no bore yet" if force is None else f"{1e-3 * force * unit_force(a):.2f} kN/m"
    said = (
        f"force of the flow: {shown}; of a bore in a fluid {1e-3 * fluid * unit_force(a):.2f}, in sand under passive pressure "
        f"{1e-3 * passive * unit_force(a):.2f} kN/m"
    )
    return body_runs.write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie("flow and wall", scene, result.frames)],
        captions={"force": "Force on the wall"},
        pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
