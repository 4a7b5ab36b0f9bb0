"""Pictures of the study levee."""

from __future__ import annotations

from pathlib import Path

from .figures import curve_figure
from .history import History
from .plots import CURVES, WIDTH


def save_liquefaction(path: Path, history: History) -> None:
    """Excess pore pressure ratios above, settlement of the crest and spreading of the toes below, over time."""
    time = history["time_s"]
    ratios = {
        "free field": "pore_pressure_ratio_free_field",
        "below a toe": "pore_pressure_ratio_below_toe",
        "below the crest": "pore_pressure_ratio_below_crest",
    }
    moved = {
        "settlement of the crest": "crest_settlement_m",
        "of the free field": "ground_settlement_m",
        "spreading of the toes": "spreading_of_toes_m",
    }
    with curve_figure(path, (WIDTH, 4.8), rows=2) as axes:
        for panel, curves, label in zip(
            axes, (ratios, moved), ("Excess pore pressure ratio\n$1 - p'/p'_0$", "Displacement [m]")
        ):
            for k, (name, column) in enumerate(curves.items()):
                panel.plot(time, history[column], color=CURVES[k], linewidth=0.9, label=name)
            panel.set(ylabel=label, xmargin=0)
            low, high = panel.get_ylim()
            panel.set_ylim(low, high + 0.25 * (high - low))  # space for the names above the curves
            panel.legend(ncols=3, loc="upper left", fontsize=8)
        axes[0].axhline(1.0, color="#b0b0b0", linewidth=0.8, zorder=0)
        axes[-1].set_xlabel("Time [s]")
