"""Cyclic laboratory tests at constant volume on one point of a law, and their picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

import mpm_core as mpm

from .figures import curve_figure
from .history import History
from .plots import CURVES

CYCLIC = ("cyclic-shear", "cyclic-triaxial")
LARGEST, SMALLEST = 2e-4, 1e-7
"""Sizes of increments of strain [-]"""
PART = 0.05
"""Increment of stress over the amplitude that increments of strain aim at"""


def amplitude(kind: str, stress: np.ndarray) -> float:
    """Shear stress [Pa] of a simple shear test, half the difference of axial and lateral stress of a triaxial one, in compression."""
    return float(stress[3] if kind == "cyclic-shear" else 0.5 * (stress[1] - stress[0]))


def strain_of(kind: str, strain: np.ndarray) -> float:
    """Shear strain of a simple shear test, axial strain of a triaxial one, in compression [-]."""
    return float(strain[3] if kind == "cyclic-shear" else -strain[0])


def cycles(
    test: mpm.ElementTest,
    kind: str,
    increment: Callable[[float], list[float | None]],
    largest: float,
    strain: float,
    most: int,
) -> Iterator[float]:
    """Load a point to and fro between two stresses; gives the number of cycles up to the last peak, a quarter at the first one.

    Args:
        kind: one of `CYCLIC`.
        increment: strain increment of a size.
        largest: amplitude of the stress [Pa].
        strain: single amplitude of strain [-] with which the test ends.
        most: cycles after which it ends, at the last of their peaks.

    Raises:
        RunError: the law failed.
    """
    direction, halves, size = 1, 0, SMALLEST * 10
    while halves < 2 * most and abs(strain_of(kind, test.strain)) < strain:
        before, start = (test.stress, test.state, test.strain), amplitude(kind, test.stress)
        test.step(increment(direction * size))
        change = direction * (amplitude(kind, test.stress) - start)
        if direction * start + change >= largest:  # once more, to the largest stress
            test.stress, test.state, test.strain = before
            test.step(increment(direction * size * (largest - direction * start) / change))
            halves, direction, size = halves + 1, -direction, SMALLEST
        else:
            size = float(np.clip(size * PART * largest / max(abs(change), 1e-300), 0.3 * size, 2 * size))
            size = min(max(size, SMALLEST), LARGEST)
        yield max(0.0, 0.5 * halves - 0.25)


def first_cycle(history: History, reached: np.ndarray) -> float | None:
    """Number of cycles [-] at which something begins to hold in the rows of a history; None where it never does."""
    return float(history["cycles"][reached.argmax()]) if reached.any() else None


def draw_cycles(history: History, kind: str, path: Path) -> None:
    """Stress path, loops of stress and strain, and both over the cycles."""
    shear = kind == "cyclic-shear"
    strain = 100 * history["shear_strain" if shear else "axial_strain"]
    stress = 1e-3 * (history["shear_stress_Pa"] if shear else 0.5 * history["axial_difference_Pa"])
    pressure = 1e-3 * history["p_Pa"]
    stress_label = "Shear stress [kPa]" if shear else r"$(\sigma_a - \sigma_r) / 2$ [kPa]"
    strain_label = "Shear strain [%]" if shear else "Axial strain, compression [%]"
    # The cycles within a cycle follow from the increments, so that curves over them do not jump
    number = history["cycles"]
    begins = np.flatnonzero(np.diff(number, prepend=-1.0) > 0)
    over = np.interp(np.arange(len(number)), [*begins, len(number)], [*number[begins], number[-1] + 0.5])
    with curve_figure(path, (11, 3.2), panels=3) as axes:
        axes[0].plot(pressure, stress, color=CURVES[0], linewidth=0.7)
        axes[0].plot(pressure[:1], stress[:1], "o", color="black", markersize=4, markerfacecolor="white", zorder=3)
        axes[0].set(xlabel="$p'$ [kPa]", ylabel=stress_label, xlim=(0, 1.05 * pressure.max()))
        axes[1].plot(strain, stress, color=CURVES[0], linewidth=0.7)
        axes[1].set(xlabel=strain_label, ylabel=stress_label)
        axes[2].plot(over, 1 - pressure / pressure[0], color=CURVES[0], linewidth=0.9)
        axes[2].set(
            xlabel="Number of cycles", ylabel="Excess pore pressure ratio $1 - p'/p'_0$", ylim=(None, 1.05), xmargin=0
        )
        axes[2].yaxis.label.set_color(CURVES[0])
        other = axes[2].twinx()
        other.plot(over, strain, color=CURVES[1], linewidth=0.7)
        other.set_ylabel(strain_label, color=CURVES[1])
        other.grid(False)
