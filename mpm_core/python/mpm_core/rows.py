"""Rows of arrays between all ranks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray


def exchanged(comm: MPI.Comm, ranks: NDArray, rows: NDArray) -> tuple[NDArray, NDArray]:
    """Send each row to a rank; returns the rows that came, by rising rank and in the order of that rank, and their ranks.

    Args:
        comm: the ranks that take part.
        ranks: where each row goes, shape (n,).
        rows: shape (n, k), of int64 or float64.

    Note:
        Collective.
    """
    width, kind = rows.shape[1], rows.dtype.char
    sent = np.bincount(ranks, minlength=comm.size)
    received = np.empty_like(sent)
    comm.Alltoall(sent, received)
    came = np.empty((received.sum(), width), rows.dtype)
    packed = np.ascontiguousarray(rows[np.argsort(ranks, kind="stable")])
    comm.Alltoallv([packed, sent * width, kind], [came, received * width, kind])
    return came, np.repeat(np.arange(comm.size), received)


def requested(comm: MPI.Comm, ranks: NDArray, requests: NDArray, reply: Callable[[NDArray], NDArray]) -> NDArray:
    """Send each rank its requests, a row each; returns its replies, a row each, in the order of the requests.

    Args:
        comm: the ranks that take part.
        ranks: ranks that the requests go to, shape (n,).
        requests: shape (n, k).
        reply: function that returns a row for each row of requests.

    Note:
        Collective.
    """
    came, senders = exchanged(comm, ranks, requests)
    replies, _ = exchanged(comm, senders, reply(came))
    back = np.empty_like(replies)
    back[np.argsort(ranks, kind="stable")] = replies
    return back


def found(comm: MPI.Comm, numbers: NDArray, rows: NDArray, wanted: NDArray) -> tuple[NDArray, NDArray]:
    """Find items by their global numbers; rank (number mod size) keeps the directory.

    Args:
        comm: the ranks that take part.
        numbers: global numbers of this rank's items, shape (n,). An item of several ranks is found on the lowest of them.
        rows: local rows of these items, shape (n,).
        wanted: global numbers of the items to find, shape (m,).

    Returns:
        Ranks and rows of these items, shape (m,) each; -1 for items that no rank has.

    Note:
        Collective.
    """
    entries = np.column_stack([numbers, np.full(len(numbers), comm.rank), rows]).astype(np.int64)
    came, _ = exchanged(comm, entries[:, 0] % comm.size, entries)
    known, first = np.unique(came[:, 0], return_index=True)

    def places(asked: NDArray) -> NDArray:
        at = np.searchsorted(known, asked[:, 0])
        there = np.flatnonzero(at < len(known))
        there = there[known[at[there]] == asked[there, 0]]
        reply = np.full((len(asked), 2), -1)
        reply[there] = came[first[at[there]], 1:]
        return reply

    requests = wanted.astype(np.int64)[:, None]
    ranks, rows = requested(comm, requests[:, 0] % comm.size, requests, places).T
    return ranks, rows
