"""What structural members carry while ground consolidates: a history, a table at the frames, and pictures."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mpi4py import MPI

import mpm_core as mpm
from fenics_bridge import water

from ..figures import Pictures
from ..history import History
from ..site.member_results import (
    StageForces,
    axial_column,
    force_columns,
    force_row,
    member_pictures,
    moment_column,
    write_members,
)
from ..water.site import time_in_words
from .plots import save_over_time


class MembersOverTime:
    """Forces of the members of a site, at each step where they are largest, and all of them at the frames.

    Args:
        members: all that the site installs, by name.
    """

    def __init__(self, members: Mapping[str, mpm.Member]) -> None:
        self._members = members
        self.columns = force_columns(members)
        """Names of the columns of the history"""
        self.frames: list[StageForces] = []
        """Forces at the frames"""

    def row(self, model: water.Consolidation) -> dict[str, float]:
        """Values of the columns now; NaN of members that are not there. Collective."""
        absent = dict.fromkeys(self.columns, np.nan)
        return absent | force_row(self._members, {name: model.member_forces(name) for name in model.members})

    def frame(self, model: water.Consolidation) -> None:
        """Keep the forces now. Collective."""
        name = f"After {time_in_words(model.time)}" if model.time > 0 else "Beginning"
        forces = {each: model.member_forces(each) for each in model.members}
        self.frames.append(StageForces(len(self.frames), name, forces, model.time))

    def lines(self, model: water.Consolidation) -> list[tuple[np.ndarray, np.ndarray]]:
        """Nodes (n, 2) [m] of each member that is there, and their displacements with the ground [m]. Collective."""
        return [(model.member_forces(name).positions, model.moved_member(name)) for name in model.members]

    def largest(self, history: History) -> dict[str, float]:
        """Entries of the summary: of each column the value that is farthest from 0; None where there is none."""
        found = {}
        for column in self.columns:
            values = history[column][np.isfinite(history[column])]
            found[f"largest_{column}"] = float(values[np.argmax(np.abs(values))]) if len(values) else None
        return found

    def write(self, folder: Path, comm: MPI.Comm) -> None:
        """Write ``members.csv`` and the series ``members``. Collective."""
        write_members(folder, self.frames, comm)

    def pictures(self, folder: Path, history: History, logarithmic: bool, stages: list[float]) -> Pictures:
        """Each beam at the frames, and the largest axial forces and moments over time.

        Args:
            history: of the study; logarithmic: scale of the time.
            stages: days at which further stages begin.
        """
        if not self._members:
            return {}
        drawn = {name: one for name, one in member_pictures(self.frames, folder).items() if name != "axial_forces"}
        beams = [name for name, member in self._members.items() if member.bending_stiffness]
        since = 1 if logarithmic else 0  # the logarithm of time has no beginning
        for file, label, column, names in (
            ("axial_forces", "Largest axial force [kN/m]", axial_column, list(self._members)),
            ("moments", "Largest moment [kN m/m]", moment_column, beams),
        ):
            curves = {name: 1e-3 * history[column(name)][since:] for name in names}
            if names:
                path, days = folder / f"{file}.png", history["time_days"][since:]
                drawn[file] = lambda path=path, days=days, curves=curves, label=label: save_over_time(
                    path, days, curves, label, stages=stages, logarithmic=logarithmic
                )
        return drawn
