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


def carried(comm: MPI.Comm, numbers: NDArray, values: NDArray, wanted: NDArray) -> NDArray:
    """Values by number, from whatever rank has them; rank (number mod size) keeps the directory.

    Args:
        numbers: of this rank's values over all ranks, shape (n,); a number that several ranks give has the same value on all.
        values: shape (n, k).
        wanted: numbers of the values to get, shape (m,); each must be given by some rank.

    Note:
        Collective.
    """
    came, _ = exchanged(comm, numbers % comm.size, np.column_stack([numbers.astype(np.float64), values]))
    known, first = np.unique(came[:, 0], return_index=True)
    kept = came[first, 1:]
    return answered(comm, wanted % comm.size, wanted[:, None].astype(np.float64),
                    lambda asked: kept[np.searchsorted(known, asked[:, 0])])  # fmt: skip
