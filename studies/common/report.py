"""The page of a run: one HTML file that opens without a network, with a player for the particles, curves, figures, parameters.

The page's own program lies in ``report_page/``; it and all data are written into the file. Numbers of the player are rounded to
one part in 65,534 of their range.
"""

from __future__ import annotations

import base64
import html
import json
import os
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import matplotlib
import numpy as np

from .history import History
from .parameters import Parameter
from .plots import Quantity, Scene, colour_limits, disc_diameter
from .report_sections import Section, figures_html, sections_html

PAGE = Path(__file__).parent / "report_page"
SCRIPTS = ("data.js", "view.js", "player.js", "curves.js", "main.js")
MAPS = ("viridis", "inferno", "plasma", "cividis")
LEVELS = 65534
ABSENT = 65535
MOST_BYTES = 60e6
"""Of one movie before it is packed; of a longer one some frames are left out."""


@dataclass(frozen=True)
class Movie:
    """Particles over time, for one panel of the player.

    Args:
        title: stands above the panel.
        scene: mesh behind the particles.
        frames: at least one, each with ``time`` [s], ``position`` (n, 2) [m], ``volume`` (n,) [m^3 per metre], the quantities
            by their keys (n,) in SI units, and ``id`` (n,) when rows change their order or number from frame to frame.
        quantities: those of the frames that can be chosen, by key.
    """

    title: str
    scene: Scene
    frames: Sequence[Mapping[str, np.ndarray]]
    quantities: Mapping[str, Quantity]


@dataclass
class Report:
    """What stands on the page.

    Args:
        title: heading.
        subtitle: one sentence below it.
        facts: the few results that count, name to text with unit.
        movies: panels side by side; they share time, quantity and colour scale.
        history: its first column is the time [s]; names end in their unit.
        figures: PNG files with captions.
        parameters: as ``Options.parameters`` gives them.
        results: further results, name to text or number.
        sections: text, tables and pictures that belong together.
    """

    title: str
    subtitle: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    movies: Sequence[Movie] = ()
    history: History | None = None
    figures: Mapping[Path, str] = field(default_factory=dict)
    parameters: Sequence[Parameter] = ()
    results: Mapping[str, object] = field(default_factory=dict)
    sections: Sequence[Section] = ()
    footer: str = ""


def save_report(path: Path, report: Report) -> None:
    """Write the page; the file appears as a whole or not at all. Call it on one rank.

    Raises:
        ValueError: a movie without frames.
    """
    # "</" would end the script element that the data stand in.
    data = json.dumps(_data(report), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
    filled = {
        "title": html.escape(report.title),
        "subtitle": html.escape(report.subtitle),
        "facts": "".join(
            f"<li><b>{html.escape(v)}</b><span>{html.escape(k)}</span></li>" for k, v in report.facts.items()
        ),
        "sections": sections_html(report.sections),
        "figures": _figures(report.figures),
        "tables": _tables(report.parameters, report.results),
        "footer": html.escape(report.footer),
        "style": _part("page.css"),
        "script": "\n".join(_part(name) for name in SCRIPTS),
        "data": data,
    }
    page = _part("page.html")
    pieces = page.split("{{")
    text = pieces[0] + "".join(filled[name] + rest for name, rest in (piece.split("}}", 1) for piece in pieces[1:]))
    aside = path.with_name(path.name + ".part")
    aside.write_text(text, encoding="utf-8")
    os.replace(aside, path)


def _part(name: str) -> str:
    return (PAGE / name).read_text(encoding="utf-8")


# --- data of the player ----------------------------------------------------------------------------------------------


def _data(report: Report) -> dict:
    movies = report.movies
    if any(not movie.frames for movie in movies):
        raise ValueError("frames is empty, expected at least one")
    quantities = {key: quantity for movie in movies for key, quantity in movie.quantities.items()}
    limits = {key: colour_limits(q, _values(movies, key)) for key, q in quantities.items()}
    corners = [movie.scene.limits([frame["position"] for frame in movie.frames]) for movie in movies]
    return {
        "movies": [_packed(movie) for movie in movies],
        "quantities": {k: {"name": q.name, "unit": q.unit, "colours": q.colours} for k, q in quantities.items()},
        "first": next(iter(quantities), None),
        "limits": limits,
        "extent": [np.min([c[0] for c in corners], 0).tolist(), np.max([c[1] for c in corners], 0).tolist()]
        if corners
        else [],
        "maps": {
            name: _base64(_colours(name)) for name in dict.fromkeys([*MAPS, *(q.colours for q in quantities.values())])
        },
        "history": _history(report.history) if report.history is not None and len(report.history) else None,
    }


def _values(movies: Sequence[Movie], key: str) -> list[np.ndarray]:
    return [frame[key] for movie in movies if key in movie.quantities for frame in movie.frames]


def _packed(movie: Movie) -> dict:
    """A movie as JSON: each field (frames, particles), rows by rising id."""
    most = max(len(frame["position"]) for frame in movie.frames)
    fields = 3 + len(movie.quantities)
    every = max(1, int(np.ceil(len(movie.frames) * most * fields * 2 / MOST_BYTES)))
    # The last frame always stays: counted backwards.
    frames = list(movie.frames)[::-1][::every][::-1]
    numbers = [np.asarray(frame.get("id", np.arange(len(frame["position"])))).astype(np.int64) for frame in frames]
    ids = np.unique(np.concatenate(numbers))
    columns = [np.searchsorted(ids, n) for n in numbers]

    def over_time(values: Sequence[np.ndarray]) -> dict:
        table = np.full((len(frames), len(ids)), np.nan, np.float32)
        for row, column, value in zip(table, columns, values):
            row[column] = value
        return quantised(table)

    packed = {
        "x": over_time([frame["position"][:, 0] for frame in frames]),
        "y": over_time([frame["position"][:, 1] for frame in frames]),
        "radius": over_time([0.5 * disc_diameter(frame["volume"]) for frame in frames]),
    }
    for key, quantity in movie.quantities.items():
        packed[key] = over_time([quantity.scale * frame[key] for frame in frames])
    return {
        "title": movie.title,
        "times": [float(frame["time"]) for frame in frames],
        "count": len(ids),
        "ids": ids.tolist() if (ids != np.arange(len(ids))).any() else None,
        "fields": packed,
        "scene": _scene(movie.scene),
    }


def quantised(table: np.ndarray) -> dict:
    """A field (frames, particles) in 16 bits, packed for ``readField`` in ``data.js``; NaN where a particle is absent.

    Successive frames hardly differ, nor do the high bytes: differences and bytes set apart pack well.
    """
    present = np.isfinite(table)
    low = float(np.min(table, where=present, initial=np.inf))
    high = float(np.max(table, where=present, initial=-np.inf))
    if not low <= high:
        low = high = 0.0
    span = high - low if high > low else 1.0
    levels = np.where(present, np.rint((np.where(present, table, low) - low) / span * LEVELS), ABSENT).astype(np.uint16)
    differences = np.concatenate([levels[:1], levels[1:] - levels[:-1]]).ravel()
    apart = np.concatenate([(differences & 255).astype(np.uint8), (differences >> 8).astype(np.uint8)])
    return {"low": low, "high": low + span, "data": _base64(zlib.compress(apart.tobytes(), 6))}


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _colours(name: str) -> bytes:
    rgb = matplotlib.colormaps[name](np.arange(256) / 255.0)[:, :3]
    return np.rint(255 * rgb).astype(np.uint8).tobytes()


def _scene(scene: Scene) -> dict:
    """Lines behind the particles, each as x0 y0 x1 y1 [m]."""
    cells = scene.cells
    edges = np.unique(np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]]), axis=1), axis=0)
    lines = {"boundary": scene.boundary, "outline": scene.initial_outline, "mesh": scene.points[edges]}
    return {name: np.round(segments.reshape(-1), 5).tolist() for name, segments in lines.items()}


def _history(history: History) -> dict:
    time, *columns = history.columns
    curves = []
    for column in columns:
        name, unit = _name_and_unit(column)
        values = [float(v) if np.isfinite(v) else None for v in history[column]]
        curves.append({"name": name, "unit": unit, "values": values})
    return {"times": history[time].tolist(), "curves": curves}


def _name_and_unit(column: str) -> tuple[str, str]:
    """A column such as kinetic_energy_J_per_m as ("Kinetic energy", "J/m")."""
    if column == "dt_s":
        return "Time step", "s"
    for ending, unit in (
        ("_J_per_m", "J/m"),
        ("_N_per_m", "N/m"),
        ("_kPa", "kPa"),
        ("_Pa", "Pa"),
        ("_m", "m"),
        ("_s", "s"),
    ):
        if column.endswith(ending):
            return column.removesuffix(ending).replace("_", " ").capitalize(), unit
    return column.replace("_", " ").capitalize(), "-"


# --- what stands on the page as it is --------------------------------------------------------------------------------


def _figures(figures: Mapping[Path, str]) -> str:
    return f"<section><h2>Figures</h2>{figures_html(figures)}</section>" if figures else ""


def _tables(parameters: Sequence[Parameter], results: Mapping[str, object]) -> str:
    rows = "".join(
        f'<tr><td class="name">{html.escape(p.name)}</td><td class="number">{_shown(p.value)}</td>'
        f"<td>{'' if p.unit == '-' else html.escape(p.unit)}</td><td>{html.escape(p.meaning)}</td></tr>"
        for p in parameters
    )
    first = f"<div><h2>Parameters</h2><table>{rows}</table></div>" if rows else ""
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td><td class='number'>{_shown(value)}</td></tr>"
        for name, value in results.items()
    )
    second = f"<div><h2>Results</h2><table>{rows}</table></div>" if rows else ""
    return f'<section class="tables">{first}{second}</section>' if first or second else ""


def _shown(value: object) -> str:
    if value is None:
        return "&ndash;"
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    return html.escape(f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value))
