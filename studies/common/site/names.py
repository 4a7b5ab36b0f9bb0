"""The boundaries and soils that the file of a site names, compared with those of its mesh."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import fenics_bridge as bridge
import mpm_core as mpm

BY_BOUNDARY = ("supports", "boundaries", "pressures")
"""Keys of a site whose tables are by boundary"""
OF_STAGES = ("pressure", "support", "boundaries", "release")
"""Keys of a stage that name boundaries"""


def names_at(given: Mapping[str, Any], key: str, where: str, what: str) -> list[str]:
    """The names that a key lists, of which a single one may stand without brackets; where: it stands, what: it names, for the message."""
    value = given.get(key, [])
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise mpm.InputError(f"{where}: {key} is {value!r}, expected names of {what}")
    return names


def require_soils(names: Collection[str], soils: Collection[str], where: str) -> None:
    """Raise InputError for a name that is none of the soils of a site; where: it stands, for the message."""
    for name in names:
        if name not in soils:
            raise mpm.InputError(f"{where}: soil {name!r} is not among the soils {', '.join(soils)}")


def require_boundaries(table: Mapping[str, Any], path: Path, facet_tags: Any) -> None:
    """Require that a mesh has the boundaries that the file of a site names, also for studies that leave them out.

    Args:
        table: of the site.
        path: of the file, for the error.
        facet_tags: of the mesh.

    Raises:
        InputError: a boundary is not there, or a key that is by boundary has another value than a table.
    """
    known = bridge.names_of(facet_tags)
    for name, where in _named(table, path):
        if name not in known:
            has = ", ".join(map(repr, known)) or "none that has a name"
            raise mpm.InputError(
                f"{where}: no boundary of the mesh {str(table['mesh'])!r} has the name {name!r}; it has {has}"
            )


def _named(table: Mapping[str, Any], path: Path) -> Iterator[tuple[str, str]]:
    """The names of boundaries in a file, each with the place where it stands."""
    for key in BY_BOUNDARY:
        yield from ((name, f"{path}: {key}.{name}") for name in _table_by_boundary(table, key, str(path)))
    for number, row in enumerate(table.get("stages", [])):
        where = f"{path}: stages[{number}]"
        for key in OF_STAGES[:-1]:
            yield from ((name, f"{where}.{key}.{name}") for name in _table_by_boundary(row, key, where))
        yield from ((name, f"{where}: release") for name in names_at(row, "release", where, "boundaries"))


def _table_by_boundary(given: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    found = given.get(key, {})
    if not isinstance(found, dict):
        raise mpm.InputError(f"{where}: {key} is {found!r}, expected a table such as {key} = {{name = value}}")
    return found


@contextmanager
def mistakes_in(path: Path) -> Iterator[None]:
    """Begin the message of an InputError about what a file says with the path of the file."""
    try:
        yield
    except mpm.InputError as error:
        text = str(error)
        raise mpm.InputError(text if text.startswith(f"{path}: ") else f"{path}: {text}") from None
