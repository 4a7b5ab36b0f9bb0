"""A cone is pushed into soil, as in a cone penetration test: resistance over depth, in axial symmetry.

A 60 degree cone with a smooth shaft is pushed downwards from the surface of the ground; both are rigid bodies in contact with
the particles, and half of the section is computed. The soil has neither weight nor initial stress. Without friction it is
undrained clay (Tresca), and the resistance over the shear strength is the cone factor, which depends on the rigidity index and
on the roughness of the cone. With friction and cohesion it is a drained soil (Mohr-Coulomb), whose cohesion acts as an initial
stress of c cot(phi) does (Caquot). The factor rises until the cone is some diameters deep, the more the stiffer the soil.
There is no exact factor: it is compared with two fits to numerical results for clay and, for soil with friction, with the
limit pressure of a spherical cavity, which is too low.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common.body_runs import MAY_CHANGE, BodyRun, add_body_run_options, body_pictures, follow, mean_force, write_results
from common.checkpoint import check_restart
from common.checks import check_cells, check_cells_of_radius, say
from common.cone_theory import STEEPNESS, beyond_factors, clay_factors, spherical_limit_pressure
from common.figures import Pictures, curve_figure
from common.history import History
from common.movie import particle_movie
from common.options import add_choice, add_number, check, study_parser
from common.plots import CURVES, Scene
from common.quiet import GATHERS, without_warning
from common.ranks import run_study
from common.results import ROOT, open_results
from common.scenes import scene_of
from common.site.laws import unit_doubt
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
COLUMNS = ["time_s", "depth_m", "cone_factor", "resistance_Pa", "impulse_Ns", "shaft_impulse_Ns", "contact_area_m2",
           "sticking_fraction", "unexplained_fraction_of_energy", "dt_s"]  # fmt: skip
STEADY = 0.15
"""Last part of the way over which the factor is averaged"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_number(p, "--radius", 0.018, "m", "radius of the cone and of its shaft", above=0)
    add_number(p, "--penetration", 0.18, "m", "final depth of the cone's shoulder", above=0)
    add_choice(
        p, "--face", "smooth", ("smooth", "rough"), "no shear stress on the cone, or up to the strength of the soil"
    )
    add_number(p, "--strength", 20e3, "Pa", "undrained shear strength, or the cohesion with friction", above=0)
    add_number(
        p, "--friction-angle", 0.0, "degrees", "friction angle of the soil; 0 is undrained clay", at_least=0, below=90
    )
    add_number(p, "--dilation-angle", 0.0, "degrees", "dilation angle of the soil", at_least=0, below=90)
    add_number(p, "--rigidity", 100.0, "-", "rigidity index, the ratio of shear modulus to strength", above=0)
    add_number(p, "--poisson", 0.49, "-", "Poisson's ratio", above=-1, below=0.5)
    add_number(p, "--density", 1800.0, "kg/m3", "density of the soil", above=0)
    add_number(p, "--speed", 3e-3, "-", "ratio of the cone's speed to that of elastic waves", above=0, at_most=0.1)
    add_number(p, "--cell-size", 0.0015, "m", "size of the cells along the path of the cone's shoulder", above=0)
    add_number(p, "--width", 20.0, "-", "ratio of the ground's radius to that of the cone", at_least=5)
    add_number(
        p, "--coarsening", 2.0, "-", "ratio of the size of the cells beside this path to that along it", at_least=1
    )
    add_number(p, "--growth", 0.15, "-", "increase of the cell size per length of distance from the path", above=0)
    add_body_run_options(p, damping=0.0, pic=0.01, nmd=True, integration="particles")
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    check_cells_of_radius(p, a)
    check(p, a.dilation_angle <= a.friction_angle, lambda: f"--dilation-angle is {a.dilation_angle:g} degrees, expected "
          f"--friction-angle, {a.friction_angle:g} degrees, at most")  # fmt: skip
    inside = 2.5 * a.radius * (way(a) + 1.5 * a.radius) / (a.coarsening * a.cell_size) ** 2
    check_cells(p, a, 2.3 * (inside + 12 * way(a) / a.cell_size), "--cell-size", "--radius", "--penetration")
    say(unit_doubt({"shear_strength" if a.friction_angle == 0 else "cohesion": a.strength}, "the soil"))
    check_restart(p, a, MAY_CHANGE)
    say(beyond_factors(a.rigidity) if a.friction_angle == 0 else "")
    return a


# --- 2. Ground and cone ----------------------------------------------------------------------------------------------


def young(a: Namespace) -> float:
    """Young's modulus [Pa]."""
    return float(2 * (1 + a.poisson) * a.rigidity * a.strength)


def soil(a: Namespace) -> mpm.MohrCoulomb:
    if a.friction_angle == 0:
        return mpm.tresca(young=young(a), poisson=a.poisson, shear_strength=a.strength)
    return mpm.MohrCoulomb(young=young(a), poisson=a.poisson, cohesion=a.strength, friction_angle=a.friction_angle,
                           dilation_angle=a.dilation_angle)  # fmt: skip


def speed_of(a: Namespace) -> float:
    """Speed of the cone [m/s]."""
    return float(a.speed * np.sqrt(soil(a).p_wave_modulus / a.density))


def way(a: Namespace) -> float:
    """Displacement from the first touch of the tip until the shoulder is at the final depth [m]."""
    return float(a.penetration + STEEPNESS * a.radius)


def duration(a: Namespace) -> float:
    """The cone gains its speed over a hundredth of the way [s]."""
    return 1.01 * way(a) / speed_of(a)


def cone(a: Namespace, tip: float) -> mpm.Polyline:
    """The whole section of the cone with its tip at a height [m]; the soil is outside."""
    shoulder = tip + STEEPNESS * a.radius
    return mpm.Polyline([(0.0, tip), (-a.radius, shoulder), (a.radius, shoulder)], closed=True)


def shaft(a: Namespace, tip: float) -> mpm.Box:
    """The shaft on a cone with its tip at a height [m]."""
    shoulder = tip + STEEPNESS * a.radius
    return mpm.Box((-a.radius, shoulder), (a.radius, shoulder + a.penetration + 4 * a.radius))


def build(a: Namespace) -> mpm.Model:
    """Ground on a fixed base under the cone. Collective."""
    near = a.coarsening * a.cell_size
    lengths = {
        "half_width": a.radius, "width": a.width * a.radius, "depth": way(a) + 0.5 * a.width * a.radius,
        "headroom": 3 * a.radius, "penetration": way(a), "edge_size": a.cell_size, "near_size": near,
        "far_size": near + a.growth * a.width * a.radius,
    }  # fmt: skip
    mesh = bridge.read_mesh(ROOT / "meshes" / "footing_push.geo", comm, parameters=lengths)
    model = mpm.Model(bridge.background_mesh(*mesh), soil(a), geometry=mpm.Geometry.AXISYMMETRIC)
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=a.density, per_cell=a.particles_per_cell, cell_tag="soil")
    for side in ("axis", "far"):
        model.roller(side, normal=(1, 0))
    model.fix("base")
    tip = 1e-9 * a.radius - model.gap(cone(a, 0.0))  # particles are larger than their distance from the surface
    speed = speed_of(a)
    motion = ([0.0, 0.02 * way(a) / speed], [(0.0, 0.0), (0.0, -speed)])
    # Soil that is pressed on a rough face is weaker than the contact, and fails itself.
    model.add_contact(cone(a, tip), friction=1.0 if a.face == "rough" else 0.0, velocity=motion)
    model.add_contact(shaft(a, tip), velocity=motion)
    model.rebalance()
    return model


def full_load(a: Namespace) -> float:
    """The strength on the section of the shaft that one radian has [N]."""
    return 0.5 * a.radius**2 * a.strength


def row(a: Namespace, body: mpm.RigidContact, history: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history. Collective."""
    factor = mean_force(history, body, report.time, 1) / full_load(a)
    return {
        "time_s": report.time, "depth_m": -body.displacement[1] - STEEPNESS * a.radius, "cone_factor": factor,
        "resistance_Pa": factor * a.strength, "impulse_Ns": body.impulse[1],
        "shaft_impulse_Ns": body.model.contacts[1].impulse[1], "contact_area_m2": body.area,
        "sticking_fraction": body.sticking_fraction, "unexplained_fraction_of_energy": report.unexplained_fraction,
        "dt_s": report.dt,
    }  # fmt: skip


def estimates(a: Namespace) -> dict[str, float]:
    """Cone factors of the literature by their source."""
    rough = float(a.face == "rough")
    if a.friction_angle == 0:
        return clay_factors(a.rigidity, rough)
    pressure = spherical_limit_pressure(young=young(a), poisson=a.poisson, cohesion=a.strength, friction_angle=a.friction_angle,
                                        dilation_angle=a.dilation_angle) / a.strength  # fmt: skip
    face = rough * (1 + pressure * np.tan(np.radians(a.friction_angle)))
    return {"spherical cavity": pressure + face / np.tan(np.radians(30))}


def in_the_end(history: History) -> tuple[float, float | None]:
    """Mean factor over the last part of the way, and how much higher it is than over as long a part before, if rows are there."""
    depth, factor = history["depth_m"], history["cone_factor"]
    length = STEADY * (depth[-1] - depth[0])
    parts = np.floor((depth[-1] - depth) / length * (1 - 1e-9))
    last = float(factor[parts == 0].mean())
    return last, last / float(factor[parts == 1].mean()) - 1 if (parts == 1).any() else None


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw_resistance(path: Path, a: Namespace, history: History) -> None:
    """The cone factor over the depth, which goes down."""
    with curve_figure(path, (3.8, 4.6)) as axes:
        depth = history["depth_m"] / (2 * a.radius)
        axes.plot(history["cone_factor"], depth, color=CURVES[0], label=f"{a.face} cone")
        for (name, value), line in zip(estimates(a).items(), ("--", ":")):
            axes.axvline(value, color="black", linewidth=0.9, linestyle=line, label=name)
        strength = "$s_u$" if a.friction_angle == 0 else "$c$"
        axes.set(xlabel=f"Cone resistance over {strength} [-]", ylabel="Depth of the shoulder over the diameter [-]",
                 xlim=(0, None), ylim=(depth[-1], depth[0]))  # fmt: skip
        axes.legend(loc="lower left")


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """The resistance, the soil and the cone in the end, and a film."""
    depth = result.history["depth_m"][-1]
    box = np.array([[0.0, -depth - 5 * a.radius], [5 * a.radius, 2 * a.radius]])  # beyond it nothing yields
    pictures = body_pictures(a, scene, result, folder, f"depth {depth:.3g} m", box=box)
    return (
        {"resistance": lambda: draw_resistance(folder / "resistance.png", a, result.history), **pictures}
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
    body, _ = model.contacts
    result = follow(a, model, duration(a), COLUMNS, partial(row, a, body), folder, shown="cone_factor")
    history, scene = result.history, scene_of(model, [1])
    (factor, rise), known = in_the_end(history), estimates(a)
    results = {
        "cone_factor": factor, "rise_of_the_factor": rise, "resistance_Pa": factor * a.strength,
        "depth_m": history["depth_m"][-1], "estimates": known,
    }  # fmt: skip
    others = ", ".join(f"{value:.2f} by {name}" for name, value in known.items())
    change = "" if rise is None else f", {100 * rise:+.1f} % over the preceding section of the path"
    said = f"cone factor {factor:.2f}{change}; {others}"
    return write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie("cone", scene, result.frames)],
        captions={"resistance": "Resistance of the cone over the strength of the soil, over the depth"},
        pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
