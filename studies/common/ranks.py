"""How a study starts and ends, on any number of ranks."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import NoReturn

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


def run_study(main: Callable[[], int], *expected: type[BaseException]) -> NoReturn:
    """Run a study's script and exit with what ``main`` returns.

    Args:
        main: the study.
        expected: errors whose message is all that the user needs; they end the script with code 2.
    """
    comm = MPI.COMM_WORLD
    end_all_on_error(comm)
    try:
        sys.exit(main())
    except expected as error:
        if comm.rank == 0:
            print(f"studies/run {Path(sys.argv[0]).stem}: {error}", file=sys.stderr)
        sys.exit(2)
