"""Counts the instructions of small explicit steps and of one Newton assembly, phase by phase, under valgrind's callgrind,
and compares them with the recorded budget: a phase that needs over 3 % more fails.

Counts are repeatable on one build; each compiler has its own budget. After a change that is worth its instructions:
`tests/bench/budget.py build-portable/tests/bench/mpm_counted --record` writes the new ones.
"""

from __future__ import annotations

import argparse
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

BUDGET = Path(__file__).with_name("budget.json")
TOLERANCE = 0.03
PHASES = {
    "explicit step, 2D": "explicit_step<mpm::base::PlaneStrain>",
    "sums at nodes, 2D": "particles_to_nodes<mpm::base::PlaneStrain, 2>",
    "pass over the particles, 2D": "particle_pass<mpm::base::PlaneStrain>",
    "motion of particles, 2D": "move_particles<2>",
    "strain of particles, 2D": "strain_particles<2>",
    "stress sums, 2D": "stress_sum<mpm::base::PlaneStrain, 2>",
    "Mohr-Coulomb, 2D": "update<2>(mpm::materials::MohrCoulomb const&",
    "averaged volumetric strain, 2D": "average_strains<mpm::base::PlaneStrain, 2>",
    "explicit step, 3D": "explicit_step<mpm::base::Solid>",
    "pass over the particles, 3D": "particle_pass<mpm::base::Solid>",
    "Mohr-Coulomb, 3D": "update<3>(mpm::materials::MohrCoulomb const&",
    "residual and tangents of an implicit step, 2D": "find_residual<mpm::base::PlaneStrain>",
    "entries of the stiffness matrix, 2D": "find_tangent<mpm::base::PlaneStrain, 2>",
}
"""What is counted: the functions, with all that they call"""


def counts(program: Path) -> dict[str, int]:
    """Instructions of each phase, by callgrind.

    Raises:
        SystemExit: callgrind failed, or does not know a phase.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "callgrind.out"
        run = subprocess.run(
            ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", str(program)],
            capture_output=True,
            text=True,
        )
        if run.returncode != 0:
            sys.exit(f"callgrind failed:\n{run.stderr[-2000:]}")
        listing = subprocess.run(
            ["callgrind_annotate", "--inclusive=yes", "--threshold=100", "--show-percs=no", str(out)],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
    found: dict[str, int] = {}
    for line in listing.splitlines():
        match = re.match(r" *([\d,]+) +(.*)", line)
        for phase, function in PHASES.items():
            if match and "::" + function in match[2] and "'2" not in match[2]:
                found.setdefault(phase, int(match[1].replace(",", "")))
    missing = [phase for phase in PHASES if phase not in found]
    if missing:
        sys.exit(f"callgrind's listing has no function for: {', '.join(missing)}")
    return found


def compiler(program: Path) -> str:
    """The compiler's name and version, from the comment that it leaves in the program."""
    text = subprocess.run(
        ["readelf", "-p", ".comment", str(program)], capture_output=True, text=True, check=True
    ).stdout
    return re.findall(r"\]\s+(.*)", text)[-1].strip()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=Path, help="the program mpm_counted")
    parser.add_argument("--record", action="store_true", help="write the counts as the new budget of this compiler")
    a = parser.parse_args()
    budgets = json.loads(BUDGET.read_text()) if BUDGET.exists() else {}
    used, by = counts(a.program), compiler(a.program)
    if a.record:
        BUDGET.write_text(json.dumps({**budgets, by: used}, indent=2) + "\n")
    budget = used if a.record else budgets.get(by, {})
    print(f"{'phase':48} {'instructions':>14} {'budget':>14} {'change':>8}")
    over = []
    for phase, count in used.items():
        allowed = budget.get(phase)
        change = f"{count / allowed - 1:+8.1%}" if allowed else "        "
        print(f"{phase:48} {count:14,d} {allowed or 0:14,d} {change}")
        if allowed and count > (1 + TOLERANCE) * allowed:
            over.append(phase)
    if not budget:
        print(f"no budget is recorded for {by}; nothing to compare with")
    if over:
        sys.exit(f"more than {TOLERANCE:.0%} over the budget: {', '.join(over)}")


if __name__ == "__main__":
    main()
