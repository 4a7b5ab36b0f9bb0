"""Rows of arrays between all ranks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from . import _core


def exchange_rows(comm: MPI.Comm, ranks: NDArray, rows: NDArray) -> tuple[NDArray, NDArray]:
    """Send each row to a rank; returns the rows that came, by rising rank and in the order of that rank, and their ranks.

    Collective.

    Args:
        comm: the ranks that take part.
        ranks: where each row goes, shape (n,).
        rows: shape (n, k), of int64 or float64.
    """
    width, kind = rows.shape[1], rows.dtype.char
    sent = np.bincount(ranks, minlength=comm.size)
    received = np.empty_like(sent)
    comm.Alltoall(sent, received)
    came = np.empty((received.sum(), width), rows.dtype)
    packed = np.ascontiguousarray(rows[np.argsort(ranks, kind="stable")])
    comm.Alltoallv([packed, sent * width, kind], [came, received * width, kind])
    return came, np.repeat(np.arange(comm.size), received)


def request_rows(comm: MPI.Comm, ranks: NDArray, requests: NDArray, reply: Callable[[NDArray], NDArray]) -> NDArray:
    """Send each rank its requests, a row each; returns its replies, a row each, in the order of the requests. Collective.

    Args:
        comm: the ranks that take part.
        ranks: ranks that the requests go to, shape (n,).
        requests: shape (n, k).
        reply: function that returns a row for each row of requests.
    """
    came, senders = exchange_rows(comm, ranks, requests)
    replies, _ = exchange_rows(comm, senders, reply(came))
    back = np.empty_like(replies)
    back[np.argsort(ranks, kind="stable")] = replies
    return back


def find_items(comm: MPI.Comm, numbers: NDArray, rows: NDArray, wanted: NDArray) -> tuple[NDArray, NDArray]:
    """Find items by their global numbers; the core keeps the directory. Collective.

    Args:
        comm: the ranks that take part.
        numbers: global numbers of this rank's items, shape (n,). An item of several ranks is found on the lowest of them.
        rows: local rows of these items, shape (n,).
        wanted: global numbers of the items to find, shape (m,).

    Returns:
        Ranks and rows of these items, shape (m,) each; -1 for items that no rank has.
    """
    whole = (np.ascontiguousarray(one, np.int64) for one in (numbers, rows, wanted))
    ranks, places = _core.first_holders(*whole, MPI._addressof(comm)).T
    return ranks, places
