"""Regular checkpoints of a study, and the options of a restart."""

from __future__ import annotations

import argparse
import time
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from mpi4py import MPI

import mpm_core as mpm

from .notes import changes, restart_row
from .options import Options, check
from .parameters import plain_values


def add_checkpoint_options(parser: argparse.ArgumentParser) -> None:
    """Options ``--checkpoint-every`` and ``--restart``."""
    parser.add_argument(
        "--checkpoint-every", type=_interval, default=None, metavar="N|Xmin",
        help="save checkpoint.h5 in the results folder every so many steps, such as 500, or minutes of wall time, such as 5min "
        "(default: only when the run is interrupted)",
    )  # fmt: skip
    parser.add_argument(
        "--restart", type=Path, default=None, metavar="FILE",
        help="continue from a checkpoint, with the options of its run, and in its folder unless --output names "
        "another",
    )  # fmt: skip


def check_restart(parser: argparse.ArgumentParser, options: Options, may_change: Collection[str]) -> None:
    """Compare the options with those that the checkpoint's run had: end with an error, or take note of what changed.

    Args:
        may_change: names, without dashes in front, of the options that may change from there on; with another value of any
            other the run would not be the one that it says it is.
    """
    if not options.notes:
        return
    reached, end = options.notes["time"], getattr(options, "time", np.inf)  # other studies end by the way of a body
    check(parser, end >= reached, lambda: f"--time is {end:g} s, expected at least the {reached:g} s that the run of checkpoint "
          f"{options.restart} has reached")  # fmt: skip
    changed = changes(options.notes, options.parameters())
    for name, (before, now) in changed.items():
        check(parser, name in may_change,
              lambda name=name, before=before, now=now: f"--{name} is {now}, but the run of checkpoint {options.restart} has "
              f"{before}; leave it out to continue with that, or start a new run. A restart may change: "
              f"{', '.join(sorted(may_change))}")  # fmt: skip
    options.restarts = [*options.notes["restarts"], restart_row(options.notes, changed, MPI.COMM_WORLD.size)]


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
    """The checkpoint file of a run, ``checkpoint.h5`` in its folder, replaced whenever it is due.

    Args:
        model: what is saved.
        options: of the run, which are kept in the file; without ``--checkpoint-every`` it is written only by ``save``.
        start: results of the initial state for the summary, which are kept there too.
    """

    def __init__(
        self, model: mpm.Model, folder: Path, options: Options, start: Mapping[str, Any] | None = None
    ) -> None:
        self.path = folder / "checkpoint.h5"
        self._notes = {"study": options.study, "options": plain_values(options.parameters()), "restarts": options.restarts,
                       "start": start or {}}  # fmt: skip
        self._model = model
        self._every = None if options.checkpoint_every is None else _read(options.checkpoint_every)
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
        self._model.save(self.path, self._notes)
        self._last = self._now()


def numbered(folder: Path, name: str, restarted: bool) -> Path:
    """A path for a series of files: NAME, or after a restart NAME-2, NAME-3, ..., so that earlier frames stay."""
    number = 1
    while restarted and (folder / f"{name}{'' if number == 1 else f'-{number}'}.xdmf").exists():
        number += 1
    return folder / (name if number == 1 else f"{name}-{number}")
