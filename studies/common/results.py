"""The results folder of a run: no two runs write to one, and none writes over another's results unless asked to."""

from __future__ import annotations

import errno
import fcntl
import itertools
import json
import logging
import os
import shutil
import socket
import sys
from collections.abc import Iterator
from datetime import datetime, timezone
from pathlib import Path
from typing import Any, TextIO

from mpi4py import MPI
from mpm_core.collective import on_first_rank

from .files import IN_SOURCES, NOT_WRITTEN, ROOT, OutputError, written_whole
from .options import Options
from .parameters import write_parameters
from .site.tables import site_files

MARK = ".talus-run"
"""The file that says which run writes, or wrote, to a folder. The run holds a lock on it, which ends with the process."""
RESERVED = 1 << 16
"""Bytes reserved on the disk, so that there is a summary however full it becomes."""
NAMES = ("summary.json", "verification.json", "history.csv", "checkpoint.h5", "report.html")
"""Names by which results are recognised in a folder without that file."""
BY_HAND = "empty it, or choose another folder by --output"
_locks: dict[Path, TextIO] = {}


def open_results(options: Options, comm: MPI.Comm = MPI.COMM_WORLD, *, adds: bool = False) -> Path:
    """The folder for the results of a run, locked until the process ends, with ``parameters.toml`` in it. Collective.

    Of a run with ``--site`` it also has ``site.toml``, a copy of that file as it is now, since sites are changed from run to run, and
    ``site-2.toml`` and so on of the files that it extends.

    Without ``--output`` it is ``results/NAME`` of the repository (of the present folder for an installed package), or where that
    holds a run, ``results/NAME-2`` and so on. A folder named by ``--output`` that holds results is refused, unless
    ``--overwrite`` says that they may be deleted. A run that goes on from a checkpoint writes to the run's folder, where the
    checkpoint lies, unless ``--output`` names another, to which its tables over time are copied.

    Args:
        options: of the study, as parsed and checked.
        adds: the study adds to the results of earlier runs.

    Raises:
        OutputError: on all ranks: the folder cannot be written to, holds results, or another run writes to it.
    """
    NOT_WRITTEN.clear()

    def opened() -> Path:
        folder = _opened(options, adds)
        write_parameters(folder / "parameters.toml", options.parameters(), options.study, options.restarts)
        site = getattr(options, "site", None)
        files = [] if site is None or not site.is_file() else site_files(site)  # if there is none, the study says so
        for number, file in enumerate(files, 1):
            with written_whole(folder / ("site.toml" if number == 1 else f"site-{number}.toml")) as aside:
                shutil.copyfile(file, aside)
        return folder

    folder = comm.bcast(on_first_rank(comm, opened, OutputError))
    _keep_compiler_lines(folder)
    return folder


def _keep_compiler_lines(folder: Path) -> None:
    """Write the output of the C compiler, while it compiles forms, to ``forms.log``; without output there is no such file."""
    logger = logging.getLogger("fenics_bridge.forms")
    for handler in [handler for handler in logger.handlers if isinstance(handler, logging.FileHandler)]:
        logger.removeHandler(handler)
        handler.close()
    logger.addHandler(logging.FileHandler(folder / "forms.log", delay=True, encoding="utf-8"))


def subfolder(folder: Path, name: str, comm: MPI.Comm = MPI.COMM_WORLD) -> Path:
    """A folder in a results folder, made if it is not there. Collective.

    Raises:
        OutputError: on all ranks, with path and reason.
    """

    def made() -> Path:
        path = folder / name
        try:
            path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(f"cannot write results to {path}: {error.strerror}") from None
        return path

    return comm.bcast(on_first_rank(comm, made, OutputError))


def release_reserved_space(folder: Path) -> None:
    """Release the space reserved for the summary, just before it is written. Call it on the first rank."""
    lock = _locks.get(folder)
    if lock is not None:
        _store(lock, _known(lock))


def note_what_was_written(folder: Path) -> None:
    """Store which files the run has written, so that ``--overwrite`` removes no others. Call it on the first rank, at the end."""
    lock = _locks.get(folder)
    known = _known(lock) if lock is not None else {}
    if known:
        _store(lock, {**known, "written": sorted(_names(folder) - set(known["there_before"]))})


# --- which folder ----------------------------------------------------------------------------------------------------


def _opened(options: Options, adds: bool) -> Path:
    restart = getattr(options, "restart", None)
    home = restart.absolute().parent if restart is not None else None
    if home is not None and not (home / MARK).exists():
        home = None  # a checkpoint that was copied elsewhere
    if options.output is not None or home is not None:
        folder = Path(options.output) if options.output is not None else home
        goes_on = home is not None and folder.exists() and folder.samefile(home)
        if goes_on and options.overwrite:
            raise OutputError("--overwrite would remove the checkpoint that --restart continues from; leave it out")
        obstacle = _taken(folder, adds or goes_on, options.overwrite)
        if obstacle is not None:
            raise OutputError(obstacle)
        if goes_on:
            _set_aside(folder)
        elif home is not None:
            _bring_histories(home, folder)
        return folder.resolve()
    first = _home() / options.study
    for folder in _numbered(first):
        obstacle = _taken(folder, adds, options.overwrite)
        if obstacle is None:
            if folder != first:
                print(f"{first} holds a run; this one writes to {folder} (with --overwrite it would replace that one)")
            return folder.resolve()
        if options.overwrite or adds:
            raise OutputError(obstacle)
    raise AssertionError("there is always another number")


def _home() -> Path:
    """Folder of the results of all studies: ``TALUS_RESULTS``, otherwise in the source tree, or else the current folder."""
    if "TALUS_RESULTS" in os.environ:
        return Path(os.environ["TALUS_RESULTS"])
    return (ROOT if IN_SOURCES else Path.cwd()) / "results"


def _numbered(first: Path) -> Iterator[Path]:
    yield first
    for number in itertools.count(2):
        yield first.with_name(f"{first.name}-{number}")


def _taken(folder: Path, keeps: bool, overwrite: bool) -> str | None:
    """Take a folder for this run, or say why it cannot be had.

    Args:
        keeps: what is there stays, and the run adds to it.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return _locked(folder.resolve(), keeps, overwrite)
    except FileExistsError:
        raise OutputError(f"cannot write results to {folder}: it is a file, not a folder") from None
    except OSError as error:
        raise OutputError(f"cannot write results to {folder}: {error.strerror}") from None


def _locked(folder: Path, keeps: bool, overwrite: bool) -> str | None:
    if folder in _locks:
        _locks.pop(folder).close()
    lock = open(folder / MARK, "a+", encoding="utf-8")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        with lock:
            known = _known(lock)
        return (f"another run writes to {folder}: process {known.get('process')} on {known.get('host')} since "
                f"{known.get('started')}; wait for it, or choose another folder by --output")  # fmt: skip
    except OSError as error:
        if error.errno not in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
            raise
        print(f"note: the file system of {folder} has no locks; nothing keeps another run from writing there",
              file=sys.stderr)  # fmt: skip
    known = _known(lock)
    earlier, names = _earlier(folder, known), _names(folder)
    if earlier and not keeps:
        if not overwrite:
            lock.close()
            return (
                f"{folder} holds the results of an earlier run; replace them by --overwrite, or choose another folder by "
                "--output"
            )
        if not known:
            lock.close()
            return f"{folder} holds results of a version that did not note which files are its own; {BY_HAND}"
        for name in earlier | {"parameters.toml"}:
            _remove(folder / name)
    others = sorted((names if known else names - set(NAMES)) - earlier - {"parameters.toml"})
    now = datetime.now(timezone.utc).isoformat(timespec="seconds")
    _store(
        lock, {"host": socket.gethostname(), "process": os.getpid(), "started": now, "there_before": others}, RESERVED
    )
    _locks[folder] = lock
    return None


def _earlier(folder: Path, known: dict[str, Any]) -> set[str]:
    """Files of an earlier run, without its parameters: a run that ended before it computed anything does not count."""
    names = _names(folder)
    if not known:
        return names & set(NAMES)
    mine = set(known["written"]) & names if "written" in known else names - set(known["there_before"])
    return mine - {"parameters.toml"}


def _names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()} - {MARK}


def _remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _set_aside(folder: Path) -> None:
    """Give summary and page of the earlier part of a continued run a number, since they do not describe the new part."""
    number = next(n for n in itertools.count(1) if not (folder / f"summary-{n}.json").exists())
    for path in (folder / "summary.json", folder / "report.html"):
        if path.exists():
            path.rename(path.with_name(f"{path.stem}-{number}{path.suffix}"))
    for path in folder.glob("*.part"):
        path.unlink()


def _bring_histories(home: Path, folder: Path) -> None:
    """Copy the tables over time of a run that goes on in another folder: its results are those of the whole run."""
    for path in home.glob("*.csv"):
        shutil.copyfile(path, folder / path.name)


# --- the mark --------------------------------------------------------------------------------------------------------


def _known(lock: TextIO) -> dict[str, Any]:
    """Content of a mark; empty if it is new or damaged."""
    lock.seek(0)
    try:
        known = json.loads(lock.read().rstrip("\0"))
    except ValueError:
        return {}
    return known if isinstance(known, dict) and "there_before" in known else {}


def _store(lock: TextIO, known: dict[str, Any], reserve: int = 0) -> None:
    """Write a mark, with so many bytes reserved behind it."""
    # In place: the lock is on the file, not on its name.
    lock.seek(0)
    lock.truncate()
    json.dump(known, lock, indent=1)
    lock.flush()
    if reserve:
        os.posix_fallocate(lock.fileno(), 0, reserve)
