"""Load balance: a slope that slides from rank to rank, with the first partition of the mesh and with repartition.

DOLFINx partitions the background mesh by cells. Soil fills only some of them, so that ranks have different numbers of particles
from the start, which change as the slope slides. Each step waits for the rank with most particles. The slope slides twice: with
the first partition, and with a repartition by the number of particles (PT-SCOTCH) whenever the load imbalance exceeds
--rebalance.
"""

from __future__ import annotations

from argparse import ArgumentParser
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from common.movie import frame_of, particle_movie
from common.options import add_count, add_number, formerly, study_parser
from common.page import Page
from common.plots import Quantity, save_history
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.slope.case import SlopeCase, add_slope_options, build_slope, check_slope_options
from common.summary import write_summary
from mpi4py import MPI

import mpm_core as mpm

comm = MPI.COMM_WORLD
RANK = Quantity("Rank", "-", colours="viridis")


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_slope_options(p)
    add_number(p, "--time", 1.5, "s", "duration of the slide", above=0)
    add_number(
        p,
        "--rebalance",
        1.2,
        "-",
        "repartition the mesh above this load imbalance: maximum over mean particles per rank",
        above=1,
    )
    formerly(p, "threshold", "--rebalance")
    add_count(p, "--frames", 60, "times at which particles are counted")
    return p


@dataclass
class Slide:
    """Result of one slide; `imbalance` is the load imbalance at each time."""

    time: list[float] = field(default_factory=list)
    imbalance: list[float] = field(default_factory=list)
    frames: list[dict | None] = field(default_factory=list)
    repartitions: int = 0
    seconds: float = 0.0


def slide(case: SlopeCase, until: float, frames: int, rebalance: float | None) -> Slide:
    """Run the slope without damping from zero stress. Collective."""
    run, model = Slide(), case.model

    def look(time: float) -> None:
        run.time.append(time)
        run.imbalance.append(model.imbalance())
        p = model.particles
        run.frames.append(frame_of(model, time, {
            "position": p.position, "volume": p.volume, "id": p.id, "rank": np.full(len(p), float(comm.rank))
        }))  # fmt: skip

    with Progress("first partition" if rebalance is None else "repartition", until, comm) as progress:
        look(0.0)
        started = perf_counter()
        for report in model.explicit(until, every=until / frames, pic=0.02, rebalance=rebalance):
            run.seconds += perf_counter() - started
            look(report.time)
            progress.show(report.time, report.steps)
            started = perf_counter()
    run.repartitions = model.repartitions
    return run


def difference(one: Slide, other: Slide) -> float:
    """Largest distance between particles of two runs at their ends [m]; on the first rank."""
    if comm.rank != 0:
        return 0.0
    last = [run.frames[-1]["position"][np.argsort(run.frames[-1]["id"])] for run in (one, other)]
    return float(np.linalg.norm(last[0] - last[1], axis=1).max())


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    a = p.parse_args(arguments)
    check_slope_options(p, a)
    if comm.size == 1:
        raise mpm.InputError("one rank is always balanced; run the study on several, by --ranks 4")
    folder = open_results(a, comm)
    cases = [build_slope(a, comm) for _ in range(2)]
    runs = {"first partition": slide(cases[0], a.time, a.frames, None),
            "repartition": slide(cases[1], a.time, a.frames, a.rebalance)}  # fmt: skip
    scene = cases[0].scene()
    first, repartitioned = runs.values()
    results = {
        "mean_imbalance_first_partition": float(np.mean(first.imbalance[1:])),
        "mean_imbalance_repartitioned": float(np.mean(repartitioned.imbalance[1:])),
        "repartitions": repartitioned.repartitions,
        "largest_difference_m": difference(first, repartitioned),
        "wall_seconds": {name: run.seconds for name, run in runs.items()},
    }
    page, pictures = None, {}
    if scene is not None:
        pictures["imbalance"] = lambda: save_history(
            folder / "imbalance.png", np.array(first.time), {name: run.imbalance for name, run in runs.items()},
            "Load imbalance (maximum over mean) [-]", limits=(1.0, 1.05 * max(first.imbalance)))  # fmt: skip
        page = Page(movies=[particle_movie(name, scene, run.frames, {"rank": RANK}) for name, run in runs.items()],
                    captions={"imbalance": "Load imbalance: maximum over mean number of particles per rank"})  # fmt: skip
    said = (
        f"load imbalance: {results['mean_imbalance_first_partition']:.2f} with the first partition, "
        f"{results['mean_imbalance_repartitioned']:.2f} with {repartitioned.repartitions} repartitions"
    )
    return write_summary(folder, a, results, comm, page, pictures, said)


if __name__ == "__main__":
    run_study(main)
