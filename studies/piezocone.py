"""A piezocone in saturated clay: resistance and pore pressures between drained and undrained penetration, in axial symmetry.

A smooth 60 degree cone with a rounded tip and its shaft, which is in the ground from the start, is pushed down at a constant velocity
through Modified Cam-Clay under a uniform effective stress. The water flows through the clay as it is pressed aside: implicit steps
couple both. How much it drains depends on the normalised velocity V = v d / c_v, with the diameter d and the coefficient of
consolidation c_v = k (1 + e) p' / (lambda gamma_w): below some 0.1 the clay drains, above 100 it does not, and drained clay
resists twice as much or more. The resistance without drainage is compared with cone factors of clay, and the part of its rise
by drainage with the trend of experiments (DeJong & Randolph 2012). The ground has no weight; pore pressures are those in excess.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common.body_runs import (
    FILES_MAY_CHANGE,
    SHOWN,
    WATER,
    BodyRun,
    add_body_file_options,
    body_pictures,
    follow,
    mean_force,
    write_results,
)
from common.checkpoint import check_restart
from common.checks import check_cells, check_cells_of_radius, low_pressure, say
from common.cone_theory import STEEPNESS, beyond_factors, clay_factors, drained_part, undrained_strength
from common.figures import Pictures, curve_figure
from common.history import History
from common.movie import QUANTITIES, WET_QUANTITIES, particle_movie
from common.options import add_number, check, study_parser
from common.plots import CURVES, Scene
from common.quiet import GATHERS, without_warning
from common.ranks import run_study
from common.results import ROOT, open_results
from common.scenes import scene_of
from common.schemes import add_particles_per_cell
from mpi4py import MPI
from mpm_core.output import PARTICLE_FIELDS, WATER_FIELDS

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.water.soils import WATER_WEIGHT

comm = MPI.COMM_WORLD
COLUMNS = ["time_s", "penetration_m", "net_resistance_Pa", "pore_pressure_face_Pa", "pore_pressure_shoulder_Pa", "pore_pressure_ratio",
           "impulse_Ns", "contact_area_m2", "dt_s"]  # fmt: skip
ABOVE, BELOW = 4.0, 12.0
"""Height of the ground above the shoulder, and depth below the last place of the tip, over the radius"""
ROUNDING = 0.2
"""Radius of the sphere that the tip ends in, over that of the cone"""
FILTER = 1.5
"""Radius of the places where pore pressures are read, in cells"""
GHOST = mpm.GhostPenalty(stiffness=0.02, mass=1.0, filled=0.95)
"""Keeps pore pressures smooth in the cells beside the cone, which are not quite full; those that alternate where no water flows would
take all effective stress from single particles"""
NEWTON = mpm.Newton(max_iterations=50, max_halvings=8)
"""Patient, where single particles beside the cone change between touching and not"""
LOOSEST, STEEPEST = 20.0, 3.0
"""Void ratio and slope of the critical state line of hardly any soil"""
INERTIA = 0.1
"""Density times the square of the velocity, over the strength, from which inertia counts: it adds 3 % without drainage"""
STEADY = 1 / 3
"""Last part of the way over which results are averaged"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--radius", 0.01785, "m", "radius of the cone and of its shaft", above=0)
    add_number(p, "--penetration", 0.09, "m", "way of the cone", above=0)
    add_number(p, "--velocity", 0.02, "m/s", "velocity of the cone", above=0)
    soil = p.add_argument_group("clay")
    add_number(
        soil,
        "--conductivity",
        1e-8,
        "m/s",
        "hydraulic conductivity, which does not change with the void ratio",
        above=0,
    )
    add_number(soil, "--pressure", 100e3, "Pa", "initial effective stress, equal in all directions", above=0)
    add_number(
        soil, "--overconsolidation", 1.0, "-", "ratio of the preconsolidation pressure to the initial one", at_least=1
    )
    add_number(soil, "--compression-slope", 0.2, "-", "slope lambda of the virgin compression line", above=0)
    add_number(soil, "--swelling-slope", 0.04, "-", "slope kappa of the swelling lines", above=0)
    add_number(soil, "--critical-slope", 0.92, "-", "slope M of the critical state line in p and q", above=0)
    add_number(soil, "--void-ratio", 1.5, "-", "initial void ratio", above=0)
    add_number(soil, "--poisson", 0.25, "-", "Poisson's ratio", at_least=0, below=0.5)
    add_number(soil, "--attraction", 2e3, "Pa", "isotropic tension that the clay bears", at_least=0)
    run = p.add_argument_group("particles and run")
    add_number(run, "--cell-size", 0.003, "m", "size of the cells along the path of the cone", above=0)
    add_number(run, "--width", 30.0, "-", "ratio of the ground's radius to that of the cone", at_least=5)
    add_number(run, "--growth", 0.15, "-", "increase of the cell size per length of distance from the path", above=0)
    add_number(
        run,
        "--step",
        0.25,
        "-",
        "ratio of the largest way of the cone in a time step to the size of the cells",
        above=0,
        at_most=1,
    )
    add_particles_per_cell(run, 6)
    add_body_file_options(p, 60, (*PARTICLE_FIELDS, *WATER_FIELDS))
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    check_cells_of_radius(p, a)
    check(p, a.swelling_slope < a.compression_slope, lambda: f"--swelling-slope is {a.swelling_slope:g}, expected less than "
          f"--compression-slope, {a.compression_slope:g}")  # fmt: skip
    path = a.penetration + (ABOVE + STEEPNESS) * a.radius
    check_cells(
        p, a, 2.3 * path * (a.radius / a.cell_size**2 + 10 / a.cell_size), "--cell-size", "--radius", "--penetration"
    )
    check_restart(p, a, FILES_MAY_CHANGE | {"step"})
    for text in doubts(a):
        say(text)
    return a


def doubts(a: Namespace) -> Iterator[str]:
    """Warnings of options that are probably mistakes, or for which the results mean something else; some are empty."""
    yield low_pressure("--pressure", a.pressure)
    if a.compression_slope * np.log(2) > a.void_ratio:
        yield (f"--compression-slope {a.compression_slope:g} and --void-ratio {a.void_ratio:g}: twice the pressure would press out more than "
               "the water of all pores; both are ratios, not in percent")  # fmt: skip
    if a.void_ratio > LOOSEST:
        yield f"--void-ratio is {a.void_ratio:g}, more than that of peat; {a.void_ratio:g} % are {a.void_ratio / 100:g}"
    if a.critical_slope > STEEPEST:
        friction = np.sin(np.radians(min(a.critical_slope, 90.0)))
        yield (f"--critical-slope is {a.critical_slope:g}, more than the {STEEPEST:g} of a friction angle of 90 degrees; it is "
               f"6 sin(phi) / (3 - sin(phi)), {6 * friction / (3 - friction):.2g} for {min(a.critical_slope, 90.0):g} degrees")  # fmt: skip
    strength, rigidity = strength_and_rigidity(a)
    yield beyond_factors(rigidity)
    if density(a) * a.velocity**2 > INERTIA * strength:
        yield (f"--velocity is {a.velocity:g} m/s: the inertia of the clay adds to the resistance above "
               f"{np.sqrt(INERTIA * strength / density(a)):.2g} m/s; for less drainage take a smaller --conductivity")  # fmt: skip


# --- 2. Ground and cone ----------------------------------------------------------------------------------------------


def soil(a: Namespace) -> mpm.CamClay:
    # A pressure on the yield surface itself would be outside of it by round-off.
    return mpm.CamClay(compression=a.compression_slope, swelling=a.swelling_slope, critical_slope=a.critical_slope, poisson=a.poisson,
                       preconsolidation=a.overconsolidation * a.pressure * (1 + 1e-6), void_ratio=a.void_ratio,
                       attraction=a.attraction)  # fmt: skip


def porosity(a: Namespace) -> float:
    return float(a.void_ratio / (1 + a.void_ratio))


def density(a: Namespace) -> float:
    """Of the saturated clay [kg/m3]."""
    return 2700 * (1 - porosity(a)) + 1000 * porosity(a)


def normalised_velocity(a: Namespace) -> float:
    """v d / c_v with the coefficient of consolidation of virgin compression."""
    consolidation = a.conductivity * (1 + a.void_ratio) * a.pressure / (a.compression_slope * WATER_WEIGHT)
    return float(a.velocity * 2 * a.radius / consolidation)


def strength_and_rigidity(a: Namespace) -> tuple[float, float]:
    """Undrained shear strength [Pa], and the shear modulus of the initial state over it."""
    law = soil(a)
    strength = undrained_strength(law, a.pressure)
    bulk = (1 + a.void_ratio) * (a.pressure + law.attraction) / a.swelling_slope
    return strength, 1.5 * (1 - 2 * a.poisson) / (1 + a.poisson) * bulk / strength


def outline(a: Namespace, inset: float) -> mpm.Polyline:
    """The whole section of cone and shaft, with its shoulder at the height 0 but for the inset [m]; the soil is outside."""
    radius, tip, centre = a.radius - inset, 2 * inset - STEEPNESS * a.radius, (2 * ROUNDING - STEEPNESS) * a.radius
    angles = np.radians(np.linspace(-90, -30, 7))
    arc = (ROUNDING * a.radius - inset) * np.column_stack([np.cos(angles), np.sin(angles)]) + (0.0, centre)
    half = [*arc, (radius, tip + STEEPNESS * radius), (radius, 2 * ABOVE * a.radius + a.penetration)]
    return mpm.Polyline([*((-x, y) for x, y in half), *half[:0:-1]], closed=True)


def build(a: Namespace) -> mpm.Model:
    """Ground around the cone. Collective."""
    near = 2 * a.cell_size
    lengths = {
        "radius": a.radius, "tip_radius": ROUNDING * a.radius, "above": ABOVE * a.radius, "penetration": a.penetration, "below": BELOW * a.radius, "width": a.width * a.radius,
        "cell_size": a.cell_size, "near_size": near, "far_size": near + a.growth * a.width * a.radius,
    }  # fmt: skip
    mesh = bridge.read_mesh(ROOT / "meshes" / "piezocone.geo", comm, parameters=lengths)
    model = mpm.Model(bridge.background_mesh(*mesh), soil(a), geometry=mpm.Geometry.AXISYMMETRIC)
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=density(a), per_cell=a.particles_per_cell, cell_tag="soil")
    model.roller("axis", normal=(1, 0))
    for side in ("base", "top"):
        model.roller(side, normal=(0, 1))
    stress = np.zeros((len(model.particles), 4))
    stress[:, :3] = -a.pressure
    model.particles.set("stress", stress)
    model.add_water(porosity=porosity(a), conductivity=a.conductivity, modulus=np.inf)
    model.hold_pore_pressure("far", 0.0)
    model.press_surface("far", a.pressure)
    overlap = max(0.0, -model.gap(outline(a, 0.0)))  # of particles that are larger than their distance from the surface
    model.add_contact(outline(a, 1.02 * overlap), velocity=(0.0, -a.velocity))
    model.rebalance()
    return model


def section(model: mpm.Model, a: Namespace) -> float:
    """Area of the cone that one radian has [m2]."""
    radius = float(np.abs(model.contacts[0].outline()[0][:, 0]).max())
    return 0.5 * radius**2


def pressure_near(model: mpm.Model, place: np.ndarray, reach: float) -> float:
    """Mean pore pressure of the particles near a place [Pa]. Collective."""
    near = np.hypot(*(model.particles.position - place).T) < reach
    total, count = comm.allreduce(np.array([model.particles.pore_pressure[near].sum(), near.sum()]))
    return float(total / count) if count else float("nan")


def row(a: Namespace, body: mpm.RigidContact, history: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    model, depth = body.model, abs(float(body.displacement[1]))
    # The cone is in the ground from the start, under its pressure, though particles touch it in the first step only.
    net = mean_force(history, body, report.time, 1) / section(model, a) - a.pressure if depth else 0.0
    shoulder, face = np.array([a.radius, -depth]), np.array([a.radius / 2, -depth - STEEPNESS * a.radius / 2])
    u1, u2 = (pressure_near(model, place, FILTER * a.cell_size) for place in (face, shoulder))
    return {
        "time_s": report.time, "penetration_m": depth, "net_resistance_Pa": net, "pore_pressure_face_Pa": u1, "pore_pressure_shoulder_Pa": u2,
        "pore_pressure_ratio": u2 / net if net else 0.0, "impulse_Ns": body.impulse[1], "contact_area_m2": body.area, "dt_s": report.dt,
    }  # fmt: skip


def in_the_end(history: History) -> dict[str, float]:
    """Means over the last part of the way."""
    last = history["penetration_m"] >= (1 - STEADY) * history["penetration_m"][-1]
    names = ("net_resistance_Pa", "pore_pressure_face_Pa", "pore_pressure_shoulder_Pa")
    return {name: float(history[name][last].mean()) for name in names}


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw_resistance(path: Path, a: Namespace, history: History) -> None:
    """Net resistance and pore pressures over the way, which goes down."""
    strength, rigidity = strength_and_rigidity(a)
    with curve_figure(path, (6.2, 4.2), panels=2) as panels:
        ratio = history["penetration_m"] / (2 * a.radius)
        panels[0].plot(1e-3 * history["net_resistance_Pa"], ratio, color=CURVES[0])
        for (name, factor), line in zip(clay_factors(rigidity, 0.0).items(), ("--", ":")):
            panels[0].axvline(1e-3 * factor * strength, color="black", linewidth=0.9, linestyle=line, label=name)
        panels[0].set(
            xlabel="Net resistance of the cone [kPa]", ylabel="Penetration over the diameter [-]", xlim=(0, None)
        )
        panels[0].legend(loc="lower left", title="without drainage:", fontsize=8, title_fontsize=8)
        for name, colour in (("face", CURVES[1]), ("shoulder", CURVES[2])):
            panels[1].plot(1e-3 * history[f"pore_pressure_{name}_Pa"], ratio, color=colour, label=f"at the {name}")
        panels[1].set(xlabel="Excess pore pressure [kPa]")
        panels[1].legend(loc="best")
        for axes in panels:
            axes.set(ylim=(ratio[-1] or 1.0, 0.0))


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """Resistance and pore pressures, the clay and the cone in the end, and a film."""
    depth = result.history["penetration_m"][-1]
    box = np.array([[0.0, -depth - 7 * a.radius], [9 * a.radius, ABOVE * a.radius]])
    title = f"$V$ = {normalised_velocity(a):.3g}, penetration {depth:.3g} m"
    pictures = body_pictures(a, scene, result, folder, title, shown=WATER | SHOWN, box=box)
    return (
        {"resistance": partial(draw_resistance, folder / "resistance.png", a, result.history), **pictures}
        if pictures
        else {}
    )


# --- 4. All together -------------------------------------------------------------------------------------------------


@without_warning(GATHERS)
def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    model = build(a)
    steps = partial(
        model.implicit,
        dt=a.step * a.cell_size / a.velocity,
        nmd=True,
        integration=mpm.Integration.MIXED,
        ghost=GHOST,
        solver=NEWTON,
    )
    result = follow(a, model, a.penetration / a.velocity, COLUMNS, partial(row, a, model.contacts[0]), folder, shown="net_resistance_Pa",
                    begin=steps)  # fmt: skip
    means, scene = in_the_end(result.history), scene_of(model, [1])
    (strength, rigidity), speed = strength_and_rigidity(a), normalised_velocity(a)
    net, factors = means["net_resistance_Pa"], clay_factors(rigidity, 0.0)  # of a smooth cone
    results = {
        **means, "pore_pressure_ratio": means["pore_pressure_shoulder_Pa"] / net if net else 0.0, "cone_factor": net / strength,
        "normalised_velocity": speed, "undrained_strength_Pa": strength, "rigidity_index": rigidity,
        "undrained_cone_factors": factors, "drained_part_in_experiments": drained_part(speed),
    }  # fmt: skip
    others = ", ".join(f"{value:.2f} by {name}" for name, value in factors.items())
    found = (f"net resistance {1e-3 * net:.0f} kPa, {net / strength:.2f} times the undrained strength (undrained clay: {others}); pore "
             f"pressure at the shoulder {1e-3 * means['pore_pressure_shoulder_Pa']:.0f} kPa")  # fmt: skip
    said = f"normalised velocity {speed:.3g}: " + (found if len(result.history) > 1 else "the cone has not moved")
    return write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie("piezocone", scene, result.frames, WET_QUANTITIES | QUANTITIES)],
        captions={"resistance": "Net resistance of the cone and excess pore pressures beside it"},
        pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
