"""Pore pressures as functions of positions."""

from __future__ import annotations

from typing import Any

import numpy as np

from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.types import OfPosition


def at_positions(pressure: Any, outside: OfPosition | None) -> OfPosition:
    """A finite element function of pressures [Pa] as a function of positions (n, D), which every rank must call.

    Args:
        pressure: the function.
        outside: function of positions for points outside the body; None for zero there.
    """

    def at(points):
        points = np.ascontiguousarray(points, dtype=float)
        search = PointSearch(pressure.function_space.mesh, points)
        values = search.values(pressure)[:, 0]
        elsewhere = np.zeros(len(points)) if outside is None else np.broadcast_to(outside(points), len(points))
        return np.where(search.found, values, elsewhere)

    return at
