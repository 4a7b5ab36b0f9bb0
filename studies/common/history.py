"""Quantities over time as a CSV file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from mpi4py import MPI
from mpm_core.row_file import RowFile


class History(RowFile):
    """Rows of a CSV file, each on disk as soon as it is added, and kept for plotting; a context manager.

    Example:
        >>> with History(folder / "history.csv", ["time_s", "crest_displacement_m"]) as history:
        ...     history.add(time_s=0.0, crest_displacement_m=0.0)
        ...     history["time_s"]
        array([0.])

    Args:
        path: of the file. The first rank writes, every rank keeps the rows.
        columns: names, which end in their unit.
        keep_before: keep the rows before this time [s] of a file that is there, as after a restart; otherwise it is replaced.

    Raises:
        InputError: on all ranks, with path and reason: the file cannot be written, or has other columns to keep.
    """

    def __init__(
        self, path: Path, columns: Sequence[str], comm: MPI.Comm = MPI.COMM_WORLD, *, keep_before: float | None = None
    ) -> None:
        super().__init__(path, columns, comm, keep_before=keep_before)
        self.columns = list(columns)
        self._rows: list[list[float]] = [[float(value) for value in row] for row in comm.bcast(self.kept)]

    def add(self, **values: float) -> None:
        """Add a row. Collective.

        Args:
            values: one number for each column, by name.

        Raises:
            RunError: on all ranks, with path and reason, when the file cannot be written.
        """
        if set(values) != set(self.columns):
            raise ValueError(f"columns are {', '.join(values)}, expected {', '.join(self.columns)}")
        self._rows.append([float(values[name]) for name in self.columns])
        super().add(self._rows[-1])

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, column: str) -> np.ndarray:
        """Values of a column, one for each row."""
        k = self.columns.index(column)
        return np.array([row[k] for row in self._rows])
