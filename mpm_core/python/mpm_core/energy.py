"""Check of the energy balance of a run: a warning where it is not closed, and an error where the gap is large."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

from ._core import InputError, Integration, RunError
from .report import Report

WARN_ABOVE = 0.01
"""Unexplained fraction of the energy above which there is a warning"""

NOISE_ABOVE = 0.1
"""Fraction of the energy at work in motion of the particles against their nodes above which there is a warning"""

PIC_ABOVE = 0.1
"""Fraction of the energy at work that a PIC fraction has dissipated above which there is a warning, where soil flows"""

LEAST_STEPS = 32
"""Steps of a model before its energy is checked: in the first explicit steps half a time step is a large part of it"""


_CAUSES = "cell crossings and too long steps are the usual causes"
ADVICE = f"{_CAUSES}; docs/energy.md has the error of each scheme"
"""Advice for runs with unexplained energy"""

ADVICE_FOR = {
    Integration.PARTICLES: f"{_CAUSES}; integration=MIXED closes the balance in soil with cohesion (docs/howto/switches.md)",
    Integration.MIXED: "with mixed integration the usual causes are few particles in a cell, bodies that bend and soil that comes "
    "apart; more particles in a cell or integration=PARTICLES help, and in bodies that bend moving_cells=True (docs/integration.md)",
}
"""Advice for explicit runs, by the integration of stresses; for others see `ADVICE`"""


class EnergyWarning(RuntimeWarning):
    """The energy balance of a run is not closed; see docs/energy.md."""


@dataclass
class EnergyWatch:
    """Checks the energy in the reports of a run.

    Args:
        limit: unexplained energy over the largest energy at work so far, at which the run ends with an error; None for none.
        speaks: whether this rank issues the warning.
        advice: what its text ends with, of energy that was generated (True) or dissipated; called on all ranks alike.
        least_steps: steps of a model before its energy is checked.
        noisy: leave out the warning of motion against the nodes, as where particles do not cross cells, or have no such motion.
        damped: leave out the warning of dissipation by a PIC fraction, as where there is none.
    """

    limit: float | None
    speaks: bool
    advice: Callable[[bool], str] = lambda generated: ADVICE
    least_steps: int = LEAST_STEPS
    warned: float = WARN_ABOVE
    noisy: bool = False
    damped: bool = False
    largest: float = 0.0  # of the energies at work so far: a body that swings back has little of it

    def look(self, report: Report) -> None:
        """Warn when the unexplained part has passed 1 %, and again each time it has grown tenfold.

        Warn once, too, when motion of the particles relative to their nodes has more than a tenth of the energy and a third of
        the kinetic energy, and when a PIC fraction has dissipated more than a tenth of the energy of soil that flows.

        Args:
            report: the state of the run.

        Raises:
            RunError: it has passed the limit.
        """
        if report.steps < self.least_steps:
            return
        self.largest = max(self.largest, report.energy_scale)
        fraction = abs(report.unexplained_energy) / self.largest if self.largest > 0 else 0.0
        generated = report.unexplained_energy < 0
        if self.limit is not None and fraction > self.limit:
            raise RunError(
                f"{_said(report, self.largest)}, above energy_limit, {100 * self.limit:g} %; {self.advice(generated)}"
            )
        if fraction > self.warned:
            self.warned, advice = 10 * fraction, self.advice(generated)
            if self.speaks:
                warnings.warn(f"{_said(report, self.largest)}; {advice}", EnergyWarning, stacklevel=4)
        if not self.noisy and _is_noisy(report, self.largest):
            self.noisy = True
            if self.speaks:
                warnings.warn(_noise(report, self.largest), EnergyWarning, stacklevel=4)
        flows = report.plastic_work > PIC_ABOVE * self.largest  # soil that comes to rest under its weight may be damped
        if not self.damped and flows and report.pic_loss > PIC_ABOVE * self.largest:
            self.damped = True
            if self.speaks:
                warnings.warn(_damping(report, self.largest), EnergyWarning, stacklevel=4)


def _against_nodes(report: Report) -> float:
    return report.kinetic_energy - report.nodal_kinetic_energy


def _is_noisy(report: Report, energy: float) -> bool:
    """Whether motion against the nodes has much of the energy, and more than a smooth motion has between coarse nodes."""
    noise = _against_nodes(report)
    return noise > NOISE_ABOVE * energy and noise > report.kinetic_energy / 3


def _noise(report: Report, energy: float) -> str:
    fraction = 100 * _against_nodes(report) / energy
    return (
        f"at t = {report.time:.6g} s {fraction:.3g} % of the energy at work is motion of the particles against their nodes, "
        "which the noise of cell crossings excites. A body in tension or bending then sags and does not give its strain energy "
        "back: use moving_cells=True, with which no particle crosses, or more particles per cell (24 in triangles; docs/integration.md)"
    )


def _damping(report: Report, energy: float) -> str:
    return (
        f"at t = {report.time:.6g} s the PIC fraction has dissipated {100 * report.pic_loss / energy:.3g} % of the energy at work, as a "
        "viscosity of the soil would, which shortens run-outs, more in stiff or undrained soil, whose critical steps are short: try a "
        "fraction (pic) of a tenth of it"
    )


def _said(report: Report, energy: float) -> str:
    part = 100 * report.unexplained_energy / energy
    verb = "was dissipated by the discretisation" if part > 0 else "was generated by the discretisation"
    return (
        f"at t = {report.time:.6g} s {abs(part):.3g} % of the energy at work {verb}: "
        f"{abs(report.unexplained_energy):.4g} J of {energy:.4g} J"
    )


def energy_limit(limit: float | None) -> float | None:
    """Check the energy limit that a caller gives.

    Raises:
        InputError: it is neither None nor a number above 0.01.
    """
    if limit is not None and not limit > WARN_ABOVE:
        raise InputError(f"energy_limit is {limit}, expected None or a number above {WARN_ABOVE}")
    return limit
