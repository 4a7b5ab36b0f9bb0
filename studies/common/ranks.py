"""Start and end of a study on any number of ranks."""

from __future__ import annotations

import errno
import io
import signal
import sys
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn

from mpi4py import MPI

from mpm_core import InputError, RunError

from .files import NOT_WRITTEN, PROGRAM, OutputError
from .option_words import in_options


def end_all_on_error(comm: MPI.Comm = MPI.COMM_WORLD) -> None:
    """Let an error that nothing catches end all ranks, with its message; otherwise they would wait for ever."""
    if comm.size == 1:
        return

    def end(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        print(f"error on rank {comm.rank}:", file=sys.stderr)
        traceback.print_exception(kind, error, trace)
        sys.stderr.flush()
        comm.Abort(1)

    sys.excepthook = end


def shown_once(show: Callable[..., None]) -> Callable[..., None]:
    """Let `warnings.showwarning` leave out what it has shown, also as a beginning: elements and particles warn alike."""
    texts: list[str] = []

    def show_new(text: Warning | str, *rest: Any, **more: Any) -> None:
        if not any(earlier.startswith(str(text)) for earlier in texts):
            texts.append(str(text))
            show(text, *rest, **more)

    return show_new


class _Unheard(io.FileIO):
    """A standard stream that stays one when its reader has ended: a closed pipe or terminal, to which text is lost."""

    def write(self, text: Any) -> int:
        try:
            return super().write(text)
        except OSError as error:
            if error.errno not in (errno.EPIPE, errno.EIO):
                raise
            return len(text)


def outlive_readers() -> None:
    """Let a run continue when the reader of its output has ended.

    In ``studies/run slope 2>&1 | tee log`` Ctrl-C ends tee, too, and what the study still prints must not keep it from
    writing its results.
    """
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # which Python does, but PETSc ends the program
    for name, number in (("stdout", 1), ("stderr", 2)):
        stream = getattr(sys, name)
        stream.flush()
        raw = io.BufferedWriter(_Unheard(number, "w", closefd=False))
        setattr(sys, name, io.TextIOWrapper(raw, stream.encoding, stream.errors, line_buffering=True))


def run_study(main: Callable[[], int], *expected: type[BaseException]) -> NoReturn:
    """Run a study's script and exit with what ``main`` returns.

    Args:
        main: the study. When it returns 0 but a picture or film could not be written, the code is 1, and the last lines say
            why.
        expected: errors whose message is all that the user needs, beside those of Talus; they end the script with code 2.
            Ctrl-C, where the study does not catch it by `Interrupt`, ends it with code 130.
    """
    comm, script = MPI.COMM_WORLD, Path(sys.argv[0])
    name = script.parent.name if script.stem == "__main__" else script.stem
    end_all_on_error(comm)
    outlive_readers()
    parser_of_study = getattr(sys.modules[main.__module__], "parser", lambda: None)
    # The place in the source does not help a user.
    warnings.formatwarning = lambda text, *_, **__: f"warning: {in_options(str(text), parser_of_study())}\n"
    warnings.showwarning = shown_once(warnings.showwarning)
    signal.signal(signal.SIGUSR1, signal.default_int_handler)  # by which `studies/run --ranks` hands Ctrl-C on
    try:
        code = main()
        for reason in NOT_WRITTEN:
            print(f"{PROGRAM} {name}: {reason}", file=sys.stderr)
        sys.exit(code or (1 if NOT_WRITTEN else 0))
    except (InputError, RunError, OutputError, *expected) as error:
        if comm.rank == 0:
            print(f"{PROGRAM} {name}: {in_options(str(error), parser_of_study())}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        print(f"\n{PROGRAM} {name}: interrupted", file=sys.stderr)
        if comm.size > 1:
            comm.Abort(128 + signal.SIGINT)
        sys.exit(128 + signal.SIGINT)
