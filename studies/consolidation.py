"""Consolidation of ground under a load: pore pressures rise as it is placed, and fall as the water leaves and the ground settles.

The site is a TOML file (`meshes/fill.toml` unless another is given): a mesh of gmsh, soils with laws of effective stress and
conductivities, supports, what the water does at the boundaries, and pressures in time. The ground begins at rest under its
weight and the steady flow; from there displacement and pore pressure are found together.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.consolidation_plots import ExcessPicture, save_excess, save_over_time
from common.consolidation_site import ConsolidationSite, read_consolidation_site
from common.field_files import FieldFiles
from common.field_plots import gathered
from common.figures import Pictures
from common.files import OutputError
from common.options import add_count, add_number, study_parser
from common.page import Page
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.site_options import add_site_file
from common.summary import write_summary
from common.water_site import DAY
from dolfinx import fem
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

comm = MPI.COMM_WORLD
ELEMENTS = {"P2-P1": water.Element.TAYLOR_HOOD, "P1-P1": water.Element.STABILISED}


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """All options; units stand in the help."""
    p = study_parser(__doc__)
    elements = "P1-P1", tuple(ELEMENTS), "quadratic displacement (P2-P1), or stabilised linear one"
    add_site_file(p, "fill", "soils, water and pressures", elements)
    add_number(p, "--days", 3000.0, "days", "time that is followed", above=0)
    add_number(p, "--first-step", 0.5, "days", "first step", above=0)
    add_number(p, "--growth", 1.15, "-", "factor from step to step", at_least=1)
    add_count(p, "--frames", 5, "pictures in time, evenly over its logarithm")
    return p


# --- 2. The ground in time -------------------------------------------------------------------------------------------


class Files(FieldFiles):
    """What is written as time goes on: frames for ParaView, and the history of the settlements."""

    def __init__(self, model: water.Consolidation, site: ConsolidationSite, folder: Path) -> None:
        self._model, self._names = model, list(site.points)
        self._places = np.array(list(site.points.values())) if comm.rank == 0 else np.empty((0, 2))
        self._start = model.pressure.x.array.copy()
        self._excess = fem.Function(model.pressure.function_space, name="excess_pore_pressure")
        settlements = (f"settlement_{name}_m" for name in self._names)
        columns = ["time_days", *settlements, "largest_excess_pressure_Pa", "water_error_m2"]
        super().__init__(model.domain, folder / "consolidation", folder / "history.csv", columns)
        self.pictures: list[ExcessPicture | None] = []

    def row(self, report: water.ConsolidationReport | None = None) -> None:
        """Add settlements and the largest excess pressure to the history. Collective."""
        model = self._model
        self._excess.x.array[:] = model.pressure.x.array - self._start
        largest = comm.allreduce(float(self._excess.x.array.max(initial=-np.inf)), MPI.MAX)
        settled = comm.bcast(-model.evaluate_at(self._places)["displacement"][:, 1])
        values = {f"settlement_{name}_m": value for name, value in zip(self._names, settled)}
        error = report.water_error if report else 0.0
        self.history.add(time_days=model.time / DAY, largest_excess_pressure_Pa=largest, water_error_m2=error, **values)

    def frame(self) -> None:
        """Add pressures, displacement and stress to the files for ParaView, and a picture. Collective."""
        model = self._model
        stress = model.stress_function(smooth=True)
        there = bridge.evaluate_at(
            self.points, u=model.displacement, p=model.pressure, excess=self._excess, stress=stress
        )
        fields = {"displacement": there["u"], "pore_pressure": there["p"][:, 0], "excess_pore_pressure": there["excess"][:, 0],
                  "effective_stress": there["stress"]}  # fmt: skip
        self.output.write(model.time, fields, {})
        excess, moved = gathered(self._excess), gathered(model.displacement)
        days = model.time / DAY
        name = f"After {days:.0f} days" if days >= 100 else f"After {days:.3g} days"
        self.pictures.append(None if excess is None or moved is None else ExcessPicture(name, excess, moved.values))


def follow(a: Namespace, model: water.Consolidation, files: Files) -> str | None:
    """The ground in time. Returns why it ended early, if it did. Collective."""
    dt = DAY * min(a.first_step, a.days)
    frames = np.geomspace(min(10 * a.first_step, 0.5 * a.days), a.days, a.frames) if a.frames > 1 else [a.days]
    with Progress("consolidation", a.days, comm, unit="days") as progress:

        def made(report: water.ConsolidationReport) -> None:
            if report.converged:
                files.row(report)
                progress.show(model.time / DAY, len(files.history))

        for frame in frames:
            reports = model.run(DAY * frame, dt, a.growth, progress=made)
            if not reports[-1].converged:
                return f"no step from {model.time / DAY:.4g} days on: {reports[-1].reason}"
            dt = max(dt, max(report.dt for report in reports))
            files.frame()
    return None


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def drawn(site: ConsolidationSite, files: Files, folder: Path) -> Pictures:
    """Excess pressures at the frames; settlements and the largest excess pressure over the logarithm of time."""
    shown, history = [picture for picture in files.pictures if picture is not None], files.history
    days = history["time_days"][1:]
    settled = {name: 1e3 * history[f"settlement_{name}_m"][1:] for name in site.points}
    largest = {"largest": 1e-3 * history["largest_excess_pressure_Pa"][1:]}
    return {
        "excess_pressure.png": lambda: save_excess(folder / "excess_pressure.png", shown),
        "settlement.png": lambda: save_over_time(
            folder / "settlement.png", days, settled, "Settlement [mm]", downward=True
        ),
        "largest_excess.png": lambda: save_over_time(
            folder / "largest_excess.png", days, largest, "Largest excess pore pressure [kPa]"
        ),
    }


CAPTIONS = {
    "excess_pressure": "Pore pressure above that at the beginning, on the deformed ground",
    "settlement": "Settlement of the points of the site over the logarithm of time",
    "largest_excess": "Largest excess pore pressure over the logarithm of time",
}


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a: Namespace = parser().parse_args(arguments)
    start = perf_counter()
    folder = open_results(a, comm)
    site = read_consolidation_site(a.site, comm, a.cell_size)
    model = site.at_rest(ELEMENTS[a.elements])
    with Files(model, site, folder) as files:
        files.row()
        stopped = follow(a, model, files)
    history = files.history
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped,
        **{f"settlement_{name}_m": history[f"settlement_{name}_m"][-1] for name in site.points},
        "largest_excess_pressure_Pa": history["largest_excess_pressure_Pa"].max(),
        "largest_water_error_m2": np.abs(history["water_error_m2"]).max(),
        "last_time_days": model.time / DAY, "steps": len(history) - 1, "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    write_summary(folder, a, summary, comm, Page(captions=CAPTIONS), drawn(site, files, folder))
    if comm.rank == 0:
        for name in site.points:
            print(f"settlement, {name}: {1e3 * summary[f'settlement_{name}_m']:.4g} mm")
        if stopped:
            print(f"ended early: {stopped}", file=sys.stderr)
        print(f"results in {folder}")
    return 1 if stopped else 0


if __name__ == "__main__":
    run_study(main, mpm.InputError, mpm.RunError, OutputError)
