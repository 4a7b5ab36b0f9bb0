"""Errors of the bridge that are raised on all ranks alike."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI

from mpm_core import InputError

__all__ = ["InputError", "agree", "is_finite"]


def agree(comm: MPI.Comm, message: str | None) -> None:
    """Raise an error on all ranks if there is one on any. Collective.

    Call it before communication that would hang or crash if one rank had left.

    Args:
        comm: the ranks.
        message: what is wrong on this rank; None means no error.

    Raises:
        InputError: with the message of the lowest rank that gives one.
    """
    first = next((text for text in comm.allgather(message) if text is not None), None)
    if first is not None:
        raise InputError(first)


def is_finite(value: Any) -> bool:
    """Whether a value is a number, and a finite one."""
    return isinstance(value, (int, float, np.number)) and bool(np.isfinite(value))
