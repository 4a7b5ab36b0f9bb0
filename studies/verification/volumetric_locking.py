"""Volumetric locking: Cook's membrane, a strip footing and a slope of nearly incompressible soil.

Linear triangles whose diagonals all have the same direction lock; with nodal mixed discretisation (NMD) they do not. Particles
fill every cell and come to rest in quasi-static implicit steps. The reference is Prandtl's pressure for the footing, and the
result of Taylor-Hood elements on the finest mesh for the others. The bodies and their meshes are those of the study `locking`.
"""

from argparse import Namespace

from _case import Check, Kind, Result
from locking import compare
from locking_cases import CASES
from locking_cases.pictures import save_errors
from mpi4py import MPI

LOCKED, FREE = 0.5, 0.1
"""Errors that plain triangles stay above, and that those with NMD fall below on the finest mesh."""


def run(quick: bool, folder) -> Result:
    checks, figures, meshes = [], {}, 3
    for case in [CASES["cook"]] if quick else CASES.values():
        # --- 1. Each element on each mesh ----------------------------------------------------------------------------
        rows, _ = compare(Namespace(meshes=meshes, reference_mesh=meshes), case, "implicit")
        poisson = max(row["poisson"] for row in rows)
        rows = [row for row in rows if row["poisson"] == poisson]

        # --- 2. Plain triangles lock, those with NMD do not, and converge -------------------------------------------
        errors = {name: [row["error"] for row in rows if row["elements"] == name] for name in ("plain", "NMD")}
        name = f"{case.TITLE}, ν = {poisson:.9g}"
        source = "Prandtl 1921" if case.EXACT else "Taylor-Hood elements"
        over = "the pressure of Prandtl" if case.EXACT else "the result of these elements"
        checks += [
            Check(f"error of plain triangles, {name}", LOCKED, f"{source}; triangles that lock have large errors",
                  errors["plain"][-1], 0.0, kind=Kind.AT_LEAST),
            Check(f"error with NMD, {name}", 0.0, source, errors["NMD"][-1], FREE, scale=1.0, over=over),
            Check(f"error over that on the next coarser mesh, {name}", 0.6, "convergence with the cell size",
                  errors["NMD"][-1] / errors["NMD"][-2], 0.0, kind=Kind.AT_MOST),
        ]  # fmt: skip
        if MPI.COMM_WORLD.rank == 0:
            save_errors(folder / f"{case.NAME}.png", rows, case.TITLE)
        figures[f"{case.NAME}.png"] = f"{case.TITLE}: error of the {case.QUANTITY}"
    return Result(checks, figures)
