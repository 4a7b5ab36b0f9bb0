"""Warnings about soil that fails in a run whose options do not suit it."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

from ._core import Integration
from .integration import integration_of
from .law_warnings import locks_at_failure

if TYPE_CHECKING:
    from .model import Model
    from .report import Report

YIELDS_ABOVE = 0.2
"""Plastic work over the energy at work above which a body counts as one that fails"""

BESIDE_AVERAGES = ", best together with integration=MIXED"
LOCKING = (
    "the soil fails, and its dilation angle is below its friction angle, so that its volume hardly changes; linear cells "
    "then overestimate the strength (volumetric locking), the more the coarser the mesh. Use nmd=True, which averages "
    f"volumetric strains{BESIDE_AVERAGES} (docs/howto/switches.md)"
)
GATHERING = (
    "the soil fails with nmd=True and integration=PARTICLES: particles gather in some cells, and the slide goes too far, the "
    "more the finer the mesh. Use integration=MIXED (docs/howto/switches.md)"
)


class FailureWatch:
    """Warns once where soil fails that the options of a run do not suit.

    Args:
        model: the model.
        options: the core's options of the scheme, with `nmd` and `integration`.
    """

    def __init__(self, model: Model, options: Any) -> None:
        self._warning = ""
        if not options.nmd and locks_at_failure(model.laws):
            mixed = options.integration == Integration.MIXED
            self._warning = LOCKING.replace(BESIDE_AVERAGES, "") if mixed else LOCKING
        elif (
            options.nmd and options.integration == Integration.PARTICLES and integration_of(model) == Integration.MIXED
        ):
            self._warning = GATHERING
        self._speaks = bool(self._warning) and model.comm.rank == 0

    def look(self, report: Report) -> None:
        """Warn if the soil has failed.

        Args:
            report: the state of the run.
        """
        if self._speaks and report.plastic_work > YIELDS_ABOVE * report.energy_scale > 0:
            self._speaks = False
            warnings.warn(self._warning, RuntimeWarning, stacklevel=5)
