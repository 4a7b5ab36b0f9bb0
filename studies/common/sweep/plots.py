"""Pictures of a sweep: a result over the parameters, its distribution, and what changes it most."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..figures import curve_figure
from ..plots import CURVES
from .plan import Variable, column
from .results import changes_alone, label, rank_correlations, values_of
from .runs import Run

BLUE, RED = CURVES[:2]
MOST_PANELS = 4
"""Parameters over which samples are drawn, those with the largest correlation"""
MOST_BINS = 25
Mark = tuple[str, float] | None


def picture_of(
    runs: Sequence[Run], variables: Sequence[Variable], result: str, names: Mapping[str, str], one_at_a_time: bool,
    mark: Mark,
) -> Callable[[Path], None]:  # fmt: skip
    """The picture of a result that suits the sweep: a tornado, a distribution with its sources, curves, or points.

    Args:
        runs: of the sweep, all of them.
        variables: its parameters.
        result: name of the result.
        names: of the parameters with their units.
        one_at_a_time: whether each run changes one parameter alone.
        mark: a value of the result that is drawn, with a word for it; None for none.
    """
    if one_at_a_time:
        return lambda path: _tornado(path, runs, result, names, mark)
    if any(one.samples for one in variables):
        return lambda path: _distribution(path, runs, variables, result, names, mark)
    if len(variables) <= 2:
        return lambda path: _curves(path, runs, variables, result, names, mark)
    return lambda path: _points(path, runs, variables, result, names, mark)


def _curves(
    path: Path, runs: Sequence[Run], variables: Sequence[Variable], result: str, names: Mapping[str, str],
    mark: Mark,
) -> None:  # fmt: skip
    """The result over the parameter with most values, a curve for each value of the other one."""
    along, *other = sorted(variables, key=lambda one: -len(one.values))
    groups = other[0].values if other else (None,)
    with curve_figure(path, (4.9, 3.3)) as axes:
        for k, group in enumerate(groups):
            mine = [run for run in runs if not other or run.values[other[0].name] == group]
            mine = in_order(mine, along.name)
            x, y = column([run.values[along.name] for run in mine]), values_of(mine, result)
            text = f"{names[other[0].name]}: {_shown(group)}" if other else None
            axes.plot(x, y, "o-", color=CURVES[k % len(CURVES)], markersize=3, linewidth=1.1, label=text)
        axes.set(xlabel=names[along.name], ylabel=label(result))
        _draw_mark(axes.axhline, mark)
        if other or mark is not None:
            axes.legend(fontsize=8)


def in_order(runs: Sequence[Run], name: str) -> list[Run]:
    """Runs in the order of the values of a parameter, whose list may have them in any; of texts in that of the list."""
    values = column([run.values[name] for run in runs])
    return list(runs) if values.dtype.kind == "U" else [runs[k] for k in np.argsort(values, kind="stable")]


def _points(
    path: Path, runs: Sequence[Run], variables: Sequence[Variable], result: str, names: Mapping[str, str],
    mark: Mark,
) -> None:  # fmt: skip
    """The result of all runs over each parameter."""
    shown = variables[:MOST_PANELS]
    with curve_figure(path, (0.6 + 2.5 * len(shown), 3.0), panels=len(shown)) as panels:
        _scatter(np.atleast_1d(panels), runs, [one.name for one in shown], result, names, mark)


def _distribution(
    path: Path, runs: Sequence[Run], variables: Sequence[Variable], result: str, names: Mapping[str, str],
    mark: Mark,
) -> None:  # fmt: skip
    """How often the result has which value, and the result over the parameters that it depends on most."""
    found = rank_correlations(runs, [one.name for one in variables if one.quantile is not None], result)
    shown = sorted(found, key=lambda name: -abs(found[name]))[:MOST_PANELS]
    values = values_of(runs, result)
    values = values[np.isfinite(values)]
    with curve_figure(path, (0.6 + 2.6 * (1 + len(shown)), 3.0), panels=1 + len(shown)) as panels:
        first, *rest = np.atleast_1d(panels)
        bins = min(MOST_BINS, max(5, math.ceil(math.sqrt(len(values)))))
        first.hist(values, bins, weights=np.full(len(values), 100 / max(len(values), 1)), color=BLUE, alpha=0.35)
        first.set(xlabel=label(result), ylabel="Fraction of the runs [%]")
        total = first.twinx()
        total.grid(False)
        total.step(np.sort(values), 100 * np.arange(1, len(values) + 1) / max(len(values), 1), where="post", color=BLUE)
        total.set(ylim=(0, 100), ylabel="Fraction not above [%]")
        _draw_mark(first.axvline, mark)
        if mark is not None and len(values):
            first.set_title(f"{np.mean(values < mark[1]):.1%} of the runs below {mark[1]:g}", fontsize=8)
        _scatter(rest, runs, shown, result, names, mark, found)


def _scatter(
    panels: Sequence[Any], runs: Sequence[Run], shown: Sequence[str], result: str, names: Mapping[str, str],
    mark: Mark, correlations: Mapping[str, float] | None = None,
) -> None:  # fmt: skip
    y = values_of(runs, result)
    for k, (axes, name) in enumerate(zip(panels, shown)):
        axes.plot(column([run.values.get(name) for run in runs]), y, ".", color=BLUE, markersize=4)
        axes.set_xlabel(names[name])
        if k == 0:
            axes.set_ylabel(label(result))
        if correlations:
            axes.set_title(f"rank correlation {correlations[name]:.2f}", fontsize=8)
        _draw_mark(axes.axhline, mark)


def _tornado(path: Path, runs: Sequence[Run], result: str, names: Mapping[str, str], mark: Mark) -> None:
    """The change of the result by each parameter alone, those that change it most at the top."""
    rows, base = changes_alone(runs, result), runs[0].result(result)
    parameters = list(dict.fromkeys(name for name, _, _ in rows))
    with curve_figure(path, (5.6, 0.9 + 0.5 * len(parameters))) as axes:
        for k, name in enumerate(parameters):
            values = [(value, given) for one, given, value in rows if one == name and math.isfinite(value)]
            ends = [min(values, default=None), max(values, default=None)] if values else []
            for place, end in zip((-1, 1), ends):
                axes.barh(k, end[0] - base, left=base, height=0.6, color=RED if end[0] < base else BLUE, alpha=0.6)
                if place > 0 or ends[0] != ends[1]:
                    side = 1 if end[0] > base or (end[0] == base and place > 0) else -1
                    axes.annotate(_shown(end[1]), (end[0], k), (3 * side, 0), textcoords="offset points", fontsize=7,
                                  va="center", ha="left" if side > 0 else "right")  # fmt: skip
        axes.axvline(base, color="black", linewidth=0.8)
        _draw_mark(axes.axvline, mark)
        axes.set_yticks(range(len(parameters)), [names[name] for name in parameters])
        axes.set_xlabel(label(result))
        axes.grid(visible=False, axis="y")
        axes.margins(x=0.2)


def _draw_mark(line: Callable[..., Any], mark: Mark) -> None:
    if mark is not None:
        line(mark[1], color="black", linestyle="--", linewidth=0.9, label=f"{mark[0]} {mark[1]:g}")


def _shown(value: Any) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) and not isinstance(value, bool) else str(value)
