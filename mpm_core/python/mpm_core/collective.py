"""Errors that are raised on all ranks alike."""

import hashlib
import os
from collections.abc import Callable
from typing import TypeVar

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ._core import InputError, RunError

T = TypeVar("T")


def collectively(comm: MPI.Comm, work: Callable[[], T], kind: type[Exception] = InputError) -> T:
    """Run ``work`` on each rank. An error of one rank is raised on all of them, so that no rank waits for another.

    Raises:
        kind: that of the lowest rank with an error; where the errors differ the message names the rank.
    """
    error: str | None = None
    result = None
    try:
        result = work()
    except kind as exc:
        error = str(exc)
    if comm.size == 1:
        if error is not None:
            raise kind(error)
        return result  # type: ignore[return-value]
    errors = comm.allgather(error)
    for rank, message in enumerate(errors):
        if message is not None:
            alike = all(other == message for other in errors)
            raise kind(message if alike else f"{message} (on rank {rank})")
    return result  # type: ignore[return-value]


def on_first_rank(comm: MPI.Comm, work: Callable[[], T], kind: type[Exception] = InputError) -> T | None:
    """Run ``work`` on the first rank only.

    Returns:
        Its result on the first rank, None on the others.

    Raises:
        kind: on all ranks, with the message of the error of that kind that ``work`` raised.
    """
    result, failure = None, None
    if comm.rank == 0:
        try:
            result = work()
        except kind as error:
            failure = str(error)
    failure = comm.bcast(failure)
    if failure is not None:
        raise kind(failure)
    return result


def written(path: str | os.PathLike[str], work: Callable[[], T]) -> T:
    """Run ``work``, which writes a file.

    Raises:
        RunError: with the path of the error, or the given one, and the reason why the system refused.
    """
    try:
        return work()
    except OSError as error:
        raise RunError(f"cannot write {error.filename or os.fspath(path)}: {error.strerror}") from None


def write_on_first_rank(comm: MPI.Comm, path: str | os.PathLike[str], work: Callable[[], object]) -> None:
    """Run ``work``, which writes a file, on the first rank.

    Raises:
        RunError: on all ranks, as of `written`.
    """
    on_first_rank(comm, lambda: written(path, work), RunError)


def check_same_path(comm: MPI.Comm, path: str | os.PathLike[str]) -> None:
    """Check that all ranks mean the same file: the first rank writes, and would not see another rank's mistake.

    Raises:
        InputError: on all ranks: the paths differ.
    """
    paths = [os.fspath(one) for one in comm.allgather(path)]
    other = next((rank for rank, one in enumerate(paths) if one != paths[0]), None)
    if other is not None:
        raise InputError(f"path is not the same on all ranks: {paths[0]} on rank 0, {paths[other]} on rank {other}")


def require_same(comm: MPI.Comm, name: str, array: NDArray[np.generic]) -> None:
    """Check that all ranks give the same array, of which each takes its part.

    Args:
        name: of the argument.
        array: what it is on this rank.

    Raises:
        InputError: on all ranks: the arrays differ.
    """
    if comm.size == 1:
        return
    digest = hashlib.blake2b(np.ascontiguousarray(array).tobytes(), digest_size=16).hexdigest()
    given = comm.allgather((array.shape, array.dtype.str, digest))
    other = next((rank for rank, one in enumerate(given) if one != given[0]), None)
    if other is not None:
        raise InputError(
            f"{name} are not the same on all ranks, with shape {given[0][0]} on rank 0 and {given[other][0]} on rank {other}, "
            "expected all of them on every rank"
        )
