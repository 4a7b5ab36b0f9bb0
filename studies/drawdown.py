"""A bank during drawdown: its factor of safety over time by finite elements, and its slide by particles (`--slide`).

The site is a TOML file (`meshes/drawdown.toml` unless another is given): mesh, soils, supports, and the level of the reservoir
in time. Transient seepage gives the pore pressures, and strength reduction the factor of safety at chosen times. The factor is
compared with two limits: slow drawdown, by the steady flow under the last levels, and fast drawdown without drainage, where
pore pressures fall by the weight of the water that has left (Morgenstern 1963). They are no bounds (docs/water.md). `--slower`
stretches the times of the drawdown.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

import numpy as np
from common.options import study_parser
from common.ranks import run_study
from common.slope.site import SlopeSite
from common.water.runs import water_slope_study
from common.water.site import DAY
from common.water.slides import add_optional_slide, check_slide
from common.water.slopes import add_water_slope_options, safety, steady_safety

import fenics_bridge as bridge
from fenics_bridge import water


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_water_slope_options(p, "drawdown", days=60.0, suction=False)
    add_optional_slide(p)
    return p


def limits(a: Namespace, slope: SlopeSite, flow: water.Seepage) -> dict[str, bridge.Collapse]:
    """Factors of safety after drawdown that is slow, and fast, without limit. Collective."""
    standing, before, end = slope.standing(), flow.pore_pressure(), DAY * a.days

    def undrained(x: np.ndarray) -> np.ndarray:
        return np.maximum(before(x) - standing(x, 0.0) + standing(x, end), 0.0)

    return {
        "slow drawdown, steady flow": steady_safety(a, slope, end, "slow drawdown"),
        "fast drawdown, no drainage": safety(a, slope, undrained, "fast drawdown"),
    }


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    a = p.parse_args(arguments)
    check_slide(p, a)
    return water_slope_study(a, water.Reservoir, limits)


if __name__ == "__main__":
    run_study(main)
