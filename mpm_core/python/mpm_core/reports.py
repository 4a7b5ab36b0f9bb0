"""Iteration over the reports of a run, with a progress bar where one is wanted."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import TYPE_CHECKING, Generic, TypeVar

from .report import Report

if TYPE_CHECKING:
    from .model import Model

R = TypeVar("R", bound=Report)


class Reports(Generic[R]):
    """Iterator over the reports of a run; each request continues the run up to the next one.

    Example:
        >>> for report in model.explicit(until=2.0, every=0.5):
        ...     print(report.time)
        >>> report = model.explicit(until=4.0).last()
        >>> for report in model.explicit(until=6.0, every=0.1).with_progress():
        ...     pass

    A run whose reports are not requested makes no step; a RuntimeWarning says so.
    """

    def __init__(self, steps: Iterator[R], scheme: str, model: Model, until: float) -> None:
        self._steps, self._scheme, self._begun = steps, scheme, False
        self._model, self._until = model, until

    def __repr__(self) -> str:
        return (
            f"<Reports: Model.{self._scheme} from t = {self._model.time:g} s to {self._until:g} s; "
            "iterate over it, or call last()>"
        )

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

    def with_progress(self) -> Iterator[R]:
        """The same reports, with a bar of simulated time on the first rank: in a notebook its own, elsewhere on the terminal.

        Raises:
            ImportError: tqdm is not installed.
        """
        from tqdm.auto import tqdm

        form = "{desc}: {percentage:3.0f}% |{bar}| {n:.4g}/{total:.4g} s [{elapsed} < {remaining}]"
        shown = self._model.comm.rank == 0
        with tqdm(
            total=self._until, initial=self._model.time, desc=self._scheme, bar_format=form, disable=not shown
        ) as bar:
            for report in self:
                bar.update(report.time - bar.n)
                yield report

    def __del__(self) -> None:
        if not getattr(self, "_begun", True):
            warnings.warn(
                f"Model.{self._scheme}(...) made no step, because its reports were not requested: write "
                f"`for report in model.{self._scheme}(...)`, or model.{self._scheme}(...).last() to run to the end",
                RuntimeWarning,
                stacklevel=2,
            )
