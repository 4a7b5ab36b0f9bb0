"""The player as a page of its own, or as parts of a page that has more on it."""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from particle_player.movie import Movie, packed
from particle_player.scene import colour_limits

WEB = Path(__file__).parent / "web"
SCRIPTS = ("data.js", "view.js", "player.js")
MAPS = ("viridis", "inferno", "plasma", "cividis")

_PAGE = """\
<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>
{style}
</style>
</head>
<body>
<main>
<h1>{title}</h1>
{html}
</main>
<script type="application/json" id="data">{data}</script>
<script>
{script}
startPlayer(JSON.parse(document.getElementById("data").textContent)).then((player) => {{ window.page = {{ player }}; }});
</script>
</body>
</html>
"""


@dataclass(frozen=True)
class Parts:
    """Parts of the player on a page.

    Its script has to call ``startPlayer(data)``, which gives a promise of the player, with ``data`` as they are here or with
    further entries.

    Attributes:
        html: the element ``<section id="player">``, once in the page's ``<main>``.
        style: CSS.
        script: JavaScript.
        data: for `startPlayer`, as JSON takes them.
    """

    html: str
    style: str
    script: str
    data: dict[str, Any]


def parts_of_page(movies: Sequence[Movie], slider: tuple[str, str] = ("t", "s")) -> Parts:
    """The player with its movies, for a page with more on it.

    Args:
        movies: panels side by side; without any, the player stays hidden.
        slider: what the slider shows, and its unit.

    Raises:
        ValueError: a movie without frames.
    """
    script = "\n".join(_text(name) for name in SCRIPTS)
    return Parts(_text("player.html"), _text("player.css"), script, _data(movies, slider))


def save_player(
    path: str | os.PathLike[str],
    movies: Sequence[Movie],
    title: str = "Particles",
    slider: tuple[str, str] = ("t", "s"),
) -> None:
    """Write a page that has the player only; it needs no other file and no network.

    Values are rounded to one part in 65,534 of their range. Of a movie that would become too large, some frames are left out.

    Args:
        path: of the HTML file.
        movies: at least one; they stand side by side.
        title: of the page.
        slider: what the slider shows, and its unit.

    Raises:
        ValueError: no movie, or one without frames.
        OSError: the file cannot be written.
    """
    if not movies:
        raise ValueError("movies is empty, expected at least one")
    parts = parts_of_page(movies, slider)
    text = _PAGE.format(
        title=escape(title), style=parts.style, html=parts.html, data=as_json(parts.data), script=parts.script
    )
    Path(path).write_text(text, encoding="utf-8")


def as_json(data: Mapping[str, Any]) -> str:
    """Data as they may stand within an element ``<script>``, which "</" would end."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False).replace("</", "<\\/")


def _text(name: str) -> str:
    return (WEB / name).read_text(encoding="utf-8")


def _data(movies: Sequence[Movie], slider: tuple[str, str]) -> dict[str, Any]:
    quantities = {key: quantity for movie in movies for key, quantity in movie.quantities.items()}
    limits = {key: colour_limits(q, _values(movies, key)) for key, q in quantities.items()}
    bodies = [[movie.in_picture(frame["bodies"]) for frame in movie.frames if "bodies" in frame] for movie in movies]
    corners = [
        movie.scene.limits([movie.in_picture(frame["position"]) for frame in movie.frames], segments)
        for movie, segments in zip(movies, bodies, strict=True)
    ]
    extent = (
        [np.min([c[0] for c in corners], 0).tolist(), np.max([c[1] for c in corners], 0).tolist()] if corners else []
    )
    maps = dict.fromkeys([*MAPS, *(q.colours for q in quantities.values())])
    return {
        "movies": [packed(movie) for movie in movies],
        "slider": slider,
        "quantities": {k: {"name": q.name, "unit": q.unit, "colours": q.colours} for k, q in quantities.items()},
        "first": _first(movies, limits),
        "limits": limits,
        "extent": extent,
        "maps": {name: base64.b64encode(_colours(name)).decode("ascii") for name in maps},
    }


def _first(movies: Sequence[Movie], limits: Mapping[str, tuple[float, float]]) -> str | None:
    """The quantity shown first: one that varies in all panels, so that none is of one colour; otherwise the first there is."""

    def varies(movie: Movie, key: str) -> bool:
        if key not in movie.quantities:
            return False
        low, high = limits[key]
        shown = (
            np.clip(movie.quantities[key].scale * frame[key], low, high) for frame in movie.frames if len(frame[key])
        )
        # A few particles at a corner are not seen.
        return any(np.ptp(np.percentile(values, (5, 95))) > 0.05 * (high - low) for values in shown)

    return next((key for key in limits if all(varies(movie, key) for movie in movies)), next(iter(limits), None))


def _values(movies: Sequence[Movie], key: str) -> list[NDArray]:
    return [frame[key] for movie in movies if key in movie.quantities for frame in movie.frames]


def _colours(name: str) -> bytes:
    rgb = matplotlib.colormaps[name](np.arange(256) / 255.0)[:, :3]
    return np.rint(255 * rgb).astype(np.uint8).tobytes()
