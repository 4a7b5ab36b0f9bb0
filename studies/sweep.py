"""A study many times with other parameters: sensitivity, all combinations, samples of distributions, back-analysis.

Each parameter of --vary is an option of the study or a key of its site file, such as soils.clay.cohesion. It has a list of values
(20,25,30), equal steps (20:30:5, five values from 20 to 30) or a distribution (normal:MEAN:SD, lognormal:MEAN:SD, both also with
:LOW:HIGH for limits, uniform:LOW:HIGH, triangular:LOW:MODE:HIGH). Lists give all combinations; distributions need --samples. With
--find in place of --vary, the value of a parameter is found for which a result is that of --target. The study and its options come last:

    sweep --vary cohesion=2e3:6e3:5 --vary friction-angle=20,25,30 safety --meshes 1
    sweep --find friction-angle=15:35 --target factor_of_safety=1 safety --meshes 1
    sweep --vary soils.core.cohesion=lognormal:10e3:3e3 --samples 200 --limit factor_of_safety=1 safety --site dam.toml
"""

from __future__ import annotations

import math
import sys
from argparse import REMAINDER, ArgumentParser, Namespace
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from common.checks import check_effect
from common.figures import Pictures
from common.files import PROGRAM
from common.interrupt import Interrupt
from common.options import add_count, add_flag, check, study_parser
from common.page import Page
from common.parameters import did_you_mean
from common.progress import Progress
from common.ranks import run_study
from common.results import open_results
from common.site.laws import law_units
from common.summary import write_summary
from common.sweep.find import find as find_value
from common.sweep.find import wanted_of
from common.sweep.maps import hazard_maps
from common.sweep.plan import Variable, correlation_of, number_of, plan, variable_of
from common.sweep.plots import picture_of
from common.sweep.results import drawn_results, ended_before, label, said, summarise, write_table
from common.sweep.runs import Run, Study, carry_out, processors, require_names, runs_of, study_of, take_results
from mpi4py import MPI

from mpm_core import InputError
from talus import find

BAD_INPUT = 2
"""Exit code of a run whose options or site are not possible"""


# --- 1. Options ------------------------------------------------------------------------------------------------------


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    p.add_argument("--vary", action="append", default=[], metavar="NAME=VALUES", help="a parameter and its values, see above; may be "
                   "repeated")  # fmt: skip
    add_count(p, "--samples", None, "samples of the parameters that have distributions")
    p.add_argument("--correlate", action="append", default=[], metavar="NAME,NAME=R", help="correlation of two parameters that have "
                   "distributions, between -1 and 1; may be repeated")  # fmt: skip
    add_count(p, "--seed", 1, "number from which the samples follow")
    add_flag(
        p,
        "--one-at-a-time",
        "change one parameter in each run; one with a distribution to the values that are exceeded in 95 and in 5 of 100 "
        "cases",
    )
    p.add_argument("--result", action="append", default=[], metavar="NAME", help="a result that is drawn, by its name in summary.json; "
                   "may be repeated (default: the first ones that differ between runs)")  # fmt: skip
    p.add_argument("--limit", action="append", default=[], metavar="NAME=X", help="a limit of a result, of which the probability of being "
                   "below it is found; may be repeated")  # fmt: skip
    p.add_argument("--find", default=None, metavar="NAME=LOW:HIGH", help="instead of --vary: find the value of a parameter between two "
                   "others for which --target holds")  # fmt: skip
    p.add_argument("--target", default=None, metavar="NAME=X", help="the value of a result that --find looks for, such as "
                   "factor_of_safety=1")  # fmt: skip
    add_count(p, "--jobs", None, "runs at once (default: processors over --run-ranks)")
    add_count(p, "--run-ranks", 1, "MPI ranks of each run")
    add_flag(p, "--resume", "go on with the sweep in the folder of --output: runs that gave results are kept; with more --samples, "
             "others follow")  # fmt: skip
    p.add_argument("--run", nargs=REMAINDER, default=[], metavar="STUDY ...", help="the study and its options, which may also stand at "
                   "the end without --run")  # fmt: skip
    return p


def parse(arguments: Sequence[str] | None = None) -> Namespace:
    """The options of the sweep; the words from the study's name on are not looked at."""
    p, words = parser(), list(sys.argv[1:] if arguments is None else arguments)
    own, run = split(p, words)
    a = p.parse_args(own)
    a.run = run or a.run
    check(
        p,
        MPI.COMM_WORLD.size == 1,
        "the sweep starts its runs itself; expected one rank, and --run-ranks N for N ranks of each run",
    )
    check(p, bool(a.run), "no study is named, expected its name and options at the end")
    check(
        p, bool(a.vary or a.find), "--vary is not given, expected a parameter and its values, such as cohesion=1e3,2e3"
    )
    check(p, not (a.vary and a.find), "--find is given, expected no --vary with it")
    check(p, bool(a.find) == bool(a.target), "--find and --target are expected together")
    check_effect(
        p,
        a,
        not a.find,
        ["--samples", "--correlate", "--one-at-a-time", "--result", "--limit", "--resume"],
        "no --find",
    )
    for name in ("--output", "--overwrite"):
        after = any(word.split("=")[0] == name for word in a.run[1:])
        check(
            p,
            not after,
            f"{name} is given after the study, expected it before: each run has a folder of its own in that of the sweep",
        )
    asked = next((word for word in a.run[1:] if word in ("-h", "--help")), None)
    check(
        p,
        asked is None,
        f"{asked} is given after the study, expected it without the sweep: {PROGRAM} {a.run[0]} --help",
    )
    check(p, not a.resume or a.output is not None, "--resume is given, expected --output DIR with it")
    check(
        p, not (a.resume and a.overwrite), "--overwrite is given, expected it without --resume, which keeps the results"
    )
    check(
        p,
        not (a.one_at_a_time and (a.samples or a.correlate)),
        "--one-at-a-time is given, expected no --samples or --correlate with it",
    )
    return a


def split(p: ArgumentParser, words: Sequence[str]) -> tuple[list[str], list[str]]:
    """The words of the sweep, and those from the study's name on."""
    with_value = {name for action in p._actions if action.nargs != 0 for name in action.option_strings}
    k = 0
    while k < len(words) and words[k].startswith("-"):
        if words[k] == "--run":
            return list(words[:k]), list(words[k + 1 :])
        k += 2 if words[k] in with_value else 1
    return list(words[:k]), list(words[k:])


def limits_of(words: Sequence[str]) -> dict[str, float]:
    """Limits of results by name."""
    limits = {}
    for word in words:
        name, _, text = word.partition("=")
        limit = number_of(text)
        if not name or limit is None:
            raise InputError(f"--limit is {word!r}, expected NAME=X, such as factor_of_safety=1")
        limits[name] = limit
    return limits


# --- 2. All runs -----------------------------------------------------------------------------------------------------


def make_all(runs: list[Run], study: Study, folder: Path, names: Sequence[str], named: Sequence[str], jobs: int) -> int:
    """Make the runs that have not ended yet, with the table of those that have; returns the exit code of an interruption, or 0.

    Args:
        names: of the parameters.
        named: results that runs are expected to have.
        jobs: most runs at once.

    Raises:
        InputError: the first run to end has refused its options, or has not the results that were named.
    """
    waiting, refusals = [run for run in runs if run.code is None], []
    write_table(folder, runs, names)  # so that a sweep that is killed during its first runs can be resumed
    with Interrupt() as interrupt, Progress("runs", len(runs), unit="runs", counted="runs") as progress:
        for done, run in enumerate(carry_out(waiting, study, jobs, lambda: bool(refusals) or interrupt.requested()), 1):
            if done == 1:
                refusals = refusal(run, named)
            write_table(folder, runs, names)
            failed = sum(one.code is not None and not one.results for one in runs)
            progress.show(len(runs) - len(waiting) + done, done, **({"failed": str(failed)} if failed else {}))
        if refusals:
            raise InputError(refusals[0])
        return interrupt.exit_code


def refusal(run: Run, named: Sequence[str]) -> list[str]:
    """Why the runs of a sweep make no sense, by the first that has ended; empty where they do.

    A run that has opened its folder understands its options; it may have ended since soil of its strength does not carry its weight, as
    others may.
    """
    opened = (run.folder / "parameters.toml").is_file()
    if run.code == BAD_INPUT and not run.numbers and not opened:
        return [f"run {run.number} was refused: {run.reason}"]
    missing = [name for name in named if run.results and name not in run.results]
    there = ", ".join(name for name in run.results if "." not in name)
    return [
        f"{name} is no result of the study, expected one of {there}{did_you_mean(name, run.results)}"
        for name in missing
    ]


# --- 3. Sweep and back-analysis ------------------------------------------------------------------------------------------------------


def study_named(a: Namespace) -> Study:
    """The study that the words at the end name, with its options.

    Raises:
        InputError: there is none of that name, or it does not show its help.
    """
    script = find.study_path(a.run[0])
    if script is None:
        raise InputError(f"there is no study {a.run[0]!r}, expected one of {', '.join(find.studies())}")
    study = study_of(script, a.run[1:], a.run_ranks)
    a.run = [a.run[0], *study.words]
    return study


def jobs(a: Namespace) -> int:
    """Runs at once."""
    return a.jobs or max(1, processors() // a.run_ranks)


def swept(a: Namespace, study: Study) -> int:
    """A sweep of parameters; returns its exit code."""
    variables, limits = [variable_of(word) for word in a.vary], limits_of(a.limit)
    rows = plan(variables, a.samples, dict(map(correlation_of, a.correlate)), a.seed, a.one_at_a_time)
    names, named = [one.name for one in variables], [*a.result, *limits]
    require_names(study, names)
    resumed, a.resume = a.resume, False  # parameters.toml repeats the sweep from its beginning
    kept = ended_before(a.output, rows, names, a.run) if resumed else {}
    folder = open_results(a, MPI.COMM_SELF, adds=resumed)
    runs = runs_of(study, rows, folder)
    for run in runs:
        if run.number in kept:
            run.code, run.seconds = kept[run.number]
            take_results(run)
    there = f", of which {len(kept)} are there" if kept else ""
    print(f"{len(runs)} run{'s' * (len(runs) > 1)} of {study.script.stem}{there}", flush=True)
    interrupted = make_all(runs, study, folder, names, named, jobs(a))
    shown = drawn_results(runs, named) if any(run.results for run in runs) else []
    results = summarise(runs, variables, shown, limits, a.one_at_a_time)
    if interrupted:
        results["stopped_because"] = f"it was interrupted; --resume --output {folder} goes on with it"
    labels = {name: _with_unit(name, {**law_units(), **study.units}) for name in names}
    marks = {name: ("limit", limit) for name, limit in limits.items()}
    draw = {name: picture_of(runs, variables, name, labels, a.one_at_a_time, marks.get(name)) for name in shown}
    code = finish(a, folder, study, runs, results, draw, said(runs, results), hazard_maps(runs, folder))
    return interrupted or code


def back_analysis(a: Namespace, study: Study) -> int:
    """The value of a parameter for which a result has a given value; returns the exit code."""
    wanted = wanted_of(a.find, a.target)
    require_names(study, [wanted.name])
    folder, runs, interrupted = open_results(a, MPI.COMM_SELF), [], []

    def results_at(values: list[float]) -> list[float]:
        if interrupted:
            return [math.nan] * len(values)  # which ends the search
        new = runs_of(study, [{wanted.name: value} for value in values], folder, len(runs) + 1)
        runs.extend(new)
        if code := make_all(runs, study, folder, [wanted.name], [wanted.result], jobs(a)):
            interrupted.append(code)
        return [run.result(wanted.result) for run in new]

    found = find_value(wanted, results_at)
    label_of = _with_unit(wanted.name, {**law_units(), **study.units})
    reason = "it was interrupted" if interrupted else found.reason
    results: dict[str, Any] = {
        "parameter": wanted.name,
        "value": found.value if math.isfinite(found.value) else None,
        wanted.result: found.result if math.isfinite(found.result) else None,
        "target": wanted.target,
    }
    if reason:
        results["stopped_because"] = reason
    runs.sort(key=lambda run: run.values[wanted.name])
    draw = picture_of(
        runs, [Variable(wanted.name)], wanted.result, {wanted.name: label_of}, False, ("target", wanted.target)
    )
    text = f"{label_of} of {found.value:.4g}: {label(wanted.result)} {found.result:.4g}, after {len(runs)} runs"
    code = finish(a, folder, study, runs, results, {wanted.result: draw}, text, {})
    return interrupted[0] if interrupted else code


def finish(
    a: Namespace,
    folder: Path,
    study: Study,
    runs: list[Run],
    results: dict[str, Any],
    draw: dict[str, Any],
    text: str,
    more: Pictures,
) -> int:
    """Write summary and pictures; returns the exit code.

    Args:
        a: options.
        folder: of the results.
        study: that ran.
        runs: all of them.
        results: of the sweep.
        draw: functions of a path that draw a result, by its name.
        text: what is printed.
        more: further pictures.
    """
    paths = {name: folder / f"sweep_{name.replace('.', '_')}.png" for name in draw}
    pictures = {path.stem: partial(draw[name], path) for name, path in paths.items()} | dict(more)
    there = sum(bool(run.results) for run in runs)
    table = [{"run": run.number, **run.values, **{name: run.results.get(name) for name in draw}} for run in runs]
    summary = {"study": study.script.stem, "runs": len(runs), "runs_with_results": there, **results, "table": table}
    return write_summary(folder, a, summary, MPI.COMM_SELF, Page(), pictures, text) or int(there < len(runs))


def main(arguments: Sequence[str] | None = None) -> int:
    a = parse(arguments)
    study = study_named(a)
    return back_analysis(a, study) if a.find else swept(a, study)


def _with_unit(name: str, units: dict[str, str]) -> str:
    """A parameter with its unit, as an axis shows it."""
    unit = units.get(name.replace("_", "-") if "." not in name else name.removesuffix(".value").split(".")[-1], "-")
    return name if unit == "-" else f"{name} [{unit}]"


if __name__ == "__main__":
    run_study(main)
