"""A study of a slope and its water: factor of safety over time, its limits, and the slide where it fails."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping
from time import perf_counter
from typing import Any

import numpy as np
from mpi4py import MPI
from mpm_core.law_warnings import locks_at_failure

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

from ..checks import say
from ..collapse_runs import UNDECIDED
from ..lengths import metres
from ..page import Page
from ..quiet import NOT_REACHED, without_warning
from ..results import open_results
from ..site.doubts import ends_of_height, warn_of_suction
from ..site.field_plots import strength_pictures
from ..site.flow_doubts import warn_of_later_changes, warn_of_sealed_ground
from ..site.slides import CAPTIONS as SLIDE_CAPTIONS
from ..slope.fem import warn_of_linear_elements
from ..slope.site import SlopeSite, read_slope_site
from ..summary import write_summary
from .plots import CAPTIONS, slope_pictures
from .site import DAY, time_in_words
from .slides import require_one_level, slide_of
from .slopes import failure_time, follow, lowest

comm = MPI.COMM_WORLD


LITTLE = 0.01
"""Of the height of the mesh, by which particles move that soon rest again"""

Limits = Callable[[Namespace, SlopeSite, water.Seepage], dict[str, bridge.Collapse]]


@without_warning(NOT_REACHED)  # said by the error of a factor of safety
def water_slope_study(a: Namespace, changing: type[water.Rain] | type[water.Reservoir], limits_of: Limits) -> int:
    """Carry out a study of a slope and its water; returns its exit code. Collective.

    Args:
        a: options, with those of `add_water_slope_options` and `add_optional_slide`.
        changing: boundary condition that the site must have.
        limits_of: function of options, site and steady flow at the beginning; returns factors of safety to compare with, by name.

    Raises:
        InputError: the site has no such boundary condition, or a slide in which water flows could not have its reservoirs.
    """
    start = perf_counter()
    slope = read_slope_site(a.site, comm, a.cell_size, a.slower)
    warn_of_later_changes(a.days, slope.boundary, a.site)
    if a.davis and any(field.parameter == "friction_angle" for field in slope.site.random):
        raise mpm.InputError(f"{a.site}: friction_angle is a random field, expected --no-davis with it: the strength of Davis needs the same "
                             "angles in all of a soil")  # fmt: skip
    if not any(isinstance(condition, changing) for condition in slope.boundary):
        raise mpm.InputError(f"{a.site}: no boundary has {changing.__name__.lower()}, expected one or more")
    if a.slide and a.slide_water == "flows":
        require_one_level(slope, DAY * a.days)
    warn_of_linear_elements(a)
    folder = open_results(a, comm)
    flow = slope.seepage()
    try:
        flow.solve()
    except mpm.InputError as error:
        raise mpm.InputError(
            f"{a.site}: the steady flow at the beginning: {error}; levels are elevations in m"
        ) from None
    warn_of_sealed_ground(flow, slope.body[0], (), f"{a.site}: boundaries")
    dry = warn_of_suction(flow, slope.porous, slope.body[1], a.site)
    limits = limits_of(a, slope, flow)
    instants, history, stopped = follow(a, slope, flow, folder)
    if not dry:
        warn_of_suction(flow, slope.porous, slope.body[1], a.site)
    worst, failed = lowest(instants), failure_time(instants)
    shown = all(found.failed for found in [*limits.values(), *(instant.safety for instant in instants)])
    summary = {
        "finished_run": stopped is None, "stopped_because": stopped,
        "factor_of_safety_at_start": instants[0].safety.value, "lowest_factor_of_safety": worst.safety.value,
        "lowest_factor_time_days": worst.time / DAY, "failure_time_days": None if failed is None else failed / DAY,
        "last_factor_of_safety": instants[-1].safety.value, "failure_shown": shown,
        "limits": [{"limit": name, "factor_of_safety": found.value} for name, found in limits.items()],
    }  # fmt: skip
    movies, pictures, code = [], {}, 0
    if a.slide and failed is None:
        say("--slide has no effect: the factor of safety remains above 1")
    if a.slide and failed is not None:
        slid, movies, pictures, code = slide_of(a, slope, instants, folder)
        summary |= slid
    summary["wall_seconds"] = perf_counter() - start
    values = {name: found.value for name, found in limits.items()}
    page = Page(movies=movies, captions=CAPTIONS | SLIDE_CAPTIONS)
    fails = "stands" if failed is None else f"fails after {time_in_words(failed)}"
    lines = [f"the slope {fails}; lowest factor of safety {worst.safety.value:.3f} after {time_in_words(worst.time)}"]
    lines += [f"{name}: {value:.3f}" for name, value in values.items()]
    if values and worst.safety.value < 0.99 * min(values.values()):
        lines.append(
            "the lowest factor is below these limits, which are no bounds while water still flows from other parts of the slope"
        )
    lines += filter(None, [rests_all_the_same(a, slope, summary)])
    drawn = (slope_pictures(folder, instants, values, slope.body[1], a.film) | pictures) if a.pictures else {}
    if a.pictures and slope.site.random:
        drawn |= strength_pictures(slope.site, slope.elements(1, lambda points: np.zeros(len(points))), folder)
    early = write_summary(folder, a, summary, comm, page, drawn, said="\n".join(lines))
    return early or code or (0 if shown else UNDECIDED)


def rests_all_the_same(a: Namespace, slope: SlopeSite, summary: Mapping[str, Any]) -> str:
    """Why particles hardly slide where the factor of safety is below 1; empty where they slide, or have no other strength. Collective."""
    low, high = ends_of_height(slope.body[0])
    moved = summary.get("largest_displacement_m", np.inf)
    rests = summary.get("slide_comes_to_rest", False) and moved <= LITTLE * (high - low)
    if not (rests and a.davis and locks_at_failure(slope.site.laws.values())):
        return ""
    return (
        f"the particles rest again after {metres(moved)} although the factor of safety is below 1: they have the flow rule of the soil, with "
        "which it is stronger than with the strength of Davis in the factor (--no-davis; docs/water.md)"
    )
