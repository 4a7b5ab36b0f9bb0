"""What an update of each law costs: instructions per point, elastic and plastic, under callgrind.

The increments are those of explicit steps, some 4e-5 of shear, without tangents. Each law is compared with Mohr-Coulomb.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

LAWS = ["LinearElastic", "MohrCoulomb", "ViscoplasticMohrCoulomb", "SofteningMohrCoulomb", "DruckerPrager", "CamClay",
        "NorSand", "Sanisand", "HardeningSoil", "small-strain HardeningSoil", "HoekBrown"]  # fmt: skip
KINDS = [(2, "elastic"), (2, "plastic"), (3, "elastic"), (3, "plastic")]


def cost(program: Path, law: str, dim: int, kind: str) -> float:
    """Instructions per point and update.

    Raises:
        SystemExit: points failed, or they are not all elastic, or all but a few plastic.
    """
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", "--toggle-collect=*measured*", f"--callgrind-out-file={folder}/out",
             str(program), law, kind, str(dim)],
            capture_output=True, text=True, check=True,
        )  # fmt: skip
    points, plastic, failed = (float(number) for number in re.findall(r"(?:points|plastic|failed) (\S+)", run.stdout))
    if failed > 0 or (plastic > 0 if kind == "elastic" else plastic < 0.95 and law != "LinearElastic"):
        raise SystemExit(f"{law}, {kind}: {run.stdout}")
    collected = re.search(r"Collected : (\d+)", run.stderr)
    if not collected:
        raise SystemExit(f"callgrind counted nothing:\n{run.stderr[-2000:]}")
    return int(collected[1]) / points


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="the program mpm_counted_laws, for a processor without AVX-512")
    a = parser.parse_args()
    print(f"{'law':26}" + "".join(f"{f'{dim}D {kind}':>18}" for dim, kind in KINDS))
    costs = {law: [cost(a.program, law, dim, kind) for dim, kind in KINDS] for law in LAWS}
    for law, row in costs.items():
        cells = zip(row, costs["MohrCoulomb"], strict=True)
        print(f"{law:26}" + "".join(f"{f'{count:.0f} ({count / unit:.1f})':>18}" for count, unit in cells))


if __name__ == "__main__":
    main()
