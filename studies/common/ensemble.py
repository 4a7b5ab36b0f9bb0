"""Scatter of a result: repetitions of a slide from starts that differ by round-off."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import mpm_core as mpm

from .figures import Pictures
from .history import History
from .plots import save_history
from .schemes import run_scheme
from .slope.case import GRAVITY, SlopeCase, build_slope, initialise
from .watch import Watch

PERTURBATION = 1e-14
"""Size of the velocities that a member begins with, over that of a fall by the slope's height"""
MEASURES = ("crest_displacement_m", "runout_m")


@dataclass(frozen=True)
class Ensemble:
    """Histories of all members at the same times."""

    time: np.ndarray
    """Shape (k,) [s]"""
    measures: dict[str, np.ndarray]
    """Shape (members, k) each, by name"""

    def summary(self) -> dict[str, Any]:
        """Number of members, and mean and standard deviation of each measure at the end over them."""
        ends = {name: values[:, -1] for name, values in self.measures.items()}
        return {"members": len(ends[MEASURES[0]])} | {
            name: {"mean": float(end.mean()), "standard_deviation": float(end.std(ddof=1))}
            for name, end in ends.items()
        }

    def text(self) -> str:
        """The summary in a line."""
        s = self.summary()
        crest, runout = (f"{s[name]['mean']:.4f} ± {s[name]['standard_deviation']:.1e} m" for name in MEASURES)
        return f"{s['members']} members, mean ± standard deviation: crest displacement {crest}, run-out {runout}"

    def pictures(self, folder: Path) -> Pictures:
        """Mean, lowest and highest displacement of the crest over time."""
        crest = self.measures["crest_displacement_m"]
        curves = {
            f"mean of {len(crest)}": crest.mean(axis=0),
            "lowest": crest.min(axis=0),
            "highest": crest.max(axis=0),
        }
        label = "Displacement of the particle at the crest [m]"
        return {"figure_8_ensemble": lambda: save_history(folder / "figure_8_ensemble.png", self.time, curves, label)}


def perturb(model: mpm.Model, height: float, member: int) -> None:
    """Velocities of the size of round-off, by the particles' numbers, so that they do not depend on ranks. Collective."""
    p = model.particles
    largest = model.comm.allreduce(int(p.id.max(initial=0)), MPI.MAX)
    noise = np.random.default_rng(member).standard_normal((largest + 1, model.mesh.dim))
    p.set("velocity", p.velocity + PERTURBATION * np.sqrt(2 * GRAVITY * height) * noise[p.id])


def further_members(first: SlopeCase, history: History, stop: Callable[[], bool]) -> Ensemble:
    """The slide of a case that has run, and of all further members of its ``--ensemble``. Collective.

    Args:
        history: of the case, with the times of ``--frames`` and the measures.
        stop: whether to end before the next member or step.

    Raises:
        RunError: a member failed.
    """
    a = first.args
    rows = {name: [np.asarray(history[name])] for name in MEASURES}
    for member in range(1, a.ensemble):
        case = build_slope(a, first.model.comm)
        initialise(case, a.initial, a.initial_unit_weight, a.nmd and a.scheme == "explicit")
        perturb(case.model, a.height, member)
        watch = Watch(case)
        if a.scheme == "quasi-static":
            case.model.set_gravity((0.0, -GRAVITY), ramp=a.time)
        values = [(watch.crest_displacement(), watch.runout())]
        for _ in run_scheme(a, case.model, a.time / a.frames, stop, rebalance=a.rebalance, every_steps=a.frame_steps):
            values.append((watch.crest_displacement(), watch.runout()))
        if stop():
            break
        for k, name in enumerate(MEASURES):
            rows[name].append(np.array(values)[:, k])
    return Ensemble(np.asarray(history["time_s"]), {name: np.stack(values) for name, values in rows.items()})
