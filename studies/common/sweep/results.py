"""Results of the runs of a sweep: their table, statistics and probabilities."""

from __future__ import annotations

import csv
import io
import math
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tomllib
from numpy.typing import NDArray
from scipy import stats

from mpm_core import InputError

from ..files import write_text
from ..report import name_and_unit
from .plan import Row, Variable, column
from .runs import Run, log_of

TABLE = "sweep.csv"
"""Table of all runs"""
FEW_RESULTS = 4
"""Results that are drawn where none is named"""
NOT_DRAWN = ("seconds", "steps", "iterations", "cells", "particles", "nodes", "failed", "ranks", "out_of_balance")
"""Parts of names of results that say how a run was computed"""
QUANTILES = (0.05, 0.5, 0.95)


def write_table(folder: Path, runs: Sequence[Run], names: Sequence[str]) -> None:
    """Write the table of all runs that have ended; names: of the parameters."""
    results = list(dict.fromkeys(name for run in runs for name in run.numbers))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*_first_columns(names), *results])
    for run in runs:
        if run.code is not None:
            values = [run.values.get(name, "") for name in names]
            row = [run.number, *values, run.code, f"{run.seconds:.3g}", run.reason]
            writer.writerow([*row, *(run.numbers.get(name, "") for name in results)])
    write_text(folder / TABLE, text.getvalue())


def _first_columns(names: Sequence[str]) -> list[str]:
    return ["run", *names, "exit_code", "seconds", "reason"]


def ended_before(
    folder: Path, rows: Sequence[Row], names: Sequence[str], words: Sequence[str]
) -> dict[int, tuple[int, float]]:
    """Exit codes and seconds of the runs of an earlier sweep in a folder that gave results, by number.

    Args:
        folder: of the earlier sweep.
        rows: values of the parameters of this sweep's runs.
        names: of these parameters.
        words: the study of this sweep and its options.

    Raises:
        InputError: there is no table of a sweep, or its runs are of another study, or have other options, parameters or values.
    """
    _require_same_study(folder, words)
    try:
        with open(folder / TABLE, newline="", encoding="utf-8") as file:
            header, *table = csv.reader(file)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is empty"
        raise InputError(f"--resume: cannot read {folder / TABLE}: {reason}") from None
    first = _first_columns(names)  # by their places, since results may have the same names
    if header[: len(first)] != first:
        raise InputError(
            f"--resume: {folder / TABLE} is of a sweep with other parameters, expected the same --vary or another --output"
        )
    found = {}
    for row in table:
        number, code, seconds, reason = int(row[0]), *row[len(first) - 3 : len(first)]
        values = [str(rows[number - 1].get(name, "")) for name in names] if number <= len(rows) else None
        if values != row[1 : len(first) - 3]:
            raise InputError(f"--resume: run {number} in {folder / TABLE} has other values than this sweep; expected the same "
                             "--vary, --correlate and --seed, and at least as many --samples, or another --output")  # fmt: skip
        if code not in ("", "2") and any(row[len(first) :]) and not reason:
            found[number] = int(code), float(seconds)
    return found


def _require_same_study(folder: Path, words: Sequence[str]) -> None:
    """Require that the runs of an earlier sweep in a folder are of the same study with the same options."""
    try:
        with open(folder / "parameters.toml", "rb") as file:
            before = tomllib.load(file).get("run", [])
    except (OSError, ValueError):
        return  # without its parameters the values of its runs say whether it is the same
    if before != list(words):
        raise InputError(f"--resume: the runs in {folder} are of {shlex.join(before)!r}, not of {shlex.join(words)!r}; expected the same "
                         "study and options, or another --output")  # fmt: skip


def label(name: str) -> str:
    """A result with its unit, as an axis shows it."""
    text, unit = name_and_unit(name)
    return text if unit == "-" else f"{text} [{unit}]"


def drawn_results(runs: Sequence[Run], named: Sequence[str]) -> list[str]:
    """The results that are drawn: those that are named, or the first few numbers that differ between runs."""
    if named:
        return list(dict.fromkeys(named))
    found = []
    for name in dict.fromkeys(name for run in runs for name in run.results):
        values = values_of(runs, name)
        values = values[np.isfinite(values)]
        kind = name.split(".")[-1]
        if "." not in name and not any(word in kind for word in NOT_DRAWN) and len(values) and np.ptp(values) > 0:
            found.append(name)
    return found[:FEW_RESULTS]


def values_of(runs: Sequence[Run], name: str) -> NDArray[np.float64]:
    """A result of all runs; NaN where a run has none."""
    return np.array([run.result(name) for run in runs])


def statistics(values: NDArray[np.float64]) -> dict[str, float | None]:
    """Number, mean, standard deviation, extremes and quantiles of the values that are there; None where they are too few."""
    values = values[np.isfinite(values)]
    if not len(values):
        return {"runs": 0}
    low, median, high = np.quantile(values, QUANTILES)
    deviation = float(values.std(ddof=1)) if len(values) > 1 else None
    return {
        "runs": len(values), "mean": float(values.mean()), "standard_deviation": deviation, "smallest": float(values.min()),
        "quantile_5_percent": float(low), "median": float(median), "quantile_95_percent": float(high),
        "largest": float(values.max()),
    }  # fmt: skip


def probability_below(values: NDArray[np.float64], limit: float) -> dict[str, float | None]:
    """Probability that a result is below a limit: the fraction of the runs, its 95 % interval and its reliability index.

    The interval is that of Wilson (1927) for independent samples, which is wide rather than narrow for those of a sequence that fills
    the space evenly. The reliability index is -Phi^-1 of the probability, None where no run or every run is below the limit.

    Args:
        values: result of each run that has ended, NaN of those without it. These are left out, and counted, since the probability is
            larger if they are those that would be below.
        limit: of the result.
    """
    all_runs, values = len(values), values[np.isfinite(values)]
    n = len(values)
    if not n:
        return {"limit": limit, "runs": 0, "runs_without_result": all_runs}
    below = int(np.sum(values < limit))
    fraction, z = below / n, float(stats.norm.ppf(0.975))
    middle = (fraction + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * math.sqrt(fraction * (1 - fraction) / n + z**2 / (4 * n**2))
    index = -float(stats.norm.ppf(fraction)) if 0 < below < n else None
    return {
        "limit": limit, "runs": n, "runs_below": below, "probability_below": fraction, "interval_low": max(middle - half, 0.0),
        "interval_high": min(middle + half, 1.0), "reliability_index": index, "runs_without_result": all_runs - n,
        "probability_if_those_are_below": (below + all_runs - n) / all_runs,
    }  # fmt: skip


def rank_correlations(runs: Sequence[Run], names: Sequence[str], result: str) -> dict[str, float]:
    """Spearman's coefficient of rank correlation of a result with each parameter that has numbers and varies."""
    found, values = {}, values_of(runs, result)
    for name in names:
        given = column([run.values.get(name) for run in runs])
        if given.dtype.kind == "U":
            continue
        both = np.isfinite(given) & np.isfinite(values)
        if both.sum() > 2 and np.ptp(given[both]) > 0 and np.ptp(values[both]) > 0:
            found[name] = float(stats.spearmanr(given[both], values[both])[0])
    return found


def changes_alone(runs: Sequence[Run], result: str) -> list[tuple[str, Any, float]]:
    """Parameter, value and result of each run in which one parameter alone is changed; those that change it most come last."""
    alone = [(*next(iter(run.values.items())), run.result(result)) for run in runs if run.values]
    base = runs[0].result(result)
    most: Mapping[str, float] = {
        name: max((abs(value - base) for one, _, value in alone if one == name and math.isfinite(value)), default=0.0)
        for name, _, _ in alone
    }
    return sorted(alone, key=lambda row: most[row[0]])


def summarise(
    runs: list[Run], variables: Sequence[Variable], shown: Sequence[str], limits: dict[str, float], alone: bool
) -> dict[str, Any]:
    """Statistics of the results, by name."""
    random = any(one.samples for one in variables) and not alone
    results: dict[str, Any] = {"statistics": {name: statistics(values_of(runs, name)) for name in shown}}
    if limits and random:
        ended = [run for run in runs if run.code is not None]
        results["probabilities"] = {
            name: probability_below(values_of(ended, name), limit) for name, limit in limits.items()
        }
    if random:
        given = [one.name for one in variables if one.quantile is not None]
        found = {name: rank_correlations(runs, given, name) for name in shown}
        results["rank_correlations"] = {name: row for name, row in found.items() if row}
    return results


def said(runs: list[Run], results: dict[str, Any]) -> str:
    """What is printed at the end."""
    failed = [run for run in runs if run.code is not None and not run.results]
    lines = [f"{sum(bool(run.results) for run in runs)} of {len(runs)} runs have results"]
    lines += [f"run {run.number} failed: {run.reason} ({log_of(run)})" for run in failed[:3]]
    if failed:
        lines.append("runs that failed or ended early are left out of all numbers")
    for name, row in results["statistics"].items():
        if row["runs"]:
            spread = (
                f", mean {row['mean']:.4g}, standard deviation {row['standard_deviation']:.3g}"
                if "rank_correlations" in results
                else ""
            )
            lines.append(f"{label(name)}: {row['smallest']:.4g} to {row['largest']:.4g}{spread}")
    for name, row in results.get("probabilities", {}).items():
        if row["runs"]:
            interval = f"95 % interval {row['interval_low']:.2%} to {row['interval_high']:.2%}"
            below = f"in {row['runs_below']} of {row['runs']} runs, {row['probability_below']:.2%} ({interval})"
            lines.append(f"{label(name)} is below {row['limit']:g} {below}")
        if row["runs"] and row["runs_without_result"]:
            lines.append(f"{label(name)} is not known in {row['runs_without_result']} of {row['runs'] + row['runs_without_result']} runs; if "
                         f"it is below {row['limit']:g} there, the probability is {row['probability_if_those_are_below']:.2%}")  # fmt: skip
    return "\n".join(lines)
