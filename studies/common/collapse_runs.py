"""Last equilibria on meshes of several sizes, with associated flow and without dilation: their pictures, numbers and lines."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

import fenics_bridge as bridge

from .field_plots import bend, mechanism_field, save_convergence, save_curves, save_mechanism
from .figures import Pictures
from .options import add_switch

UNDECIDED = 3
"""Exit code of a study that found a lower bound, but no failure above it"""
CAPTIONS = {
    "mechanism": "Mechanism on the finest mesh: displacement and shear strain of the last increment, with the slip line of limit analysis",
    "mechanism_without_dilation": "Mechanism without dilation",
    "factor_displacement": "Factor that divides the strength over the largest displacement on the way to failure",
    "load_displacement": "Unit weight over the largest displacement on the way to collapse",
    "load_settlement": "Pressure over the settlement of the footing's centre on the way to collapse",
    "convergence": "Result over the size of the cells, beside limit analysis",
}  # fmt: skip
"""Of the pictures of `CollapseRuns`"""


def add_flow_options(parser: ArgumentParser) -> None:
    """Option ``--without-dilation``."""
    add_switch(parser, "--without-dilation", True, "also compute flow without dilation, for comparison")


def dilation_angles(options: Namespace) -> list[float]:
    """The dilation angle asked for and, for comparison, zero [degrees]."""
    return list(dict.fromkeys([options.dilation_angle, *([0.0] if options.without_dilation else [])]))


@dataclass(frozen=True)
class Target:
    """Target of the search.

    Args:
        name, failed_name, reference_name: in the summary, of the value, of the smallest one above it that failed, and of
            limit analysis.
        reference: by limit analysis with associated flow, in the summary's unit.
        title, line: how a value is written above a picture and in a line of text, as formats of a number.
        label: of its axis, with unit.
        unit: what the values of the runs are divided by for the summary.
        shown_unit: what the summary's values are divided by for pictures and text.
    """

    name: str
    failed_name: str
    reference_name: str
    reference: float
    title: str
    line: str
    label: str
    unit: float = 1.0
    shown_unit: float = 1.0

    def shown(self, value: float) -> float:
        """A value of the summary as pictures and text have it."""
        return value / self.shown_unit


@dataclass(frozen=True)
class CollapseRuns:
    """Result of the search.

    Args:
        target: what was looked for.
        friction_angle: of the soil [degrees].
        sizes: of the cells, from coarse to fine [m].
        runs: by dilation angle [degrees], the one asked for first; one for each size.
        curves: like the runs, (k, 2) of value and displacement [m] on the way; by default those of the runs.
    """

    target: Target
    friction_angle: float
    sizes: list[float]
    runs: dict[float, list[bridge.Collapse]]
    curves: dict[float, list[np.ndarray]] | None = None

    def summary(self) -> dict[str, object]:
        """The finest result, with limit analysis and without dilation beside it, and all meshes."""
        target, chosen = self.target, next(iter(self.runs.values()))[-1]
        value, without = self._value(chosen), self.runs.get(0.0)
        return {
            target.name: value,
            target.failed_name: chosen.failed_at / target.unit,
            "failure_shown": all(run.failed for run in self._all_runs()),
            target.reference_name: target.reference,
            "relative_difference_to_limit_analysis": value / target.reference - 1,
            "dilation_angle_degrees": next(iter(self.runs)),
            f"{target.name}_without_dilation": self._value(without[-1]) if without else None,
            "meshes": self.rows(),
        }

    def rows(self) -> list[dict[str, object]]:
        """Collapse of each run."""
        target = self.target
        return [
            {"cell_size_m": size, "dilation_angle_degrees": angle, target.name: self._value(run),
             target.failed_name: run.failed_at / target.unit, "failure_shown": run.failed,
             "carried_fraction_of_mechanism": run.carried if run.failed else None, "largest_out_of_balance_ratio": run.residual,
             "largest_missing_stress_fraction": run.missing,
             "relative_difference_to_limit_analysis": self._value(run) / target.reference - 1,
             "largest_displacement_m": run.curve[-1, 1], "steps": len(run.steps)}
            for angle, runs in self.runs.items() for size, run in zip(self.sizes, runs)
        ]  # fmt: skip

    def lines(self) -> str:
        """The rows as text."""
        return "\n".join(self._line(row, run) for row, run in zip(self.rows(), self._all_runs()))

    def _line(self, row: dict[str, object], run: bridge.Collapse) -> str:
        shown = self.target.line.format(self._shown(run.value))
        next_one = self.target.line.format(self._shown(run.failed_at)).strip()
        end = (
            f"{shown} ({row['relative_difference_to_limit_analysis']:+.1%}), fails at {next_one}, "
            f"where the mechanism carries {run.carried:.1%} of the load"
            if run.failed
            else f"AT LEAST {shown.strip()}: the solver gave up at {next_one} without a mechanism ({run.reason})"
        )
        return f"cells of {row['cell_size_m']:<7g} m, dilation angle {row['dilation_angle_degrees']:4g} degrees: {end}"

    def exit_code(self) -> int:
        """0 where failure was shown in all runs, otherwise `UNDECIDED`."""
        return 0 if all(run.failed for run in self._all_runs()) else UNDECIDED

    def _all_runs(self) -> list[bridge.Collapse]:
        return [run for runs in self.runs.values() for run in runs]

    def finest_curve(self) -> np.ndarray:
        """Values and displacements [m] on the finest mesh: (k, 2)."""
        return next(iter(self._curves().values()))[-1]

    def curve_pictures(self, folder: Path, name: str, labels: tuple[str, str], lowest: float = 0.0) -> Pictures:
        """Value over displacement, and convergence.

        Args:
            name: of the first picture's file.
            labels: of its axes, with units; displacement is drawn in mm.
            lowest: end of its vertical axis.
        """
        target, curves = self.target, self._curves()
        reference = (target.shown(target.reference), "limit analysis, associated flow")
        drawn = {f"{size:g} m, {self._flow(angle)}": (1e3 * of_angle[k][:, 1], self._shown(of_angle[k][:, 0]))
                 for k, size in enumerate(self.sizes) for angle, of_angle in curves.items()}  # fmt: skip
        wide = 1e3 * bend([curve for of_angle in curves.values() for curve in of_angle])
        limits = ((0, wide), (lowest, None))
        values = {self._flow(angle): [self._shown(run.value) for run in runs] for angle, runs in self.runs.items()}
        pictures = {name: partial(save_curves, folder / f"{name}.png", drawn, labels, reference=reference, limits=limits,
                                  per_colour=len(curves))}  # fmt: skip
        if len(self.sizes) > 1:
            pictures["convergence"] = partial(
                save_convergence, folder / "convergence.png", self.sizes, values, target.label, reference
            )
        return pictures

    def mechanism_pictures(self, folder: Path, line: np.ndarray | None, line_name: str, **options) -> Pictures:
        """The last increment on the finest mesh with the slip line of limit analysis over it. Collective.

        Args:
            line: the slip line, (k, 2) [m].
            options: further ones of `save_mechanism`.
        """
        pictures = {}
        for number, (angle, runs) in enumerate(self.runs.items()):
            field = mechanism_field(runs[-1].mechanism)
            if field is not None:
                name = "mechanism" if number == 0 else "mechanism_without_dilation"
                bound = "" if runs[-1].failed else "Lower bound: "
                title = f"{bound}{self.target.title.format(self._shown(runs[-1].value))}, {self._flow(angle)}"
                pictures[name] = partial(save_mechanism, folder / f"{name}.png", field, title, line=line,
                                         line_name=line_name, **options)  # fmt: skip
        return pictures

    def _value(self, run: bridge.Collapse) -> float:
        return run.value / self.target.unit

    def _shown(self, value):
        return self.target.shown(value / self.target.unit)

    def _curves(self) -> dict[float, list[np.ndarray]]:
        return self.curves or {angle: [run.curve for run in runs] for angle, runs in self.runs.items()}

    def _flow(self, angle: float) -> str:
        return "associated" if angle == self.friction_angle else rf"$\psi$ = {angle:g}°"
