"""Stages of construction by finite elements, with a row of results, a picture and a frame for ParaView after each."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge.compat import cell_dofs
from fenics_bridge.fem.stages import require_stages

from ..figures import Pictures
from ..quiet import NOT_REACHED, without_warning
from ..site.file import Site
from ..site.member_results import StageForces, force_row, member_pictures, stage_forces, write_members
from ..site.names import mistakes_in
from ..site.options import add_site_file
from ..solids.member_forces import force_picture
from ..solids.stages import solid_stage, solid_stage_pictures
from .flow import flow_row, upward_exits, warn_of_heave
from .plots import StageFiles, first_shown, stage_picture, stage_pictures
from .surface import surface_rows


def add_stage_options(parser: ArgumentParser, site: str, elements: str) -> None:
    """Options of a site that is built in stages: its file, by default one of `meshes/`, its cells and elements."""
    meaning = "linear triangles, as the particles have them, quadratic ones, or those of degree 4"
    add_site_file(parser, site, "soils, supports and stages", (elements, ("P1", "P2", "P4"), meaning))


@dataclass
class StageRun:
    """Stages that were carried out.

    site: in its last equilibrium; rows: of results, one for each stage; pictures: the same, on the first rank; forces: of the
    structural members; stopped: why the stages ended early, None if they did not
    """

    site: bridge.FemSite
    rows: list[dict[str, Any]] = field(default_factory=list)
    pictures: list[Any] = field(default_factory=list)
    forces: list[StageForces] = field(default_factory=list)
    stopped: str | None = None

    def add_surface(self, stages: Sequence[bridge.Stage]) -> None:
        """Add the settlements of level ground to the rows, on the first rank, which has the pictures."""
        if self.pictures and self.site.fem.domain.topology.dim == 2:
            for row, more in zip(self.rows, surface_rows(self.pictures, first_shown(stages, self.rows))):
                row |= more

    def drawn(self, stages: Sequence[bridge.Stage], folder: Path) -> Pictures:
        """Pictures of the stages and of the structural members."""
        solid = self.site.fem.domain.topology.dim == 3
        draw: Callable[..., Pictures] = solid_stage_pictures if solid else stage_pictures
        pictures = {**draw(stages, self.rows, self.pictures, folder), **member_pictures(self.forces, folder)}
        last = [each for each in zip(self.pictures, self.forces) if solid and each[1].forces][-1:]
        for stage, forces in last:
            pictures |= force_picture(stage.solid.part(stage.there), forces.forces, f"Stage: {stage.name}", folder)
        return pictures


@without_warning(NOT_REACHED)  # said by the error
def carry_out(site: Site, degree: int, folder: Path, comm: MPI.Comm, **options: Any) -> StageRun:
    """Carry out all stages, with files for ParaView and tables in the folder. Collective.

    Args:
        options: of `Site.finite_elements`.

    Raises:
        InputError: before the first stage, for one that cannot follow those before it.
    """
    run = StageRun(bridge.FemSite(site.finite_elements(degree, **options)))
    with mistakes_in(site.path):
        require_stages(run.site, site.stages)
    with StageFiles(run.site, folder / "stages", comm) as files:
        for stage in site.stages:
            try:
                report = run.site.carry_out(stage)
            except bridge.StageError as error:
                run.stopped = str(error)
                break
            files.write(report.number)
            run.forces.append(stage_forces(run.site, report.name))
            run.rows.append({**movements(run.site), "stage": report.name, "steps": report.steps, "iterations": report.iterations,
                             "largest_displacement_m": report.largest_displacement, **flow_row(run.site.state.pore_pressure), **force_row(run.site.fem.members, run.forces[-1].forces)})  # fmt: skip
            if stage.deconfinement < 1:
                run.rows[-1]["deconfinement"] = stage.deconfinement
            state = run.site.state
            warn_of_heave(report.name, upward_exits(state.pore_pressure, state.unit_weight))
            picture = (stage_picture if site.dimension == 2 else solid_stage)(run.site, report.name)
            if picture is not None:
                run.pictures.append(picture)
                print(f"stage {report.number}, {report.name}: {report.steps} steps, largest displacement "
                      f"{1e3 * report.largest_displacement:.1f} mm", file=sys.stderr)  # fmt: skip
    write_members(folder, run.forces, comm)
    return run


def movements(staged: bridge.FemSite) -> dict[str, float]:
    """Largest heave, settlement and sideways displacement of a node of the soil that is there [m]. Collective.

    At nodes, as the surface moves more than the points inside of cells where stresses are, the more the larger these are.
    """
    fem = staged.fem
    there = cell_dofs(fem.displacement.function_space)[fem.points.cells[fem.points.material >= 0]].ravel()
    u = fem.displacement.x.array.reshape(-1, fem.domain.geometry.dim)[there]
    movements = u[:, -1], -u[:, -1], np.linalg.norm(u[:, :-1], axis=1)
    largest = [fem.domain.comm.allreduce(float(v.max(initial=0.0)), MPI.MAX) for v in movements]
    return dict(zip(("heave_m", "settlement_m", "sideways_m"), largest))
