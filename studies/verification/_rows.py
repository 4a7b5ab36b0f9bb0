"""The history of a study that a case runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from common.body_runs import scheme

import mpm_core as mpm


class Rows:
    """The columns of a history, without a file."""

    def __init__(self) -> None:
        self.rows: list[dict[str, float]] = []

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, column: str) -> np.ndarray:
        return np.array([row[column] for row in self.rows])


def followed(a: Any, model: mpm.Model, until: float, every: float, row: Callable[..., dict[str, float]]) -> Rows:
    """The rows of a study in which a rigid body moves, whose body is the first contact of the model."""
    rows = Rows()
    body = model.contacts[0]
    rows.rows.append(row(a, body, rows, model.report()))
    for report in model.explicit(until, every=every, **scheme(a)):
        rows.rows.append(row(a, body, rows, report))
    return rows
