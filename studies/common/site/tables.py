"""Files of sites as tables: what is in them, and how one extends another."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomllib

import mpm_core as mpm

MOST_FILES = 10
"""Most files of sites that extend one another; more are probably a circle"""


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Values of both tables; where both have a table, that of both, and where both have a value, the one above."""
    both = [name for name in below if name in above and isinstance(below[name], dict) and isinstance(above[name], dict)]
    return {**below, **above, **{name: merged(below[name], above[name]) for name in both}}


def parsed(path: Path) -> dict[str, Any]:
    """The keys and values of a TOML file."""
    try:
        with open(path, "rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise mpm.InputError(f"cannot read the site {path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise mpm.InputError(f"the site {path} is not TOML: {error}") from None


def site_files(path: Path) -> list[Path]:
    """The file of a site, and those that it extends, each after the one that extends it.

    Raises:
        InputError: one of them cannot be read.
    """
    files = [path]
    while (base := parsed(files[-1]).get("extends")) is not None and len(files) < MOST_FILES:
        files.append(files[-1].parent / str(base))
    return files
