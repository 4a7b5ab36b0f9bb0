"""Factor of safety of a slope while its water rises or falls: seepage in time, and strength reduction at chosen times.

The flow gives pore pressures, and suctions; finite elements on effective stresses find the factor at each time. Nothing goes back
from the soil to the flow, but that standing water loads the pores as well as the soil.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm
from fenics_bridge import water

from ..field_files import FieldFiles
from ..history import History
from ..options import add_count, add_number, add_switch
from ..progress import Progress
from ..site.options import add_site_file
from ..slope.site import SlopeSite
from .seepage_plots import FlowPicture, flow_picture
from .site import DAY, time_in_words
from .steps import FlowSteps

comm = MPI.COMM_WORLD
FIRST_STEP, TOLERANCE = 0.1, 0.005
"""First step of the factor of safety, and the width of its last interval as a fraction of the factor"""


def add_water_slope_options(parser: ArgumentParser, site: str, days: float, suction: bool) -> None:
    """Options of a slope and its water: the site's file, by default one of `meshes/`, its times, its elements."""
    p = parser
    elements = "P2", ("P1", "P2"), "linear or quadratic triangles for the factor of safety"
    add_site_file(p, site, "soils, supports and water", elements)
    add_number(p, "--days", days, "days", "duration of the transient flow", above=0)
    add_number(p, "--slower", 1.0, "-", "factor by which all times in the tables of the site are multiplied", above=0)
    add_count(p, "--factor-times", 6, "number of times, evenly over --days, at which the factor of safety is found, in addition "
              "to the beginning, the corners of the site's tables and three times before each of them")  # fmt: skip
    add_number(
        p,
        "--start",
        0.3,
        "-",
        "first factor of safety to try; it is halved, up to three times, where the slope does not stand with it",
        above=0,
    )
    add_switch(p, "--davis", True, "factor of safety with associated flow and the strength that Davis (1968) gives for soil of "
               "less dilation; otherwise with the flow rule of the site's soils")  # fmt: skip
    add_switch(p, "--suction", suction, "add suction times effective saturation to the effective stress (Bishop)")


@dataclass
class Instant:
    """The slope at one time.

    time: [s]; safety: its factor; pore_pressure: function of positions, in reservoirs too
    picture: of the flow, on the first rank
    """

    time: float
    safety: bridge.Collapse
    pore_pressure: Callable
    picture: FlowPicture | None


def safety(a: Namespace, slope: SlopeSite, pore_pressure: Callable, title: str) -> bridge.Collapse:
    """The factor of safety under given pore pressures. Collective.

    Args:
        a: options with elements, start and davis.
        title: for the line that is printed.
    """
    fem = slope.elements(int(a.elements[1]), pore_pressure)
    reduce = bridge.davis_reduced_strength if a.davis else bridge.reduced_strength
    found = bridge.factor_of_safety(
        fem, slope.site.load(), start=a.start, first_step=FIRST_STEP, tolerance=TOLERANCE, reduce=reduce
    )
    if comm.rank == 0:
        print(f"{title}: factor of safety {found.value:.3f}{'' if found.failed else ' at least'}", file=sys.stderr)
    return found


def steady_safety(a: Namespace, slope: SlopeSite, time: float, title: str) -> bridge.Collapse:
    """The factor of safety under the steady flow that belongs to the boundary conditions at a time [s]. Collective."""
    flow = slope.seepage(slope.boundary_at(time))
    try:
        flow.solve()
    except mpm.InputError as error:
        raise mpm.InputError(
            f"{title}, the steady flow under the boundary conditions after {time_in_words(time)}: {error}; a reservoir that is emptied "
            "keeps the level of the lowest ground at its boundary"
        ) from None
    return safety(a, slope, flow.pore_pressure(a.suction), title)


class Files(FieldFiles):
    """Files that are written during the run: the factors, and frames for ParaView."""

    def __init__(self, flow: water.Seepage, folder: Path) -> None:
        self._flow = flow
        columns = ["time_days", "factor_of_safety", "failed_at_factor", "stored_water_m2"]
        super().__init__(flow.domain, folder / "slope", folder / "factors.csv", columns)

    def add(self, instant: Instant) -> None:
        """Add the factor, the pressures and the mechanism of an instant, at which the flow is. Collective."""
        flow, found = self._flow, instant.safety
        self.history.add(time_days=instant.time / DAY, factor_of_safety=found.value, failed_at_factor=found.failed_at,
                         stored_water_m2=flow.stored_water())  # fmt: skip
        there = bridge.evaluate_at(self.points, p=flow.pressure_head, u=found.mechanism, s=flow.saturation())
        head = there["p"][:, 0]
        fields = {"pore_pressure": flow.unit_weight * head, "total_head": head + self.points[:, -1],
                  "acting_pore_pressure": instant.pore_pressure(self.points), "mechanism": there["u"],
                  "saturation": there["s"][:, 0]}  # fmt: skip
        self.output.write(instant.time, fields, {})


def follow(
    a: Namespace, slope: SlopeSite, flow: water.Seepage, folder: Path
) -> tuple[list[Instant], History, str | None]:
    """The slope and its flow, steady at the beginning; returns also why it ended early, if it did. Collective."""
    end = DAY * a.days
    steps, instants, stopped = FlowSteps(flow, end), [], None
    corners = np.array([0.0, *slope.times(end)])
    between = np.interp(np.arange(0, len(corners) - 0.75, 0.25), np.arange(len(corners)), corners)
    times = np.unique(np.round([*between, *np.linspace(0.0, end, a.factor_times + 1)], 6))
    with Files(flow, folder) as files, Progress("water and slope", a.days, comm, unit="days") as progress:
        for time in times:
            stopped = steps.until(time)
            if stopped:
                break
            days = time_in_words(time)
            pressure = flow.pore_pressure(a.suction, outside=slope.free_water(time))
            picture = flow_picture(flow, f"After {days}" if time else "At the beginning", slope.ground())
            instants.append(Instant(time, safety(a, slope, pressure, days), pressure, picture))
            files.add(instants[-1])
            progress.show(flow.time / DAY, len(instants))
    return instants, files.history, stopped


def failure_time(instants: list[Instant]) -> float | None:
    """Time [s] at which the factor falls below 1, between two instants by a straight line; None where it does not."""
    for before, after in zip([instants[0], *instants], instants):
        if after.safety.value < 1.0:
            fell = before.safety.value - after.safety.value
            fraction = (before.safety.value - 1.0) / fell if fell > 0 else 1.0
            return before.time + fraction * (after.time - before.time)
    return None


def lowest(instants: list[Instant]) -> Instant:
    """The instant of the lowest factor."""
    return min(instants, key=lambda instant: instant.safety.value)
