"""Quantities over time as a CSV file."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from mpi4py import MPI


class History:
    """Rows of a CSV file, each on disk as soon as it is added, and kept for plotting; a context manager.

    Example:
        >>> with History(folder / "history.csv", ["time_s", "crest_displacement_m"]) as history:
        ...     history.add(time_s=0.0, crest_displacement_m=0.0)
        ...     history["time_s"]
        array([0.])

    Args:
        path: of the file; an older one is replaced. The first rank writes, every rank keeps the rows.
        columns: names, which end in their unit.
    """

    def __init__(self, path: Path, columns: Sequence[str], comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        self.columns = list(columns)
        self._rows: list[list[float]] = []
        self._file = open(path, "w", newline="", encoding="utf-8") if comm.rank == 0 else None
        if self._file is not None:
            self._writer = csv.writer(self._file)
            self._writer.writerow(self.columns)
            self._file.flush()

    def add(self, **values: float) -> None:
        """Add a row.

        Args:
            values: one number for each column, by name.
        """
        if set(values) != set(self.columns):
            raise ValueError(f"columns are {', '.join(values)}, expected {', '.join(self.columns)}")
        self._rows.append([float(values[name]) for name in self.columns])
        if self._file is not None:
            self._writer.writerow([f"{value:.9g}" for value in self._rows[-1]])
            self._file.flush()

    def __len__(self) -> int:
        return len(self._rows)

    def __getitem__(self, column: str) -> np.ndarray:
        """Values of a column, one for each row."""
        k = self.columns.index(column)
        return np.array([row[k] for row in self._rows])

    def __enter__(self) -> History:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()
