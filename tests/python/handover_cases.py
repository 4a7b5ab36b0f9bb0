"""The slope of finite elements that tests of the hand-over share."""

from __future__ import annotations

from bridge_cases import slope_model

import fenics_bridge as bridge

UNIT_WEIGHT = 18e3
"""[N/m3]"""


def solved(**options):
    """QuasiStatic of the slope in equilibrium under its weight, as the particles of `slope_particles` are to be."""
    model = slope_model(dilation_angle=0.0, **options)
    model.solve(bridge.Load(unit_weight=UNIT_WEIGHT))
    assert model.converged
    return model
