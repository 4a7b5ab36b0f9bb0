"""The results folder and the files ``summary.json`` and ``parameters.toml`` in it."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from argparse import Namespace
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from mpi4py import MPI

from .options import Options
from .page import Page, write_page
from .parameters import write_parameters

ROOT = Path(__file__).parents[2]


class OutputError(RuntimeError):
    """The results cannot be written; the message names the path and the reason."""


def results_folder(name: str, chosen: Path | None = None, comm: MPI.Comm = MPI.COMM_WORLD) -> Path:
    """Create the folder for the results of a study, and see to it that files can be written there.

    Args:
        name: of the study; its folder is ``results/NAME`` of the repository unless ``chosen`` is given.
        chosen: another folder.

    Raises:
        OutputError: on all ranks, with path and reason.

    Note:
        Collective.
    """
    folder = Path(chosen) if chosen is not None else ROOT / "results" / name
    problem = None
    if comm.rank == 0:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            trial = folder / ".writable"
            trial.touch()
            trial.unlink()
        except OSError as error:
            problem = f"cannot write results to {folder}: {error.strerror}"
    problem = comm.bcast(problem, root=0)
    if problem is not None:
        raise OutputError(problem)
    return folder.resolve()


def versions() -> dict[str, str]:
    """Versions of the program and what it stands on, by name."""
    import mpm_core

    found = {
        "program": mpm_core.__version__,
        "git_revision": git_revision(),
        "compiler": f"GCC or compatible {mpm_core.compiler}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "mpi": MPI.Get_library_version().split(",")[0].strip(),
    }
    try:
        import dolfinx

        found["dolfinx"] = dolfinx.__version__
    except ImportError:
        found["dolfinx"] = "not found"
    try:
        from petsc4py import PETSc

        found["petsc"] = ".".join(map(str, PETSc.Sys.getVersion()))
    except ImportError:
        found["petsc"] = "not found"
    return found


def git_revision() -> str:
    """Commit of the sources, with ``-changed`` when files differ from it; ``unknown`` outside a clone."""
    command = ["git", "-C", str(ROOT), "describe", "--always", "--abbrev=12", "--exclude=*", "--dirty=-changed"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def write_summary(
    folder: Path,
    options: Namespace,
    results: Mapping[str, object],
    comm: MPI.Comm = MPI.COMM_WORLD,
    page: Page | None = None,
) -> None:
    """Write ``summary.json``: options, versions, number of ranks, date, and the results by their names.

    The options also go to ``parameters.toml``, by which the run can be repeated, and everything to the page ``report.html``.
    ``summary.json`` and the page appear as a whole or not at all. Call it on every rank, when all figures and tables are
    written; the first rank writes.

    Args:
        folder: as ``results_folder`` gave it.
        options: of the study, as parsed.
        results: numbers, texts, lists or mappings of these, NumPy's too, by name (names end in their unit: ``_m``).
        page: what the study adds to its page, such as moving particles.
    """
    if comm.rank != 0:
        return
    summary = {
        "parameters": vars(options),
        "versions": versions(),
        "ranks": comm.size,
        "machine": platform.machine(),
        "finished": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        **results,
    }
    aside = folder / "summary.json.part"
    aside.write_text(json.dumps(summary, indent=2, default=_plain) + "\n", encoding="utf-8")
    os.replace(aside, folder / "summary.json")
    if isinstance(options, Options):
        write_parameters(folder / "parameters.toml", options.parameters(), options.study)
        told = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in summary["versions"].items())
        write_page(folder, options, results, page, f"{told}; {comm.size} rank(s); {summary['finished']}")


def _plain(value: object) -> object:
    """What JSON has no form for, as something that it has."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"cannot write {value!r} to JSON")
