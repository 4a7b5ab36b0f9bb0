"""Seepage through a dam, or through a site of your own: steady flow, then transient flow as reservoirs and rain change.

The site is a TOML file (`meshes/dam.toml` unless another is given): a mesh of gmsh, soils with conductivities and retention
curves by the names of its physical groups, and boundary conditions of the water. The water table is part of the solution.
If boundary values change in time, transient flow is computed from the steady state at the beginning.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
from time import perf_counter

import numpy as np
from common.field_files import FieldFiles
from common.field_plots import save_curves
from common.figures import Pictures
from common.options import add_count, add_number, add_switch, study_parser
from common.page import Page
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.site.doubts import warn_of_suction
from common.site.flow_doubts import warn_of_degree, warn_of_later_changes, warn_of_sealed_ground
from common.site.options import add_site_file
from common.summary import write_summary
from common.water.discharge import exit_gradients, extent_of, in_words, inflow_column, inflows
from common.water.seepage_plots import SATURATION, FlowPicture, dries, few, flow_picture, save_flow, save_flow_film
from common.water.site import DAY, WaterSite, read_water_site, time_in_words
from common.water.steps import FlowSteps
from mpi4py import MPI

from fenics_bridge import water
from fenics_bridge.compat import cell_dofs

comm = MPI.COMM_WORLD

FILM_FRAMES = 60
"""Frames of the film, evenly over time as far as steps are not longer"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_site_file(p, "dam", "soils and boundaries", ("P1", ("P1", "P2"), "linear or quadratic triangles"))
    add_number(p, "--days", 60.0, "days", "duration of transient flow, if boundary values change", above=0)
    add_count(p, "--frames", 6, "times at which the flow is stored; up to four of them are drawn")
    add_switch(p, "--film", True, "draw a film of the flow over time")
    return p


# --- 2. The flow -----------------------------------------------------------------------------------------------------


class Files(FieldFiles):
    """Files that are written during the run: frames for ParaView, and the history of the inflows."""

    def __init__(self, flow: water.Seepage, names: list[str], folder: Path) -> None:
        self._flow, self._names = flow, names
        extent = extent_of(flow)
        self._stored = f"stored_water_{extent.unit}"
        columns = ["time_days", *(inflow_column(name, extent) for name in names), self._stored]
        super().__init__(flow.domain, folder / "seepage", folder / "history.csv", columns)

    def row(self) -> None:
        """Add the present inflows and stored water to the history. Collective."""
        flow = self._flow
        stored = {self._stored: extent_of(flow).factor * flow.stored_water()}
        self.history.add(time_days=flow.time / DAY, **stored, **inflows(flow, self._names))

    def frame(self) -> None:
        """Add pressure, head and velocity to the files for ParaView. Collective."""
        flow = self._flow
        head, saturation = self.at_points(flow.pressure_head), self.at_points(flow.saturation())
        velocity = flow.velocity()
        dofs = cell_dofs(velocity.function_space)[: self.n_cells]
        means = velocity.x.array.reshape(-1, flow.domain.geometry.dim)[dofs].mean(axis=1)
        fields = {
            "pore_pressure": flow.unit_weight * head,
            "total_head": head + self.points[:, -1],
            "saturation": saturation,
        }
        self.output.write(flow.time, fields, {"velocity": means})


def follow(
    a: Namespace, walls: list[np.ndarray], flow: water.Seepage, files: Files, pictures: list[FlowPicture | None],
    film: list[FlowPicture | None],
) -> str | None:  # fmt: skip
    """The flow in time, with steps as long as Newton's method takes well. Returns why it ended early, if it did. Collective."""
    end = DAY * a.days
    steps = FlowSteps(flow, end)
    with Progress("seepage", a.days, comm, unit="days") as progress:

        def made() -> None:
            files.row()
            if a.film and flow.time >= end * len(film) / FILM_FRAMES:
                film.append(flow_picture(flow, f"After {time_in_words(flow.time)}", members=walls))
            progress.show(flow.time / DAY, len(files.history))

        for frame in np.linspace(0.0, end, a.frames + 1)[1:]:
            stopped = steps.until(frame, made)
            if stopped:
                return stopped
            files.frame()
            pictures.append(flow_picture(flow, f"After {time_in_words(flow.time)}", members=walls))
    return None


# --- 3. Pictures -----------------------------------------------------------------------------------------------------


def drawn(
    site: WaterSite,
    flow: water.Seepage,
    files: Files,
    pictures: list[FlowPicture | None],
    film: list[FlowPicture | None],
    folder: Path,
) -> Pictures:
    """Head, flow lines and water table of each frame and in a film, and the inflows over time."""
    shown = [picture for picture in pictures if picture is not None]
    saturation: Pictures = {}
    if shown and dries(shown):
        saturation = {"saturation.png": lambda: save_flow(folder / "saturation.png", few(shown), SATURATION)}
    if len(pictures) == 1:
        return {"seepage_steady.png": lambda: save_flow(folder / "seepage_steady.png", shown), **saturation}
    history, extent = files.history, extent_of(flow)
    curves = {c.facet_tag: (history["time_days"], history[inflow_column(c.facet_tag, extent)]) for c in site.boundary}
    moving = [picture for picture in film if picture is not None]
    axes, limits = ("Time [days]", f"Inflow [{extent.label}]"), ((0, None), (None, None))
    return {
        "seepage_steady.png": lambda: save_flow(folder / "seepage_steady.png", shown[:1]),
        "seepage_in_time.png": lambda: save_flow(folder / "seepage_in_time.png", few(shown)),
        **saturation,
        "inflow.png": lambda: save_curves(folder / "inflow.png", curves, axes, limits=limits),
        **({"film": lambda: save_flow_film(folder / "film", moving)} if len(moving) > 1 else {}),
    }


CAPTIONS = {
    "seepage_steady": "Steady flow: total head, flow lines, and the water table (blue)",
    "seepage_in_time": "The flow in time: total head, flow lines, and the water table (blue)",
    "saturation": "Degree of saturation, flow lines, and the water table (blue)",
    "inflow": "Water that enters at each boundary, {}; negative where it leaves",
}


# --- 4. All together -------------------------------------------------------------------------------------------------


def main(arguments: list[str] | None = None) -> int:
    a: Namespace = parser().parse_args(arguments)
    start = perf_counter()
    site = read_water_site(a.site, comm, a.cell_size)
    warn_of_later_changes(a.days, site.boundary, a.site)
    warn_of_degree(int(a.elements[1]), site.varies, site.soils)
    folder = open_results(a, comm)
    flow = site.seepage(int(a.elements[1]))
    names = [c.facet_tag for c in site.boundary]
    flow.solve()
    warn_of_sealed_ground(flow, site.ground, site.walls, f"{a.site}: boundaries")
    extent, steady, gradients = extent_of(flow), inflows(flow, names), exit_gradients(flow)
    dry = warn_of_suction(flow, site.soils, site.cell_tags, a.site)
    title = "Steady flow at the beginning" if site.varies else "Steady flow"
    pictures, stopped = [flow_picture(flow, title, members=site.walls)], None
    film = pictures[:1]
    with Files(flow, names, folder) as files:
        files.row()
        files.frame()
        if site.varies:
            stopped = follow(a, site.walls, flow, files, pictures, film)
            if not dry:
                warn_of_suction(flow, site.soils, site.cell_tags, a.site)
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped,
        **{f"steady_{name}": value for name, value in (steady | gradients).items()},
        "last_time_days": flow.time / DAY, f"stored_water_{extent.unit}": extent.factor * flow.stored_water(),
        "steps": len(files.history) - 1, "wall_seconds": perf_counter() - start,
    }  # fmt: skip
    said = zip(names, in_words(steady, extent).values())
    lines = [f"steady inflow, {name}: {value}" for name, value in dict(said).items()]
    largest, upward = gradients.values()
    lines += [
        f"largest gradient of the steady flow where water leaves: {largest:.3g}, its upward part {upward + 0.0:.3g} (about 1 lifts sand)"
    ]
    page = Page(captions=CAPTIONS | {"inflow": CAPTIONS["inflow"].format(extent.words)})
    return write_summary(
        folder, a, summary, comm, page, drawn(site, flow, files, pictures, film, folder), said="\n".join(lines)
    )


if __name__ == "__main__":
    run_study(main)
