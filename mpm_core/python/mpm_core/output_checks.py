"""Fields that output takes: what they must be, and what all ranks must agree on."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ._core import InputError
from .collective import collectively

Arrays = Mapping[str, np.ndarray]


def agreed(comm: MPI.Comm, check: Callable[[], Arrays]) -> tuple[dict[str, np.ndarray], list[int]]:
    """Arrays of all ranks by name, whole numbers as wide as any rank needs; and the rows of the first array on each rank.

    Raises:
        InputError: on all ranks: that of `check` on any rank, or names or components that are not the same on all.
    """
    arrays = dict(collectively(comm, check))
    shapes = [f"{name}:{'x'.join(map(str, values.shape[1:]))}" for name, values in arrays.items()]
    wide = {name for name, values in arrays.items() if values.dtype.kind == "i" and not _fits(values)}
    n = len(next(iter(arrays.values()), ()))
    names, counts, wides = zip(*comm.allgather((shapes, n, wide)))
    if any(other != shapes for other in names):
        raise InputError(f"fields are not the same on all ranks; here: {', '.join(shapes)}")
    for name, values in arrays.items():
        if values.dtype.kind == "i":
            arrays[name] = values.astype(np.int64 if any(name in wide for wide in wides) else np.int32, copy=False)
    return arrays, list(counts)


def _fits(values: NDArray[np.integer]) -> bool:
    """Whether whole numbers fit into 32 bits."""
    limits = np.iinfo(np.int32)
    return not values.size or bool(limits.min <= values.min() and values.max() <= limits.max)


def narrowest(largest: int) -> type[np.int32] | type[np.int64]:
    return np.int64 if largest > np.iinfo(np.int32).max else np.int32


def _numeric(name: str, values: np.ndarray) -> np.ndarray:
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise InputError(f"{name} has dtype {array.dtype}, expected numbers")
    if array.ndim not in (1, 2):
        raise InputError(f"{name} has shape {array.shape}, expected (n,) or (n, k)")
    return array


def _checked_name(name: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9_-]+", name):
        raise InputError(f"name of a field is '{name}', expected letters, digits, _ and -")
    return name


def _checked_fields(fields: Arrays, n: int) -> dict[str, np.ndarray]:
    """Arrays of n rows by name; all whole numbers of one component signed."""
    arrays = {_checked_name(name): _numeric(name, values) for name, values in fields.items()}
    for name, values in arrays.items():
        if values.ndim == 2 and values.shape[1] < 1:
            raise InputError(f"{name} has 0 components, expected at least 1")
        if len(values) != n:
            raise InputError(f"{name} has {len(values)} rows, expected {n}")
        if values.dtype.kind in "ub":
            arrays[name] = values.astype(np.int64)
        elif values.dtype.kind == "i" and values.ndim == 2:
            arrays[name] = values.astype(np.float64)
    return arrays


def real_fields(fields: Arrays, n: int) -> dict[str, np.ndarray]:
    return {name: values.astype(np.float64, copy=False) for name, values in _checked_fields(fields, n).items()}


def particle_fields(fields: Arrays) -> dict[str, np.ndarray]:
    """The fields of particles, the position first."""
    if "position" not in fields:
        raise InputError(f"fields are {', '.join(fields) or 'none'}, expected 'position' among them")
    position = _numeric("position", fields["position"])
    if position.ndim != 2 or position.shape[1] not in (2, 3):
        raise InputError(f"position has shape {position.shape}, expected (n, 2) or (n, 3)")
    others = {name: values for name, values in fields.items() if name != "position"}
    return {"position": position, **_checked_fields(others, len(position))}


def moved_points(points: np.ndarray | None, n: int, dim: int) -> dict[str, np.ndarray]:
    """The positions of nodes that have moved, by the name ``points``; nothing for None."""
    if points is None:
        return {}
    if np.shape(points) != (n, dim):
        raise InputError(f"points has shape {np.shape(points)}, expected ({n}, {dim})")
    return real_fields({"points": points}, n)


def type_of_positions(comm: MPI.Comm, points: np.ndarray, real: np.dtype) -> np.dtype:
    """The type in which positions are stored. Collective.

    Double precision where single precision does not resolve a hundred-thousandth of their extent: coordinates of a map, such as
    UTM, are known to half a metre by it.

    Args:
        comm: the ranks that have positions.
        points: of this rank (n, D) [m].
        real: the type of other real numbers.
    """
    points = points.astype(np.float64, copy=False)
    corners = np.concatenate([-points.min(axis=0, initial=np.inf), points.max(axis=0, initial=-np.inf)])
    comm.Allreduce(MPI.IN_PLACE, corners, MPI.MAX)
    highest, lowest = corners[points.shape[1] :], -corners[: points.shape[1]]
    extent, farthest = np.max(highest - lowest), np.abs(corners).max()
    return np.dtype(np.float64) if farthest * np.finfo(np.float32).eps / 2 > 1e-5 * extent > 0 else real


def checked_mesh(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = np.asarray(points)
    cells = np.asarray(cells)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"points has shape {points.shape}, expected (n, 2) or (n, 3)")
    if cells.ndim != 2 or cells.shape[1] != points.shape[1] + 1 or cells.dtype.kind not in "iu":
        raise InputError(
            f"cells has shape {cells.shape} and dtype {cells.dtype}, expected (m, {points.shape[1] + 1}) whole numbers"
        )
    if cells.size and not 0 <= cells.min() <= cells.max() < len(points):
        raise InputError(
            f"cells has node {max(cells.max(), -cells.min())}, expected numbers from 0 to {len(points) - 1}"
        )
    return np.ascontiguousarray(points, np.float64), np.ascontiguousarray(cells, np.int64)
