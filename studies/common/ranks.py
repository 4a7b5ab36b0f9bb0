"""Errors on one of several ranks."""

from __future__ import annotations

import sys
import traceback
from types import TracebackType

from mpi4py import MPI


def end_all_on_error(comm: MPI.Comm = MPI.COMM_WORLD) -> None:
    """From now on an error that nothing catches ends all ranks, with its message; otherwise they would wait for ever."""
    if comm.size == 1:
        return

    def end(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        print(f"error on rank {comm.rank}:", file=sys.stderr)
        traceback.print_exception(kind, error, trace)
        sys.stderr.flush()
        comm.Abort(1)

    sys.excepthook = end
