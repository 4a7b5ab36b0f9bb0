"""A rigid footing is pushed into clay: load over settlement, from the first yield to large penetration.

A strip or circular footing, smooth or rough, is a rigid body in contact with the particles. It does not depend on the mesh,
and is pushed further when the soil beside it has risen above its base. The clay is undrained and has no weight (Tresca), so
that the load over area and shear strength just after the soil has yielded is the bearing capacity factor N_c: 5.14 for a
strip, 5.69 for a smooth and 6.05 for a rough circle. It converges from above, because cells at the edge make the footing
wider by half of their size. With further penetration the load continues to rise, as for an embedded footing. Soft clay, as that
of the default --rigidity, has not yielded before the footing is embedded: take 2000 or more to find N_c.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
from common.body_runs import MAY_CHANGE, BodyRun, add_body_run_options, body_pictures, follow, mean_force, write_results
from common.checkpoint import check_restart
from common.checks import check_cells, say
from common.figures import Pictures, curve_figure
from common.history import History
from common.movie import particle_movie
from common.options import add_choice, add_number, check, study_parser
from common.plots import CURVES, Scene
from common.ranks import run_study
from common.results import ROOT, open_results
from common.scenes import scene_of
from common.site.laws import unit_doubt
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
COLUMNS = ["time_s", "settlement_m", "load_factor", "impulse_Ns", "contact_area_m2", "sticking_fraction",
           "unexplained_fraction_of_energy", "dt_s"]  # fmt: skip
EXACT = {
    ("strip", "smooth"): 2 + np.pi,
    ("strip", "rough"): 2 + np.pi,
    ("circular", "smooth"): 5.69,
    ("circular", "rough"): 6.05,
}
"""Bearing capacity factors: Prandtl 1920; Cox, Eason and Hopkins 1961; Eason and Shield 1960"""
COLLAPSE = (12.0, 24.0)
"""Settlements between which the factor is taken, over the width times the strength over Young's modulus: the soil has just
yielded, and stiff clay has hardly embedded the footing"""
EMBEDDED = 0.03
"""Settlement over the width, above which the load is more than that of a footing at the surface"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_choice(
        p, "--shape", "strip", ("strip", "circular"), "half of a strip, or the half section of a circular footing"
    )
    add_choice(
        p, "--base", "rough", ("smooth", "rough"), "no shear stress on the footing, or up to the strength of the clay"
    )
    add_number(p, "--half-width", 0.5, "m", "half of the footing's width, or its radius", above=0)
    add_number(p, "--penetration", 0.3, "m", "final settlement", above=0)
    add_number(p, "--strength", 20e3, "Pa", "undrained shear strength of the clay", above=0)
    add_number(p, "--rigidity", 200.0, "-", "ratio of Young's modulus to the shear strength", above=0)
    add_number(p, "--poisson", 0.45, "-", "Poisson's ratio", above=-1, below=0.5)
    add_number(p, "--density", 1800.0, "kg/m3", "density of the clay", above=0)
    add_number(p, "--speed", 1e-3, "-", "ratio of the footing's speed to that of elastic waves", above=0, at_most=0.1)
    add_number(p, "--cell-size", 0.02, "m", "size of the cells along the path of the footing's edge", above=0)
    add_number(p, "--coarsening", 2.5, "-", "ratio of the size of the cells under the footing to that along this path; cells far "
               "away are four times as large", at_least=1)  # fmt: skip
    add_body_run_options(p, damping=0.0, pic=0.01, nmd=True)
    return p


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    a = p.parse_args(arguments)
    check(p, a.penetration <= 4 * a.half_width, lambda: f"--penetration is {a.penetration:g} m, expected up to twice the width, "
          f"{4 * a.half_width:g} m")  # fmt: skip
    check(p, 2 * a.cell_size <= a.half_width, lambda: f"--cell-size is {a.cell_size:g} m, expected half of --half-width, "
          f"{a.half_width:g} m, at most")  # fmt: skip
    inside = 2.5 * a.half_width * (a.penetration + 1.5 * a.half_width) / (a.coarsening * a.cell_size) ** 2
    check_cells(p, a, 2.3 * (inside + 12 * a.penetration / a.cell_size), "--cell-size", "--half-width", "--penetration")
    say(unit_doubt({"shear_strength": a.strength}, "the clay"))
    check_restart(p, a, MAY_CHANGE)
    return a


# --- 2. Ground and footing -------------------------------------------------------------------------------------------


def clay(a: Namespace) -> mpm.MohrCoulomb:
    return mpm.tresca(young=a.rigidity * a.strength, poisson=a.poisson, shear_strength=a.strength)


def speed_of(a: Namespace) -> float:
    """Speed of the footing [m/s]."""
    return float(a.speed * np.sqrt(clay(a).p_wave_modulus / a.density))


def duration(a: Namespace) -> float:
    """The footing gains its speed over a hundredth of the way [s]."""
    return 1.01 * a.penetration / speed_of(a)


def footing(a: Namespace, base: float) -> mpm.Box:
    """The footing with its base at a height [m]."""
    return mpm.Box((-a.half_width, base), (a.half_width, base + a.half_width + a.penetration))


def build(a: Namespace) -> mpm.Model:
    """Clay on a fixed base under the footing. Collective."""
    near = a.coarsening * a.cell_size
    lengths = {
        "half_width": a.half_width, "width": 5 * a.half_width + a.penetration, "depth": 3 * a.half_width + a.penetration,
        "headroom": 0.25 * a.half_width + 0.5 * a.penetration, "penetration": a.penetration, "edge_size": a.cell_size,
        "near_size": near, "far_size": 4 * near,
    }  # fmt: skip
    mesh = bridge.read_mesh(ROOT / "meshes" / "footing_push.geo", comm, parameters=lengths)
    geometry = mpm.Geometry.AXISYMMETRIC if a.shape == "circular" else mpm.Geometry.PLANE_STRAIN
    model = mpm.Model(bridge.background_mesh(*mesh), clay(a), geometry=geometry)
    if a.restart is not None:
        model.restore(a.restart)
        return model
    model.seed(density=a.density, per_cell=a.particles_per_cell, cell_tag="soil")
    for side in ("axis", "far"):
        model.roller(side, normal=(1, 0))
    model.fix("base")
    base = 1e-9 * a.half_width - model.gap(footing(a, 0.0))  # particles are larger than their distance from the surface
    speed = speed_of(a)
    rising = ([0.0, 0.02 * a.penetration / speed], [(0.0, 0.0), (0.0, -speed)])
    model.add_contact(footing(a, base), adhesion=a.strength if a.base == "rough" else 0.0, velocity=rising)
    model.rebalance()
    return model


def full_load(a: Namespace) -> float:
    """Shear strength times the part of the footing that the half section has: that of half a strip, of one radian [N]."""
    return a.strength * (0.5 * a.half_width**2 if a.shape == "circular" else a.half_width)


def row(a: Namespace, body: mpm.RigidContact, history: History, report: mpm.Report) -> dict[str, float]:
    """A row of the history; Collective."""
    return {
        "time_s": report.time, "settlement_m": -body.displacement[1],
        "load_factor": mean_force(history, body, report.time, 1) / full_load(a), "impulse_Ns": body.impulse[1],
        "contact_area_m2": body.area, "sticking_fraction": body.sticking_fraction,
        "unexplained_fraction_of_energy": report.unexplained_fraction, "dt_s": report.dt,
    }  # fmt: skip


def collapse_factor(a: Namespace, history: History) -> float | None:
    """Mean load factor just after the soil has yielded; None where the footing did not get there."""
    settled = history["settlement_m"] * a.rigidity / (2 * a.half_width)
    chosen = (settled >= COLLAPSE[0]) & (settled <= COLLAPSE[1])
    return float(history["load_factor"][chosen].mean()) if chosen.any() else None


def read_between(a: Namespace) -> tuple[float, float]:
    """Settlements between which the bearing capacity factor is read [m]."""
    first, last = (2 * a.half_width * ratio / a.rigidity for ratio in COLLAPSE)
    return first, last


def embedded(a: Namespace) -> str:
    """What the line of results adds where the factor is that of an embedded footing rather than that of the surface; else no text."""
    last = COLLAPSE[1] / a.rigidity
    if last <= EMBEDDED:
        return ""
    return (
        f" ({a.rigidity:g} times as stiff as strong, the clay yields as the footing is embedded by up to {100 * last:.2g} % of its width, which "
        f"raises N_c; with --rigidity {COLLAPSE[1] / EMBEDDED:.0f} and more it is that of the surface)"
    )


def factor_said(a: Namespace, factor: float | None, settlement: float) -> str:
    """The bearing capacity factor in words, or why there is none."""
    first, last = read_between(a)
    if factor is not None:
        return f"{factor:.2f} at settlements of {first:.3g} to {last:.3g} m"
    if settlement < first:
        return f"not reached: it is read at settlements of {first:.3g} to {last:.3g} m"
    return f"not known: none of --frames {a.frames} is at a settlement of {first:.3g} to {last:.3g} m"


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def draw_load(path: Path, a: Namespace, history: History) -> None:
    """The load factor over the settlement, with the exact one."""
    with curve_figure(path) as axes:
        settled = history["settlement_m"] / (2 * a.half_width)
        axes.plot(settled, history["load_factor"], color=CURVES[0], label=f"{a.base} {a.shape} footing")
        axes.axhline(
            EXACT[a.shape, a.base], color="black", linewidth=0.9, linestyle="--", label="exact, at the surface"
        )
        width = "width" if a.shape == "strip" else "diameter"
        axes.set(
            xlabel=f"Settlement over the {width} [-]",
            ylabel="Load over area and $s_u$ [-]",
            xlim=(0, None),
            ylim=(0, None),
        )
        axes.legend(loc="lower right")


def drawn(a: Namespace, scene: Scene | None, result: BodyRun, folder: Path) -> Pictures:
    """The load, the soil and the footing in the end, and a film."""
    settlement = result.history["settlement_m"][-1]
    box = np.array([[0.0, -settlement - 2.5 * a.half_width], [4 * a.half_width, a.half_width]])
    pictures = body_pictures(a, scene, result, folder, f"settlement {settlement:.3g} m", box=box)
    return {"load": lambda: draw_load(folder / "load.png", a, result.history), **pictures} if pictures else {}


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    begin = perf_counter()
    folder = open_results(a, comm)
    model = build(a)
    (body,) = model.contacts
    result = follow(a, model, duration(a), COLUMNS, partial(row, a, body), folder, shown="load_factor")
    history, scene = result.history, scene_of(model, [1])
    factor, exact, name = collapse_factor(a, history), EXACT[a.shape, a.base], f"{a.base} {a.shape} footing"
    settlement, load = (history[column][-1] for column in ("settlement_m", "load_factor"))
    results = {
        "bearing_capacity_factor": factor, "bearing_capacity_factor_read_at_settlements_m": read_between(a), "exact_factor": exact,
        "largest_load_factor": float(history["load_factor"].max()),
        "settlement_m": settlement, "load_factor_in_the_end": load,
    }  # fmt: skip
    more = embedded(a) if factor is not None else ""
    said = f"{name}: N_c {factor_said(a, factor, settlement)}, exact {exact:.2f} at the surface{more}; load factor {load:.2f} at a settlement "
    said += f"of {settlement:.3g} m"
    return write_results(
        a, model, result, folder, results, said, begin=begin,
        movies=[particle_movie(name, scene, result.frames)],
        captions={"load": "Load over area and shear strength, over the settlement"},
        pictures=drawn(a, scene, result, folder),
    )  # fmt: skip


if __name__ == "__main__":
    run_study(main)
