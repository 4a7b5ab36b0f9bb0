"""Content of a study's page, from its options, its results and the files that it wrote."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from pathlib import Path

import numpy as np

from particle_player import Movie

from .options import Options
from .report import Report, Section, name_and_unit, save_report, shown

STARTED = time.time()
"""Files that are older do not belong to this run."""
MOST_FACTS = 6
TITLES = {
    "history": "History of the run", "totals": "Totals of all particles", "crest": "Particle at the crest",
    "section_crest": "Force across the vertical section under the crest",
}  # fmt: skip
"""Titles of curves by the names of their files"""
NOT_FACTS = ("steps", "cells", "soil_cells", "failed", "wall_seconds")


@dataclass
class Page:
    """Additions of a study to its page, all of them optional.

    Args:
        movies: particles over time, panels side by side; None entries (of ranks that hold none) are left out.
        slider: what the movies' slider shows, and its unit.
        facts: the few results that count, name to text with unit; the first numbers of the results if not given. The computing
            time of the run is added.
        subtitle: one sentence; the study's first sentence if not given.
        captions: of figures, by the names of their files without the ending; made from these names if not given.
    """

    movies: Sequence[Movie | None] = ()
    slider: tuple[str, str] = ("t", "s")
    facts: Mapping[str, str] = field(default_factory=dict)
    subtitle: str = ""
    captions: Mapping[str, str] = field(default_factory=dict)


def write_page(
    folder: Path, options: Options, results: Mapping[str, object], page: Page | None = None, footer: str = ""
) -> None:
    """Write ``report.html``: the PNG and CSV files that this run wrote, options, results, and what ``page`` adds.

    Call it on the first rank, when everything else is written.
    """
    page = page or Page()
    title, subtitle = _heading(options)
    numbers, sections, curves = _sorted_out(results)
    save_report(folder / "report.html", Report(
        title=title,
        subtitle=page.subtitle or subtitle,
        facts={**(page.facts or _facts(numbers)), "computing time": f"{seconds_since_start():.3g} s"},
        movies=[movie for movie in page.movies if movie is not None],
        slider=page.slider,
        curves={**dict(_histories(folder)), **curves},
        figures={path: page.captions.get(path.stem, _caption(path)) for path in _recent(folder, "*.png")},
        parameters=options.parameters(),
        results=numbers,
        sections=sections,
        footer=footer,
    ))  # fmt: skip


def seconds_since_start() -> float:
    """Time since this program started [s]."""
    return time.time() - STARTED


def _heading(options: Options) -> tuple[str, str]:
    """Title and subtitle: the site of a user's own, which the description does not know, else the description's first sentence, cut at its colon."""
    site, usual = getattr(options, "site", None), [
        action.default for action in options.actions if action.dest == "site"
    ]
    if site is not None and site not in usual:
        return f"Site {Path(site).stem}", f"Study {options.study}"
    first = " ".join(options.description.strip().split("\n\n")[0].split())
    title, colon, rest = first.partition(": ")
    return (title, rest[:1].upper() + rest[1:]) if colon else (first.rstrip("."), "")


def _recent(folder: Path, pattern: str) -> list[Path]:
    # A second of grace: file systems round times.
    return sorted(path for path in folder.glob(pattern) if path.stat().st_mtime >= STARTED - 1)


def _caption(path: Path) -> str:
    words = path.stem.replace("_", " ")
    return words[:1].upper() + words[1:]


def _histories(folder: Path) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """CSV files of numbers, as titles and columns."""
    for path in _recent(folder, "*.csv"):
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
        try:
            values = np.array(rows[1:], float)
        except ValueError:  # with words in it; a table of results, not a history
            continue
        if len(values):
            columns = dict(zip(rows[0], values.T))
            # Over the first column that changes.
            moving = [name for name, column in columns.items() if column.min() < column.max()]
            yield TITLES.get(path.stem, _caption(path)), {
                name: columns[name] for name in dict.fromkeys([*moving[:1], *columns])
            }


def _sorted_out(results: Mapping[str, object]) -> tuple[dict, list[Section], dict]:
    """Single values, tables and curves among the results. Mappings are taken apart, other lists are left to the files."""
    numbers: dict[str, object] = {}
    sections: list[Section] = []
    curve: dict[str, np.ndarray] = {}
    for name, value in results.items():
        if isinstance(value, Mapping):
            numbers.update({f"{name}: {key}": one for key, one in value.items() if _is_single(one)})
            parts = {key: one for key, one in value.items() if isinstance(one, Mapping)}
            if parts:
                sections.append(_table(name, [{"": key, **one} for key, one in parts.items()]))
        elif name.startswith("curve_"):
            curve[name.removeprefix("curve_")] = np.asarray(value, float)
        elif isinstance(value, (list, tuple)) and value and all(isinstance(row, Mapping) for row in value):
            sections.append(_table(name, value))
        elif _is_single(value):
            numbers[name] = value
    # Over the last one: a load is given first, the displacement under it last.
    return numbers, sections, {"Curve": dict(reversed(curve.items()))} if curve else {}


def _table(name: str, rows: Sequence[Mapping[str, object]]) -> Section:
    """Rows of the results as a table."""
    names = list(dict.fromkeys(key for row in rows for key in row))
    heads = [f"{text} [{unit}]" if unit != "-" else text for text, unit in map(name_and_unit, names)]
    return Section(name_and_unit(name)[0], columns=heads, rows=[[shown(row.get(key)) for key in names] for row in rows])


def _is_single(value: object) -> bool:
    return value is None or isinstance(value, (str, bool, np.generic, Real))


def _facts(numbers: Mapping[str, object]) -> dict[str, str]:
    """The first few results that are numbers."""
    facts = {}
    for key, value in numbers.items():
        counts = isinstance(value, (Real, np.number)) and not isinstance(value, (bool, np.bool_))
        if counts and value != 0 and ":" not in key and not key.startswith(NOT_FACTS):
            name, unit = name_and_unit(key)
            text = f"{value:,.0f}" if abs(value) >= 1e4 else f"{float(value):.4g}"
            facts[name] = text + ("" if unit == "-" else f" {unit}")
    return dict(list(facts.items())[:MOST_FACTS])
