"""Errors that are raised on all ranks alike."""

from collections.abc import Callable
from typing import TypeVar

from mpi4py import MPI

from ._core import InputError

T = TypeVar("T")


def collectively(comm: MPI.Comm, work: Callable[[], T]) -> T:
    """Run ``work`` on each rank. An error of one rank is raised on all of them, so that no rank waits for another.

    Raises:
        InputError: that of the lowest rank with an error; on several ranks the message names the rank.
    """
    error: str | None = None
    result = None
    try:
        result = work()
    except InputError as exc:
        error = str(exc)
    if comm.size == 1:
        if error is not None:
            raise InputError(error)
        return result  # type: ignore[return-value]
    errors = comm.allgather(error)
    for rank, message in enumerate(errors):
        if message is not None:
            alike = all(other == message for other in errors)
            raise InputError(message if alike else f"{message} (on rank {rank})")
    return result  # type: ignore[return-value]
