"""Pore pressures as functions of positions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.errors import real_numbers
from fenics_bridge.fem.pore_water import pressures_at
from fenics_bridge.fem.evaluate import PointSearch
from fenics_bridge.types import OfPosition


def at_positions(pressure: Any, outside: OfPosition | None) -> OfPosition:
    """A finite element function of pressures [Pa] as a function of positions (n, D), which every rank must call.

    Args:
        pressure: the function.
        outside: function of positions for points outside the body; None for zero there.
    """

    def at(points: ArrayLike) -> NDArray[np.float64]:
        mesh = pressure.function_space.mesh
        x = real_numbers(mesh.comm, "points", points)
        search = PointSearch(mesh, x)
        values = search.values(pressure)[:, 0]
        elsewhere = np.zeros(len(x)) if outside is None else pressures_at(mesh.comm, outside, x, "outside")
        return np.where(search.found, values, elsewhere)

    return at
