"""Warnings that a study does not show, because it chose what they warn of or says itself what they say."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

NOT_REACHED = "the load was not reached"
"""Beginning of the warning of finite elements that found no equilibrium"""
GATHERS = "the soil fails with nmd=True and integration=PARTICLES"
"""Beginning of the warning that mixed integration suits a slide better. Beside bodies that move soil it does not: soil that is pushed
up fills cells in part, and mixed integration then generates energy (docs/contact_studies.md), which sums over particles do not."""
LOCKS = "linear (cells|elements)|the soil fails, and its dilation angle"
"""Beginnings of the warnings of linear cells and elements that lock"""


@contextmanager
def without_warning(*beginnings: str) -> Iterator[None]:
    """Leave out warnings that begin so; also as a decorator.

    Args:
        beginnings: regular expressions.
    """
    with warnings.catch_warnings():
        for beginning in beginnings:
            warnings.filterwarnings("ignore", beginning)
        yield
