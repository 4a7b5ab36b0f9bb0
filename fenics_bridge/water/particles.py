"""Boundary conditions of the water of finite elements, for implicit particles whose pores hold water."""

from __future__ import annotations

from collections.abc import Iterable

import mpm_core as mpm
from fenics_bridge.errors import agree
from fenics_bridge.water.boundary import Reservoir, WaterBoundary, value_at


def apply_reservoirs(model: mpm.Model, boundary: Iterable[WaterBoundary], time: float) -> None:
    """Let reservoirs stand against the soil of particles, with the levels that they have at a time. Collective.

    Their water has hydrostatic pressure below the level, in the pores and on the soil. Above the level the pressure is zero, so
    that water may enter there, which finite elements do not allow: keep the boundary under water, or wet.

    Args:
        model: particles with pore water, see `Model.add_water`.
        boundary: boundary conditions as for `Consolidation`, all of them reservoirs.
        time: [s].

    Raises:
        InputError: another boundary condition, particles without water, or an unknown tag. Raised on all ranks alike.
    """
    conditions = list(boundary)
    reservoirs = [one for one in conditions if isinstance(one, Reservoir)]
    others = [one for one in conditions if not isinstance(one, Reservoir)]
    agree(model.comm, f"boundary has {others[0]!r}, expected reservoirs only for particles" if others else None)
    for one in reservoirs:
        model.hold_pore_pressure(one.facet_tag, level=value_at(one.level, time))
