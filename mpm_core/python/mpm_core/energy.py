"""Check of the energy balance of a run: a warning where it is not closed, and an error where the gap is large."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

from ._core import InputError, RunError
from .report import Report

WARN_ABOVE = 0.01
"""Unexplained fraction of the energy above which there is a warning"""


LEAST_STEPS = 32
"""Steps of a model before its energy is checked: in the first steps half a time step is a large part of it"""


class EnergyWarning(RuntimeWarning):
    """The energy balance of a run is not closed; see docs/energy.md."""


@dataclass
class EnergyWatch:
    """Checks the energy in the reports of a run.

    Args:
        limit: `Report.unexplained_fraction` at which the run ends with an error; None for none.
        speaks: whether this rank issues the warning.
    """

    limit: float | None
    speaks: bool
    warned: float = WARN_ABOVE

    def look(self, report: Report) -> None:
        """Warn when the unexplained part has passed 1 %, and again each time it has grown tenfold.

        Raises:
            RunError: it has passed the limit.
        """
        if report.steps < LEAST_STEPS:
            return
        fraction = abs(report.unexplained_fraction)
        if self.limit is not None and fraction > self.limit:
            raise RunError(f"{_said(report)}, above energy_limit, {100 * self.limit:g} %; {_ADVICE}")
        if fraction > self.warned:
            self.warned = 10 * fraction
            if self.speaks:
                warnings.warn(f"{_said(report)}; {_ADVICE}", EnergyWarning, stacklevel=4)


_ADVICE = (
    "particles that cross cells and too long steps do this: docs/energy.md says what each choice of " "scheme costs"
)


def _said(report: Report) -> str:
    part = 100 * report.unexplained_fraction
    verb = "was lost" if part > 0 else "came from nothing"
    return (
        f"at t = {report.time:.6g} s {abs(part):.3g} % of the energy at work {verb}: "
        f"{abs(report.unexplained_energy):.4g} J of {report.energy_scale:.4g} J"
    )


def energy_limit(limit: float | None) -> float | None:
    """Check the energy limit that a caller gives.

    Raises:
        InputError: it is neither None nor a number above 0.01.
    """
    if limit is not None and not limit > WARN_ABOVE:
        raise InputError(f"energy_limit is {limit}, expected None or a number above {WARN_ABOVE}")
    return limit
