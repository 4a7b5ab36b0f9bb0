"""Iteration over the reports of a run."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Generic, TypeVar

R = TypeVar("R")


class Reports(Generic[R]):
    """Iterator over the reports of a run; each request continues the run up to the next one.

    Example:
        >>> for report in model.explicit(until=2.0, every=0.5):
        ...     print(report.time)
        >>> report = model.explicit(until=4.0).last()

    A run whose reports are not requested makes no step; a RuntimeWarning says so.
    """

    def __init__(self, steps: Iterator[R], scheme: str) -> None:
        self._steps, self._scheme, self._begun = steps, scheme, False

    def __iter__(self) -> Reports[R]:
        return self

    def __next__(self) -> R:
        self._begun = True
        return next(self._steps)

    def last(self) -> R | None:
        """Run to the end. Returns the last report; None when the time was reached before."""
        report: R | None = None
        for each in self:
            report = each
        return report

    def __del__(self) -> None:
        if not getattr(self, "_begun", True):
            warnings.warn(
                f"Model.{self._scheme}(...) made no step, since nothing asked for its reports: write "
                f"`for report in model.{self._scheme}(...)`, or model.{self._scheme}(...).last() to run to the end",
                RuntimeWarning,
                stacklevel=2,
            )
