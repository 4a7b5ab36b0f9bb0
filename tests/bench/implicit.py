"""Whole implicit steps by Newton's method: where the processor's time goes at 10,000 cells of soil."""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from steps import slope

import mpm_core as mpm
from mpm_core import _core, linear

PHASES = {
    "residual and tangents of cells": (_core.ImplicitStep2, "trial"),
    "entries of the matrix": (_core.ImplicitStep2, "assemble"),
    "matrix and its symbolic factorisation, where cells have changed": (linear.Tangent, "__init__"),
    "values into the matrix, factorisation": (linear.Tangent, "update"),
    "solution": (linear.Tangent, "solve"),
    "particles to nodes, and back": (_core.ImplicitStep2, "finish"),
}


def timed(work: Callable[..., Any], seconds: dict[str, float], name: str) -> Callable[..., Any]:
    """The same work, which adds its processor time to a phase."""

    def wrapper(*arguments: Any, **options: Any) -> Any:
        start = time.process_time()
        result = work(*arguments, **options)
        seconds[name] += time.process_time() - start
        return result

    return wrapper


def newton_steps(cell_size: float, nmd: bool, steps: int = 5) -> dict[str, Any]:
    """Shares of the phases in the time of some steps of a sliding slope [-], and the time of an iteration [s]."""
    soil = mpm.MohrCoulomb(young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0)
    model = slope(cell_size, soil)
    seconds = dict.fromkeys(PHASES, 0.0)
    plain = {name: getattr(*place) for name, place in PHASES.items()}
    for name, (owner, method) in PHASES.items():
        setattr(owner, method, timed(plain[name], seconds, name))
    dt = 50 * model.critical_time_step()
    start = time.process_time()
    reports = list(model.implicit(model.time + steps * dt, dt=dt, damping=0.75, nmd=nmd))
    total = time.process_time() - start
    for name, (owner, method) in PHASES.items():
        setattr(owner, method, plain[name])
    iterations = sum(report.iterations for report in reports)
    shares = {name: value / total for name, value in seconds.items()}
    return {"nmd": nmd, "particles": reports[-1].particles, "iterations": iterations,
            "seconds_per_iteration": total / iterations, "shares": shares}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", type=Path, help="write the results to this file as well")
    a = parser.parse_args()
    rows = [newton_steps(0.025, nmd) for nmd in (False, True)]
    for row in rows:
        print(f"implicit slope{', NMD' if row['nmd'] else ''}: {row['particles']} particles, {row['iterations']} iterations, "
              f"{1e3 * row['seconds_per_iteration']:.1f} ms each")  # fmt: skip
        for name, share in row["shares"].items():
            print(f"    {share:6.1%}  {name}")
    if a.json:
        a.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
