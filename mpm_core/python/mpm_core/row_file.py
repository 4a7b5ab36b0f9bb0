"""A CSV file of numbers that grows during a run, and that a restart of the run continues."""

from __future__ import annotations

import csv
import math
import os
import sys
from collections.abc import Sequence
from typing import Any, TypeVar

from mpi4py import MPI

from ._core import InputError
from .collective import on_first_rank, write_on_first_rank

ROUNDING = 1e-8
"""Relative; more than that of times in the file, which have twelve digits."""

T = TypeVar("T", bound="RowFile")


class RowFile:
    """Rows under one heading, each on disk as soon as it was added; the first rank writes. A context manager.

    The file is begun as ``path.part`` and renamed when its first rows are on the disk: a run that is killed before that leaves
    an older file unchanged.

    Args:
        path: of the file.
        columns: names; the first is the time [s].
        keep_before: keep the rows before this time [s] of a file that is there, as after a restart; None replaces the file. Rows
            that are not whole, or not later than the one before, are left out, with a note on standard error.

    Raises:
        InputError: on all ranks, with path and reason: the file cannot be written, or has other columns to keep.

    Note:
        Collective, as `add` is.
    """

    def __init__(
        self, path: str | os.PathLike[str], columns: Sequence[str], comm: MPI.Comm, *, keep_before: float | None = None
    ) -> None:
        self.path, self._comm = os.fspath(path), comm
        self._file: Any = None
        self.kept: list[list[str]] = []
        """Rows that were kept, as texts; on the first rank"""
        on_first_rank(comm, lambda: self._begin(list(columns), keep_before))

    def __repr__(self) -> str:
        return f"<RowFile: {self.path}>"

    def _begin(self, columns: list[str], keep_before: float | None) -> None:
        aside = f"{self.path}.part"
        try:
            if keep_before is not None and os.path.exists(self.path):
                self.kept = _rows_before(self.path, columns, keep_before)
            file = open(aside, "w", newline="", encoding="utf-8")
            self._file, self._writer = file, csv.writer(file)
            self._writer.writerows([columns, *self.kept])
            file.flush()
            os.fsync(file.fileno())
            os.replace(aside, self.path)
        except OSError as error:
            raise InputError(f"path: cannot write {self.path}: {error.strerror}") from None

    def add(self, values: Sequence[float]) -> None:
        """Add a row.

        Raises:
            RunError: on all ranks, with path and reason, when it cannot be written.
        """

        def write() -> None:
            self._writer.writerow([f"{value:.12g}" for value in values])
            self._file.flush()

        write_on_first_rank(self._comm, self.path, write)

    def close(self) -> None:
        """Close the file; nothing can be added after that. A row that the disk could not hold is left out."""
        if self._file is not None:
            try:
                self._file.close()
            except OSError:  # what could not be written was an error when it was added
                pass

    def __enter__(self: T) -> T:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def _rows_before(path: str, columns: list[str], time: float) -> list[list[str]]:
    """Rows of a file before a time, without those that a killed run left half-written."""
    with open(path, newline="", encoding="utf-8", errors="replace") as file:
        text = file.read()
    rows = list(csv.reader(text.splitlines()))
    if not rows:
        return []
    if rows[0] != columns:
        raise InputError(f"path: {path} has the columns {', '.join(rows[0])}; expected {', '.join(columns)}")
    if not text.endswith("\n"):
        rows[-1] = []
    kept: list[list[str]] = []
    last, dropped = -math.inf, 0
    for row in rows[1:]:
        at = _time_of(row, len(columns))
        if at is None or at <= last:
            dropped += 1
        elif at < time - ROUNDING * abs(time):
            kept.append(row)
            last = at
    if dropped:
        print(f"note: {path}: {dropped} incomplete or repeated row(s) left out", file=sys.stderr)
    return kept


def _time_of(row: list[str], width: int) -> float | None:
    """The first number of a row of numbers; None where it is no such row."""
    try:
        numbers = [float(value) for value in row]
    except ValueError:
        return None
    return numbers[0] if len(numbers) == width else None
