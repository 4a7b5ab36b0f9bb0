"""The page of a run: one HTML file that opens without a network, with a player for the particles, curves, figures, parameters.

The template and the program of the page lie in ``report_page/``, the player is that of `particle_player`; all of it and all data
are written into the file.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import jinja2
import numpy as np
from markupsafe import Markup

from particle_player import Movie, parts_of_page
from particle_player.page import as_json

from .files import expendable
from .parameters import Parameter

PAGE = Path(__file__).parent / "report_page"
SCRIPTS = ("curves.js", "main.js")
_ONE = "(?:mm|m|m2|m3|s|s2|Ns|N.s|Nm|N.m|N|kN|kPa|Pa|J|kg|rad|seconds|hours|days|degrees)"
UNIT = re.compile(rf"_({_ONE}(?:(?:_per_|/){_ONE})?)$")
"""Unit of a quantity by the end of its name, such as Pa, m_per_s or m/s"""
SPECIAL = {
    "dt_s": ("Time step", "s"), "wall_seconds": ("Computing time without pictures", "s"),
    "pic": ("PIC", "-"), "nmd": ("Nodal mixed discretisation", "-"),
    "runout_m": ("Run-out", "m"), "kinetic_energy_J_per_m": ("Kinetic energy of the particles", "J/m"),
    "nodal_kinetic_energy_J_per_m": ("Kinetic energy of the nodes", "J/m"),
    "plastic_fraction": ("Fraction of particles that yield", "-"),
    "unbalanced_ratio": ("Out-of-balance ratio", "-"),
}  # fmt: skip


@dataclass
class Section:
    """One part of a page.

    Args:
        title: heading.
        text: paragraphs, separated by empty lines.
        columns: names of the table's columns.
        rows: texts, one for each column; numbers are set to the right.
        wrong: numbers of the rows that are marked.
        figures: PNG files with captions; those that could not be drawn are left out.
    """

    title: str
    text: str = ""
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    wrong: Sequence[int] = ()
    figures: Mapping[Path, str] = field(default_factory=dict)


@dataclass
class Report:
    """Content of the page.

    Args:
        title: heading.
        subtitle: one sentence below it.
        facts: the few results that count, name to text with unit.
        movies: panels side by side, with the same time, quantity and colour scale.
        slider: what the player's slider shows, and its unit.
        curves: tables of numbers by title, each column's values by its name, which ends in its unit; drawn over the first
            column, and following the player if that is ``time_s``.
        figures: PNG files with captions.
        parameters: as ``Options.parameters`` gives them.
        results: further results, name to text or number.
        sections: text, tables and pictures that belong together.
    """

    title: str
    subtitle: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    movies: Sequence[Movie] = ()
    slider: tuple[str, str] = ("t", "s")
    curves: Mapping[str, Mapping[str, np.ndarray]] = field(default_factory=dict)
    figures: Mapping[Path, str] = field(default_factory=dict)
    parameters: Sequence[Parameter] = ()
    results: Mapping[str, object] = field(default_factory=dict)
    sections: Sequence[Section] = ()
    footer: str = ""


def save_report(path: Path, report: Report) -> None:
    """Write the page; the file appears as a whole or not at all, see `expendable`. Call it on one rank.

    Raises:
        ValueError: a movie without frames.
    """
    player = parts_of_page(report.movies, report.slider)
    curves = [_curves(title, table) for title, table in report.curves.items() if _drawable(table)]
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(PAGE), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"shown": shown, "name_and_unit": name_and_unit, "png": _png}
    environment.tests["numeric"] = _is_number
    text = environment.get_template("page.html").render(
        report=report,
        player=Markup(player.html),
        style=Markup(player.style + _part("page.css")),
        script=Markup("\n".join([player.script, *map(_part, SCRIPTS)])),
        data=Markup(as_json({**player.data, "curves": curves})),
    )
    with expendable(path) as aside:
        aside.write_text(text, encoding="utf-8")


def name_and_unit(column: str) -> tuple[str, str]:
    """A name such as kinetic_energy_J_per_m as ("Kinetic energy", "J/m"); "-" for what has no unit."""
    if ": " in column:
        group, name = column.split(": ", 1)
        text, unit = name_and_unit(group)
        return f"{text}: {name.replace('_', ' ')}", unit
    if column in SPECIAL:
        return SPECIAL[column]
    if "unit_weight" in column:
        return _words(column), "N/m\u00b3"
    found = UNIT.search(column)
    if found is None:
        return _words(column), "-"
    unit = found.group(1).replace("_per_", "/").replace("2", "\u00b2").replace("3", "\u00b3")
    unit = unit.replace("seconds", "s").replace("Ns", "N s").replace("Nm", "N m").replace(".", " ").replace("_", " ")
    return _words(column[: found.start()]), unit


def _words(name: str) -> str:
    text = name.replace("_", " ")
    return text if len(text) == 1 else text[:1].upper() + text[1:]  # symbols keep their case


def _part(name: str) -> str:
    return (PAGE / name).read_text(encoding="utf-8")


def _drawable(table: Mapping[str, np.ndarray]) -> bool:
    return len(table) > 1 and len(next(iter(table.values()))) > 1


def _curves(title: str, table: Mapping[str, np.ndarray]) -> dict:
    """A table as JSON; NaN becomes null. What does not change is given as text, and not drawn."""
    columns, constant = [], []
    for number, (column, values) in enumerate(table.items()):
        name, unit = name_and_unit(column)
        numbers = [float(v) if np.isfinite(v) else None for v in values]
        # Before the first step there is no time step yet, or that of an equilibrium before the run.
        of_run = numbers[1:] if column == "dt_s" else numbers
        if number > 0 and len(set(of_run)) == 1:
            constant.append(f"{name} {shown(of_run[0])}{'' if unit == '-' else f' {unit}'}")
        else:
            columns.append({"name": name, "unit": unit, "values": numbers})
    first, *others = columns
    text = f"Constant: {', '.join(constant)}." if constant else ""
    return {"title": title, "isTime": next(iter(table)) == "time_s", "along": first, "curves": others, "constant": text}


# --- what stands on the page as it is --------------------------------------------------------------------------------


def _png(path: Path) -> str | None:
    """A picture as text; None where there is none."""
    return base64.b64encode(path.read_bytes()).decode("ascii") if path.exists() else None


def _is_number(text: str) -> bool:
    return text.lstrip("≤≥= −-")[:1].isdigit() or text == "–"


def shown(value: object) -> str:
    """A value as text."""
    if value is None:
        return "\u2013"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)
