"""Progress of a run: a bar on a terminal, elsewhere a line from time to time."""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Iterator, Sequence
from typing import TypeVar

from mpi4py import MPI
from tqdm import tqdm

T = TypeVar("T")


class Progress:
    """Shows simulated time, time left, step rate and chosen quantities; a context manager. The first rank shows it.

    Example:
        >>> with Progress("sliding", until=34.8) as progress:
        ...     progress.show(time=0.1, steps=12, crest="0.01 m")

    Args:
        title: of what is running.
        until: simulated time at the end, s.
        pause: wall time between two lines where there is no terminal, s.
        unit: in which simulated times are given and shown.
        counted: what the rate counts.
    """

    def __init__(
        self, title: str, until: float, comm: MPI.Comm = MPI.COMM_WORLD, pause: float = 10.0, unit: str = "s",
        counted: str = "steps",
    ) -> None:  # fmt: skip
        self._title, self._unit, self._counted = title, unit, counted
        self._until = until
        self._shown = comm.rank == 0
        self._pause = pause
        self._start = self._last_line = clock.monotonic()
        self._bar = None
        self._last = ""
        if self._shown and sys.stderr.isatty():
            form = (
                f"{{desc}}: {{percentage:3.0f}}% |{{bar}}| {{n:.4g}}/{{total:.4g}} {unit} "
                "[{elapsed} < {remaining}{postfix}]"
            )
            self._bar = tqdm(total=until, desc=title, bar_format=form, file=sys.stderr, dynamic_ncols=True, leave=True)

    def show(self, time: float, steps: int, **quantities: str) -> None:
        """Report the state.

        Args:
            time: simulated, s.
            steps: made since the start.
            quantities: texts with units, by name.
        """
        if not self._shown:
            return
        elapsed = max(clock.monotonic() - self._start, 1e-9)
        facts = [f"{steps / elapsed:.4g} {self._counted}/s", *(f"{name} {text}" for name, text in quantities.items())]
        if self._bar is not None:
            self._bar.n = min(time, self._until)
            self._bar.set_postfix_str(", ".join(facts))
            return
        left = elapsed * (self._until - time) / time if time > 0 else float("nan")
        self._last = (
            f"{self._title}: {time:.4g} of {self._until:.4g} {self._unit}, {_duration(left)} left, {', '.join(facts)}"
        )
        if clock.monotonic() - self._last_line >= self._pause:
            self._print_last()

    def _print_last(self) -> None:
        self._last_line = clock.monotonic()
        if self._last:
            print(self._last, file=sys.stderr, flush=True)
        self._last = ""

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
        elif self._shown:
            self._print_last()


def counted(title: str, items: Sequence[T]) -> Iterator[T]:
    """Passes items on one by one, with a bar on a terminal, elsewhere with one line; for the first rank."""
    if items and not sys.stderr.isatty():
        print(f"{title}: {len(items)}", file=sys.stderr, flush=True)
    form = "{desc}: {percentage:3.0f}% |{bar}| {n}/{total} [{elapsed} < {remaining}]"
    yield from tqdm(
        items,
        desc=title,
        bar_format=form,
        file=sys.stderr,
        dynamic_ncols=True,
        disable=not (items and sys.stderr.isatty()),
    )


def _duration(seconds: float) -> str:
    if not seconds < 1e7:
        return "unknown time"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
