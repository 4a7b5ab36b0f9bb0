"""Results of structural members after each stage: a table, points for ParaView, and pictures of walls and of axial forces."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.collective import on_first_rank
from mpm_core.output import ParticleOutput

import fenics_bridge as bridge
import mpm_core as mpm

from ..figures import Pictures, curve_figure
from ..files import OutputError, write_text
from ..plots import CURVES, curve_look, name_curves
from .keys import DAY

COLUMNS = (
    "stage", "name", "member", "x_m", "y_m", "displacement_x_m", "displacement_y_m", "axial_force_N_per_m",
    "shear_force_N_per_m", "moment_N_m_per_m",
)  # fmt: skip
COLUMNS_OF_BODY = (
    "stage", "name", "member", "x_m", "y_m", "z_m", "displacement_x_m", "displacement_y_m", "displacement_z_m", "axial_force_N",
)  # fmt: skip
"""In three dimensions, where no member bends and a force is that of a single one"""
HOOPS = ("hoop_force_N_per_m", "hoop_moment_N_m_per_m")
"""Further columns of members of axisymmetric bodies"""
LEGEND_COLUMNS = 4
"""Stages beside one another in the legend of a beam"""
BEAM = (
    "displacement across its line, bending moment, shear force and axial force; tension is positive, and so is a moment by which the left "
    "side, seen from the first point of the line to its last, is compressed"
)


@dataclass
class StageForces:
    """Forces of the members after a stage or at a time [s]: its number and name, and the forces by the name of each member."""

    number: int
    name: str
    forces: dict[str, mpm.MemberForces]
    time: float | None = None


def stage_forces(site: bridge.FemSite, name: str) -> StageForces:
    """The forces of all members of a site now. Collective."""
    return StageForces(site.number, name, _forces(site.fem))


def last_forces(fem: bridge.QuasiStatic, name: str) -> list[StageForces]:
    """The forces of all members of finite elements now, as those of one stage of that name; none without members. Collective."""
    return [StageForces(1, name, _forces(fem))] if fem.members else []


def _forces(fem: bridge.QuasiStatic) -> dict[str, mpm.MemberForces]:
    """The forces of all members now, by name. Collective."""
    return {each: fem.member_forces(each) for each in fem.members}


def axial_column(member: str, dim: int = 2) -> str:
    """Name of the column of a member's axial force, which in plane strain is that of a slice 1 m thick; dim: of its points."""
    return f"{member.replace(' ', '_')}_axial_force_N{'' if dim == 3 else '_per_m'}"


def axial_label(dim: int = 2) -> str:
    """Label of the axis of axial forces; dim: of the points of members."""
    return f"Axial force [kN{'' if dim == 3 else '/m'}]"


def moment_column(member: str) -> str:
    """Name of the column of a beam's moment."""
    return f"{member.replace(' ', '_')}_moment_N_m_per_m"


def shear_column(member: str) -> str:
    """Name of the column of a beam's shear force."""
    return f"{member.replace(' ', '_')}_shear_force_N_per_m"


def force_columns(members: Mapping[str, mpm.Member]) -> list[str]:
    """Names of the columns of `force_row`."""
    bending = [moment_column(name) for name, member in members.items() if member.bending_stiffness]
    shear = [shear_column(name) for name, member in members.items() if member.bending_stiffness]
    return [*(axial_column(name, member.dim) for name, member in members.items()), *bending, *shear]


def force_row(members: Mapping[str, mpm.Member], forces: Mapping[str, mpm.MemberForces]) -> dict[str, float]:
    """Axial force of each member, and moment and shear force of each beam, where they are largest, for a table."""
    axial = {axial_column(name, members[name].dim): largest(one.axial_force) for name, one in forces.items()}
    beams = {name: one for name, one in forces.items() if members[name].bending_stiffness}
    moments = {moment_column(name): largest(one.moment) for name, one in beams.items()}
    hoops = {f"{name.replace(' ', '_')}_{column}": largest(values) for name, one in beams.items()
             for column, values in zip(HOOPS, (one.hoop_force, one.hoop_moment)) if values is not None}  # fmt: skip
    return axial | moments | {shear_column(name): largest(one.shear_force) for name, one in beams.items()} | hoops


def largest(values: np.ndarray) -> float:
    """The value that is farthest from 0, with its sign."""
    return float(values[np.argmax(np.abs(values))])


def at_nodes(per_segment: np.ndarray) -> np.ndarray:
    """Values of segments (n - 1,) as those of the nodes (n,): the mean of the two beside each."""
    ends = np.concatenate([per_segment[:1], per_segment, per_segment[-1:]])
    return (ends[1:] + ends[:-1]) / 2


def write_members(folder: Path, stages: list[StageForces], comm: MPI.Comm) -> None:
    """Write ``members.csv``, and the series ``members`` of the nodes for ParaView, where there are members. Collective.

    Stages with a time have it in the table, in days, and in the series, in seconds, in the place of their number.
    """
    if not any(stage.forces for stage in stages):
        return
    on_first_rank(comm, lambda: write_text(folder / "members.csv", _table(stages)), OutputError)
    shells, dim = _has_shells(stages), _dimension(stages)
    with ParticleOutput(folder / "members", comm) as output:
        for stage in stages:
            parts = [_fields(forces, number, shells, dim) for number, forces in enumerate(stage.forces.values())] or [
                _fields(None, 0, shells, dim)
            ]
            fields = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
            mine = slice(None) if comm.rank == 0 else slice(0)
            output.write(
                float(stage.number) if stage.time is None else stage.time,
                {name: values[mine] for name, values in fields.items()},
            )


def member_pictures(stages: list[StageForces], folder: Path) -> Pictures:
    """A picture of each beam, and one of the axial forces of bars and struts over the stages."""
    names = list(dict.fromkeys(name for stage in stages for name in stage.forces))
    bending = [name for name in names if any(s.forces[name].bends for s in stages if name in s.forces)]
    pictures: dict[str, Any] = {}
    for name in bending:
        path = folder / f"{file_name(name)}.png"
        pictures[path.stem] = lambda name=name, path=path: save_beam(path, name, stages)
    if straight := [name for name in names if name not in bending]:
        pictures["axial_forces"] = lambda: save_axial_forces(folder / "axial_forces.png", straight, stages)
    return pictures


def captions(stages: list[StageForces], when: str = "after each stage") -> dict[str, str]:
    """Captions of `member_pictures`, by file name; when: they have these forces."""
    names = dict.fromkeys(name for stage in stages for name in stage.forces)
    beams = {file_name(name): f"Member {name} {when}: {BEAM}" for name in names}
    return {**beams, "axial_forces": f"Largest axial force of each bar and strut {when}; tension is positive"}


def file_name(member: str) -> str:
    """Name of the picture of a beam."""
    return "member_" + "".join(c if c.isalnum() else "_" for c in member)


def save_beam(path: Path, name: str, stages: list[StageForces]) -> None:
    """Displacement across a beam, moment, shear and axial force over its height, or its length where it is flat."""
    shown = [stage for stage in stages if name in stage.forces]
    extent = np.ptp(shown[0].forces[name].positions, axis=0)
    upright = bool(extent[1] >= extent[0])
    curves = [_curves(stage.forces[name], upright) for stage in shown]
    count = max(map(len, curves))
    rows, columns = (1, count) if upright else (count, 1)
    size = (6.9 * count / 4, 4.0) if upright else (5.4, 7.4 * count / 4)
    with curve_figure(path, size, columns, rows) as panels:
        for k, stage in enumerate(shown):
            style = {"color": CURVES[k % len(CURVES)], "linewidth": 1.1, "label": stage.name, "marker": ""}
            for axes, (label, (values, where)) in zip(panels, curves[k].items()):
                axes.plot(*((values, where) if upright else (where, values)), **style)
                (axes.set_xlabel if upright else axes.set_ylabel)(label)
                (axes.axvline if upright else axes.axhline)(0.0, color="black", linewidth=0.5)
        if upright:
            panels[0].set_ylabel("Height [m]")
            for axes in panels[1:]:
                axes.tick_params(labelleft=False)
        else:
            panels[-1].set_xlabel("x [m]")
        figure, lines = panels[0].figure, -(-len(shown) // LEGEND_COLUMNS)
        room = (0.2 * lines + 0.1) / figure.get_size_inches()[1]
        figure.get_layout_engine().set(rect=(0, 0, 1, 1 - room))
        figure.legend(*panels[0].get_legend_handles_labels(), loc="upper center", ncol=LEGEND_COLUMNS, fontsize=8)


def _curves(forces: mpm.MemberForces, upright: bool) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Values and places of the curves of a beam by their labels, over its height or along x; hoop moments of plates alone."""
    nodes = forces.positions[:, 1 if upright else 0]
    ends = np.column_stack([nodes[:-1], nodes[1:]]).ravel()  # of the segments, whose forces jump where a strut is
    curves = {
        "Displacement [mm]": (1e3 * forces.displacement[:, 0 if upright else 1], nodes),
        "Moment [kN m/m]": (1e-3 * forces.moment, nodes),
    }
    segments = {"Shear force [kN/m]": forces.shear_force, axial_label(): forces.axial_force}
    if forces.hoop_force is not None and forces.hoop_moment is not None:
        segments["Hoop force [kN/m]"] = forces.hoop_force
        if np.ptp(forces.positions[:, 0]) > 0:  # a cylinder has none
            segments["Hoop moment [kN m/m]"] = forces.hoop_moment
    return curves | {label: (1e-3 * np.repeat(values, 2), ends) for label, values in segments.items()}


def save_axial_forces(path: Path, names: list[str], stages: list[StageForces]) -> None:
    """Largest axial force of bars and struts after each stage, or of one stage alone as bars."""
    shown = [stage for stage in stages if stage.forces]
    if len(shown) == 1:
        return _save_bars(
            path, {name: largest(shown[0].forces[name].axial_force) for name in names}, _dimension(stages)
        )
    with curve_figure(path, (5.4, 3.4)) as axes:
        for k, name in enumerate(names):
            values = [1e-3 * largest(s.forces[name].axial_force) if name in s.forces else np.nan for s in shown]
            axes.plot(range(len(shown)), values, marker="o", markersize=3.5, label=name, **curve_look(k))
        axes.set_xticks(range(len(shown)), [stage.name for stage in shown], rotation=25, ha="right")
        axes.set(xlabel="Stage", ylabel=axial_label(_dimension(stages)))
        axes.axhline(0, color="black", linewidth=0.5)
        name_curves(axes, fontsize=8)


def _save_bars(path: Path, forces: Mapping[str, float], dim: int) -> None:
    """Axial forces [N/m], in three dimensions [N], by the name of the member, from above in their order; dim: of their points."""
    with curve_figure(path, (5.4, 0.9 + 0.28 * len(forces))) as axes:
        axes.barh(list(forces), [1e-3 * force for force in forces.values()], height=0.6, color=CURVES[0], zorder=2)
        axes.invert_yaxis()
        axes.tick_params(axis="y", length=0)
        axes.grid(False, axis="y")
        axes.set(xlabel=f"Largest {axial_label(dim)[0].lower()}{axial_label(dim)[1:]}")
        axes.axvline(0, color="black", linewidth=0.5)


def _table(stages: list[StageForces]) -> str:
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    timed = any(stage.time is not None for stage in stages)
    hoops, solid = HOOPS if _has_shells(stages) else (), _dimension(stages) == 3
    columns = COLUMNS_OF_BODY if solid else COLUMNS
    rows.writerow((*columns[:2], *(["time_days"] if timed else []), *columns[2:], *hoops))
    for stage in stages:
        for name, forces in stage.forces.items():
            around = [at_nodes(one) for one in (forces.hoop_force, forces.hoop_moment) if one is not None]
            bent = [] if solid else [at_nodes(forces.shear_force), forces.moment]
            values = np.column_stack(
                [forces.positions, forces.displacement, at_nodes(forces.axial_force), *bent, *around]
            )
            days = [] if stage.time is None else [f"{stage.time / DAY:.9g}"]
            start = [stage.number, stage.name, *days, name]
            rows.writerows([*start, *(f"{value:.6g}" for value in row)] for row in values)
    return text.getvalue()


def _has_shells(stages: list[StageForces]) -> bool:
    """Whether there are members of axisymmetric bodies, with forces around the axis."""
    return any(forces.hoop_force is not None for stage in stages for forces in stage.forces.values())


def _dimension(stages: list[StageForces]) -> int:
    """Of the points of members, of which there are some."""
    return int(next(forces.positions.shape[1] for stage in stages for forces in stage.forces.values()))


def _fields(forces: mpm.MemberForces | None, number: int, shells: bool, dim: int) -> dict[str, np.ndarray]:
    """Fields of the nodes of a member; none of them where there is no member.

    shells: whether there are forces around an axis; dim: of the points of members.
    """
    scalars = ("axial_force", "shear_force", "moment", *(("hoop_force", "hoop_moment") if shells else ()))
    if forces is None:
        empty = {"position": np.zeros((0, dim)), "displacement": np.zeros((0, dim)), "member": np.zeros(0, dtype=int)}
        return empty | {name: np.zeros(0) for name in scalars}
    places = {"position": forces.positions, "displacement": forces.displacement}
    values = {name: getattr(forces, name) for name in scalars}
    at = {name: one if name == "moment" else at_nodes(one) for name, one in values.items()}
    return {**places, "member": np.full(len(forces.positions), number), **at}
