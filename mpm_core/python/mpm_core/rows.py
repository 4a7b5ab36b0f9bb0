"""Rows of arrays between all ranks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray


def exchanged(comm: MPI.Comm, ranks: NDArray, rows: NDArray) -> tuple[NDArray, NDArray]:
    """Send each row to a rank; returns the rows that came, by rising rank and in the order of that rank, and their ranks.

    Args:
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


def answered(comm: MPI.Comm, ranks: NDArray, questions: NDArray, answer: Callable[[NDArray], NDArray]) -> NDArray:
    """Ask ranks questions, a row each; returns their answers, a row each, in the order of the questions.

    Args:
        ranks: whom to ask, shape (n,).
        questions: shape (n, k).
        answer: gives a row of answers to each row of questions.

    Note:
        Collective.
    """
    came, askers = exchanged(comm, ranks, questions)
    replies, _ = exchanged(comm, askers, answer(came))
    back = np.empty_like(replies)
    back[np.argsort(ranks, kind="stable")] = replies
    return back


def found(comm: MPI.Comm, numbers: NDArray, rows: NDArray, wanted: NDArray) -> tuple[NDArray, NDArray]:
    """Where things are, by their number over all ranks; rank (number mod size) keeps the directory.

    Args:
        numbers: of what this rank has, shape (n,). What several ranks have is found on the lowest of them.
        rows: of these things on this rank, shape (n,).
        wanted: numbers of the things to find, shape (m,).

    Returns:
        Ranks and rows of the wanted things, shape (m,) each; -1 for what no rank has.

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
        answer = np.full((len(asked), 2), -1)
        answer[there] = came[first[at[there]], 1:]
        return answer

    questions = wanted.astype(np.int64)[:, None]
    ranks, rows = answered(comm, questions[:, 0] % comm.size, questions, places).T
    return ranks, rows
