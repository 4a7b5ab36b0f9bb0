"""A slope of loose saturated sand loses its strength and runs out as a flow slide.

The slope is saturated up to its surface and rests under its weight. At the start the pore pressures of the loose sand rise by
a fraction of the effective vertical stresses, as in an earthquake, and effective normal stresses fall by this fraction. Shear
stresses stay, which equilibrium asks for, as far as the strength that is left carries them. Soil and water then move with separate
velocities. Fine sand hardly drains while it flows; coarse sand drains as fast as it flows.

As long as its pores are full, the sand keeps its volume (`volume_gain`) and flows out until its surface is nearly level. By default
its grains follow the law of Mohr and Coulomb without dilation. Loose sand contracts as it is sheared, which raises the pore pressures
further, and dense sand dilates: `--material nor-sand` with its `--state-parameter`. Use `--air-entry 0` for
sand so coarse that it sustains no suction: it dilates where effective stresses would become tensile, and its pores empty.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common import body_runs
from common.body_runs import BodyRun, follow
from common.checkpoint import check_restart
from common.checks import check_cells, check_effect, say
from common.figures import Pictures, curve_figure
from common.front import front
from common.history import History
from common.lengths import metres
from common.movie import QUANTITIES, WET_QUANTITIES, particle_movie
from common.options import add_choice, add_number, check, formerly, study_parser
from common.plots import CURVES, Scene, colour_limits, save_particles
from common.ranks import run_study
from common.results import open_results
from common.scenes import scene_of
from common.schemes import INTEGRATIONS
from common.site.laws import unit_doubt
from common.soils import add_parameter
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
GRAVITY, WATER = 9.81, 1000.0  # m/s2, kg/m3
GRAINS = 2650.0
NOR_SAND = {"critical_void_ratio": 1.0, "critical_compression": 0.03, "critical_slope": 1.25, "dilatancy": 4.0, "hardening": 100.0,
            "rigidity": 200.0, "coupling": 0.2, "attraction": 1000.0}  # fmt: skip
"""Parameters of NorSand that are options, of which the attraction [Pa] keeps some strength at the surface"""
COLUMNS = ["time_s", "runout_m", "crest_settlement_m", "pressure_ratio", "volume_gain", "water_out_m2", "fastest_m_per_s",
           "kinetic_energy_J", "unexplained_fraction_of_energy", "dt_s"]  # fmt: skip


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--height", 3.0, "m", "height of the slope", above=0)
    add_number(p, "--angle", 12.0, "degrees", "inclination of the slope", above=0, below=60)
    add_number(p, "--crest", 4.0, "m", "length of the level ground behind the slope", above=0)
    add_number(p, "--runout-length", 40.0, "m", "length of the background mesh beyond the toe", above=0)
    formerly(p, "runout", "--runout-length")
    add_number(p, "--cell-size", 0.25, "m", "edge of the triangles", above=0)
    add_number(p, "--pressure-ratio", 0.9, "-", "ratio of the rise of the pore pressures to the effective vertical stresses",
               at_least=0, below=1)  # fmt: skip
    add_number(p, "--conductivity", 1e-5, "m/s", "hydraulic conductivity", above=0)
    add_number(p, "--porosity", 0.45, "-", "porosity of the loose sand", above=0, below=1)
    add_number(
        p, "--water-modulus", 2e7, "Pa", "bulk modulus of the water; values below 2.2e9 allow longer steps", above=0
    )
    add_choice(p, "--material", "mohr-coulomb", ("mohr-coulomb", "nor-sand"), "law of the sand")
    add_number(p, "--young", 1e7, "Pa", "Mohr-Coulomb: Young's modulus of the sand", above=0)
    add_number(p, "--friction-angle", 33.0, "degrees", "Mohr-Coulomb: friction angle of the sand", above=0, below=50)
    add_number(p, "--cohesion", 100.0, "Pa", "Mohr-Coulomb: cohesion of the sand", at_least=0)
    add_number(p, "--state-parameter", 0.08, "-", "NorSand: void ratio at the start less that of the critical state at the same "
               "pressure; above 0 for loose sand")  # fmt: skip
    for name, value in NOR_SAND.items():
        add_parameter(p, mpm.NorSand, name, value, "NorSand: ")
    add_number(p, "--time", 10.0, "s", "duration", above=0)
    add_number(p, "--air-entry", 2e4, "Pa", "suction up to which pores stay full; 0 lets them run empty", at_least=0)
    body_runs.add_body_run_options(p, damping=0.0, pic=0.0005, nmd=True, frames=60)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    loose = a.material == "nor-sand"
    check_effect(p, a, not loose, ("--young", "--friction-angle", "--cohesion"), "--material mohr-coulomb")
    of_nor_sand = ("--state-parameter", *("--" + name.replace("_", "-") for name in NOR_SAND))
    check_effect(p, a, loose, of_nor_sand, "--material nor-sand")
    friction, option = friction_angle(a), "that of --critical-slope" if loose else "--friction-angle"
    check(p, a.angle < friction, lambda: f"--angle is {a.angle:g}, expected less than {option}, {friction:.3g} degrees")
    length = a.crest + a.height / np.tan(np.radians(a.angle)) + a.runout_length
    check_cells(
        p,
        a,
        2.3 * length * (a.height + a.cell_size) / a.cell_size**2,
        "--cell-size",
        "--height",
        "--angle",
        "--crest",
        "--runout-length",
    )
    say(unit_doubt({"young": a.young}, "the sand"))
    check_restart(p, a, body_runs.MAY_CHANGE)
    return a


# --- 2. The slope ----------------------------------------------------------------------------------------------------


def density(a: Namespace) -> float:
    """Density of the saturated sand [kg/m3]."""
    return float((1 - a.porosity) * GRAINS + a.porosity * WATER)


def friction_angle(a: Namespace) -> float:
    """Friction angle of the sand [degrees]: of NorSand that of the critical state in triaxial compression."""
    of_critical_state = np.degrees(np.arcsin(3 * a.critical_slope / (6 + a.critical_slope)))
    return a.friction_angle if a.material == "mohr-coulomb" else float(of_critical_state)


def depth(a: Namespace, x: np.ndarray) -> np.ndarray:
    """Depth of places (n, 2) below the surface of the slope at the start [m]; zero above it."""
    surface = np.clip(a.height - (x[:, 0] - a.crest) * np.tan(np.radians(a.angle)), 0.0, a.height)
    return np.maximum(surface - x[:, 1], 0.0)


def sand(a: Namespace) -> mpm.MohrCoulomb | mpm.NorSand:
    """The law of the skeleton."""
    if a.material == "mohr-coulomb":
        strength = {"cohesion": a.cohesion, "friction_angle": a.friction_angle, "dilation_angle": 0.0}
        return mpm.MohrCoulomb(young=a.young, poisson=0.3, **strength)
    at_base = (density(a) - WATER) * GRAVITY * a.height  # of which the largest stiffness, and so the time step, follows
    parameters = {name: getattr(a, name) for name in NOR_SAND}
    return mpm.NorSand(**parameters, poisson=0.2, image_pressure=at_base, void_ratio=a.porosity / (1 - a.porosity))


def build(a: Namespace) -> mpm.Model:
    """The slope at rest, and then with the raised pore pressures. Collective."""
    mesh = bridge.slope_mesh(comm, a.height, a.angle, a.crest, a.cell_size, kind="gmsh", runout=a.runout_length)
    model = mpm.Model(bridge.background_mesh(*mesh), sand(a))
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=density(a), per_cell=a.particles_per_cell, cell_tag=bridge.SOIL)
    model.roller(bridge.LEFT, (1, 0))
    model.roller(bridge.RIGHT, (1, 0))
    model.fix(bridge.BASE)
    model.set_gravity((0.0, -GRAVITY))
    model.add_water(porosity=a.porosity, conductivity=a.conductivity, modulus=a.water_modulus, kozeny_carman=True,
                    suction_limit=a.air_entry)  # fmt: skip
    model.rebalance()
    raise_pressures(a, model)
    return model


def raise_pressures(a: Namespace, model: mpm.Model) -> None:
    """Bring the slope to equilibrium, and turn a part of its effective stresses into pore pressure. Collective."""
    p, buoyant = model.particles, (density(a) - WATER) * GRAVITY
    model.set_pore_pressure(lambda x: WATER * GRAVITY * depth(a, x))
    p.set("stress", -buoyant * depth(a, p.position)[:, None] * np.array([0.5, 1.0, 0.5, 0.0]))
    if a.material == "nor-sand":
        set_state(a, model, overconsolidation=10.0)  # elastic: it would compact on its way to equilibrium
        model.equilibrate(integration=INTEGRATIONS[a.integration], nmd=a.nmd)
        set_state(a, model)
    else:  # soil at yield: equilibrium of averaged forces takes too many steps, and the start moves it by less than 1 mm
        try:
            model.equilibrate(integration=INTEGRATIONS[a.integration])
        except mpm.RunError as error:
            raise mpm.InputError(
                f"--angle is {a.angle:g} degrees, at which the saturated slope does not stand before its pore pressures rise ({error}); "
                "expected a smaller one, or a higher --friction-angle or --cohesion"
            ) from error
    p.set("initial_position", p.position)  # displacements count from here
    raised = np.maximum(-a.pressure_ratio * p.stress[:, 1], 0.0)
    p.set("pore_pressure", p.pore_pressure + raised)
    # Each by its fraction: the same decrease of all would end in tension to the sides.
    left = 1 - a.pressure_ratio * np.array([1.0, 1.0, 1.0, 0.0])
    p.set("stress", left * p.stress)


def set_state(a: Namespace, model: mpm.Model, overconsolidation: float = 1.0) -> None:
    """Give NorSand its state parameter at the present stresses, which its yield surfaces pass through unless it is overconsolidated."""
    states = mpm.nor_sand_state(model.laws[0], model.particles.stress, a.state_parameter, overconsolidation)
    for name, values in states.items():
        model.set_state(name, values)


# --- 3. The slide ----------------------------------------------------------------------------------------------------


def row(a: Namespace, model: mpm.Model, _: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    p = model.particles
    grains = (1 - p.porosity) * p.volume
    volume, volume_of_grains = comm.allreduce(np.array([p.volume.sum(), grains.sum()]))
    weighed = np.array([p.volume @ p.pore_pressure, p.volume @ (p.pore_pressure - p.stress[:, 1])])
    pressure, total = comm.allreduce(weighed)
    top = p.initial_position[:, 1] > a.height - a.cell_size
    crest = top & (p.initial_position[:, 0] > 0.5 * a.crest) & (p.initial_position[:, 0] < a.crest)
    count, settled = comm.allreduce(np.array([crest.sum(), -p.displacement[crest, 1].sum()]))
    runout = front(p.position[:, 0], grains) - front(p.initial_position[:, 0], grains)
    fastest = comm.allreduce(float(np.linalg.norm(p.velocity, axis=1).max(initial=0.0)), MPI.MAX)
    return {
        "time_s": report.time, "runout_m": runout, "crest_settlement_m": settled / max(count, 1),
        "pressure_ratio": pressure / total, "volume_gain": volume * (1 - a.porosity) / volume_of_grains - 1,
        "water_out_m2": -model.water_inflow(), "fastest_m_per_s": fastest,
        "kinetic_energy_J": report.kinetic_energy, "unexplained_fraction_of_energy": report.unexplained_fraction,
        "dt_s": report.dt,
    }  # fmt: skip


# --- 4. Pictures -----------------------------------------------------------------------------------------------------


def draw_course(path: Path, history: History) -> None:
    """Ways of front and crest, and mean pore pressure over total vertical stress, over time."""
    with curve_figure(path, (4.6, 4.2), rows=2) as (above, below):
        above.plot(history["time_s"], history["runout_m"], color=CURVES[0], label="front, forwards")
        above.plot(history["time_s"], history["crest_settlement_m"], color=CURVES[2], label="crest, downwards")
        above.legend(fontsize=8)
        above.set(ylabel="Displacement of\nfront and crest [m]", ylim=(0, None))
        below.plot(history["time_s"], history["pressure_ratio"], color=CURVES[1])
        below.set(
            xlabel="Time [s]", ylabel="Mean pore pressure over\ntotal vertical stress [-]", xlim=(0, None), ylim=(0, 1)
        )


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """The course of the slide, the particles at three times, and a film."""
    pictures = body_runs.body_pictures(a, scene, result, folder, f"$t$ = {result.history['time_s'][-1]:.3g} s")
    if scene is None or not pictures:
        return pictures
    frames = result.frames
    shown = {"start": frames[0], "slide": frames[len(frames) // 4], "end": frames[-1]}
    for key, quantity in WET_QUANTITIES.items():
        for name, frame in shown.items():
            # Pore pressures in the end are small beside those that liquefy the sand.
            compared = [frame] if name == "end" else [frames[0], shown["slide"]]
            limits = colour_limits(quantity, [one[key] for one in compared])
            pictures[f"{key}_{name}"] = partial(
                save_particles, folder / f"{key}_{name}.png", scene, frame["position"], frame["volume"], frame[key], quantity,
                limits=limits, title=f"$t$ = {float(frame['time']):.3g} s",
            )  # fmt: skip
    return {"course": lambda: draw_course(folder / "course.png", result.history), **pictures}


# --- 5. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    model = build(a)
    result = follow(a, model, a.time, COLUMNS, partial(row, a, model), folder, shown="runout_m")
    history, scene = result.history, scene_of(model, [bridge.SOIL])
    speeds = model.wave_speeds()
    results = {
        "runout_m": history["runout_m"][-1], "crest_settlement_m": history["crest_settlement_m"][-1],
        "fastest_m_per_s": history["fastest_m_per_s"].max(), "pressure_ratio_at_start": history["pressure_ratio"][0],
        "pressure_ratio_in_the_end": history["pressure_ratio"][-1], "volume_gain": history["volume_gain"][-1],
        "water_out_m2": history["water_out_m2"][-1],
        "water_modulus_Pa": a.water_modulus, "undrained_wave_m_per_s": speeds.undrained, "fast_wave_m_per_s": speeds.fast,
        "critical_time_step_s": model.critical_time_step(),
    }  # fmt: skip
    said = (
        f"front moved by {metres(results['runout_m'])}, crest by {metres(results['crest_settlement_m'])}; water of "
        f"{a.water_modulus:.3g} Pa: undrained wave {speeds.undrained:.0f} m/s, critical step "
        f"{1e6 * results['critical_time_step_s']:.0f} us"
    )
    captions = {
        "course": "Ways of front and crest, and mean pore pressure over total vertical stress",
        **{f"{key}_{name}": f"{quantity.name}: {text}"
           for key, quantity in WET_QUANTITIES.items()
           for name, text in (("start", "at the start"), ("slide", "as it slides"), ("end", "in the end"))},
    }  # fmt: skip
    return body_runs.write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie("flow slide", scene, result.frames, {**WET_QUANTITIES, **QUANTITIES})],
        captions=captions, pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
