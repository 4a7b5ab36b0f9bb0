"""The page of a run: one HTML file that opens without a network, with a player for the particles, curves, figures, parameters.

The template and the program of the page lie in ``report_page/``; both and all data are written into the file. The numbers that
the player shows are rounded to one part in 65,534 of their range.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import jinja2
import matplotlib
import numpy as np
from markupsafe import Markup

from .files import expendable
from .movie import Movie, packed
from .parameters import Parameter
from .plots import colour_limits

PAGE = Path(__file__).parent / "report_page"
SCRIPTS = ("data.js", "view.js", "player.js", "curves.js", "main.js")
MAPS = ("viridis", "inferno", "plasma", "cividis")
UNITS = {
    "_J_per_m": "J/m", "_N_per_m": "N/m", "_kPa": "kPa", "_Pa": "Pa", "_m": "m", "_mm": "mm", "_s": "s", "_seconds": "s",
    "_degrees": "degrees",
}  # fmt: skip
"""Of a quantity, by the end of its name."""
SPECIAL = {
    "dt_s": ("Time step", "s"), "wall_seconds": ("Computing time", "s"),
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
    """What stands on the page.

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
    # "</" would end the script element that the data stand in.
    data = json.dumps(_data(report), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(PAGE), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= {"shown": shown, "name_and_unit": name_and_unit, "png": _png}
    environment.tests["numeric"] = _is_number
    text = environment.get_template("page.html").render(
        report=report,
        style=Markup(_part("page.css")),
        script=Markup("\n".join(map(_part, SCRIPTS))),
        data=Markup(data),
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
    for ending, unit in UNITS.items():
        if column.endswith(ending):
            return _words(column.removesuffix(ending)), unit
    return _words(column), "-"


def _words(name: str) -> str:
    text = name.replace("_", " ")
    return text if len(text) == 1 else text[:1].upper() + text[1:]  # symbols keep their case


def _part(name: str) -> str:
    return (PAGE / name).read_text(encoding="utf-8")


# --- data of the player ----------------------------------------------------------------------------------------------


def _data(report: Report) -> dict:
    movies = report.movies
    quantities = {key: quantity for movie in movies for key, quantity in movie.quantities.items()}
    limits = {key: colour_limits(q, _values(movies, key)) for key, q in quantities.items()}
    bodies = [[frame["bodies"] for frame in movie.frames if "bodies" in frame] for movie in movies]
    corners = [
        movie.scene.limits([frame["position"] for frame in movie.frames], segments)
        for movie, segments in zip(movies, bodies, strict=True)
    ]
    return {
        "movies": [packed(movie) for movie in movies],
        "slider": report.slider,
        "quantities": {k: {"name": q.name, "unit": q.unit, "colours": q.colours} for k, q in quantities.items()},
        "first": _first(movies, limits),
        "limits": limits,
        "extent": [np.min([c[0] for c in corners], 0).tolist(), np.max([c[1] for c in corners], 0).tolist()]
        if corners
        else [],
        "maps": {
            name: _base64(_colours(name)) for name in dict.fromkeys([*MAPS, *(q.colours for q in quantities.values())])
        },
        "curves": [_curves(title, table) for title, table in report.curves.items() if _drawable(table)],
    }


def _first(movies: Sequence[Movie], limits: Mapping[str, tuple[float, float]]) -> str | None:
    """The quantity shown first: one that varies in all panels, so that none is of one colour; otherwise the first there is."""

    def varies(movie: Movie, key: str) -> bool:
        if key not in movie.quantities:
            return False
        low, high = limits[key]
        values = [
            np.clip(movie.quantities[key].scale * frame[key], low, high) for frame in movie.frames if len(frame[key])
        ]
        span = max((v.max() for v in values), default=low) - min((v.min() for v in values), default=low)
        return bool(span > 0.05 * (high - low))

    return next((key for key in limits if all(varies(movie, key) for movie in movies)), next(iter(limits), None))


def _values(movies: Sequence[Movie], key: str) -> list[np.ndarray]:
    return [frame[key] for movie in movies if key in movie.quantities for frame in movie.frames]


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _colours(name: str) -> bytes:
    rgb = matplotlib.colormaps[name](np.arange(256) / 255.0)[:, :3]
    return np.rint(255 * rgb).astype(np.uint8).tobytes()


def _drawable(table: Mapping[str, np.ndarray]) -> bool:
    return len(table) > 1 and len(next(iter(table.values()))) > 1


def _curves(title: str, table: Mapping[str, np.ndarray]) -> dict:
    """A table as JSON; NaN becomes null. What does not change is given as text, and not drawn."""
    columns, constant = [], []
    for number, (column, values) in enumerate(table.items()):
        name, unit = name_and_unit(column)
        numbers = [float(v) if np.isfinite(v) else None for v in values]
        if number > 0 and len(set(numbers)) == 1:
            constant.append(f"{name} {shown(numbers[0])}{'' if unit == '-' else f' {unit}'}")
        else:
            columns.append({"name": name, "unit": unit, "values": numbers})
    first, *others = columns
    text = f"Constant: {', '.join(constant)}." if constant else ""
    return {"title": title, "isTime": next(iter(table)) == "time_s", "along": first, "curves": others, "constant": text}


# --- what stands on the page as it is --------------------------------------------------------------------------------


def _png(path: Path) -> str | None:
    """A picture as text; None where there is none."""
    return _base64(path.read_bytes()) if path.exists() else None


def _is_number(text: str) -> bool:
    return text.lstrip("≤≥= −-")[:1].isdigit() or text == "–"


def shown(value: object) -> str:
    """A value as text."""
    if value is None:
        return "\u2013"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)
