"""An unsaturated slope in the rain: its factor of safety over time by finite elements, and its slide by particles (`--slide`).

The site is a TOML file (`meshes/rain.toml` unless another is given): mesh, soils with retention curves, supports, and the rain
in time. Suction times effective saturation is added to the effective stress (Bishop 1959) and decreases as rain infiltrates;
strength reduction finds the factor of safety at chosen times. It is compared with the initial factor without suction.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from common.options import study_parser
from common.ranks import run_study
from common.slope.site import SlopeSite
from common.water.runs import water_slope_study
from common.water.slides import add_optional_slide, check_slide
from common.water.slopes import add_water_slope_options, safety

import fenics_bridge as bridge
from fenics_bridge import water


def parser() -> ArgumentParser:
    """Parser of all options; the help shows their units."""
    p = study_parser(__doc__)
    add_water_slope_options(p, "rain", days=15.0, suction=True)
    add_optional_slide(p)
    return p


def limits(a: Namespace, slope: SlopeSite, flow: water.Seepage) -> dict[str, bridge.Collapse]:
    """The factor of safety at the beginning without what suction adds to it. Collective."""
    return {"at the beginning, without suction": safety(a, slope, flow.pore_pressure(), "without suction")}


def main(arguments: list[str] | None = None) -> int:
    p = parser()
    a = p.parse_args(arguments)
    check_slide(p, a)
    return water_slope_study(a, water.Rain, limits)


if __name__ == "__main__":
    run_study(main)
