"""A mesh as gmsh has it, as plain arrays; also by a process of its own, since gmsh crashes on some damaged files.

Nothing of this package is imported here, so that such a process starts quickly and knows nothing of MPI.
"""

from __future__ import annotations

import contextlib
import importlib.util
import re
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np


@contextlib.contextmanager
def _own_ctrl_c() -> Iterator[None]:
    """Ctrl-C stays what it is, a KeyboardInterrupt usually, while gmsh would have it end Python at once."""
    handler = signal.getsignal(signal.SIGINT)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler if handler is not None else signal.SIG_DFL)


def _imported_when_used(name: str) -> Any:
    """Module that is loaded when one of its attributes is first used: gmsh takes a fifth of a second."""
    spec = importlib.util.find_spec(name) if name not in sys.modules else None
    if spec is None or spec.loader is None:
        return importlib.import_module(name)
    spec.loader = importlib.util.LazyLoader(spec.loader)
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


gmsh = _imported_when_used("gmsh")

_SIMPLEX = {2: "triangles", 3: "tetrahedra"}
_GMSH_SIMPLEX = {1: 1, 2: 2, 3: 4}  # dimension -> element type of the linear simplex in gmsh
REFUSED, TOO_LARGE = 3, 4
"""Exit codes of the process when the mesh cannot be used, the reason is on its standard error, and when it needs more memory."""


LAST_TAG = 2**31 - 1
"""gmsh and DOLFINx keep tags in 32 bits; of larger numbers gmsh keeps the low bits, which may be another group's tag"""


NO_REASON = "it gives no reason"
"""What stands for the reason of an error without one: newer versions of gmsh end so when they get no more memory"""


class MeshError(Exception):
    """A mesh that cannot be used; says why."""


@contextlib.contextmanager
def gmsh_session() -> Iterator[Any]:
    """gmsh, silent."""
    with _own_ctrl_c():
        gmsh.initialize(["gmsh", "-v", "0"], False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            yield gmsh.model
        finally:
            gmsh.finalize()


def gmsh_message(error: Exception) -> str:
    """Message of gmsh about an error, on one line."""
    return " ".join(str(error).split()) or gmsh.logger.getLastError() or NO_REASON


def read_file(path: Path, dim: int) -> dict[str, Any]:
    """Arrays of a file, see `model_arrays`; a .geo file is meshed."""
    if path.suffix.lower() == ".msh":
        _check_written_tags(path)
    with gmsh_session():
        try:
            gmsh.open(str(path))
            if path.suffix.lower() == ".geo":
                gmsh.model.mesh.generate(dim)
        except Exception as error:  # gmsh's Python interface raises nothing more special
            raise MeshError(f"gmsh cannot read it: {gmsh_message(error)}") from error
        return model_arrays(dim)


def _check_written_tags(path: Path) -> None:
    """Refuse a file in text form whose tags do not fit into 32 bits, by the line. Raises MeshError."""
    text = path.read_bytes()
    if re.match(rb"\s*\$MeshFormat\s+\S+\s+0\s", text) is None:
        return  # binary files have tags of 32 bits
    for name in (b"PhysicalNames", b"Entities", b"Elements"):
        begin = text.find(b"$" + name)
        end = text.find(b"$End" + name, begin) if begin >= 0 else begin
        for found in re.compile(rb"(?<!\S)-?\d{10,}(?!\S)").finditer(text, max(begin, 0), max(end, 0)):
            if abs(int(found.group())) > LAST_TAG:
                line = text.count(b"\n", 0, found.start()) + 1
                raise MeshError(f"line {line} has the number {found.group().decode()} in ${name.decode()}, expected tags from 1 "
                                f"to {LAST_TAG}")  # fmt: skip


def model_arrays(dim: int) -> dict[str, Any]:
    """The current model of gmsh: points (n, dim), cells (m, dim + 1), cell_values (m,), facets (k, dim), facet_values (k,).

    Cells and facets are rows of points. cell_names, facet_names: names of physical groups, with their numbers in
    cell_numbers, facet_numbers. Raises MeshError.
    """
    gmsh.model.mesh.removeDuplicateNodes()  # soils whose common border was drawn twice would fall apart
    cells, cell_values = _entities(dim)
    facets, facet_values = _entities(dim - 1, only_groups=True)
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    points = coordinates.reshape(-1, 3)
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise MeshError(f"node {tags[row]} is at {tuple(points[row].tolist())}, expected finite coordinates")
    if not np.isin(cells, tags).all():
        raise MeshError("has cells with nodes that are not there")
    if dim == 2 and np.ptp(points[np.isin(tags, cells), 2]) > 1e-9 * np.ptp(points):
        raise MeshError(
            "its nodes have different z, expected triangles in the plane z = 0; tetrahedra are read with dim=3"
        )
    order = np.argsort(tags)
    used = np.unique(cells)
    rows = order[np.searchsorted(tags, used, sorter=order)]
    inside = np.isin(facets, used).all(axis=1)
    return {
        "points": points[rows, :dim], "cells": np.searchsorted(used, cells), "cell_values": cell_values,
        "facets": np.searchsorted(used, facets[inside]), "facet_values": facet_values[inside],
        **_names("cell", dim), **_names("facet", dim - 1),
    }  # fmt: skip


def _names(kind: str, dim: int) -> Any:
    """Names of the physical groups of one dimension and their numbers."""
    named = [(gmsh.model.getPhysicalName(dim, tag), tag) for _, tag in gmsh.model.getPhysicalGroups(dim)]
    named = [(name, tag) for name, tag in named if name]
    return {
        f"{kind}_names": np.array([name for name, _ in named], dtype=np.str_),
        f"{kind}_numbers": np.array([tag for _, tag in named], dtype=np.int64),
    }


def _entities(dim: int, only_groups: bool = False) -> tuple[Any, ...]:
    """Node tags (m, dim + 1) and physical groups (m,) of the model's elements of one dimension."""
    groups = gmsh.model.getPhysicalGroups(dim)
    blocks = [(entity, tag) for _, tag in groups for entity in gmsh.model.getEntitiesForPhysicalGroup(dim, tag)]
    twice = len(blocks) != len({entity for entity, _ in blocks})
    if twice:
        raise MeshError(f"an entity of dimension {dim} is in two physical groups; a tag must be single")
    if not groups and not only_groups:
        blocks = [(entity, 0) for _, entity in gmsh.model.getEntities(dim)]
    wrong = [tag for _, tag in groups if not 1 <= tag <= LAST_TAG]
    if wrong:
        raise MeshError(
            f"a physical group of dimension {dim} has the tag {wrong[0]}, or one that gmsh turned into it; expected tags from 1 "
            f"to {LAST_TAG}"
        )
    nodes, values = [np.empty((0, dim + 1), np.int64)], [np.empty(0, np.int32)]
    for entity, tag in blocks:
        for kind, _, element_nodes in zip(*gmsh.model.mesh.getElements(dim, entity)):
            _check_element(kind, dim)
            nodes.append(np.asarray(element_nodes, dtype=np.int64).reshape(-1, dim + 1))
            values.append(np.full(len(nodes[-1]), tag, dtype=np.int32))
    if not only_groups:
        _check_cells(nodes, dim)
    return np.concatenate(nodes), np.concatenate(values)


def _check_element(kind: int, dim: int) -> None:
    if kind == _GMSH_SIMPLEX[dim]:
        return
    text, _, order, *_ = gmsh.model.mesh.getElementProperties(kind)
    if order > 1:
        raise MeshError(f"has elements of order {order} ({text}), expected straight ones (order 1)")
    expected = _SIMPLEX.get(dim, "lines")
    raise MeshError(f"has elements of type {text!r}, expected only {expected}")


def _check_cells(nodes: Any, dim: int) -> None:
    found = sum(len(block) for block in nodes)
    higher = dim == 2 and len(gmsh.model.mesh.getElements(3)[0]) > 0
    if higher:
        raise MeshError("has cells of dimension 3, but dim=2 was asked for")
    if not found:
        lower = dim == 3 and len(gmsh.model.mesh.getElements(2)[0]) > 0
        detail = ", its cells have dimension 2" if lower else ""
        raise MeshError(f"has no cells of dimension {dim}{detail}")
