"""Files that a study of finite elements writes during the run: fields for ParaView, and a history."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import numpy as np
from dolfinx import fem
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.output import MeshOutput

import fenics_bridge as bridge
from fenics_bridge.compat import cell_dofs

from .history import History

Self = TypeVar("Self", bound="FieldFiles")


class FieldFiles:
    """Frames of a mesh for ParaView, and a history. A context manager; a study adds what fills them.

    Args:
        domain: mesh with its communicator.
        frames: path of the frames, without suffix.
        history: path of the history, a CSV file with the `columns`.
    """

    def __init__(self, domain: Mesh, frames: Path, history: Path, columns: list[str]) -> None:
        comm: MPI.Comm = domain.comm
        mesh = bridge.background_arrays(domain)
        self.points, own = mesh["points"], mesh["cell_owners"] == comm.rank
        self._nodes = mesh["cells"]
        self.n_cells = int(own.sum())
        self.output = MeshOutput(frames, comm, self.points, mesh["cells"][own])
        self.history = History(history, columns, comm)

    def at_points(self, function: fem.Function) -> np.ndarray:
        """Values of a scalar Lagrange function at the mesh's points, on both sides where it has two at one place: (n,)."""
        values = np.zeros(len(self.points))
        values[self._nodes] = function.x.array[cell_dofs(function.function_space)[:, : self._nodes.shape[1]]]
        return values

    def __enter__(self: Self) -> Self:
        self.history.__enter__()
        return self

    def __exit__(self, *error) -> None:
        self.history.__exit__(*error)
        self.output.close()
