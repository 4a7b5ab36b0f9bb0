"""An embankment built in layers on soft clay: settlement by FEM and particles, then failure and slide by particles.

The site is a TOML file (`meshes/embankment.toml` unless another is given): a mesh of gmsh, soils with their laws by the names
of its physical groups, supports by boundary, and a list of stages. Finite elements and quasi-static particles compute the
same stages; with --nmd linear elements, too, average strains. Then the strength of all soils is divided by --factor, and the
explicit scheme computes the failure, through which pore pressures of the last stage stay as they are in space; if a stage has no
equilibrium, its failure is computed without reduction of the strength.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Callable
from time import perf_counter

import numpy as np
from common.checks import say
from common.interrupt import Interrupt
from common.lengths import metres
from common.options import study_parser
from common.page import Page
from common.ranks import run_study
from common.results import open_results
from common.site import slides
from common.site.field_plots import CAPTIONS as STRENGTHS
from common.site.field_plots import strength_pictures
from common.site.file import Site, read_site
from common.site.member_results import captions
from common.site.slides import add_strength_factor
from common.solids.plots import captions_for
from common.stages.runs import add_stage_options, carry_out
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
CAPTIONS = {
    "stages_displacement": "The soil after each stage, by its displacement",
    "stages_strain": "The soil after each stage, by the strain accumulated since the displacements were reset",
    "movements": "Largest movements after each stage", **slides.CAPTIONS, **STRENGTHS,
}  # fmt: skip


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_stage_options(p, "embankment", "P1")
    add_strength_factor(p)
    slides.add_slide_options(p, damping=0.01, pic=0.002)
    return p


# --- 2. The same stages by particles ---------------------------------------------------------------------------------


def build(
    site: Site, per_cell: int, factor: float, nmd: bool, staged: bridge.FemSite | None = None
) -> tuple[bridge.ParticleSite, str | None]:
    """Particles after all stages, and why they ended early if they did; weaker laws are there for the slide. Collective.

    Where stages install structural members, or strengths are random fields or follow the vertical stress, the particles begin from the finite elements, `staged`:
    quasi-static ones of their own have none.
    """
    model, materials = site.model(site.weaker_laws(factor) if factor > 1 else ())
    particles = bridge.ParticleSite(
        model, materials, site.supports, per_cell=per_cell, small_displacements=True, nmd=nmd
    )
    if begins_from_elements(site) and staged is not None:
        handover = particles.take_over(staged)
        parts = {"the structural members": site.members, "the random fields": site.random,
                 "the strengths by the vertical stress": site.soils_with_strength_ratio}  # fmt: skip
        has = " and ".join(name for name, there in parts.items() if there)
        say(
            f"the particles begin from the finite elements, which have {has}; out-of-balance ratio {handover.unbalanced_ratio:.1e}"
        )
        return particles, None
    try:
        for report in bridge.carry_out(particles, site.stages):
            if comm.rank == 0:
                print(
                    f"particles, stage {report.number}, {report.name}: {report.iterations} iterations", file=sys.stderr
                )
    except bridge.StageError as error:
        return particles, str(error)
    return particles, None


def begins_from_elements(site: Site) -> bool:
    """Whether a site has what quasi-static particles cannot have in their own stages."""
    return bool(site.members or site.random or site.soils_with_strength_ratio)


def stress_difference(particles: bridge.ParticleSite, staged: bridge.FemSite) -> float:
    """Largest difference between the particles' stresses and those of the finite elements, over the largest [-]. Collective."""
    p = particles.model.particles
    expected = staged.fem.evaluate_at(p.position)["stress"]
    apart, largest = (
        comm.allreduce(float(np.abs(v).max(initial=0.0)), MPI.MAX) for v in (p.stress - expected, expected)
    )
    return apart / largest


# --- 3. Failure and slide --------------------------------------------------------------------------------------------


def weaken(site: Site, model: mpm.Model, factor: float) -> None:
    """Give all particles the laws whose strength is divided by the factor."""
    if factor > 1:
        model.assign(model.particles.material + len(site.laws) + len(site.further_laws))


def pore_water(particles: bridge.ParticleSite) -> Callable[[], None]:
    """Function that lets the pore pressures of the last stage act on the particles where they are by then. Collective.

    Pressures on boundaries are dead loads, which move with the particles; beside such loads the forces of the water do too.
    """
    model, state = particles.model, particles.state

    def act() -> None:
        if state.pore_pressure is not None and not state.pressure:
            model.particles.set("traction", bridge.seepage_forces(model, state.pore_pressure))

    if state.pore_pressure is not None and state.pressure:
        say("in the slide the forces of the pore water move with the soil, as the pressures of the stages do")
    return act


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parser().parse_args(arguments)
    start = perf_counter()
    site = read_site(a.site, comm, a.cell_size, needed=("stages",))
    folder = open_results(a, comm)
    degree = int(a.elements[1])
    nmd = a.nmd and degree == 1
    run = carry_out(site, degree, folder, comm, nmd=nmd, as_particles=nmd and begins_from_elements(site))
    failed, rows = run.stopped, run.rows
    built = perf_counter()
    particles, failed_particles = build(site, slides.particles_per_cell(a, site), a.factor, a.nmd, run.site)
    own_stages = not (failed or failed_particles or begins_from_elements(site))
    apart = stress_difference(particles, run.site) if own_stages else None
    model = particles.model
    model.particles.set("initial_position", model.particles.position)
    factor = 1.0 if failed_particles or (failed and begins_from_elements(site)) else a.factor
    weaken(site, model, factor)
    ground = slides.ground_of(model, site.laws)
    with Interrupt(comm) as interrupt:
        result, stopped = slides.slide(a, model, folder, interrupt, pore_water(particles))
    moved = result.history["largest_displacement_m"][-1]
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped, "stage_without_equilibrium_fem": failed,
        "stage_without_equilibrium_particles": failed_particles,
        "settlement_m": rows[-1]["settlement_m"] if rows else None, "sideways_m": rows[-1]["sideways_m"] if rows else None,
        "stress_difference_of_particles_to_fem": apart, "factor": factor, "largest_displacement_of_slide_m": moved,
        "particles": comm.allreduce(len(model.particles)),
        "stages": [{"stage": row["stage"], **{k: v for k, v in row.items() if k != "stage"}} for row in rows],
        "wall_seconds": {"stages_fem": built - start, "all": perf_counter() - start},
    }  # fmt: skip
    drawn = {
        **(run.drawn(site.stages, folder) if a.pictures else {}),
        **slides.slide_pictures(a, result, ground, folder),
        **(strength_pictures(site, run.site.fem, folder) if a.pictures else {}),
    }
    slide = f"strength divided by {factor:g}" if factor > 1 else "full strength"
    movie = [slides.slide_movie(slide, ground, result)]
    if comm.rank == 0:
        for who, message in (("finite elements", failed), ("particles", failed_particles)):
            if message:
                print(f"{who}: {message}", file=sys.stderr)
    said = f"slide, {slide}: largest displacement {metres(moved)} after {result.history['time_s'][-1]:.3g} s"
    code = write_summary(
        folder,
        a,
        summary,
        comm,
        Page(movies=movie, captions=captions_for({**CAPTIONS, **captions(run.forces)}, site.dimension)),
        drawn,
        said,
    )
    return interrupt.exit_code or code


if __name__ == "__main__":
    run_study(main)
