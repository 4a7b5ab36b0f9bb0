"""Names of soils and boundaries: the physical groups of gmsh, used wherever a tag is asked for."""

from __future__ import annotations

import numpy as np

from fenics_bridge.errors import InputError


def name_tags(tags, names):
    """Give tags of a mesh their names, in place; a name may stand for several tags. Returns the tags.

    tags: cell or facet tags of DOLFINx; names: {name: tag or tags}, e.g. {"clay": 1, "fill": (2, 3)}
    """
    tags.names = {str(name): tuple(int(t) for t in np.atleast_1d(numbers)) for name, numbers in names.items()}
    return tags


def names_of(tags):
    """Names of the tags as {name: tuple of tags}; empty where there are none, e.g. for tags made with DOLFINx."""
    return getattr(tags, "names", {})


def label(tags, number):
    """A tag as messages show it: its own name if it has one, else the number."""
    return next((repr(name) for name, numbers in names_of(tags).items() if numbers == (number,)), str(number))


def known_tags(comm, tags):
    """All tags that entities have on any rank, in order. Collective."""
    every = comm.allgather(set(np.unique(tags.values).tolist()) if tags is not None else set())
    return sorted(set().union(*every))


def described(tags, known):
    """Tags and names that a mesh has, for messages."""
    return ", ".join(label(tags, number) for number in known) or "none"


def tag_numbers(comm, tags, given, argument, entity="facet"):
    """The tags that a number, a name, or a sequence of them stands for: tuple of int.

    Raises InputError, on all ranks, where one of them does not exist on any rank. Collective.
    """
    known, names, found = known_tags(comm, tags), names_of(tags), []
    for one in given if isinstance(given, (list, tuple, set, np.ndarray)) else [given]:
        numbers = names.get(one, ()) if isinstance(one, str) else (one,)
        present = [number for number in numbers if number in known]
        if not present:
            what = "name" if isinstance(one, str) else "tag"
            raise InputError(f"{argument}: no {entity} has the {what} {one!r}; the mesh has {described(tags, known)}")
        found += present
    return tuple(dict.fromkeys(found))


def by_number(comm, tags, given, argument, entity="facet"):
    """A dictionary by tags or names as one by tags alone; None as a key stays.

    Raises InputError, on all ranks, for a tag that does not exist or that is given twice. Collective.
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
