"""Errors of the bridge that are raised on all ranks alike."""

from __future__ import annotations

from mpm_core import InputError

__all__ = ["InputError", "agree", "on_root"]


def agree(comm, message):
    """Raise `InputError` on all ranks if any rank gives a message; None means no error.

    The message of the lowest rank that gives one is raised. Collective: call it before communication that would
    hang or crash if one rank had left.
    """
    first = next((text for text in comm.allgather(message) if text is not None), None)
    if first is not None:
        raise InputError(first)


def on_root(comm, task):
    """Result of `task()` on rank 0 and None elsewhere; its `InputError` reaches every rank. Collective."""
    result, message = None, None
    if comm.rank == 0:
        try:
            result = task()
        except InputError as error:
            message = str(error)
    agree(comm, message)
    return result
