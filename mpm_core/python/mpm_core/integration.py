"""How stresses become forces where the caller does not say it: by the laws of the soil, and the number of its particles."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._core import Integration
from .checks import member
from .law_warnings import with_inner_laws
from .resting import represented

if TYPE_CHECKING:
    from .model import Model

LEAST_IN_CELL = {2: 6, 3: 4}
"""Particles of which a cell must be full for mixed integration, by the dimension: with fewer it generates energy"""


def default_integration(model: Model) -> Integration:
    """How runs of a model integrate stresses where none is named (docs/integration.md, "The default, and why"). Collective.

    MIXED where soil yields, all of it that does has cohesion, and six of its particles fill a triangle, or four a tetrahedron:
    the energy balance of slides closes, and their results depend least on the mesh. PARTICLES otherwise: in bodies that bend,
    in grains that come apart, and with few particles in a cell mixed integration generates energy. What a law in Python or a
    UMAT is made of is not known; it counts as soil without cohesion.

    Args:
        model: with its particles.
    """
    # Rounded, as round-off and small strains change volumes.
    mixed = all_cohesive(model.laws) and np.rint(particles_in_cell(model)) >= LEAST_IN_CELL[model.mesh.dim]
    return Integration.MIXED if mixed else Integration.PARTICLES


def integration_of(model: Model, integration: Any = None) -> Integration:
    """The integration that is named, or for None the default as it was at the first use of the present particles. Collective."""
    if integration is not None:
        return member("integration", integration, Integration)
    if model._integration is None:
        model._integration = default_integration(model)
    return model._integration


def all_cohesive(laws: Iterable[Any]) -> bool:
    """Whether some soil yields, and all of it that does has cohesion."""
    yielding = [law for law in map(_innermost, laws) if not isinstance(law, _core.LinearElastic)]
    return bool(yielding) and all(map(_has_cohesion, yielding))


def particles_in_cell(model: Model) -> float:
    """Mean number of particles that fill a cell, by their volumes and those of their cells. Collective."""
    p = model.particles
    counts = represented(p)
    with np.errstate(divide="ignore"):  # a volume of zero is refused by the run
        full = counts * model.cell_volumes[p.cell] / p.volume
    total, n = model.comm.allreduce(np.array([counts @ full, counts.sum()]))
    return float(total / n) if n else 0.0


def _innermost(law: Any) -> Any:
    """The law within those that add water, large strains or random fields to it."""
    return deque(with_inner_laws(law), maxlen=1).pop()


def _has_cohesion(law: Any) -> bool:
    if isinstance(law, _core.CamClay):
        return True
    strength = getattr(law, "cohesion", getattr(law, "strength", 0.0))
    return isinstance(strength, (int, float)) and strength > 0
