"""Material point method for geomechanics: particles, constitutive laws, explicit and implicit steps.

Conventions: SI units; tension positive; components ``xx yy zz xy`` in plane strain and ``xx yy zz xy yz xz`` in three
dimensions; shear strain is engineering shear. Angles are in degrees where the name says ``angle``.
"""

from ._core import (
    ConeMatch,
    DruckerPrager,
    InputError,
    LinearElastic,
    MohrCoulomb,
    RelaxationKind,
    RunError,
    StressUpdate,
)
from ._core import compiler as compiler
from ._core import version as __version__
from .ghost import GhostPenalty
from .element import ElementTest
from .laws import matched_drucker_prager, tresca, von_mises
from .mesh import Mesh
from .model import Model
from .newton import Newton
from .particles import Particles
from .relaxation import Relaxation
from .report import ImplicitReport, Report

__all__ = [
    "ConeMatch",
    "DruckerPrager",
    "ElementTest",
    "GhostPenalty",
    "ImplicitReport",
    "InputError",
    "LinearElastic",
    "Mesh",
    "Model",
    "MohrCoulomb",
    "Newton",
    "Particles",
    "Relaxation",
    "RelaxationKind",
    "Report",
    "RunError",
    "StressUpdate",
    "__version__",
    "matched_drucker_prager",
    "tresca",
    "von_mises",
]
