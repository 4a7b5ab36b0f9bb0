"""Ctrl-C and SIGTERM end a run cleanly: the loop sees a flag, and the results so far are written.

So does the end of the terminal (SIGHUP), unless nohup keeps it away, and what schedulers send before the time is up: SIGUSR1,
which mpirun hands on to its ranks, SIGUSR2 and SIGXCPU. `studies/run --ranks` turns the others into SIGUSR1, since mpirun
itself kills its ranks a second after Ctrl-C.
"""

from __future__ import annotations

import contextlib
import os
import signal
import time
from types import FrameType

from mpi4py import MPI

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1, signal.SIGUSR2, signal.SIGXCPU, signal.SIGHUP)
AGAIN = 3.0
"""Seconds after which a second signal is one of its own.

A scheduler signals the ranks, mpirun and its shell, and each passes it on.
"""


class Interrupt:
    """Catches the first of these signals while the context lasts. `AGAIN` seconds later and more, another Ctrl-C or SIGTERM ends
    the program at once.

    Example:
        >>> with Interrupt() as interrupt:
        ...     for report in model.explicit(until=10.0, every=0.1):
        ...         if interrupt.requested():
        ...             break
        >>> sys.exit(interrupt.exit_code)
    """

    def __init__(self, comm: MPI.Comm = MPI.COMM_WORLD) -> None:
        self._comm = comm
        # Set by the handler alone: were the exchange to set it too, a signal that comes in its middle would be lost.
        self._caught = 0
        self._when = 0.0
        self._agreed = 0  # what came on any rank, as far as all know of it
        self._before: dict[int, object] = {}

    def _catch(self, number: int, _: FrameType | None) -> None:
        if self._caught:
            if number in (signal.SIGINT, signal.SIGTERM) and time.monotonic() - self._when > AGAIN:
                self._restore()
                os.kill(os.getpid(), number)
            return
        self._caught, self._when = number, time.monotonic()
        if self._comm.rank == 0:
            # Past Python's buffer, which the signal may have found half-way through another line.
            text = "ending after this step and writing what there is; again, some seconds later, to end at once"
            with contextlib.suppress(OSError):
                os.write(2, f"\ninterrupted: {text}\n".encode())

    def requested(self) -> bool:
        """Whether the run should end; true on all ranks once a signal came on any. Collective."""
        self._agreed = self._comm.allreduce(self._caught, op=MPI.MAX)
        return self._agreed != 0

    @property
    def exit_code(self) -> int:
        """0, or 128 plus the signal's number, as shells have it."""
        number = max(self._caught, self._agreed)
        return 128 + number if number else 0

    def _restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)  # type: ignore[arg-type]
        self._before = {}

    def __enter__(self) -> Interrupt:
        nohup = signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
        caught = [number for number in SIGNALS if not (nohup and number == signal.SIGHUP)]
        self._before = {number: signal.signal(number, self._catch) for number in caught}
        return self

    def __exit__(self, *_: object) -> None:
        self._restore()
