"""The file ``summary.json`` of a run, and its page."""

from __future__ import annotations

import json
import platform
import sys
from argparse import Namespace
from collections.abc import Mapping
from datetime import datetime, timezone
from pathlib import Path

import numpy as np
from mpi4py import MPI
from mpm_core.collective import on_first_rank

from .figures import Pictures, draw_pictures
from .files import NOT_WRITTEN, OutputError, expendable, write_text
from .options import Options
from .page import Page, seconds_since_start, write_page
from .results import note_what_was_written, release_reserved_space
from .versions import versions


def write_summary(
    folder: Path,
    options: Namespace,
    results: Mapping[str, object],
    comm: MPI.Comm = MPI.COMM_WORLD,
    page: Page | None = None,
    pictures: Pictures | None = None,
    said: str | None = None,
) -> int:
    """Write ``summary.json``: options that the run uses, versions, number of ranks, date, and the results by their names; then pictures and page.

    The pictures come second, so that a full disk costs them and not the results. Everything goes to the page ``report.html``
    as well. Each file appears as a whole or not at all. Call it on every rank, when all tables are written; the first rank
    writes.

    Args:
        folder: as ``open_results`` gave it.
        options: of the study, as parsed.
        results: numbers, texts, lists or mappings of these, NumPy's too, by name (names end in their unit: ``_m``).
        page: what the study adds to its page, such as moving particles.
        pictures: figures and films, drawn on the first rank when the summary is on the disk.
        said: what the study prints at its end; where the results are follows, and why the run ended early. None prints nothing.

    Returns:
        The study's exit code: 1 where the results have a reason as ``stopped_because``, else 0.

    Raises:
        OutputError: on all ranks, with path and reason, when ``summary.json`` cannot be written. A picture, a film or the page
            that cannot be written costs only itself.
    """
    on_first_rank(comm, lambda: _write(folder, options, results, comm, page, pictures or {}), OutputError)
    stopped = results.get("stopped_because")
    if said is not None and comm.rank == 0:
        print("\n".join([*filter(None, [said]), f"results in {folder}"]), flush=True)
        if stopped:
            print(f"the run ended early: {stopped}; the results so far have been written", file=sys.stderr)
    return 1 if stopped else 0


def _write(
    folder: Path, options: Namespace, results: Mapping[str, object], comm: MPI.Comm, page: Page | None,
    pictures: Pictures,
) -> None:  # fmt: skip
    unused = options.unused if isinstance(options, Options) else set()
    summary = {
        "parameters": {name: value for name, value in vars(options).items() if name not in unused},
        "versions": versions(),
        "ranks": comm.size,
        "machine": platform.machine(),
        "finished": datetime.now(timezone.utc).isoformat(timespec="seconds"),
        **results,
    }
    if isinstance(options, Options) and options.restarts:
        summary["restarts"] = options.restarts
    release_reserved_space(folder)
    write_text(folder / "summary.json", json.dumps(summary, indent=2, default=_plain) + "\n")
    draw_pictures(pictures)
    if isinstance(options, Options):
        used = ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in summary["versions"].items())
        more = {"restarts": options.restarts} if options.restarts else {}
        write_page(folder, options, {**results, **more}, page, f"{used}; {comm.size} rank(s); {summary['finished']}")
    summary["run_seconds"], summary["not_written"] = seconds_since_start(), list(NOT_WRITTEN)
    with expendable(folder / "summary.json") as aside:
        aside.write_text(json.dumps(summary, indent=2, default=_plain) + "\n", encoding="utf-8")
    note_what_was_written(folder)


def _plain(value: object) -> object:
    """Convert a value that JSON cannot represent."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Path):
        return str(value)
    raise TypeError(f"cannot write {value!r} to JSON")
