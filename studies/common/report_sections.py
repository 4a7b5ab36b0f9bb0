"""Sections of a page: a heading, text, a table and pictures that belong together."""

from __future__ import annotations

import base64
import html
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Section:
    """One part of a page.

    Args:
        title: heading.
        text: paragraphs, separated by empty lines.
        columns: names of the table's columns.
        rows: texts, one for each column; numbers are set to the right.
        wrong: numbers of the rows that are marked.
        figures: PNG files with captions.
    """

    title: str
    text: str = ""
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    wrong: Sequence[int] = ()
    figures: Mapping[Path, str] = field(default_factory=dict)


def sections_html(sections: Sequence[Section]) -> str:
    """The sections as they stand on the page."""
    return "".join(
        f"<section><h2>{html.escape(section.title)}</h2>{_paragraphs(section.text)}{_table(section)}"
        f"{figures_html(section.figures)}</section>"
        for section in sections
    )


def figures_html(figures: Mapping[Path, str]) -> str:
    """Pictures with captions, as data in the page; those that could not be drawn are left out."""
    shown = "".join(
        f'<figure><img alt="{html.escape(caption)}" '
        f'src="data:image/png;base64,{base64.b64encode(path.read_bytes()).decode("ascii")}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
        for path, caption in figures.items()
        if path.exists()
    )
    return f'<div class="grid">{shown}</div>' if shown else ""


def _paragraphs(text: str) -> str:
    return "".join(f'<p class="text">{html.escape(part)}</p>' for part in text.split("\n\n") if part.strip())


def _table(section: Section) -> str:
    if not section.rows:
        return ""
    numeric = [_is_number(text) for text in section.rows[-1]]
    head = "".join(
        f"<th{' class=number' if right else ''}>{html.escape(name)}</th>"
        for name, right in zip(section.columns, numeric)
    )
    body = ""
    for k, row in enumerate(section.rows):
        cells = "".join(f"<td{' class=number' if _is_number(text) else ''}>{html.escape(text)}</td>" for text in row)
        body += f"<tr{' class=wrong' if k in section.wrong else ''}>{cells}</tr>"
    return f"<table><tr>{head}</tr>{body}</table>"


def _is_number(text: str) -> bool:
    return text.lstrip("≤≥= −-")[:1].isdigit() or text == "–"
