"""Terrain: rasters of elevations, a background mesh above them, a slide between two of them, and maps of its deposit."""

from fenics_bridge.terrain.maps import SlideMaps
from fenics_bridge.terrain.raster import Raster, read_raster, write_raster
from fenics_bridge.terrain.slide import seed_slide
from fenics_bridge.terrain.terrain_mesh import GROUND, SIDES, SKY, terrain_mesh

__all__ = ["GROUND", "SIDES", "SKY", "Raster", "SlideMaps", "read_raster", "seed_slide", "terrain_mesh", "write_raster"]
