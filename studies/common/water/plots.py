"""Pictures of slopes and their water: factor of safety over time, pore pressures, the mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from ..field_plots import Field, mechanism_field, save_mechanism
from ..figures import Pictures, curve_figure
from ..plots import CURVES
from .seepage_plots import MOST_PANELS, PRESSURE, SATURATION, dries, save_flow, save_flow_film
from .site import DAY, time_in_words
from .slopes import Instant, lowest

CAPTIONS = {
    "pore_pressure": "Pore pressure, negative (brown) where it is suction, with flow lines, the water table and standing water (blue)",
    "saturation": "Degree of saturation, with flow lines, the water table and standing water (blue)",
    "factor_of_safety": "Factor of safety over time",
    "mechanism": "Mechanism in which the slope fails at the time of the lowest factor, its strength divided by the factor, with the water "
    "table (blue)",
}


def slope_pictures(
    folder: Path, instants: Sequence[Instant], limits: Mapping[str, float], soils: object, film: bool = True
) -> Pictures:
    """Draw all pictures of a slope in time. Collective.

    Args:
        limits: factors of safety by name, drawn as lines.
        soils: tags of the cells of the slope, by name.
        film: draw a film of the flow too.
    """
    worst = lowest(list(instants))
    field: Field | None = mechanism_field(worst.safety.mechanism, soils=soils)
    if field is None or worst.picture is None:
        return {}
    table = worst.picture.table()
    shown = [one.picture for one in _chosen(instants, worst) if one.picture is not None]
    moving = [one.picture for one in instants if one.picture is not None]
    title = f"{time_in_words(worst.time)}: factor of safety {worst.safety.value:.2f}"
    saturation = {"saturation": lambda: save_flow(folder / "saturation.png", shown, SATURATION)} if dries(shown) else {}
    return {
        **saturation,
        **({"flow": lambda: save_flow_film(folder / "flow", moving, PRESSURE)} if film else {}),
        "pore_pressure": lambda: save_flow(folder / "pore_pressure.png", shown, PRESSURE),
        "factor_of_safety": lambda: save_factors(folder / "factor_of_safety.png", instants, limits),
        "mechanism": lambda: save_mechanism(folder / "mechanism.png", field, title, water=table),
    }


def _chosen(instants: Sequence[Instant], worst: Instant) -> list[Instant]:
    """The first, the worst and the last instant, and one between the first two."""
    k = next(k for k, instant in enumerate(instants) if instant is worst)
    numbers = sorted({0, k // 2, k, len(instants) - 1})
    return [instants[n] for n in numbers[:MOST_PANELS]]


def save_factors(path: Path, instants: Sequence[Instant], limits: Mapping[str, float]) -> None:
    """The factor of safety over time, with lines for its limits and for 1."""
    days = np.array([instant.time for instant in instants]) / DAY
    factors = np.array([instant.safety.value for instant in instants])
    with curve_figure(path, (4.9, 3.3)) as axes:
        axes.plot(days, factors, "o-", color=CURVES[0], markersize=3, label="transient flow")
        for k, (name, value) in enumerate(limits.items()):
            axes.axhline(value, color=CURVES[k + 1], linestyle=("--", "-.", ":")[k % 3], linewidth=1.1, label=name)
        axes.axhline(1.0, color="black", linewidth=0.7)
        every = [*factors, *limits.values(), 1.0]
        margin = 0.08 * (max(every) - min(every))
        axes.set(xlabel="Time [days]", ylabel="Factor of safety [-]", xlim=(0, days[-1] or 1.0),
                 ylim=(min(every) - margin, max(every) + margin))  # fmt: skip
        axes.legend(fontsize=8)
