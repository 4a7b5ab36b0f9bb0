"""Results of the runs of a sweep: their table, statistics and probabilities."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from mpm_core import InputError

from .files import write_text
from .report import name_and_unit
from .sweep_plan import Row, Variable, column
from .sweep_runs import Run, log_of

TABLE = "sweep.csv"
"""Table of all runs"""
FEW_RESULTS = 4
"""Results that are drawn where none is named"""
NOT_DRAWN = ("seconds", "steps", "iterations", "cells", "particles", "nodes", "failed", "ranks")
"""Parts of names of results that say how a run was computed"""
QUANTILES = (0.05, 0.5, 0.95)


def write_table(folder: Path, runs: Sequence[Run], names: Sequence[str]) -> None:
    """Write the table of all runs that have ended; names: of the parameters."""
    results = list(dict.fromkeys(name for run in runs for name in run.results))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["run", *names, "exit_code", "seconds", "reason", *results])
    for run in runs:
        if run.code is not None:
            values = [run.values.get(name, "") for name in names]
            row = [run.number, *values, run.code, f"{run.seconds:.3g}", run.reason]
            writer.writerow([*row, *(run.results.get(name, "") for name in results)])
    write_text(folder / TABLE, text.getvalue())


def ended_before(folder: Path, rows: Sequence[Row], names: Sequence[str]) -> dict[int, tuple[int, float]]:
    """Exit codes and seconds of the runs of an earlier sweep in a folder that gave results, by number.

    Raises:
        InputError: there is no table of a sweep, or its runs have other parameters or values.
    """
    try:
        with open(folder / TABLE, newline="", encoding="utf-8") as file:
            table = list(csv.DictReader(file))
    except OSError as error:
        raise InputError(f"--resume: cannot read {folder / TABLE}: {error.strerror}") from None
    found = {}
    for row in table:
        number = int(row["run"])
        expected = {name: str(rows[number - 1].get(name, "")) for name in names} if number <= len(rows) else {}
        if any(row.get(name) != value for name, value in expected.items()):
            raise InputError(f"--resume: run {number} in {folder / TABLE} has other values than this sweep; expected the same "
                             "--vary, --correlate and --seed, and at least as many --samples, or another --output")  # fmt: skip
        if (
            row["exit_code"] not in ("", "2")
            and any(row[key] for key in list(row)[len(names) + 4 :])
            and not row["reason"]
        ):
            found[number] = int(row["exit_code"]), float(row["seconds"])
    return found


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
    return np.array([float(run.results.get(name, math.nan)) for run in runs])


def statistics(values: NDArray[np.float64]) -> dict[str, float]:
    """Number, mean, standard deviation, extremes and quantiles of the values that are there."""
    values = values[np.isfinite(values)]
    if not len(values):
        return {"runs": 0}
    low, median, high = np.quantile(values, QUANTILES)
    deviation = float(values.std(ddof=1)) if len(values) > 1 else math.nan
    return {
        "runs": len(values), "mean": float(values.mean()), "standard_deviation": deviation, "smallest": float(values.min()),
        "quantile_5_percent": float(low), "median": float(median), "quantile_95_percent": float(high),
        "largest": float(values.max()),
    }  # fmt: skip


def probability_below(values: NDArray[np.float64], limit: float) -> dict[str, float]:
    """Probability that a result is below a limit: the fraction of the runs, its 95 % interval and its reliability index.

    The interval is that of Wilson (1927) for independent samples, which is wide rather than narrow for those of a sequence that fills
    the space evenly. The reliability index is -Phi^-1 of the probability.
    """
    values = values[np.isfinite(values)]
    n = len(values)
    if not n:
        return {"limit": limit, "runs": 0}
    below = int(np.sum(values < limit))
    fraction, z = below / n, float(stats.norm.ppf(0.975))
    middle = (fraction + z**2 / (2 * n)) / (1 + z**2 / n)
    half = z / (1 + z**2 / n) * math.sqrt(fraction * (1 - fraction) / n + z**2 / (4 * n**2))
    index = -float(stats.norm.ppf(fraction)) if 0 < below < n else math.nan
    return {
        "limit": limit, "runs": n, "runs_below": below, "probability_below": fraction, "interval_low": max(middle - half, 0.0),
        "interval_high": min(middle + half, 1.0), "reliability_index": index,
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
    alone = [(*next(iter(run.values.items())), float(run.results.get(result, math.nan))) for run in runs if run.values]
    base = float(runs[0].results.get(result, math.nan))
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
        results["probabilities"] = {
            name: probability_below(values_of(runs, name), limit) for name, limit in limits.items()
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
        lines.append("runs without results are left out of all numbers")
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
    return "\n".join(lines)
