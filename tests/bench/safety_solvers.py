"""Factors of safety of a slope without dilation, by solver, element and cell size: the table of docs/factor_of_safety.md.

    python3 tests/bench/safety_solvers.py --cell-sizes 2 1 0.5

The slope is the first example of Griffiths and Lane (1999), Géotechnique 49, 387–403; it is that of
studies/verification/published_slopes.py.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import dataclass
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from arc_length import carried_fraction

import fenics_bridge as bridge
import mpm_core as mpm

STUDIES = Path(__file__).parents[2] / "studies"
sys.path[:0] = [str(STUDIES), str(STUDIES / "verification")]

from published_slopes import ELASTIC, HEIGHT, UNIT_WEIGHT, drained_on_rock, safety, slope_on_rock  # noqa: E402

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


@dataclass(frozen=True)
class Bracket:
    """The largest factor that a method carries, the smallest that it does not, and whether failure is shown there."""

    value: float
    failed_at: float
    failed: bool


def by_arc_length(fem: bridge.QuasiStatic) -> Bracket:
    """Reduced strengths under which an arc-length method reaches the weight from zero, to 1 %. It shows no failure."""
    carried, failed, soil, unloaded = 0.4, np.inf, fem.law, fem._body.snapshot()
    while failed - carried > 0.01:
        factor = min(carried + 0.2, 0.5 * (carried + failed))
        fem._body.restore(unloaded)
        fem.law = bridge.reduced_strength(soil, factor)
        reached = carried_fraction(fem, bridge.Load(unit_weight=UNIT_WEIGHT)) >= 1.0
        carried, failed = (factor, failed) if reached else (carried, factor)
    return Bracket(carried, failed, False)


def by_particles(cell: float) -> bridge.ParticleSafety:
    """Dynamic relaxation: the explicit scheme with local damping on linear cells of a size [m], with averaged strains."""
    mesh, soil, supports = slope_on_rock(cell, runout=HEIGHT)
    background = bridge.background_mesh(*mesh)

    def weakened(factor: float) -> mpm.Model:
        model = mpm.Model(background, bridge.reduced_strength(soil, factor))
        model.seed(density=UNIT_WEIGHT / 9.81, per_cell=3, cell_tag=bridge.SOIL)
        bridge.apply_supports(model, supports)
        model.set_gravity((0.0, -9.81))
        return model

    return bridge.particle_safety(weakened, start=0.8, nmd=True)


METHODS = {
    "newton": solved_by(NEWTON),
    "arc-length": solved_by(NEWTON),
    "explicit": solved_by(NEWTON),
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
    match method:
        case "davis":
            found = bridge.factor_of_safety(
                fem, bridge.Load(unit_weight=UNIT_WEIGHT), start=0.4, first_step=0.2, tolerance=1e-3,
                reduce=bridge.davis_reduced_strength,
            )  # fmt: skip
        case "arc-length":
            found = by_arc_length(fem)
        case "explicit":
            found = by_particles(cell)
        case _:
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
