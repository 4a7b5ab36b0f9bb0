"""What contact with a rigid surface costs: its instructions over those of the rest of the explicit step, under callgrind.

Layers of soil lie on a rough plane, and on a terrain of 10^6 triangles with hills whose squares are as large as the cells of
the mesh, or smaller. Finding the bounds of the cells, once for a surface at rest, is listed apart.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

CELLS = 12
"""Over the width of the layers"""

FUNCTIONS = {
    "step": r"::explicit_step<",
    "contact": r"bool mpm::contact::add_contact_forces<",
    "bounds": r"::keep_clearance<",
}


def counts(program: Path, *arguments: str) -> dict[str, int]:
    """Instructions of the functions in ten steps, with all that they call."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", str(program), *arguments],
            capture_output=True, check=True,
        )  # fmt: skip
        listing = subprocess.run(
            ["callgrind_annotate", "--inclusive=yes", "--threshold=100", "--show-percs=no", str(out)],
            capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip
    found = {}
    for name, function in FUNCTIONS.items():
        line = next(line for line in listing.splitlines() if re.search(function, line) and "'2" not in line)
        found[name] = int(line.split()[0].replace(",", ""))
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="the program mpm_counted_contact, built with the preset portable")
    parser.add_argument("--layers", type=int, nargs="+", default=[6], help="heights of the layers [cells]")
    a = parser.parse_args()
    print(f"{'ground':34} {'dimensions':>10} {'layer':>6} {'contact':>9} {'bounds [steps]':>15}")
    for high in a.layers:
        grounds = [("2", "plane"), ("3", "plane"), *[("3", str(CELLS * finer)) for finer in (1, 2, 4)]]
        for dim, ground in grounds:
            found = counts(a.program, dim, str(high), ground)
            rest = found["step"] - found["contact"] - found["bounds"]
            name = ground if ground == "plane" else f"10^6 triangles, {int(ground) // CELLS} squares to a cell"
            print(f"{name:34} {dim:>10} {high:6} {found['contact'] / rest:9.1%} {10 * found['bounds'] / rest:15.1f}")


if __name__ == "__main__":
    main()
