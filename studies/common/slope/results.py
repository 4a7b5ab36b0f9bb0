"""What the study slope draws, writes and says at its end."""

from __future__ import annotations

import sys
from argparse import Namespace
from functools import partial
from pathlib import Path

from mpi4py import MPI

import mpm_core as mpm

from ..animation import save_animation
from ..figures import Pictures
from ..history import History
from ..lengths import metres
from ..movie import PORE, fem_frame, particle_movie
from ..page import Page
from ..plots import (
    DISPLACEMENT,
    PORE_PRESSURE,
    SHEAR_STRAIN,
    VERTICAL_STRESS,
    Quantity,
    Scene,
    colour_limits,
    save_history,
    save_mesh,
    save_particles,
)
from .case import SlopeCase

comm = MPI.COMM_WORLD


def drawn(a: Namespace, scene: Scene | None, frames: list[dict], history: History, folder: Path) -> Pictures:
    """Figures 2 to 6 of the paper and a film, from the stored frames."""
    if scene is None or not a.pictures:
        return {}
    first, last = frames[0], frames[-1]
    shown = [
        ("figure_3_displacement", "displacement", DISPLACEMENT),
        ("figure_4_shear_strain", "shear_strain", SHEAR_STRAIN),
        ("figure_5_vertical_stress", "vertical_stress", VERTICAL_STRESS),
    ]
    if PORE in last:
        shown.append(("figure_7_excess_pore_pressure", PORE, PORE_PRESSURE))
    title = f"$t$ = {last['time']:.1f} s"

    def particles(name: str, key: str, quantity: Quantity) -> None:
        limits = colour_limits(quantity, [frame[key] for frame in frames])
        save_particles(folder / f"{name}.png", scene, last["position"], last["volume"], last[key], quantity,
                       limits=limits, title=title, legend=True)  # fmt: skip

    crest = history["crest_displacement_m"]
    pictures = {
        "figure_2_mesh": lambda: save_mesh(folder / "figure_2_mesh.png", scene, first["position"], first["volume"]),
        **{each[0]: partial(particles, *each) for each in shown},
        "figure_6_crest": lambda: save_history(
            folder / "figure_6_crest.png", history["time_s"], {"crest": crest}, "Displacement of the particle at the crest [m]",
            limits=(0, max(0.5, 1.05 * crest.max()))),
    }  # fmt: skip
    if a.film:
        pictures["film"] = lambda: save_animation(folder / "slide", scene, frames, "shear_strain", SHEAR_STRAIN)
    return pictures


def page(case: SlopeCase, frames: list[dict], summary: dict) -> Page:
    """Content of the page ``report.html`` beside figures and tables. Collective."""
    a, scene = case.args, case.scene()
    movies = [particle_movie(f"MPM, {a.unit_weight / 1e3:g} kN/m\u00b3", scene, frames)]
    if case.fem is not None:
        before = fem_frame(case.model, case.fem, 0.0, case.model.particles.initial_position)
        title = f"FEM, equilibrium under {a.initial_unit_weight / 1e3:g} kN/m\u00b3 before the slide"
        movies.append(particle_movie(title, scene, [before]))
    captions = {
        "figure_2_mesh": "Background mesh and particles at the start", "figure_3_displacement": "Total displacement at the end",
        "figure_4_shear_strain": "Accumulated plastic shear strain at the end",
        "figure_5_vertical_stress": "Vertical stress at the end", "figure_6_crest": "Displacement of the crest over time",
        "figure_7_excess_pore_pressure": "Excess pore pressure at the end",
        "figure_8_ensemble": "Displacement of the crest in all runs of the ensemble",
    }  # fmt: skip
    facts = {
        "displacement of the crest": metres(summary['crest_displacement_m']), "run-out": metres(summary['runout_m']),
        "simulated": f"{summary['time_s']:.4g} s", "particles": f"{summary['particles']:,}",
    }  # fmt: skip
    viscosity = f", viscosity {a.viscosity:g} Pa s" if a.material == "viscoplastic" else ""
    subtitle = (f"{a.height:g} m high, inclined by {a.angle:g} degrees, unit weight {a.unit_weight / 1e3:g} kN/m\u00b3{viscosity}. Initial "
                f"stresses: {a.initial}; slide by the {a.scheme} material point method.")  # fmt: skip
    return Page(movies=movies if scene else (), facts=facts, subtitle=subtitle, captions=captions)


def summarised(case: SlopeCase, start: dict, loop: dict, history: History, clock: dict[str, float]) -> dict:
    """The results of a run by name. Collective."""
    a, mesh, report = case.args, case.model.mesh, loop["report"]
    names = list(clock)
    return {
        "scheme": a.scheme,
        "finished_run": loop["stopped"] is None,
        "stopped_because": loop["stopped"],
        "time_s": report.time,
        "steps": report.steps,
        "cells": comm.allreduce(mesh.owned_cells),
        "soil_cells": comm.allreduce(int((mesh.cell_tags[: mesh.owned_cells] == 1).sum())),
        "particles": report.particles,
        **start,
        "crest_displacement_m": history["crest_displacement_m"][-1],
        "runout_m": history["runout_m"][-1],
        "energy_J_per_m": energies(report),
        # There is none to balance in a quasi-static run.
        "unexplained_fraction_of_energy": report.unexplained_fraction if a.scheme != "quasi-static" else None,
        "particle_steps_per_second": loop["particle_steps"] / loop["seconds"] if loop["seconds"] else 0.0,
        "wall_seconds": {name: clock[name] - clock[before] for before, name in zip(names, names[1:])},
    }


def energies(report: mpm.Report) -> dict[str, float]:
    """Works and energies at the end, by name."""
    names = ("external_work", "support_work", "kinetic_energy", "nodal_kinetic_energy", "stored_energy", "plastic_work",
             "damping_work", "pic_loss", "unexplained_energy")  # fmt: skip
    return {name: getattr(report, name) for name in names}


def start_line(a: Namespace, start: dict[str, float]) -> str:
    """How far the initial stresses are from equilibrium."""
    kind = "zero" if a.initial == "zero" else f"{a.initial}, {a.initial_unit_weight:g} N/m3"
    found = f"out-of-balance ratio {start['initial_out_of_balance_ratio']:.2g}"
    if a.initial == "fem":
        yielded, returned = (100 * start[f"{name}_fraction"] for name in ("newly_yielded", "returned_to_strength"))
        found = (f"out-of-balance ratio before equilibration {start['initial_out_of_balance_ratio']:.2g}, after "
                 f"{start['equilibrated_out_of_balance_ratio']:.2g}; newly yielded {yielded:.2g} %; returned to the yield "
                 f"surface {returned:.2g} %")  # fmt: skip
    return f"initial stresses ({kind}): {found}"


def print_summary(summary: dict, folder: Path) -> None:
    print(
        f"crest displacement {metres(summary['crest_displacement_m'])}, run-out {metres(summary['runout_m'])} at "
        f"{summary['time_s']:g} s; {summary['particle_steps_per_second'] / 1e6:.1f} million particle-steps per second"
    )
    print(f"results in {folder}", flush=True)
    if summary["stopped_because"]:
        print(
            f"the run ended early: {summary['stopped_because']}; the results so far have been written", file=sys.stderr
        )
