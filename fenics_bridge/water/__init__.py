"""Water in the pores: retention curves, boundary conditions of the water, seepage."""

from fenics_bridge.water.boundary import Flux, Head, Rain, Reservoir, SeepageFace
from fenics_bridge.water.retention import AlwaysSaturated, FreeSurface, Gardner, Tabulated, VanGenuchten
from fenics_bridge.water.seepage import Seepage
from fenics_bridge.water.soils import PorousSoil

__all__ = [
    "AlwaysSaturated",
    "Flux",
    "FreeSurface",
    "Gardner",
    "Head",
    "PorousSoil",
    "Rain",
    "Reservoir",
    "Seepage",
    "SeepageFace",
    "Tabulated",
    "VanGenuchten",
]
