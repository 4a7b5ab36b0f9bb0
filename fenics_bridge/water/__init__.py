"""Water in the pores: retention curves, boundary conditions of the water, seepage, consolidation."""

from fenics_bridge.water.boundary import Flux, Head, Rain, Reservoir, SeepageFace
from fenics_bridge.water.consolidation import Consolidation
from fenics_bridge.water.consolidation_step import ConsolidationReport
from fenics_bridge.water.coupled import Element
from fenics_bridge.water.motion import Newmark
from fenics_bridge.water.exit_gradient import exit_gradient
from fenics_bridge.water.particles import WATERLESS, apply_reservoirs, waterless_facets
from fenics_bridge.water.retention import AlwaysSaturated, FreeSurface, Gardner, Tabulated, VanGenuchten
from fenics_bridge.water.seepage import Seepage
from fenics_bridge.water.soils import PorousSoil, dipping
from fenics_bridge.water.standing import ground_lines, reservoir_pressure, standing_water

__all__ = [
    "AlwaysSaturated",
    "Consolidation",
    "ConsolidationReport",
    "Element",
    "Flux",
    "FreeSurface",
    "Gardner",
    "Head",
    "Newmark",
    "PorousSoil",
    "Rain",
    "Reservoir",
    "Seepage",
    "SeepageFace",
    "Tabulated",
    "VanGenuchten",
    "WATERLESS",
    "apply_reservoirs",
    "dipping",
    "exit_gradient",
    "ground_lines",
    "reservoir_pressure",
    "standing_water",
    "waterless_facets",
]
