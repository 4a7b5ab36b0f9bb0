"""Notes of a study in its checkpoints: the options of the run, with which those of a restart are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from mpi4py import MPI

from .parameters import Parameter, ParameterError, plain_values


def checkpoint_notes(path: Path, study: str, comm: MPI.Comm = MPI.COMM_WORLD) -> dict[str, Any]:
    """The notes in a checkpoint of a study: ``options`` by name, ``restarts``, ``start``; and its ``time`` [s] and ``steps``.

    Collective.

    Raises:
        ParameterError: on all ranks: the file cannot be read, or no run of this study saved it.
    """
    import mpm_core as mpm

    try:
        description = mpm.checkpoint_description(path, comm)
    except mpm.RunError as error:
        raise ParameterError(str(error)) from None
    notes = description.get("notes")
    if not isinstance(notes, dict) or not isinstance(notes.get("options"), dict):
        raise ParameterError(f"checkpoint {path} was not saved by a study: it does not say with which options")
    if notes.get("study") != study:
        raise ParameterError(f"checkpoint {path} is of the study {notes.get('study')!r}, expected {study!r}")
    return {**notes, "time": description["time"], "steps": description["steps"]}


def changes(notes: Mapping[str, Any], parameters: Sequence[Parameter]) -> dict[str, tuple[Any, Any]]:
    """Options that differ from those in the notes: name to the value there and the value now."""
    before, now = notes["options"], plain_values(parameters)
    return {name: (before[name], now[name]) for name in before if name in now and before[name] != now[name]}


def restart_row(notes: Mapping[str, Any], changed: Mapping[str, tuple[Any, Any]], ranks: int) -> dict[str, Any]:
    """Entry of the summary about a restart."""
    text = ", ".join(f"{name} {_shown(old)} to {_shown(new)}" for name, (old, new) in changed.items())
    return {"time_s": notes["time"], "steps": notes["steps"], "ranks": ranks, "changed": text}


def _shown(value: Any) -> str:
    return "default" if value is None else f"{value:.9g}" if isinstance(value, float) else str(value)
