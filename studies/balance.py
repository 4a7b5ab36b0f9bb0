"""Load balance: a slope that slides over the ranks' parts of the mesh, as it was cut at first, and cut anew on the way.

DOLFINx cuts the background mesh by cells. Soil fills only some of them, so ranks have unequal numbers of particles from the
start, and other ones as the slope slides; each step waits for the rank that has most. The run is done twice: with the first
cut, and with one by the number of particles (PT-SCOTCH) whenever the most on a rank exceed the mean by the threshold.
"""

from __future__ import annotations

from argparse import ArgumentParser
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from common.files import OutputError
from common.movie import Movie, frame_of
from common.options import add_count, add_number, study_parser
from common.page import Page
from common.plots import Quantity, save_history
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.slope_case import SlopeCase, add_slope_options, build_slope, check_slope_options
from common.summary import write_summary
from mpi4py import MPI

import mpm_core as mpm

comm = MPI.COMM_WORLD
RANK = Quantity("Rank", "-", colours="viridis")


def parser() -> ArgumentParser:
    """All options; units stand in the help."""
    p = study_parser(__doc__)
    add_slope_options(p)
    add_number(p, "--time", 1.5, "s", "duration of the slide", above=0)
    add_number(
        p, "--threshold", 1.2, "-", "most particles on a rank over their mean at which the mesh is cut anew", above=1
    )
    add_count(p, "--frames", 60, "times at which particles are counted")
    return p


@dataclass
class Run:
    """One slide; `imbalance` is the most particles on a rank over the mean, at each time."""

    time: list[float] = field(default_factory=list)
    imbalance: list[float] = field(default_factory=list)
    frames: list[dict | None] = field(default_factory=list)
    cuts: int = 0
    seconds: float = 0.0


def slide(case: SlopeCase, until: float, frames: int, threshold: float | None) -> Run:
    """Run the slope without damping from zero stress. Collective."""
    run, model = Run(), case.model

    def look(time: float) -> None:
        run.time.append(time)
        run.imbalance.append(model.imbalance())
        p = model.particles
        run.frames.append(frame_of(model, time, {
            "position": p.position, "volume": p.volume, "id": p.id, "rank": np.full(len(p), float(comm.rank))
        }))  # fmt: skip

    with Progress("as cut at first" if threshold is None else "cut anew", until, comm) as progress:
        look(0.0)
        started = perf_counter()
        for report in model.explicit(until, every=until / frames, pic=0.02, rebalance=threshold):
            run.seconds += perf_counter() - started
            look(report.time)
            progress.show(report.time, report.steps)
            started = perf_counter()
    run.cuts = model.cuts
    return run


def difference(one: Run, other: Run) -> float:
    """Largest distance between particles of two runs at their ends [m]; on the first rank."""
    if comm.rank != 0:
        return 0.0
    last = [run.frames[-1]["position"][np.argsort(run.frames[-1]["id"])] for run in (one, other)]
    return float(np.abs(last[0] - last[1]).max())


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    a = p.parse_args(arguments)
    check_slope_options(p, a)
    if comm.size == 1:
        raise mpm.InputError("one rank is always balanced; run the study on several, by --ranks 4")
    folder = open_results(a, comm)
    cases = [build_slope(a, comm) for _ in range(2)]
    runs = {"as cut at first": slide(cases[0], a.time, a.frames, None),
            "cut anew": slide(cases[1], a.time, a.frames, a.threshold)}  # fmt: skip
    scene = cases[0].scene()
    first, anew = runs.values()
    results = {
        "mean_imbalance_as_cut_at_first": float(np.mean(first.imbalance)),
        "mean_imbalance_cut_anew": float(np.mean(anew.imbalance[1:])),
        "cuts": anew.cuts,
        "largest_difference_m": difference(first, anew),
        "wall_seconds": {name: run.seconds for name, run in runs.items()},
    }
    page, pictures = None, {}
    if scene is not None:
        pictures["imbalance"] = lambda: save_history(
            folder / "imbalance.png", np.array(first.time), {name: run.imbalance for name, run in runs.items()},
            "Most particles on a rank over their mean [-]", limits=(1.0, 1.05 * max(first.imbalance)))  # fmt: skip
        page = Page(movies=[Movie(name, scene, run.frames, {"rank": RANK}) for name, run in runs.items()],
                    captions={"imbalance": "Most particles on a rank over their mean"})  # fmt: skip
        print(f"most particles on a rank over their mean: {results['mean_imbalance_as_cut_at_first']:.2f} as cut at first, "
              f"{results['mean_imbalance_cut_anew']:.2f} cut anew, {anew.cuts} times; results in {folder}")  # fmt: skip
    write_summary(folder, a, results, comm, page, pictures)
    return 0


if __name__ == "__main__":
    run_study(main, mpm.InputError, mpm.RunError, OutputError)
