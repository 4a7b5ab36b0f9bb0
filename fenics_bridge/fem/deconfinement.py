"""Stages that release only a part of their out-of-balance forces, as the core of a tunnel does ahead of its lining.

The rest stays as nodal forces that hold the body (`Load.held`), until a later stage releases them with what it changes itself. This is the
convergence-confinement method in plane strain (Panet 1995, Le calcul des tunnels par la méthode convergence-confinement).
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import TYPE_CHECKING

from mpi4py import MPI

from fenics_bridge.errors import agree, is_finite
from fenics_bridge.fem.loads import Load

if TYPE_CHECKING:
    from fenics_bridge.fem.quasi_static import QuasiStatic
    from fenics_bridge.fem.stages import SiteState, Stage


def wrong_deconfinement(stage: Stage, where: str) -> str | None:
    """Error in the deconfinement of a stage; None without an error. where: what begins the message."""
    given = stage.deconfinement
    if isinstance(given, bool) or not (is_finite(given) and 0 < given <= 1):
        return f"{where}deconfinement is {given!r}, expected a fraction above 0 and up to 1, such as 0.4"
    if given == 1:
        return None
    whole, members = "", stage.install if isinstance(stage.install, dict) else {}
    stressed = next((name for name, member in members.items() if getattr(member, "prestress", 0)), None)
    if stage.fill:
        whole = f"fills {list(stage.fill)}, only a part of whose weight would act"
    elif any(value for support in stage.support for value in support.displacement or ()):
        whole = "prescribes displacements, only a part of which would happen"
    elif stressed is not None:
        whole = f"installs {stressed!r} with a prestress, only a part of which would act on the ground"
    expected = "expected 1 there, and the deconfinement in another stage"
    return f"{where}deconfinement is {given:g} in a stage that {whole}; {expected}" if whole else None


def reached_by(stage: Stage, now: Load, load: Load, state: SiteState) -> Load:
    """The load with which a stage ends.

    Args:
        stage: the stage.
        now: load after its changes, which holds all that is out of balance.
        load: load when all of it is released.
        state: the state that the stage leads to.
    """
    if stage.deconfinement == 1:
        return load
    part = now.towards(load, stage.deconfinement)
    weights = part.unit_weight
    # Soil that has been dug away has no weight, which would else be warned of.
    return replace(
        part, unit_weight={tag: weights[tag] for tag in state.there} if isinstance(weights, dict) else weights
    )


def require_released(comm: MPI.Comm, stage: Stage, reason: str) -> None:
    """Raise InputError where a stage leaves forces held. Collective.

    Args:
        comm: the ranks.
        stage: the stage.
        reason: why it must not, for the message.
    """
    problem = f"stage {stage.name!r}: deconfinement is {stage.deconfinement:g}, expected 1: {reason}"
    agree(comm, problem if stage.deconfinement < 1 else None)


def refuse_held(comm: MPI.Comm, fem: QuasiStatic) -> None:
    """Raise InputError where particles would begin from a body in equilibrium that forces of its last stage hold. Collective."""
    problem = (
        f"the load of the finite elements holds {fem.load.held:.3g} of the out-of-balance forces of its last stage, which particles would release at "
        "once: expected deconfinement = 1 in the last stage before particles take over"
    )
    agree(comm, problem if fem.converged and fem.load.held > 0 else None)


def warn_of_held(comm: MPI.Comm, load: Load) -> None:
    """Warn of a factor of safety under forces that a stage holds."""
    if isinstance(load, Load) and load.held > 0 and comm.rank == 0:
        warnings.warn(
            f"the load holds {load.held:.3g} of the out-of-balance forces of the last stage, and these forces support the ground in the factor of "
            "safety, though nothing that is built bears them; a further stage with deconfinement = 1 releases them",
            RuntimeWarning,
            stacklevel=3,
        )
