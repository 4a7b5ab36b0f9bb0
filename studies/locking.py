"""Volumetric locking of linear triangles: particles with and without mixed discretisation against Taylor-Hood elements.

Three nearly incompressible bodies are computed: Cook's membrane (elastic), and a strip footing and a slope of undrained soil
(friction angle 0). All diagonals of their meshes have the same direction, the arrangement in which linear triangles lock.
Particles fill every cell, plain and with nodal mixed discretisation (NMD), in quasi-static implicit steps and by damped
explicit motion, on finer and finer meshes. The explicit step becomes shorter as Poisson's ratio approaches 0.5, so that
explicit runs have 0.49 to 0.499.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial
from pathlib import Path
from time import perf_counter
from types import ModuleType

from common.figures import Pictures
from common.options import add_count, check, study_parser
from common.page import Page
from common.quiet import LOCKS, without_warning
from common.ranks import run_study
from common.results import open_results
from common.summary import write_summary
from locking_cases import CASES
from locking_cases.pictures import save_errors, save_pressures
from locking_cases.runs import Found
from mpi4py import MPI

comm = MPI.COMM_WORLD
SCHEMES = ("implicit", "explicit")
ELEMENTS = {"plain": False, "NMD": True}


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parse(arguments: list[str] | None = None) -> Namespace:
    p = parser()
    options = p.parse_args(arguments)
    for name, known in (("cases", tuple(CASES)), ("schemes", SCHEMES)):
        for word in getattr(options, name).split(","):
            check(p, word in known, f"--{name} names '{word}', expected some of {', '.join(known)}")
    return options


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    for name, known in (("cases", tuple(CASES)), ("schemes", SCHEMES)):
        p.add_argument(f"--{name}", default=",".join(known), metavar="NAME,...",
                       help=f"{name} to run, of {', '.join(known)} (default: all)")  # fmt: skip
    add_count(p, "--meshes", 4, "meshes, each twice as fine as the one before")
    add_count(p, "--reference-mesh", 4, "mesh on which Taylor-Hood elements give the reference, 1 for the coarsest")
    return p


# --- 2. One case, one scheme -----------------------------------------------------------------------------------------


def compare(a: Namespace, case: ModuleType, scheme: str) -> tuple[list[dict], dict[str, Found]]:
    """Errors of all elements on all meshes, and the particles of the last Poisson ratio on the finest mesh. Collective."""
    rows, last = [], {}
    meshes = [case.DIVISIONS[scheme] * 2**k for k in range(a.meshes)]
    best = min(case.MIXED_FINEST, case.DIVISIONS["implicit"] * 2 ** (a.reference_mesh - 1))
    for poisson in case.POISSON[scheme]:
        mixed = {n: case.taylor_hood(n, poisson) for n in dict.fromkeys([*meshes, best]) if n <= case.MIXED_FINEST}
        reference = case.EXACT or mixed[best]
        common = {"case": case.NAME, "scheme": scheme, "poisson": poisson, "reference": reference}
        rows += [row(case, common, "Taylor-Hood", n, mixed[n]) for n in meshes if n in mixed]
        for elements, nmd in ELEMENTS.items():
            for n in meshes:
                found = last[elements] = case.by_particles(n, poisson, nmd, scheme)
                rows.append(row(case, common, elements, n, found.value, found))
    return rows, last


def row(case: ModuleType, common: dict, elements: str, n: int, value: float, found: Found | None = None) -> dict:
    """Print and return one line of the table."""
    result = {**common, "elements": elements, "divisions": n, "cell_size_m": case.cell_size(n), "value": value,
              "error": abs(value / common["reference"] - 1)}  # fmt: skip
    if found:
        result |= {"steps": found.steps, "processor_seconds": found.seconds}
    if comm.rank == 0:
        print("{case:8}{scheme:9} nu {poisson:<12.9g} {elements:12}{divisions:4} divisions: {value:10.4f}, reference "
              "{reference:8.4f}, error {error:.2%}".format(**result), flush=True)  # fmt: skip
    return result


def finest(rows: list[dict]) -> dict[str, dict[str, float]]:
    """Errors on the finest mesh by scheme and Poisson ratio."""
    found: dict[str, dict[str, float]] = {}
    for one in rows:  # the last of a name is the one on the finest mesh
        found.setdefault(f"{one['scheme']}, nu = {one['poisson']:.9g}", {})[f"{one['elements']}_error"] = one["error"]
    return found


# --- 3. All together -------------------------------------------------------------------------------------------------


def drawn(case: ModuleType, rows: list[dict], last: dict[str, dict[str, Found]], folder: Path) -> Pictures:
    """Error over cell size, and the mean stresses side by side."""
    pictures = {}
    if len({row["divisions"] for row in rows if row["scheme"] == rows[0]["scheme"]}) > 1:
        pictures[f"error_{case.NAME}"] = partial(save_errors, folder / f"error_{case.NAME}.png", rows, case.TITLE)
    for scheme, found in last.items():
        poisson = case.POISSON[scheme][-1]
        title = f"{case.TITLE}, {scheme}, $\\nu$ = {poisson:.9g}"
        fields = {name: one.field for name, one in found.items()}
        name = f"pressure_{case.NAME}_{scheme}"
        pictures[name] = partial(save_pressures, folder / f"{name}.png", fields, case.PRESSURE_UNIT, title)
    return pictures


@without_warning(LOCKS)  # that is what this study shows
def main(arguments: list[str] | None = None) -> int:
    a = parse(arguments)
    start = perf_counter()
    folder = open_results(a, comm)
    results, captions, pictures = {}, {}, {}
    for name in a.cases.split(","):
        case, last = CASES[name], {}
        results[name] = []
        for scheme in a.schemes.split(","):
            rows, last[scheme] = compare(a, case, scheme)
            results[name] += rows
            captions[
                f"pressure_{name}_{scheme}"
            ] = f"{case.TITLE}, {scheme}: mean stress of plain triangles and with NMD."
        pictures |= drawn(case, results[name], last, folder)
        captions[f"error_{name}"] = f"{case.TITLE}: error of the {case.QUANTITY}. "
    summary = {
        **{f"{name} on its finest mesh": finest(rows) for name, rows in results.items()},
        **results,
        "wall_seconds": perf_counter() - start,
    }
    return write_summary(folder, a, summary, comm, Page(captions=captions), pictures, said="")


if __name__ == "__main__":
    run_study(main)
