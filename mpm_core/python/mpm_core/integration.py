"""How stresses become forces where a run does not say it: by what the laws of the soil allow."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from . import _core
from ._core import Integration
from .checks import member
from .setup_warnings import with_inner_laws


def default_integration(laws: Iterable[Any]) -> Integration:
    """How a run integrates stresses unless it is told (docs/integration.md, "The default, and why").

    MIXED where soil yields and all of it that does has cohesion: the energy balance of slides closes, and their results
    depend least on the mesh. PARTICLES where all is elastic or some has none: in bodies that bend and in grains that
    come apart mixed integration generates energy. What a law in Python or a UMAT is made of is not known; it counts as
    soil without cohesion.

    Args:
        laws: of the particles, as ``Model.laws``.
    """
    yielding = [law for law in map(_innermost, laws) if not isinstance(law, _core.LinearElastic)]
    return Integration.MIXED if yielding and all(map(_has_cohesion, yielding)) else Integration.PARTICLES


def integration_of(laws: Iterable[Any], integration: Any) -> Integration:
    """The integration that was asked for, or the default of the laws for None."""
    return default_integration(laws) if integration is None else member("integration", integration, Integration)


def _innermost(law: Any) -> Any:
    """The law within those that add water, large strains or random fields to it."""
    return deque(with_inner_laws(law), maxlen=1).pop()


def _has_cohesion(law: Any) -> bool:
    if isinstance(law, _core.CamClay):
        return True
    strength = getattr(law, "cohesion", getattr(law, "strength", 0.0))
    return isinstance(strength, (int, float)) and strength > 0
