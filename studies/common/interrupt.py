"""Ctrl-C and SIGTERM end a run cleanly: the loop sees a flag, and the results so far are written.

So does SIGUSR1, which mpirun hands on to its ranks; `studies/run --ranks` turns Ctrl-C into it, since mpirun itself kills
its ranks a second after Ctrl-C.
"""

from __future__ import annotations

import signal
import sys
from types import FrameType

from mpi4py import MPI

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)


class Interrupt:
    """Catches the first of these signals while the context lasts; a second one ends the program at once.

    Example:
        >>> with Interrupt() as interrupt:
        ...     for report in model.explicit(until=10.0, every=0.1):
        ...         if interrupt.requested():
        ...             break
        >>> sys.exit(interrupt.exit_code)
    """

    def __init__(self, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        self._comm = comm
        self._signal = 0
        self._before: dict[int, object] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        self._signal = number
        self._restore()  # so that the next one has its usual effect
        if self._comm.rank == 0:
            print(
                "\ninterrupted: ending after this step and writing what there is; again to end at once", file=sys.stderr
            )

    def requested(self) -> bool:
        """Whether the run should end; true on all ranks once a signal came on any.

        Note:
            Collective.
        """
        self._signal = self._comm.allreduce(self._signal, op=MPI.MAX)
        return self._signal != 0

    @property
    def exit_code(self) -> int:
        """0, or 128 plus the signal's number, as shells have it."""
        return 128 + self._signal if self._signal else 0

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        self._before = {}

    def __enter__(self) -> Interrupt:
        self._before = {number: signal.signal(number, self._catch) for number in SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()
