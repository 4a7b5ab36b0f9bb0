"""All parts of the toolkit that use DOLFINx: meshes, finite elements, water, and the transfer to particles.

Only NumPy arrays and an MPI communicator are passed to the core.
"""

from fenics_bridge.errors import InputError
from fenics_bridge.fem.collapse import Collapse, collapse_load, factor_of_safety
from fenics_bridge.fem.elastic import ElasticSolution, solve_elastic, solve_nearly_incompressible
from fenics_bridge.fem.equilibration import EquilibriumReport
from fenics_bridge.fem.evaluate import PointSearch, evaluate_at
from fenics_bridge.fem.fem_site import FemSite
from fenics_bridge.fem.fields import nodal_average
from fenics_bridge.fem.geometry import Geometry
from fenics_bridge.fem.k0 import k0_elastic, k0_jaky, k0_layered_stress, k0_stress
from fenics_bridge.fem.limit_analysis import LogSpiral, log_spiral, log_spiral_safety, log_spiral_seismic
from fenics_bridge.fem.load_steps import LoadStep, print_step
from fenics_bridge.fem.loads import Load
from fenics_bridge.fem.mixed import MixedQuasiStatic
from fenics_bridge.fem.pseudo_static import pseudo_static
from fenics_bridge.fem.quasi_static import QuasiStatic
from fenics_bridge.fem.solver import PRACTICE, Solver
from fenics_bridge.fem.stages import Stage, StageError, StageReport, carry_out, hydrostatic
from fenics_bridge.fem.strength import davis_reduced_strength, davis_strength, reduced_strength
from fenics_bridge.fem.strength_ratio import StrengthRatio
from fenics_bridge.fem.supports import Support, fixed, flat_normal, prescribed, roller
from fenics_bridge.forms import redirect_compiler_lines, repair_cache
from fenics_bridge.mesh.background import background_arrays, background_mesh, original_cells
from fenics_bridge.mesh.beside import tags_beside
from fenics_bridge.mesh.box_mesh import BODY, box_mesh
from fenics_bridge.mesh.graded import graded_tags
from fenics_bridge.mesh.meshes import read_mesh
from fenics_bridge.mesh.names import name_tags, names_of
from fenics_bridge.mesh.slope_mesh import BASE, CREST, EMPTY, LEFT, RIGHT, SLOPE, SOIL, TOP, slope_mesh
from fenics_bridge.mesh.soil import soil_mesh
from fenics_bridge.transfer.comparison import Difference, compare
from fenics_bridge.transfer.far_field import FarField
from fenics_bridge.transfer.handover import Handover, initialise
from fenics_bridge.transfer.particle_forces import boundary_forces, seepage_forces
from fenics_bridge.transfer.particle_safety import ParticleSafety, particle_safety
from fenics_bridge.transfer.particle_site import ParticleSite, apply_supports

# fmt: off
__all__ = [
    "BASE", "BODY", "CREST", "EMPTY", "LEFT", "PRACTICE", "RIGHT", "SLOPE", "SOIL", "TOP", "Collapse", "Difference",
    "ElasticSolution", "EquilibriumReport", "FarField", "FemSite", "Geometry", "Handover", "InputError", "Load", "LoadStep",
    "LogSpiral", "MixedQuasiStatic", "ParticleSafety", "ParticleSite", "PointSearch", "QuasiStatic", "Solver", "Stage",
    "StageError", "StageReport", "StrengthRatio", "Support", "apply_supports", "background_arrays", "background_mesh", "boundary_forces",
    "box_mesh", "carry_out", "collapse_load", "compare", "davis_reduced_strength", "davis_strength", "evaluate_at",
    "factor_of_safety", "fixed", "flat_normal", "graded_tags", "hydrostatic", "initialise", "k0_elastic", "k0_jaky",
    "k0_layered_stress", "k0_stress", "log_spiral", "log_spiral_safety", "log_spiral_seismic", "name_tags", "names_of", "nodal_average",
    "original_cells", "particle_safety", "prescribed", "print_step", "pseudo_static", "read_mesh", "reduced_strength", "roller",
    "seepage_forces", "slope_mesh", "soil_mesh", "solve_elastic", "solve_nearly_incompressible",
    "tags_beside",
]
# fmt: on

redirect_compiler_lines()
repair_cache()
