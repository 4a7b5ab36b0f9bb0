"""An excavation in stages: a pit is dug in steps while the water is drawn down, by elasto-plastic FEM.

The site is a TOML file (`meshes/excavation.toml` unless another is given): a mesh of gmsh, soils with their laws by the names
of its physical groups, supports by boundary, and a list of stages that place and remove soil, change laws, loads, supports
and water levels. In elastic soil the final stresses do not depend on stages that only dig and load; with --compare the study
verifies this, and computes the difference that stages make in plastic soil.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from time import perf_counter

import numpy as np
from common.options import add_switch, study_parser
from common.page import Page
from common.quiet import NOT_REACHED, without_warning
from common.ranks import run_study
from common.results import open_results
from common.site.field_plots import CAPTIONS as STRENGTHS
from common.site.field_plots import strength_pictures
from common.site.file import Site, read_site
from common.site.member_results import captions
from common.solids.plots import captions_for
from common.stages.flow import flow_lines
from common.stages.runs import add_stage_options, carry_out
from common.stages.surface import surface_lines
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge.fem.locking import warn_of_locking_at_failure

comm = MPI.COMM_WORLD
COMPARED = {
    "difference_to_at_once": "the stages change stresses by {:.2g} of the largest stress, against the same soil placed at once",
    "difference_to_at_once_elastic": "in elastic soil they change them by {:.2g}",
}
NOT_CARRIED = "for comparison: the same soil placed at once would not be carried, whose stresses begin at zero"


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_stage_options(p, "excavation", "P2")
    add_switch(
        p,
        "--compare",
        True,
        "also compute elastic soil, and the final geometry in one stage, for comparison; without members, k0 and overconsolidation",
    )
    return p


# --- 2. The stages ---------------------------------------------------------------------------------------------------


def at_once(site: Site, staged: bridge.FemSite, laws: dict | None) -> bridge.QuasiStatic | None:
    """The soil that is there in the end, placed at once with the last laws, supports, loads and water; None where that is not carried."""
    alone, state = bridge.FemSite(site.finite_elements(staged.fem.degree, laws)), staged.state
    before = alone.state.supports
    stage = bridge.Stage("at once", fill=state.there, unit_weight={tag: state.unit_weight[tag] for tag in state.there},
                         law=state.law, pressure=state.pressure, pore_pressure=state.pore_pressure,
                         support=[support for support in state.supports if support not in before],
                         release=[support.facet_tag for support in before if support not in state.supports])  # fmt: skip
    try:
        with without_warning(NOT_REACHED):  # said in the line of the comparison
            alone.carry_out(stage)
    except bridge.StageError:
        return None
    return alone.fem


def difference(one: bridge.QuasiStatic, other: bridge.QuasiStatic | None) -> float | None:
    """Largest difference of the stresses at the points, over the largest stress [-]. Collective."""
    if other is None:
        return None
    apart = comm.allreduce(float(np.abs(one.points.stress - other.points.stress).max(initial=0.0)), MPI.MAX)
    return apart / comm.allreduce(float(np.abs(other.points.stress).max(initial=0.0)), MPI.MAX)


def comparison(site: Site, staged: bridge.FemSite) -> dict[str, float | None]:
    """Staged against built at once, for the soil as it is and for elastic soil. Collective."""
    elastic = {tag: mpm.LinearElastic(young=law.young, poisson=law.poisson) for tag, law in site.laws.items()
               if hasattr(law, "young")}  # fmt: skip
    found = {"difference_to_at_once": difference(staged.fem, at_once(site, staged, None))}
    changed = any(stage.law or stage.support or stage.release for stage in site.stages)
    placed = any(stage.fill for stage in site.stages[1:])  # on soil that has settled already
    if len(elastic) < len(site.laws) or changed or placed:
        return found  # laws without a Young's modulus have no elastic twin; such stages matter in elastic soil as well
    twin = bridge.FemSite(site.finite_elements(staged.fem.degree, elastic))
    list(bridge.carry_out(twin, site.stages))
    return {**found, "difference_to_at_once_elastic": difference(twin.fem, at_once(site, twin, elastic))}


# --- 3. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a: Namespace = parser().parse_args(arguments)
    start = perf_counter()
    site = read_site(a.site, comm, a.cell_size, needed=("stages",))
    folder = open_results(a, comm)
    run = carry_out(site, int(a.elements[1]), folder, comm)
    if a.elements == "P1":
        warn_of_locking_at_failure(run.site.fem)
    compared = (
        comparison(site, run.site)
        if a.compare
        and run.stopped is None
        and site.stages[-1].deconfinement == 1
        and not (site.members or site.begins_at_rest or site.soils_with_strength_ratio)
        else {}
    )
    run.add_surface(site.stages)
    last = run.rows[-1] if run.rows else {}
    summary = {
        "finished_run": run.stopped is None, "stopped_because": run.stopped,
        **{f"last_{key}": last.get(key) for key in ("heave_m", "settlement_m", "sideways_m")}, **compared,
        "stages": [{"stage": row["stage"], **{k: v for k, v in row.items() if k != "stage"}} for row in run.rows],
        "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    shown = {"stages_displacement": "The soil after each stage, by its displacement, with the water table where there is one",
                "stages_flow": "Steady flow of the water around the walls: total head, flow lines and water table",
                "stages_strain": "The soil after each stage, by the strain accumulated since the displacements were reset",
                "surface": "Settlement of level ground at the surface after each stage",
                "movements": "Largest movements after each stage", **captions(run.forces), **STRENGTHS}  # fmt: skip
    said = flow_lines(last.get("stage", ""), run.site.state.pore_pressure)
    said += surface_lines(last)
    said += [COMPARED[name].format(value) if value is not None else NOT_CARRIED for name, value in compared.items()]
    drawn = {**run.drawn(site.stages, folder), **strength_pictures(site, run.site.fem, folder)}
    return write_summary(
        folder, a, summary, comm, Page(captions=captions_for(shown, site.dimension)), drawn, "\n".join(said)
    )


if __name__ == "__main__":
    run_study(main)
