"""Checkpoints of a study now and then, and going on from one."""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path

from mpi4py import MPI

import mpm_core as mpm

from .history import History


def add_checkpoint_options(parser: argparse.ArgumentParser) -> None:
    """Options ``--checkpoint-every`` and ``--restart``."""
    parser.add_argument(
        "--checkpoint-every", type=_interval, default=None, metavar="N|Xmin",
        help="save checkpoint.h5 in the results folder after this many steps, or minutes of wall time: 500, or 5min "
        "(default: only when the run is interrupted)",
    )  # fmt: skip
    parser.add_argument(
        "--restart", type=Path, default=None, metavar="FILE", help="go on from a checkpoint of the same mesh and soil"
    )


def _interval(text: str) -> str:
    """The text, where it can be read as an interval."""
    _read(text)
    return text


_interval.takes = "a number of steps or a text such as '5min'"  # type: ignore[attr-defined]


def _read(text: str) -> tuple[float, str]:
    """A number and "steps" or "min"."""
    unit = "min" if text.endswith("min") else "steps"
    number = text.removesuffix("min").strip()
    try:
        value = float(number) if unit == "min" else int(number)
    except ValueError:
        value = 0
    if not 0 < value < 1e12:
        raise argparse.ArgumentTypeError(
            f"is '{text}', expected a number of steps such as 500, or of minutes such as 5min"
        )
    return value, unit


class Checkpoints:
    """The checkpoint file of a run, written anew whenever it is due.

    Args:
        model: what is saved.
        path: of the file.
        every: such as "500" (steps) or "5min", as the option gives it; None to save only by ``save``.
    """

    def __init__(self, model: mpm.Model, path: Path, every: str | None) -> None:
        self.path = path
        self._model = model
        self._every = None if every is None else _read(every)
        self._last = self._now()

    def _now(self) -> float:
        """Steps, or minutes on the first rank's clock; the same on all ranks. Collective."""
        if self._every is None or self._every[1] == "steps":
            return self._model.steps
        return self._model.comm.bcast(time.monotonic() / 60)

    def save_when_due(self) -> None:
        """Save if as much has passed as ``every`` says. Collective."""
        if self._every is not None and self._now() - self._last >= self._every[0]:
            self.save()

    def save(self) -> None:
        """Save. Collective."""
        self._model.save(self.path)
        self._last = self._now()


def numbered(folder: Path, name: str, restarted: bool) -> Path:
    """A path for a series of files: NAME, or after a restart NAME-2, NAME-3, ..., so that earlier frames stay."""
    number = 1
    while restarted and (folder / f"{name}{'' if number == 1 else f'-{number}'}.xdmf").exists():
        number += 1
    return folder / (name if number == 1 else f"{name}-{number}")


def continued_history(path: Path, columns: list[str], until: float, comm: MPI.Comm) -> History:
    """A history file that keeps the rows of an earlier run before a time [s]; the first column must be the time."""
    rows: list[dict[str, str]] = []
    if comm.rank == 0 and path.exists():
        with open(path, newline="", encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if set(row) == set(columns) and float(row[columns[0]]) < until]
    rows = comm.bcast(rows)
    history = History(path, columns, comm)
    for row in rows:
        history.add(**{name: float(value) for name, value in row.items()})
    return history
