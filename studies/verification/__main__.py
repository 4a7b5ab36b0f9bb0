"""Verification and validation: every case is repeated, and one report compares the results with the expected values.

Writes report.html, verification.json and pictures. Exits with 1 when a check fails; known limits of the method are shown, but
do not count as failures.
"""

from __future__ import annotations

import importlib
from argparse import Namespace
from pathlib import Path
from time import process_time

from _case import Result, line
from _table import CaseRow, Table, case_row, save_docs, save_page, save_table
from common.files import PROGRAM
from common.options import add_flag, check, study_parser
from common.parameters import did_you_mean
from common.ranks import run_study
from common.results import ROOT, note_what_was_written, open_results, subfolder
from mpi4py import MPI

import mpm_core as mpm

comm = MPI.COMM_WORLD
GROUPS = {
    "Closed forms": ("column", "bar", "incline", "thick_cylinder", "manufactured", "finite_column", "elastica",
                     "ground_water", "coupled_consolidation", "wet_ground", "undrained_footing", "liakopoulos", "two_phase",
                     "far_field", "impact", "members", "tunnel", "hardening_soil", "small_strain",
                     "creep"),  # fmt: skip
    "Contact": ("contact_slope", "voellmy"),
    "Earthquakes": ("newmark_block",),
    "Axial symmetry": (
        "axisymmetric_cylinder",
        "axisymmetric_motion",
        "cavity_expansion",
        "circular_footing",
        "hertz_sphere",
        "lube_columns",
        "quarter_model",
    ),
    "Limit analysis": (
        "limit_slopes",
        "limit_footing",
        "cut_slice",
        "published_slopes",
        "pipe_factor",
        "pushed_footing",
        "retaining_wall",
        "hoek_brown",
        "strength_ratio",
        "weak_layer",
        "weak_plane",
    ),
    "Experiments": ("bui_collapse", "lube_runout"),
    "Large deformation": ("cantilever",),
    "Locking": ("volumetric_locking",),
    "Integration": ("stress_integration",),
    "Slides": ("slide_convergence", "damped_slide", "extruded_slope", "hand_over"),
    "The paper": ("paper_slope",),
}
CASES = tuple(name for names in GROUPS.values() for name in names)


# --- 1. Options ----------------------------------------------------------------------------------------------------


def parse(arguments: list[str] | None = None) -> Namespace:
    p = study_parser(__doc__)
    p.prog = f"{PROGRAM} verification"  # of a folder with a __main__.py
    p.add_argument("--cases", default=",".join(CASES), metavar="NAME,...", help=f"cases to run, of {', '.join(CASES)} "
                   "(default: all)")  # fmt: skip
    add_flag(p, "--quick", "small sizes, as the tests run them; tolerances are wider where sizes matter")
    add_flag(
        p,
        "--docs",
        "also write docs/verification.md with its table and pictures; cases left out by --cases stay as they are there",
    )
    options = p.parse_args(arguments)
    for name in options.cases.split(","):
        check(
            p, name in CASES, f"--cases names '{name}', expected some of {', '.join(CASES)}{did_you_mean(name, CASES)}"
        )
    check(p, not (options.docs and options.quick), "--docs needs the full sizes, without --quick")
    return options


# --- 2. One case ---------------------------------------------------------------------------------------------------


def run_case(name: str, group: str, quick: bool, folder: Path) -> CaseRow:
    """Run one case; an error in it becomes part of its result."""
    module = importlib.import_module(name)
    folder = subfolder(folder, name, comm)
    start, result, error = process_time(), Result([]), ""
    # On several ranks only errors that all of them raise: with another one, the others would wait for this rank.
    expected = Exception if comm.size == 1 else (mpm.InputError, mpm.RunError)
    try:
        result = module.run(quick, folder)
    except expected as exception:  # whatever a case fails with, the others go on
        error = f"{type(exception).__name__}: {exception}"
    row = case_row(name, group, module.__doc__ or name, result, error, process_time() - start)
    if comm.rank == 0:
        print(*map(line, result.checks), *([f"  ERROR {error}"] if error else []), sep="\n", flush=True)
    return row


# --- 3. All together -----------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    folder = open_results(a, comm)
    table, names = Table.begun(a.quick, comm.size), a.cases.split(",")
    for k, name in enumerate(names, 1):
        if comm.rank == 0:
            print(f"[{k}/{len(names)}] {name}", flush=True)
        group = next(group for group, names in GROUPS.items() if name in names)
        table.cases.append(run_case(name, group, a.quick, folder))
        if comm.rank == 0:
            save_table(folder / "verification.json", table)
            save_page(folder, table, a.parameters())
    if comm.rank == 0:
        note_what_was_written(folder)
        if a.docs:
            save_docs(ROOT / "docs", folder, table, CASES)
        print(f"{table.summary()}; report in {folder / 'report.html'}")
    return 0 if table.passed else 1


if __name__ == "__main__":
    run_study(main)
