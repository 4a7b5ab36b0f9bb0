"""Factors of safety of a slope without dilation, by solver, element and cell size: the table of docs/fem.md.

    python3 tests/bench/safety_solvers.py --cell-sizes 2 1 0.5

The slope is the first example of Griffiths and Lane (1999), Géotechnique 49, 387–403; it is that of
studies/verification/published_slopes.py.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import fenics_bridge as bridge

STUDIES = Path(__file__).parents[2] / "studies"
sys.path[:0] = [str(STUDIES), str(STUDIES / "verification")]

from published_slopes import ELASTIC, UNIT_WEIGHT, drained_on_rock, safety  # noqa: E402

NEWTON = bridge.Solver(relaxation=False)


def solved_by(solver: bridge.Solver, degree: int = 2, nmd: bool = False) -> Any:
    """The slope of a cell size [m] with another solver or other elements, as a function."""

    def slope(cell: float) -> bridge.QuasiStatic:
        of = drained_on_rock(cell)
        return bridge.QuasiStatic(of.domain, of.law, of.facet_tags, of.supports, degree, nmd, solver=solver)

    return slope


def with_tangent(tangent_of: Any, max_iterations: int) -> Any:
    """The slope of a cell size [m], solved by Newton's method with another tangent of the quadrature points (n, S, S)."""

    def slope(cell: float) -> bridge.QuasiStatic:
        fem = solved_by(bridge.Solver(relaxation=False, max_iterations=max_iterations))(cell)
        kinematics, points = fem._body.kinematics, fem.points
        consistent = kinematics.stiffness

        def stiffness():
            points.tangent[:] = tangent_of(points.tangent)
            return consistent()

        kinematics.stiffness = stiffness
        return fem

    return slope


def symmetric(tangent: np.ndarray) -> np.ndarray:
    """The symmetric part of a tangent."""
    return 0.5 * (tangent + np.swapaxes(tangent, 1, 2))


def elastic(tangent: np.ndarray) -> np.ndarray:
    """The elastic stiffness in the place of a tangent, in plane strain with the components xx, yy, zz, xy."""
    young, poisson = ELASTIC["young"], ELASTIC["poisson"]
    shear = young / (2 * (1 + poisson))
    stiffness = np.diag([2 * shear] * 3 + [shear])
    stiffness[:3, :3] += young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    return np.broadcast_to(stiffness, tangent.shape)


METHODS = {
    "newton": solved_by(NEWTON),
    "symmetric": with_tangent(symmetric, 100),
    "elastic": with_tangent(elastic, 500),
    "relaxation": solved_by(bridge.Solver()),
    "practice": solved_by(bridge.PRACTICE),
    "averaged": solved_by(bridge.Solver(), degree=1, nmd=True),
    "degree-4": solved_by(bridge.Solver(), degree=4),
    "davis": solved_by(bridge.Solver()),
}


def row(method: str, cell: float) -> dict[str, Any]:
    """The factor of safety and what it took to find it."""
    fem, cpu = METHODS[method](cell), process_time()
    if method == "davis":
        found = bridge.factor_of_safety(
            fem, bridge.Load(unit_weight=UNIT_WEIGHT), start=0.4, first_step=0.2, tolerance=1e-3,
            reduce=bridge.davis_reduced_strength,
        )  # fmt: skip
    else:
        found = safety(fem)
    return {"method": method, "cell_size_m": cell, "factor_of_safety": found.value, "failure_shown": found.failed,
            "failed_at": found.failed_at, "systems": len(fem.linear_iterations), "cpu_seconds": process_time() - cpu}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=list(METHODS))
    parser.add_argument("--cell-sizes", type=float, nargs="+", default=[2.0, 1.0], help="[m]")
    parser.add_argument("--json", type=Path, help="write the results to this file as well")
    a = parser.parse_args()
    found = []
    for method, cell in [(m, c) for m in a.methods for c in a.cell_sizes]:
        found.append(r := row(method, cell))
        print(f"{method}, {cell:g} m: {r['factor_of_safety']:.4f}, {'fails' if r['failure_shown'] else 'undecided'} "
              f"at {r['failed_at']:.4f}, {r['systems']} systems, {r['cpu_seconds']:.1f} s", flush=True)  # fmt: skip
        if a.json:
            a.json.write_text(json.dumps(found, indent=2) + "\n")


if __name__ == "__main__":
    main()
