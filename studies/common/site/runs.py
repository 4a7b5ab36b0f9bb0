"""Collapse and factor of safety of a site of several soils, from a TOML file, on meshes of several sizes."""

from __future__ import annotations

import argparse
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import locks_at_failure

import fenics_bridge as bridge

from ..checks import check_effect, say
from ..collapse_runs import UNDECIDED
from ..field_plots import bend, mechanism_field, save_convergence, save_curves, save_mechanism
from ..figures import Pictures
from ..page import Page
from ..quiet import NOT_REACHED, without_warning
from ..results import open_results
from ..slope.fem import finite_elements, step_line, warn_of_linear_elements
from ..solids.member_forces import force_picture
from ..solids.plots import captions_for, save_solid_mechanism
from ..solids.site import solid_mechanism
from ..summary import write_summary
from .field_plots import CAPTIONS as STRENGTHS
from .field_plots import strength_pictures
from .file import Site, read_site
from .k0 import say_left_out
from .member_results import StageForces, force_row, last_forces, member_pictures, write_members
from .member_results import captions as captions_of_members
from .mesh import cell_size_of
from .water_table import level_line


def add_site_option(parser: argparse.ArgumentParser) -> None:
    """Option ``--site``."""
    parser.add_argument("--site", type=Path, default=None, metavar="FILE", help="TOML file of a mesh and its soils by name, such "
                        "as meshes/embankment.toml, instead of the slope and its options; --cell-size instead of the one of "
                        "the file may be given")  # fmt: skip


def check_site_options(parser: argparse.ArgumentParser, options: Namespace, names: set[str]) -> None:
    """End with an error where the command line names options that a site does not have, and leave them out of its parameters.

    Args:
        names: of the options that it has, without dashes, besides those of the results.
    """
    kept = {f"--{name}" for name in (*names, "cell-size", "site", "output", "overwrite", "parameters")}
    others = [name for name in sorted(options.given) if name.replace("--no-", "--") not in kept]
    check_effect(parser, options, options.site is None, others, "no --site")
    if options.site is not None:
        used = [action for action in options.actions if kept.intersection(action.option_strings)]
        options.unused = {action.dest for action in options.actions} - {action.dest for action in used}
        options.actions = used


@without_warning(NOT_REACHED)  # said by the error of a factor of safety
def site_study(
    a: Namespace,
    find: Callable[[Site, bridge.QuasiStatic, Callable], bridge.Collapse],
    name: str,
    label: str,
    more: Callable[[Site], dict] = lambda site: {},
    at_once: bool = True,
    at_rest: bool = True,
    require: Callable[[Site], None] = lambda site: None,
) -> int:
    """A study on a site instead of the slope; returns its exit code. Collective.

    Args:
        a: options, with site, meshes and elements; each mesh is twice as fine as the one before, the last as the site says.
        find: function of the site, its elements (unloaded) and a progress that gives the last equilibrium.
        name: of the value in the summary; label: of its axis, with unit.
        more: function of the site on the finest mesh that returns further entries of the summary.
        at_once: whether anything of it has all soils at once, without what stages change, so that a warning is due.
        at_rest: whether the value is found from the stresses by K0 and overconsolidation; else a warning is due.
        require: function of the site that raises InputError where the study does not have what it needs, before there are results.
    """
    comm, start = MPI.COMM_WORLD, perf_counter()
    finest = a.cell_size or cell_size_of(a.site)
    sizes = [finest * 2**k for k in reversed(range(a.meshes))] if finest else [None]
    site, runs = read_site(a.site, comm, sizes[0]), []
    require(site)
    if not locks_at_failure(list(site.laws.values())):  # of which the bridge warns
        warn_of_linear_elements(a)
    folder = open_results(a, comm)
    if not at_rest:
        say_left_out(site.k0, site.overconsolidation, str(a.site))
    for size in sizes:
        site = site if size == sizes[0] else read_site(a.site, comm, size)
        site = site if at_rest else replace(site, k0={}, overconsolidation={})
        cells = "site" if size is None else f"cells of {size:g} m"
        progress = step_line(cells, label[0].lower() + label[1:])
        model = site.finite_elements(**finite_elements(a))
        runs.append(find(site, model, progress))
    if at_once:
        say(site.left_out_at_once())
    rows = [{"cell_size_m": size, name: run.value, "failed_at": run.failed_at, "failure_shown": run.failed,
             "reason": run.reason, "largest_missing_stress_fraction": run.missing, "largest_displacement_m": run.curve[-1, 1]}
            for size, run in zip(sizes, runs)]  # fmt: skip
    summary = {name: runs[-1].value, "failed_at": runs[-1].failed_at, **more(site),
               "failure_shown": runs[-1].failed, "meshes": rows, "curve_value": runs[-1].curve[:, 0],
               "curve_largest_displacement_m": runs[-1].curve[:, 1], "wall_seconds": perf_counter() - start}  # fmt: skip
    forces = last_forces(model, "last equilibrium")
    write_members(folder, forces, comm)
    if forces:
        summary["members_in_last_equilibrium"] = force_row(model.members, forces[0].forces)
    drawn = {**_drawn(folder, sizes, runs, label, site, model, forces), **strength_pictures(site, model, folder),
             **member_pictures(forces, folder)}  # fmt: skip
    said = []
    for row in rows:
        sure = "" if row["failure_shown"] else f", a lower bound only: {row['reason']}"
        cells = "mesh of the site" if row["cell_size_m"] is None else f"cells of {row['cell_size_m']:g} m"
        said.append(f"{cells}: {name.replace('_', ' ')} {row[name]:.3f}{sure}")
    value = label.split(" [")[0]
    captions = {"mechanism": "Mechanism on the finest mesh, with the soils and, where there is water, the water table",
                "value_displacement": f"{value} over the largest displacement on the way to failure",
                "convergence": f"{value} over the size of the cells",
                **STRENGTHS, **captions_of_members(forces, f"in the last equilibrium on the way to the {value[0].lower() + value[1:]}")}  # fmt: skip
    write_summary(
        folder, a, summary, comm, Page(captions=captions_for(captions, site.dimension)), drawn, "\n".join(said)
    )
    return 0 if all(run.failed for run in runs) else UNDECIDED


def _drawn(
    folder: Path,
    sizes: list,
    runs: list[bridge.Collapse],
    label: str,
    site: Site,
    model: bridge.QuasiStatic,
    forces: list[StageForces],
) -> Pictures:
    """Mechanism on the finest mesh, the value over displacement, forces of members in a body, and convergence. Collective."""
    solid = site.dimension == 3
    body = solid_mechanism(model, runs[-1].mechanism) if solid else None
    field = None if solid else mechanism_field(runs[-1].mechanism, site.axisymmetric, model.cell_tags, model.off)
    wet = not solid and model.largest_pore_pressure() > 0
    if field is None and body is None:
        return {}
    pressures = [stage.pore_pressure for stage in site.stages if stage.pore_pressure is not None]
    corners = None if field is None else (field.points.min(axis=0), field.points.max(axis=0))
    table = level_line(pressures[-1], *corners) if wet and pressures and corners else None
    names = ["mesh of the site" if size is None else f"cells of {size:g} m" for size in sizes]
    curves = {name: (1e3 * run.curve[:, 1], run.curve[:, 0]) for name, run in zip(names, runs)}
    wide, lowest = 1e3 * bend([run.curve for run in runs]), 0.98 * min(run.curve[0, 0] for run in runs)
    values, least = {"site": [run.value for run in runs]}, "" if runs[-1].failed else "of at least "
    lines = [np.array(member.points) for member in model.members.values()]
    title = f"{label.split(' [')[0]} {least}{runs[-1].value:.3f}"
    path = folder / "mechanism.png"
    pictures: Pictures = {
        "mechanism": lambda: save_solid_mechanism(path, body, title) if solid else save_mechanism(path, field, title, water=table, members=lines),
        "value_displacement": lambda: save_curves(
            folder / "value_displacement.png", curves, ("Largest displacement [mm]", label), limits=((0, wide), (lowest, None))),
    }  # fmt: skip
    if body is not None and forces:
        pictures = {**pictures, **force_picture(body, forces[0].forces, "Last equilibrium", folder)}
    if None in sizes or len(sizes) < 2:
        return pictures
    return {**pictures, "convergence": lambda: save_convergence(folder / "convergence.png", sizes, values, label, None)}
