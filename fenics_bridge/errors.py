"""Errors of the bridge that are raised on all ranks alike."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from mpi4py import MPI

from mpm_core import InputError

T = TypeVar("T")

__all__ = ["InputError", "agree", "is_finite", "on_root"]


def agree(comm: MPI.Comm, message: str | None) -> None:
    """Raise an error on all ranks if there is one on any.

    Call it before communication that would hang or crash if one rank had left.

    Args:
        comm: the ranks.
        message: what is wrong on this rank; None means no error.

    Raises:
        InputError: with the message of the lowest rank that gives one.

    Note:
        Collective.
    """
    first = next((text for text in comm.allgather(message) if text is not None), None)
    if first is not None:
        raise InputError(first)


def on_root(comm: MPI.Comm, task: Callable[[], T]) -> T | None:
    """Carry out a task on rank 0; its `InputError` reaches every rank.

    Args:
        comm: the ranks.
        task: function without arguments.

    Returns:
        The result on rank 0, None elsewhere.

    Note:
        Collective.
    """
    result, message = None, None
    if comm.rank == 0:
        try:
            result = task()
        except InputError as error:
            message = str(error)
    agree(comm, message)
    return result


def is_finite(value: Any) -> bool:
    """Whether a value is a number, and a finite one."""
    return isinstance(value, (int, float, np.number)) and bool(np.isfinite(value))
