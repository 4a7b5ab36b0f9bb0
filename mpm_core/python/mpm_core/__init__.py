"""Material point method for geomechanics: particles, constitutive laws, explicit and implicit steps.

Conventions: SI units; tension positive; components ``xx yy zz xy`` in plane strain and ``xx yy zz xy yz xz`` in three
dimensions; shear strain is engineering shear. Angles are in degrees where the name says ``angle``.
"""

from ._core import (
    CamClay,
    ConeMatch,
    DruckerPrager,
    Geometry,
    HardeningSoil,
    Hencky,
    Heterogeneous,
    HoekBrown,
    InputError,
    Integration,
    LawParameter,
    LinearElastic,
    MohrCoulomb,
    NorSand,
    PythonLaw,
    RelaxationKind,
    RunError,
    Sanisand,
    Softening,
    SofteningMohrCoulomb,
    StressUpdate,
    Transfer,
    Umat,
    Undrained,
    ViscoplasticMohrCoulomb,
    law_types,
)
from ._core import compiler as compiler
from ._core import version as __version__
from .checkpoint import checkpoint_description
from .critical_cell import CriticalCell, critical_cell
from .element import ElementTest
from .energy import EnergyWarning
from .field_contact import FieldContact
from .ghost import GhostPenalty
from .integration import default_integration
from .law_parameters import signature_of
from .laws import (
    hardening_soil_state,
    log_preconsolidation,
    matched_drucker_prager,
    nor_sand_state,
    sanisand_state,
    tresca,
    von_mises,
)
from .members import Member, MemberForces, bar, beam, strut
from .mesh import Mesh
from .model import Model
from .motion import Motion, motion_of_acceleration, read_acceleration, read_accelerogram
from .newton import Newton
from .parameter_fields import RandomField
from .particles import Particles
from .rayleigh import Rayleigh
from .relaxation import Relaxation
from .report import ImplicitReport, Report
from .reports import Reports
from .resting import Conversion
from .rigid_body import FreeBody, Servo
from .rigid_contact import RigidContact
from .space import Space, parts, space
from .surfaces import Box, Cone, Cylinder, Disc, Plane, Polyline, Sphere, Wedge, distances
from .triangles import Triangles

for _law in law_types:
    _law.__signature__ = signature_of(_law)

__all__ = [
    "Box",
    "CamClay",
    "Cone",
    "ConeMatch",
    "Conversion",
    "CriticalCell",
    "Cylinder",
    "Disc",
    "DruckerPrager",
    "ElementTest",
    "EnergyWarning",
    "FieldContact",
    "FreeBody",
    "Geometry",
    "GhostPenalty",
    "HardeningSoil",
    "Hencky",
    "Heterogeneous",
    "HoekBrown",
    "ImplicitReport",
    "InputError",
    "Integration",
    "LawParameter",
    "LinearElastic",
    "Member",
    "MemberForces",
    "Mesh",
    "Model",
    "MohrCoulomb",
    "Motion",
    "Newton",
    "NorSand",
    "Particles",
    "Plane",
    "Polyline",
    "PythonLaw",
    "RandomField",
    "Rayleigh",
    "Relaxation",
    "RelaxationKind",
    "Report",
    "Reports",
    "RigidContact",
    "RunError",
    "Sanisand",
    "Servo",
    "Softening",
    "SofteningMohrCoulomb",
    "Space",
    "Sphere",
    "StressUpdate",
    "Transfer",
    "Triangles",
    "Umat",
    "Undrained",
    "ViscoplasticMohrCoulomb",
    "Wedge",
    "__version__",
    "bar",
    "beam",
    "checkpoint_description",
    "critical_cell",
    "default_integration",
    "distances",
    "hardening_soil_state",
    "log_preconsolidation",
    "matched_drucker_prager",
    "motion_of_acceleration",
    "nor_sand_state",
    "parts",
    "read_acceleration",
    "read_accelerogram",
    "sanisand_state",
    "space",
    "strut",
    "tresca",
    "von_mises",
]
