"""Earth pressure on a rigid wall that moves away from sand, into it, or gives way.

A wall retains sand, which lies on rock with the friction angle of the sand. The wall moves away from the sand (active
pressure) or into it (passive pressure), or it is free and held by a force that falls to a fraction of the active one. For a
smooth wall the coefficients are Rankine's. For a rough wall they lie between those of a stress field (Lancellotta 2002),
which are on the safe side, and those of a plane wedge (Coulomb 1776), which are not, if the sand dilates by its friction angle.
Sand that dilates by less mobilises less of its strength where it slides along a rough wall: the field of stresses with the
strength of Davis (1968) is then the other end of what may be. It may not mobilise all of the wall friction either.
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
from common.earth_pressure import coulomb, stress_field, wall_acceleration
from common.figures import Pictures, curve_figure
from common.history import History
from common.movie import particle_movie
from common.options import add_choice, add_number, check, study_parser
from common.plots import CURVES, GREY, Scene
from common.quiet import GATHERS, without_warning
from common.ranks import run_study
from common.results import open_results
from common.scenes import scene_of
from common.site.laws import unit_doubt
from mpi4py import MPI
from mpm_core.input_warnings import in_radians

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
GRAVITY = 9.81
COLUMNS = ["time_s", "wall_displacement_m", "coefficient", "impulse_Ns", "vertical_impulse_Ns", "wall_friction",
           "unexplained_fraction_of_energy", "dt_s"]  # fmt: skip
RELEASED = 1.3
"""Time at which the support of a free wall is removed, over the time at which the sand is at rest"""
SLOW = 20.0
"""Time of a motion without inertia, over that of a wave of pressure over the height of the wall"""
LAST = 1 / 3
"""Part of the way of the wall over which the coefficient is taken, at its end"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_choice(
        p,
        "--motion",
        "active",
        ("active", "passive", "free"),
        "motion of the wall: away from the sand, into it, or free",
    )
    add_number(p, "--height", 1.0, "m", "height of the wall", above=0)
    add_number(p, "--friction-angle", 30.0, "degrees", "friction angle of the sand", above=0, below=50)
    add_number(p, "--dilation-angle", 0.0, "degrees", "dilation angle, at most the friction angle", at_least=0)
    add_number(p, "--wall-friction-angle", 0.0, "degrees", "friction angle between sand and wall", at_least=0)
    add_number(p, "--cohesion", 50.0, "Pa", "cohesion of the sand", at_least=0)
    add_number(p, "--young", 1e7, "Pa", "Young's modulus", above=0)
    add_number(p, "--density", 1800.0, "kg/m3", "density of the sand", above=0)
    add_number(p, "--movement", None, "-", "ratio of the wall's displacement to its height (default: 0.008 active, 0.03 passive)",
               above=0)  # fmt: skip
    add_number(p, "--speed", 0.01, "1/s", "ratio of the wall's speed to its height", above=0)
    add_number(p, "--support", 0.5, "-", "ratio of the final force on a free wall to the active force", at_least=0)
    add_number(
        p,
        "--wall-mass",
        0.2,
        "-",
        "ratio of the mass of a free wall to that of a square of sand of the same height",
        above=0,
    )
    add_number(
        p,
        "--cell-size",
        0.05,
        "-",
        "ratio of the side of the squares to the height of the wall, 1 over a whole number",
        above=0,
        at_most=0.25,
    )
    body_runs.add_body_run_options(p, damping=0.0, pic=0.01, nmd=True, integration="particles", frames=40)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    for name in ("dilation_angle", "wall_friction_angle"):
        value = getattr(a, name)
        check(p, value <= a.friction_angle, lambda name=name, value=value: f"--{name.replace('_', '-')} is {value:g}, expected "
              f"at most --friction-angle, {a.friction_angle:g} degrees")  # fmt: skip
    check_effect(p, a, a.motion == "free", ("--support", "--wall-mass"), "--motion free")
    check_effect(p, a, a.motion != "free", ("--movement", "--speed"), "--motion active or passive")
    check_whole(p, 1 / a.cell_size, f"--cell-size is {a.cell_size:g}, expected 1 over a whole number, such as 0.125")
    check_cells(p, a, 15 / a.cell_size**2, "--cell-size")
    say(f"--cell-size is {a.cell_size:g} of the height of the wall: active earth pressures are a quarter too low on an eighth, and half "
        "of what they should be on a quarter; take 0.1 or less" * (a.motion == "active" and a.cell_size > 0.1))  # fmt: skip
    say(in_radians("--wall-friction-angle", a.wall_friction_angle))
    say(unit_doubt({"young": a.young}, "the sand"))
    say(stands_alone(a))
    if a.movement is None:
        a.movement = 0.03 if a.motion == "passive" else 0.008
    say(too_fast(a))
    say(f"--movement is {a.movement:g} of the height: the sand heaves before the wall, and its coefficient rises above that of level ground, "
        "of smooth walls by a tenth at 0.1 and a fifth at 0.2" * (a.motion == "passive" and a.movement >= 0.1))  # fmt: skip
    check_restart(p, a, body_runs.MAY_CHANGE)
    return a


def stands_alone(a: Namespace) -> str:
    """What a warning says of sand whose cohesion holds it off a wall that moves away; empty for others.

    Active pressures K (z + h) - h, with h = c cot(phi) over the unit weight, are negative down to z = h (1 / K - 1). The wall does
    not pull there, so that the coefficient, which counts c cot(phi) as a pressure on the whole wall, is above the active one.
    """
    head = a.cohesion / np.tan(np.radians(a.friction_angle)) / (a.density * GRAVITY)
    depth = head * (1 / bounds(a)[0] - 1)
    if is_passive(a) or depth <= 0.25 * a.height:
        return ""
    return (
        f"--cohesion is {a.cohesion:g} Pa, with which the sand stands by itself down to {depth:.3g} m of the wall's {a.height:g} m: there is "
        "no active pressure there, and the coefficient, which counts c cot(phi) on the whole wall, is above the active one"
    )


def too_fast(a: Namespace) -> str:
    """What a warning says of a wall that moves so fast that the inertia of the sand counts; empty for others.

    On cells of a tenth of the height, active and passive coefficients are right to 7 % where the motion takes 23 times as long as a wave
    of pressure over the height of the wall, and wrong by a fifth and more where it takes 7 times as long.
    """
    wave = a.height / float(np.sqrt(sand(a).p_wave_modulus / a.density))
    if a.motion == "free" or a.movement / a.speed >= SLOW * wave:
        return ""
    return (
        f"--speed is {a.speed:g} of the height per second: the wall moves within {a.movement / a.speed:.2g} s, {a.movement / a.speed / wave:.2g} "
        f"times the time of a wave over its height, and the inertia of the sand changes the coefficient; take {a.movement / (SLOW * wave):.2g} "
        "or less"
    )


# --- 2. Sand and wall ------------------------------------------------------------------------------------------------


def sand(a: Namespace) -> mpm.MohrCoulomb:
    return mpm.MohrCoulomb(young=a.young, poisson=0.3, cohesion=a.cohesion, friction_angle=a.friction_angle,
                           dilation_angle=a.dilation_angle)  # fmt: skip


def is_passive(a: Namespace) -> bool:
    return bool(a.motion == "passive")


def unit_force(a: Namespace) -> float:
    """gamma H^2 / 2 [N/m]."""
    return 0.5 * a.density * GRAVITY * a.height**2


def at_rest(a: Namespace) -> float:
    """Time at which the sand is at rest under its weight [s]; gravity rises over the first third."""
    return 50 * a.height / float(np.sqrt(a.young / a.density))


def end(a: Namespace) -> float:
    """Time at which the wall has reached its displacement [s]; for a free wall the time to fall by its height."""
    if a.motion == "free":
        return at_rest(a) + 1.5 * float(np.sqrt(2 * a.height / GRAVITY))
    return at_rest(a) + 1.1 * a.movement / a.speed


def bounds(a: Namespace) -> tuple[float, float]:
    """Coefficients of the horizontal pressure by a field of stresses and by a plane wedge; the same on a smooth wall [-]."""
    angles = np.radians(a.friction_angle), np.radians(a.wall_friction_angle)
    return stress_field(*angles, passive=is_passive(a)), coulomb(*angles, passive=is_passive(a))


def davis_bound(a: Namespace) -> float | None:
    """Coefficient by a field of stresses with the strength on slip lines of sand that dilates by less than its friction angle [-].

    None behind smooth walls, where Rankine's coefficient is exact, and for sand that dilates by its friction angle.
    """
    if a.wall_friction_angle == 0 or a.dilation_angle == a.friction_angle:
        return None
    phi, delta = np.radians([bridge.davis_strength(sand(a)).friction_angle, a.wall_friction_angle])
    return stress_field(phi, min(delta, phi), passive=is_passive(a))


def wall_mass(a: Namespace) -> float:
    """Mass of a free wall [kg/m]."""
    return float(a.wall_mass * a.density * a.height**2)


def support(a: Namespace) -> float:
    """Force that holds a free wall in the end [N/m]."""
    return a.support * unit_force(a) * bounds(a)[0]


def expected_acceleration(a: Namespace) -> float:
    """Acceleration at which a free wall gives way, with a plane wedge behind it [m/s2]."""
    return wall_acceleration(*np.radians([a.friction_angle, a.wall_friction_angle]), weight=a.density * GRAVITY,
                             cohesion=a.cohesion, height=a.height, mass=wall_mass(a), support=support(a))  # fmt: skip


def acceleration(a: Namespace, history: History) -> float:
    """Acceleration of a free wall until it has moved by a tenth of its height [m/s2], by a parabola through the displacements."""
    time, moved = history["time_s"], -history["wall_displacement_m"]
    chosen = (time >= RELEASED * at_rest(a)) & (moved <= 0.1 * a.height)
    return float(2 * np.polyfit(time[chosen], moved[chosen], 2)[0]) if chosen.sum() > 3 else float("nan")


def wall_motion(a: Namespace) -> dict[str, object]:
    """Motion of the wall as arguments of ``Model.add_contact``."""
    start = at_rest(a)
    if a.motion != "free":
        speed = a.speed * a.height * (1 if is_passive(a) else -1)
        return {"velocity": ([start, start + 0.2 * a.movement / a.speed], [(0.0, 0.0), (speed, 0.0)])}
    rest = unit_force(a) * 0.45  # between the active and the passive one, so that it stands
    force = ([0.0, start / 3, start, RELEASED * start], [(0.0, 0.0), (rest, 0.0), (rest, 0.0), (support(a), 0.0)])
    return {"body": mpm.FreeBody(mass=wall_mass(a), axes=(True, False), rotates=False, force=force)}


def build(a: Namespace) -> mpm.Model:
    """Sand at rest behind the wall. Collective."""
    h, cell = a.height, a.cell_size * a.height
    before, behind, above = 1.5 if a.motion == "free" else 0.5, 5.0 if is_passive(a) else 2.0, 0.4
    counts = [round((before + behind) * h / cell), round((1 + above) * h / cell) + 1]
    left = cell * round(before * h / cell)
    body = ((left, cell), (left + 2 * behind * h, cell + h))  # over a row of empty cells
    mesh = bridge.box_mesh(comm, np.array(counts) * cell, counts, body=body)
    model = mpm.Model(bridge.background_mesh(*mesh), sand(a))
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=a.density, per_cell=a.particles_per_cell, cell_tag=bridge.BODY)
    for tag in (1, 2):
        model.roller(tag, normal=(1, 0))
    model.set_gravity((0.0, -GRAVITY), ramp=at_rest(a) / 3)
    # Particles are larger than their distance from the sides of cells.
    face, foot = (
        at + model.gap(mpm.Plane((left, cell), normal)) - 1e-9 * h for at, normal in ((left, (1, 0)), (cell, (0, 1)))
    )
    wall = mpm.Box((face - 0.3 * h, foot - h), (face, foot + 1.35 * h))
    inner, rough = np.tan(np.radians([a.friction_angle, a.wall_friction_angle]))
    model.add_contact(wall, friction=rough, adhesion=a.cohesion * rough / inner, **wall_motion(a))
    model.add_contact(mpm.Plane((0.0, foot), (0.0, 1.0)), friction=inner, adhesion=a.cohesion)
    model.rebalance()
    model.explicit(at_rest(a), **(body_runs.scheme(a) | {"damping": 0.7})).last()
    return model


def row(a: Namespace, wall: mpm.RigidContact, history: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    # Cohesion acts as a surcharge c cot(phi) that the wall feels too (corresponding states, Caquot 1934).
    surcharge = a.cohesion / np.tan(np.radians(a.friction_angle)) * a.height / unit_force(a)
    push = -mean_force(history, wall, report.time, 0)
    normal = push + surcharge * unit_force(a)  # the strength of the wall is (sigma + c cot phi) tan delta
    drag = mean_force(history, wall, report.time, 1, "vertical_impulse_Ns")
    return {
        "time_s": report.time, "wall_displacement_m": wall.displacement[0],
        "coefficient": (push / unit_force(a) + surcharge) / (1 + surcharge), "impulse_Ns": wall.impulse[0],
        "vertical_impulse_Ns": wall.impulse[1], "wall_friction": abs(drag) / normal if normal > 0 else 0.0,
        "unexplained_fraction_of_energy": report.unexplained_fraction, "dt_s": report.dt,
    }  # fmt: skip


def accelerations(a: Namespace, history: History) -> dict[str, float]:
    """Computed and expected, of a wall that is free."""
    if a.motion != "free":
        return {}
    return {
        "acceleration_m_per_s2": acceleration(a, history),
        "acceleration_by_plane_wedge_m_per_s2": expected_acceleration(a),
    }


def in_the_end(a: Namespace, history: History, column: str) -> float:
    """Mean of a column over the last third of the way."""
    moved = np.abs(history["wall_displacement_m"])
    return float(history[column][moved >= (1 - LAST) * moved[-1]].mean())


def mobilised(a: Namespace, friction: float) -> str:
    """The end of a line of results: how much of its friction a rough wall mobilises; the bounds assume all of it."""
    if a.wall_friction_angle == 0:
        return ""
    return f"; of its friction angle of {a.wall_friction_angle:g} degrees {np.degrees(np.arctan(friction)):.3g} degrees are mobilised"


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw_pressure(path: Path, a: Namespace, history: History) -> None:
    """The coefficient over the displacement of the wall, or over time where it is free, with the bounds."""
    with curve_figure(path) as axes:
        free = a.motion == "free"
        along = history["time_s"] - at_rest(a) if free else np.abs(history["wall_displacement_m"]) / a.height
        axes.plot(along, history["coefficient"], color=CURVES[0], label="computed")
        for value, name, style in zip(bounds(a), ("stress field", "plane wedge"), ("--", ":"), strict=True):
            name = name if a.wall_friction_angle > 0 else "Rankine"
            axes.axhline(value, color="black", linewidth=0.9, linestyle=style, label=f"{name}, {value:.3f}")
            if a.wall_friction_angle == 0:
                break
        davis = davis_bound(a)
        if davis is not None:
            axes.axhline(
                davis, color="black", linewidth=0.9, linestyle="-.", label=f"with Davis' strength, {davis:.3f}"
            )
        if free:
            axes.axhline(
                a.support * bounds(a)[0], color=GREY, linewidth=0.9, label="force that holds the wall in the end"
            )
        xlabel = "Time since the sand was at rest [s]" if free else "Displacement of the wall over its height [-]"
        axes.set(xlabel=xlabel, ylabel="Coefficient of earth pressure [-]", xlim=(0, None), ylim=(0, None))
        axes.legend()


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """The coefficient, sand and wall in the end, and a film."""
    pictures = body_runs.body_pictures(
        a, scene, result, folder, f"wall moved by {abs(result.history['wall_displacement_m'][-1]):.3g} m"
    )
    return (
        {"pressure": lambda: draw_pressure(folder / "pressure.png", a, result.history), **pictures} if pictures else {}
    )


# --- 4. All together -------------------------------------------------------------------------------------------------


@without_warning(GATHERS)
def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    model = build(a)
    wall = model.contacts[0]
    result = follow(a, model, end(a), COLUMNS, partial(row, a, wall), folder, shown="coefficient", since=at_rest(a))
    history, scene = result.history, scene_of(model, [bridge.BODY])
    coefficient, friction = (in_the_end(a, history, name) for name in ("coefficient", "wall_friction"))
    moved = history["wall_displacement_m"][-1]
    field, wedge = bounds(a)
    davis = davis_bound(a)
    with_davis = "" if davis is None else f", and {davis:.3f} with the strength of Davis for this dilation"
    results = {
        "coefficient_in_the_end": coefficient, "coefficient_by_stress_field": field, "coefficient_by_plane_wedge": wedge,
        "coefficient_by_stress_field_without_full_dilation": davis,
        "coefficient_at_rest": history["coefficient"][0], "wall_displacement_m": moved,
        "wall_friction_angle_in_the_end_degrees": float(np.degrees(np.arctan(friction))), **accelerations(a, history),
    }  # fmt: skip
    said = (
        f"{a.motion} wall: coefficient {coefficient:.3f} in the end, by a field of stresses {field:.3f}, by a plane wedge "
        f"{wedge:.3f}{with_davis}; the wall moved by {abs(moved):.3g} m{mobilised(a, friction)}"
    )
    return body_runs.write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie(f"{a.motion} wall", scene, result.frames)],
        captions={"pressure": "Coefficient of the horizontal earth pressure on the wall"},
        pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
