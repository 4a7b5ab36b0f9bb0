"""Inflows of water as results: per metre of a plane section, of the whole ring of an axisymmetric body."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

import mpm_core as mpm
from fenics_bridge import water
from fenics_bridge.water.boundary import value_at

from ..site.keys import DAY


class Extent(NamedTuple):
    """The body that inflows and stored water are those of."""

    factor: float
    """Over what `water.Seepage` has, per metre or per radian"""
    unit: str
    """Unit of a volume of water, as in the names of columns"""
    label: str
    """Unit of an inflow, for pictures"""
    words: str
    """The body, for captions"""


PLANE = Extent(1.0, "m2", "m$^2$/day", "per metre")
RING = Extent(2 * np.pi, "m3", "m$^3$/day", "all around the axis")


def extent_of(flow: water.Seepage | water.Consolidation) -> Extent:
    """A metre of a plane section, or the whole body of an axisymmetric one."""
    return RING if flow.geometry == mpm.Geometry.AXISYMMETRIC else PLANE


def inflow_column(name: str, extent: Extent) -> str:
    """Name of the column of the inflow at a boundary."""
    return f"inflow_{name}_{extent.unit}_per_day"


def inflows(flow: water.Seepage, names: Iterable[str]) -> dict[str, float]:
    """What enters at boundaries [m2/day], or all around the axis [m3/day], by the names of columns. Collective."""
    extent = extent_of(flow)
    return {inflow_column(name, extent): DAY * extent.factor * flow.inflow(name) for name in names}


def exit_gradients(flow: water.Seepage) -> dict[str, float]:
    """Largest gradient [-] with which water leaves, and its largest upward component, which lifts soil. Collective."""
    return {key: max(exit_gradients_by_boundary(flow, upward).values(), default=0.0)
            for key, upward in (("largest_exit_gradient", False), ("largest_upward_exit_gradient", True))}  # fmt: skip


def exit_gradients_by_boundary(flow: water.Seepage, upward: bool) -> dict[str, float]:
    """Largest gradient [-] with which water leaves at each boundary, or its largest upward component. Collective.

    Boundaries at which a flux lets no water leave do not count: at the tip of a sheet pile the gradient beside the ground is singular.
    """
    lets_out = [
        one for one in flow.boundary if not (isinstance(one, water.Flux) and value_at(one.rate, flow.time) >= 0)
    ]
    tags = list(dict.fromkeys(one.facet_tag for one in lets_out))
    return {str(tag): water.exit_gradient(flow, tag, upward) for tag in tags}


def in_words(found: Mapping[str, float], extent: Extent) -> dict[str, str]:
    """Inflows [m2/day, m3/day] with their units; zero where one is round-off of the largest."""
    largest = max(map(abs, found.values()), default=0.0)
    exact = {name: value if abs(value) > 1e-9 * largest else 0.0 for name, value in found.items()}
    if extent is RING:
        return {name: f"{value:.4g} m3/day {extent.words}" for name, value in exact.items()}
    return {name: f"{1000 * value:.4g} litres {extent.words} and day" for name, value in exact.items()}
