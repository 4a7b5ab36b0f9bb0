"""The runs of a sweep: a study with its options and site changed, each in a process of its own."""

from __future__ import annotations

import copy
import json
import math
import os
import re
import shutil
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from mpm_core import InputError
from talus.launch import ALONE, environment

from ..files import PROGRAM, write_text
from ..parameters import did_you_mean, to_toml
from ..site.keys import read_site_table
from ..site.tables import merged
from .plan import Row, Value

LOOK = 0.05
"""Pause between two looks at the runs [s]"""
NOT_RESULTS = ("parameters", "versions", "ranks", "machine", "finished", "run_seconds", "not_written", "restarts",
               "stopped_because")  # fmt: skip
"""What stands in a summary beside its results"""


@dataclass
class Run:
    """A run of the study."""

    number: int
    values: Row
    folder: Path
    command: list[str]
    code: int | None = None
    """Exit code; None before its end"""
    seconds: float = 0.0
    numbers: dict[str, float | None] = field(default_factory=dict)
    """Numbers of its summary by name, of tables with dots; None of a result that is not known"""
    reason: str = ""
    """Why it has no summary, or ended early"""

    @property
    def results(self) -> dict[str, float | None]:
        """Numbers of a run that came to its end; what one that ended early has found so far would distort statistics."""
        return {} if self.reason else self.numbers

    def result(self, name: str) -> float:
        """A result by name; NaN where there is none."""
        value = self.results.get(name)
        return math.nan if value is None else float(value)


@dataclass(frozen=True)
class Study:
    """The study that runs, as the command line gives it."""

    script: Path
    words: list[str]
    ranks: int
    units: Mapping[str, str]
    """Units of its options by name, "-" without one"""

    def variables(self) -> dict[str, str]:
        """Environment variables of the runs."""
        return {**(ALONE if self.ranks == 1 else {}), **environment(), "TALUS_PROGRAM": PROGRAM}

    def site(self) -> Path | None:
        """The file of `--site`; None where the words name none."""
        found = None  # of several the last one counts, as for the study
        for k, word in enumerate(self.words):
            if word.startswith("--site="):
                found = Path(word.removeprefix("--site="))
            elif word == "--site" and k + 1 < len(self.words):
                found = Path(self.words[k + 1])
        return found


def study_of(script: Path, words: Sequence[str], ranks: int) -> Study:
    """A study, whose options its help shows.

    Args:
        script: of the study.
        words: its options; names of files become absolute, so that the sweep can be repeated from elsewhere.
        ranks: of each run.

    Raises:
        InputError: the study does not show its help.
    """
    study = Study(script, [str(Path(word).resolve()) if Path(word).is_file() else word for word in words], ranks, {})
    shown = subprocess.run(
        [sys.executable, str(script), "--help"], capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL,
        env={**study.variables(), **ALONE, "COLUMNS": "1000"},
    )  # fmt: skip
    if shown.returncode:
        raise InputError(f"{script.name} --help failed: {last_line(shown.stderr)}")
    units = {}
    for line in shown.stdout.splitlines():
        option = re.match(r"  --([\w-]+)", line)
        if option:
            unit = re.search(r"\[([^][]+)\](?: \([^()]*\))?$", line)
            units[option[1]] = unit[1] if unit and "..." not in unit[1] else "-"
    return Study(study.script, study.words, ranks, units)


def require_names(study: Study, names: Sequence[str]) -> None:
    """Require that a study has the options and its site the keys that are to be changed.

    Raises:
        InputError: it has not; says which there are.
    """
    for name in names:
        if "." not in name and name.replace("_", "-") not in study.units:
            raise InputError(f"--vary names {name}, which is no option of {study.script.stem}{did_you_mean(name, study.units)}"
                             f" (its --help lists them; keys of a site have dots, such as soils.NAME.cohesion)")  # fmt: skip
    keys = [name for name in names if "." in name]
    if keys:
        site = study.site()
        if site is None:
            raise InputError(
                f"--vary names {keys[0]}, a key of a site, expected --site FILE among the options of the study"
            )
        table = read_site_table(site)
        for key in keys:
            site_with(table, {key: 0.0}, site)


def runs_of(study: Study, rows: Sequence[Row], folder: Path, first: int = 1) -> list[Run]:
    """The runs of all rows, numbered from `first` on; those that change a site have a file of it in the folder.

    Raises:
        InputError: a key that the site cannot have.
    """
    site = study.site()
    table = read_site_table(site) if site is not None and any("." in name for row in rows for name in row) else {}
    runs = []
    (folder / "runs").mkdir(exist_ok=True)
    for number, row in enumerate(rows, first):
        place = folder / "runs" / f"{number:03d}"  # the same name where more samples follow
        words = [sys.executable, str(study.script), *study.words]
        if study.ranks > 1:
            words = [sys.executable, "-m", "talus.launch", str(study.ranks), *words]
        for name, value in row.items():
            if "." not in name:
                words += _option(name.replace("_", "-"), value)
        changes = {name: value for name, value in row.items() if "." in name}
        if changes and site is not None:
            given = place.with_suffix(".toml")
            above = {"extends": str(site.resolve()), **site_with(table, changes, site)}
            lines = [f"{json.dumps(key)} = {to_toml(value)}" for key, value in above.items()]
            write_text(given, "\n".join(lines) + "\n")
            read_site_table(given)  # so that a wrong key is named before anything runs
            words += ["--site", str(given)]
        runs.append(Run(number, row, place, [*words, "--output", str(place)]))
    return runs


def site_with(table: Mapping[str, Any], changes: Mapping[str, Value], site: Path) -> dict[str, Any]:
    """What a site has to add to a table so that keys with dots have new values.

    Raises:
        InputError: a key in a table that is not there.
    """
    above: dict[str, Any] = {}
    for name, value in changes.items():
        above = merged(above, _changed(merged(table, above), name.split("."), value, name, site))
    return above


def _changed(below: Any, keys: Sequence[str], value: Value, name: str, site: Path) -> Any:
    """A table, a list or a value with one of its values changed; of a table only what changes."""
    if not keys:
        return value
    key = keys[0]
    if isinstance(below, list) and key.isdecimal() and int(key) < len(below):
        result, old = copy.deepcopy(below), below[int(key)]
        new = _changed(old, keys[1:], value, name, site)
        result[int(key)] = merged(old, new) if isinstance(old, dict) else new
        return result
    if not isinstance(below, dict) or (len(keys) > 1 and not _matching(key, below)):
        there = ", ".join(below) if isinstance(below, dict) else f"the numbers 0 to {len(below) - 1}" if isinstance(
            below, list) else f"no table but {below!r}"  # fmt: skip
        raise InputError(f"--vary names {name}, but {site} has no {key!r} there; it has {there}")
    there = _matching(key, below) or [key.replace("-", "_")]
    return {one: _changed(below.get(one), keys[1:], value, name, site) for one in there}


def _matching(key: str, table: Mapping[str, Any]) -> list[str]:
    """The keys of a table that are a key, with dashes or underscores, or match it where it has a *."""
    return [one for one in table if one in (key, key.replace("-", "_")) or ("*" in key and fnmatchcase(one, key))]


def _option(name: str, value: Value) -> list[str]:
    if isinstance(value, bool):
        return [f"--{name}" if value else f"--no-{name}"]
    return [f"--{name}={value}"]


# --- carrying them out -----------------------------------------------------------------------------------------------


def carry_out(runs: Sequence[Run], study: Study, jobs: int, stop: Callable[[], bool]) -> Iterator[Run]:
    """Make runs, some at once, and pass on each that has ended.

    Args:
        runs: those to be made.
        study: of which they are.
        jobs: most runs at once.
        stop: whether no further run is to begin; those that are under way are asked to end.
    """
    waiting, going, asked = deque(runs), {}, False
    while going or (waiting and not stop()):
        while waiting and len(going) < jobs and not stop():
            run = waiting.popleft()
            going[_started(run, study)] = run, time.monotonic()
        if stop() and not asked:
            asked = True
            for process in going:
                process.terminate()
        for process in [one for one in going if one.poll() is not None]:
            run, start = going.pop(process)
            run.code, run.seconds = process.returncode, time.monotonic() - start
            take_results(run)
            yield run
        time.sleep(LOOK)


def _started(run: Run, study: Study) -> subprocess.Popen:
    # In a session of its own, so that Ctrl-C comes once only, by the sweep: the second signal would end mpirun at once. A run whose sweep
    # is killed must not go on, since it would keep its folder from the sweep that resumes.
    killed = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
    with open(log_of(run), "w", encoding="utf-8") as log:
        return subprocess.Popen(
            [*killed, *run.command, "--overwrite"], stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
            env=study.variables(), start_new_session=True,
        )  # fmt: skip


def log_of(run: Run) -> Path:
    """The file of what a run prints."""
    return run.folder.with_suffix(".log")


def take_results(run: Run) -> None:
    """Read what a run that has ended has written."""
    try:
        summary = json.loads((run.folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        text = log_of(run).read_text(encoding="utf-8", errors="replace") if log_of(run).is_file() else ""
        signalled = f"signal {-(run.code or 0)} ended it" if (run.code or 0) < 0 else ""
        run.numbers, run.reason = {}, signalled or last_line(text) or f"its exit code is {run.code}"
        return
    run.numbers = {
        name: value
        for key, part in summary.items()
        if key not in NOT_RESULTS
        for name, value in numbers_of(part, key).items()
    }
    run.reason = str(summary.get("stopped_because") or "")


def numbers_of(value: Any, name: str) -> dict[str, float | None]:
    """The numbers in a value of a summary, None among them, by name and, within tables, by names with dots; lists of numbers are left out."""
    if value is None or isinstance(value, (bool, int, float)):
        return {name: value}
    inner = value.items() if isinstance(value, dict) else enumerate(value) if _is_table(value) else ()
    return {key: one for part, given in inner for key, one in numbers_of(given, f"{name}.{part}").items()}


def _is_table(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, dict) for row in value)


def last_line(text: str) -> str:
    """The last line of a text that says something, without the hint of a parser."""
    lines = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("(--help")]
    return lines[-1] if lines else ""


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))
