"""Options of studies whose site is a file."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from ..files import ROOT
from ..options import add_choice, add_number


def add_site_file(parser: ArgumentParser, site: str, contents: str, elements: tuple[str, tuple[str, ...], str]) -> None:
    """Options ``--site``, ``--cell-size`` and ``--elements``.

    Args:
        site: name of the default, a TOML file in `meshes/`.
        contents: what the file describes.
        elements: default, choices and meaning.
    """
    parser.add_argument("--site", type=Path, default=ROOT / "meshes" / f"{site}.toml", metavar="FILE",
                        help=f"TOML file of mesh, {contents} (default: meshes/{site}.toml)")  # fmt: skip
    add_number(parser, "--cell-size", None, "m", "size of the triangles (default: that of the site file)", above=0)
    add_choice(parser, "--elements", *elements)
