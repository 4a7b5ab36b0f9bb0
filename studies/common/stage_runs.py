"""Stages of construction by finite elements, with a row of results, a picture and a frame for ParaView after each."""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
from fenics_bridge.fem.stages import require_stages

from .quiet import NOT_REACHED, without_warning
from .site_file import Site
from .site_options import add_site_file
from .stage_plots import StageFiles, stage_picture


def add_stage_options(parser: ArgumentParser, site: str, elements: str) -> None:
    """Options of a site that is built in stages: its file, by default one of `meshes/`, its cells and elements."""
    meaning = "linear triangles, as the particles have them, quadratic ones, or those of degree 4"
    add_site_file(parser, site, "soils, supports and stages", (elements, ("P1", "P2", "P4"), meaning))


@without_warning(NOT_REACHED)  # said by the error
def carry_out(
    site: Site, degree: int, folder: Path, comm: MPI.Comm, **options: Any
) -> tuple[bridge.FemSite, list[dict], list, str | None]:
    """Carry out all stages; returns the site, a row and a picture for each stage, and the reason of an early end. Collective.

    Args:
        options: of `Site.finite_elements`.

    Raises:
        InputError: before the first stage, for one that cannot follow those before it.
    """
    staged, rows, pictures, stopped = bridge.FemSite(site.finite_elements(degree, **options)), [], [], None
    require_stages(staged, site.stages)
    with StageFiles(staged, folder / "stages", comm) as files:
        for stage in site.stages:
            try:
                report = staged.carry_out(stage)
            except bridge.StageError as error:
                stopped = str(error)
                break
            files.write(report.number)
            rows.append({**movements(staged), "stage": report.name, "steps": report.steps, "iterations": report.iterations,
                         "largest_displacement_m": report.largest_displacement})  # fmt: skip
            pictures.append(stage_picture(staged, report.name))
            if comm.rank == 0:
                print(f"stage {report.number}, {report.name}: {report.steps} steps, largest displacement "
                      f"{1e3 * report.largest_displacement:.1f} mm", file=sys.stderr)  # fmt: skip
    return staged, rows, [picture for picture in pictures if picture is not None], stopped


def movements(staged: bridge.FemSite) -> dict[str, float]:
    """Largest heave, settlement and sideways displacement of the soil that is there [m]. Collective."""
    fem = staged.fem
    there = np.repeat(fem.points.material >= 0, fem.points.per_cell)
    u = fem.evaluate_at(fem.points.coordinates())["displacement"][there]
    largest = [
        fem.domain.comm.allreduce(float(v.max(initial=0.0)), MPI.MAX) for v in (u[:, 1], -u[:, 1], np.abs(u[:, 0]))
    ]
    return dict(zip(("heave_m", "settlement_m", "sideways_m"), largest))
