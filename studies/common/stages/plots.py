"""Pictures of stages of finite elements: the soil after each stage, coloured by a quantity; and files for ParaView."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from mpi4py import MPI
from mpm_core.output import MeshOutput

import fenics_bridge as bridge
from particle_player import axis_labels, boundary_edges

from ..field_plots import Field, gathered
from ..figures import Pictures, curve_figure, label_axes, panel_figure, save_figure
from ..plots import CURVES, MEMBER, Quantity, paper_style
from ..site.water_table import draw_water_table, level_line, top_with_water, water_legend
from ..water.seepage_plots import FlowPicture, few, flow_picture, save_flow
from .flow import StageFlow
from .surface import surface_picture

MOVED = Quantity("Displacement", "mm", scale=1e3, colours="viridis")
SHEAR = Quantity("Accumulated deviatoric strain", "%", scale=1e2, colours="inferno")


@dataclass
class StagePicture:
    """A stage for pictures, on the first rank.

    displacement: at the corners of all cells [m]; there: of each cell; strain: accumulated deviatoric strain of each cell [-]
    water: segments (k, 2, 2) [m] of the water table, none where the site is dry; members: lines (n, 2) [m] of structural ones
    flow: the steady flow that has the pore pressures; None where a water level has them
    """

    name: str
    displacement: Field
    there: np.ndarray
    strain: np.ndarray
    water: np.ndarray = field(default_factory=lambda: np.empty((0, 2, 2)))
    members: Sequence[np.ndarray] = ()
    flow: FlowPicture | None = None

    def field(self) -> Field:
        """The displacement on the cells that are there."""
        return Field(self.displacement.points, self.displacement.cells[self.there], self.displacement.values,
                     self.displacement.half_section)  # fmt: skip

    def moved(self) -> np.ndarray:
        """Displacement [m] of each point; where soil was placed later than that beside it, it falls within a row of cells."""
        return np.linalg.norm(self.displacement.values, axis=1)


def stage_picture(site: bridge.FemSite, name: str) -> StagePicture | None:
    """The site as it is now; None but on the first rank. Collective."""
    fem, comm = site.fem, site.fem.domain.comm
    moved, pressure = gathered(fem.displacement, fem.geometry == bridge.Geometry.AXISYMMETRIC), site.state.pore_pressure
    parts = comm.gather(tuple(values[:, 0] for values in own_cell_values(fem)))
    lines, flow = [np.array(member.points) for member in fem.members.values()], None
    if isinstance(pressure, StageFlow):
        flow = flow_picture(pressure.flow, f"Stage: {name}", pressure.reservoirs, lines)
    if moved is None or parts is None:
        return None
    material, strain, _ = (np.concatenate(arrays) for arrays in zip(*parts))
    box = moved.points.min(axis=0), moved.points.max(axis=0)
    if flow is not None:
        water = {"water": flow.table()}  # the pressures of a flow are there for all ranks at once only
    else:
        water = {"water": level_line(pressure, *box)} if pressure else {}
    return StagePicture(name, moved, material >= 0, strain, members=lines, flow=flow, **water)


def own_cell_values(fem: bridge.QuasiStatic) -> list[np.ndarray]:
    """Number of the law (-1: not there), accumulated deviatoric strain and pore pressure of the cells that this rank owns: (m, 1)."""
    functions = fem.material_function(), fem.deviatoric_strain_function(), fem.pore_pressure_function()
    n = bridge.original_cells(fem.domain).size
    return [function.x.array.reshape(-1, 1)[:n].copy() for function in functions]


def save_stages(path: Path, stages: Sequence[StagePicture], quantity: Quantity) -> None:
    """Draw a panel for each stage, above one another, in one colour scale: displacement, or strain where `quantity` is SHEAR."""
    box = np.array([stages[0].displacement.points.min(axis=0), stages[0].displacement.points.max(axis=0)])
    is_strain = quantity is SHEAR
    box[1, 1] = top_with_water(*box[:, 1], [stage.water for stage in stages])
    values = [quantity.scale * (s.strain[s.there] if is_strain else s.moved()) for s in stages]
    drawn = [v if is_strain else v[np.unique(s.field().cells)] for s, v in zip(stages, values)]
    limits = (0.0, max(float(np.quantile(v, 0.995)) for v in drawn) or 1.0)
    aspect = (box[1, 1] - box[0, 1]) / (box[1, 0] - box[0, 0])
    table = False
    with paper_style():
        figure, panels = panel_figure(len(stages), aspect, tall=5.4)
        for axes, stage, shown in zip(panels.ravel(), stages, values):
            field = stage.field()
            per_cell, at_points = ({"facecolors": shown}, ()) if is_strain else ({"shading": "gouraud"}, (shown,))
            axes.tripcolor(*field.points.T, field.cells, *at_points, cmap=quantity.colours, vmin=limits[0], vmax=limits[1],
                           rasterized=True, **per_cell)  # fmt: skip
            outline = field.points[boundary_edges(field.cells)]
            axes.add_collection(LineCollection(outline, colors="black", linewidths=0.7))
            axes.add_collection(LineCollection(stage.members, colors=MEMBER, linewidths=1.6, capstyle="butt"))
            axes.set_title(f"Stage: {stage.name}", loc="left", pad=3)
            axes.set(aspect="equal", xlim=box[:, 0], ylim=box[:, 1])
            table = draw_water_table(axes, stage.water) or table
        label_axes(panels, axis_labels(stages[0].displacement.half_section))
        if table:
            water_legend(panels[0, 0], below=aspect > 1)
        bar = figure.colorbar(ScalarMappable(Normalize(*limits), quantity.colours), ax=panels.ravel().tolist(), shrink=0.6,
                              extend="max", pad=0.01)  # fmt: skip
        bar.set_label(quantity.label)
        save_figure(figure, path)


def save_over_stages(path: Path, names: Sequence[str], curves: dict[str, Sequence[float]], label: str) -> None:
    """Values after each stage, by name of the curve; NaN where there is none."""
    with curve_figure(path, (5.4, 3.4)) as axes:
        for k, (name, values) in enumerate(curves.items()):
            axes.plot(range(1, len(names) + 1), values, "o-", color=CURVES[k % len(CURVES)], markersize=3.5, label=name)
        axes.set_xticks(range(1, len(names) + 1), names, rotation=25, ha="right")
        axes.set(xlabel="Stage", ylabel=label)
        axes.axhline(0, color="black", linewidth=0.5)
        axes.legend(fontsize=8)


def stage_pictures(
    stages: Sequence[bridge.Stage], rows: list[dict], pictures: list[StagePicture], folder: Path
) -> Pictures:
    """The soil after each stage by displacement and by strain, settlements of level ground, and movements over the stages.

    Stages before displacements were reset, such as the one that makes the stresses in situ, are left out.
    """
    if not pictures:
        return {}
    first = first_shown(stages, rows)
    before = pictures[first - 1].strain if first else 0.0
    rows, pictures = rows[first:], [replace(picture, strain=picture.strain - before) for picture in pictures[first:]]
    flows = [one.flow for one in pictures if one.flow is not None and one.flow.moves]
    flowing: Pictures = {"stages_flow": lambda: save_flow(folder / "stages_flow.png", few(flows))} if flows else {}
    return {
        **flowing,
        "stages_displacement": lambda: save_stages(folder / "stages_displacement.png", pictures, MOVED),
        "stages_strain": lambda: save_stages(folder / "stages_strain.png", pictures, SHEAR),
        **surface_picture(pictures, folder),
        "movements": movement_picture(rows, folder),
    }


def first_shown(stages: Sequence[bridge.Stage], rows: Sequence[Any]) -> int:
    """The first stage from which displacements count: the last one that resets them, of those that have rows of results."""
    return max((k for k, stage in enumerate(stages[: len(rows)]) if stage.reset_displacement), default=0)


def movement_picture(rows: Sequence[Mapping[str, Any]], folder: Path) -> Callable[[], None]:
    """A picture of the largest movements over the stages."""
    curves = {name: [1e3 * row[key] for row in rows] for key, name in
              (("heave_m", "largest heave"), ("settlement_m", "largest settlement"),
               ("sideways_m", "largest horizontal"))}  # fmt: skip
    names = [row["stage"] for row in rows]
    return lambda: save_over_stages(folder / "movements.png", names, curves, "Displacement [mm]")


class StageFiles:
    """Series for ParaView, a frame after each stage, whose time is the number of the stage. A context manager. Collective."""

    def __init__(self, site: bridge.FemSite, path: Path, comm: MPI.Comm) -> None:
        self._fem = site.fem
        mesh = bridge.background_arrays(self._fem.domain)
        self._points, own = mesh["points"], mesh["cell_owners"] == comm.rank
        self._output = MeshOutput(path, comm, mesh["points"], mesh["cells"][own])

    def write(self, number: int) -> None:
        """Add displacement, stress, pore pressure, material (-1: no soil) and strain as they are after a stage."""
        material, strain, pressure = own_cell_values(self._fem)
        n = len(material)
        function = self._fem.stress_function()
        stress = function.x.array.reshape(-1, function.ufl_shape[0])[:n]
        if self._fem.geometry == bridge.Geometry.AXISYMMETRIC:  # named as those of axisymmetric particles
            stresses = {f"stress_{part}": stress[:, k].copy() for k, part in enumerate(("xx", "yy", "hoop", "xy"))}
        else:
            stresses = {"stress": stress}
        moved = bridge.evaluate_at(self._points, displacement=self._fem.displacement)["displacement"]
        cells = {
            "material": material[:, 0],
            "deviatoric_strain": strain[:, 0],
            "pore_pressure": pressure[:, 0],
            **stresses,
        }
        self._output.write(float(number), {"displacement": moved}, cells)

    def __enter__(self) -> StageFiles:
        return self

    def __exit__(self, *error: Any) -> None:
        self._output.close()
