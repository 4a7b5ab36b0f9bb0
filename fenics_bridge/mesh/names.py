"""Names of soils and boundaries: the physical groups of gmsh, used wherever a tag is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI

from fenics_bridge.errors import InputError
from fenics_bridge.types import MeshTags
from mpm_core.mesh import Tag


def name_tags(tags: MeshTags, names: Mapping[str, int | Sequence[int]]) -> MeshTags:
    """Give tags of a mesh their names, in place.

    Args:
        tags: cell or facet tags of DOLFINx.
        names: tag by name, or several tags that the name stands for, e.g. {"clay": 1, "fill": (2, 3)}.

    Returns:
        The same tags.
    """
    tags.names = {str(name): tuple(int(t) for t in np.atleast_1d(numbers)) for name, numbers in names.items()}
    return tags


def names_of(tags: MeshTags | None) -> dict[str, tuple[int, ...]]:
    """Names of the tags of a mesh.

    Args:
        tags: cell or facet tags of DOLFINx, or None.

    Returns:
        Tags by name; empty where there are no names, e.g. for tags made with DOLFINx.
    """
    return getattr(tags, "names", {})


def label(tags: Any, number: int | None) -> str:
    """A tag as messages show it: its own name if it has one, else the number."""
    return next((repr(name) for name, numbers in names_of(tags).items() if numbers == (number,)), str(number))


def group_label(tags: Any, tag: Tag) -> str:
    """A tag as messages show it: its name, else that of the smallest group that it is in, as a class of a soil is, else the number."""
    groups = [(len(numbers), name) for name, numbers in names_of(tags).items() if tag in numbers]
    return repr(min(groups)[1] if groups else tag)


def known_tags(comm: MPI.Comm, tags: Any) -> list[int]:
    """All tags that entities have on any rank, in order. Collective."""
    every = comm.allgather(set(np.unique(tags.values).tolist()) if tags is not None else set())
    return sorted(set().union(*every))


def described(tags: Any, known: Iterable[int]) -> str:
    """Tags and names that a mesh has, for messages."""
    return ", ".join(label(tags, number) for number in known) or "none"


def tag_numbers(
    comm: MPI.Comm, tags: MeshTags | None, given: Tag, argument: str, entity: str = "facet"
) -> tuple[int, ...]:
    """The tags that a number, a name, or a sequence of them stands for. Collective.

    Args:
        comm: the ranks that share the mesh.
        tags: cell or facet tags; None where there are none.
        given: number or name of a tag, or a sequence of them.
        argument: name of the argument, for the message.
        entity: "cell" or "facet", for the message.

    Returns:
        The numbers of the tags, each once.

    Raises:
        InputError: one of them does not exist on any rank. Raised on all ranks alike.
    """
    known, names, found = known_tags(comm, tags), names_of(tags), []
    if tags is None:
        raise InputError(f"{argument}: {entity}_tags is None, expected the tags in which {given!r} is looked for")
    for one in given if isinstance(given, (list, tuple, set, np.ndarray)) else [given]:
        numbers = names.get(one, ()) if isinstance(one, str) else (one,)
        present = [number for number in numbers if number in known]
        if not present:
            what = "name" if isinstance(one, str) else "tag"
            raise InputError(f"{argument}: no {entity} has the {what} {one!r}; the mesh has {described(tags, known)}")
        found += present
    return tuple(dict.fromkeys(found))


def by_number(
    comm: MPI.Comm, tags: MeshTags | None, given: Mapping[Any, Any], argument: str, entity: str = "facet"
) -> dict[Any, Any]:
    """A dictionary by tags or names as one by tags alone; None as a key stays. Collective.

    Args:
        comm: the ranks that share the mesh.
        tags: cell or facet tags; None where there are none.
        given: values by number or name of a tag.
        argument: name of the argument, for the message.
        entity: "cell" or "facet", for the message.

    Returns:
        The values by number of a tag.

    Raises:
        InputError: a tag does not exist, or is given twice. Raised on all ranks alike.
    """
    result = {}
    for key, value in given.items():
        for number in (None,) if key is None else tag_numbers(comm, tags, key, argument, entity):
            if number in result:
                raise InputError(
                    f"{argument}: the tag {label(tags, number)} is given twice, by {key!r} and another key"
                )
            result[number] = value
    return result
