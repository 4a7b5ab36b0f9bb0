"""Errors of the bridge that are raised on all ranks alike."""

from __future__ import annotations

from typing import Any

import numpy as np
from dolfinx.mesh import Mesh
from mpi4py import MPI
from mpm_core.collective import collectively
from numpy.typing import NDArray

from mpm_core import InputError, checks

__all__ = ["InputError", "agree", "is_finite", "real_numbers", "require_mesh"]


def agree(comm: MPI.Comm, message: str | None) -> None:
    """Raise an error on all ranks if there is one on any. Collective.

    Call it before communication that would hang or crash if one rank had left.

    Args:
        comm: the ranks.
        message: what is wrong on this rank; None means no error.

    Raises:
        InputError: with the message of the lowest rank that gives one.
    """
    first = next((text for text in comm.allgather(message) if text is not None), None)
    if first is not None:
        raise InputError(first)


def is_finite(value: Any) -> bool:
    """Whether a value is a number, and a finite one."""
    return isinstance(value, (int, float, np.number)) and bool(np.isfinite(value))


def real_numbers(comm: MPI.Comm, name: str, values: Any) -> NDArray[np.float64]:
    """Real numbers of any shape, float64. Collective.

    Args:
        comm: the ranks.
        name: of the argument, for the error.
        values: numbers or arrays of them.

    Raises:
        InputError: text, complex numbers or other things on any rank. Raised on all ranks alike.
    """
    return collectively(comm, lambda: checks.real_numbers(name, values))


PARTED = "parted_along_walls"
"""Attribute of meshes whose nodes are doubled along walls"""


def require_mesh(domain: Any, connected: bool = False) -> None:
    """Require that an argument is a mesh, before its communicator is used. Not collective.

    Args:
        domain: the argument.
        connected: whether its soil must hold together on both sides of walls.

    Raises:
        InputError: it is something else, such as a mesh together with its tags, or a mesh that is parted along walls.
    """
    if isinstance(domain, Mesh):
        if connected and getattr(domain, PARTED, False):
            raise InputError(
                "domain is parted along walls, where its soil would come apart, expected the mesh without walls: that of "
                "soil_mesh(..., walls=...) is for water.Seepage"
            )
        return
    whole = isinstance(domain, (tuple, list)) and len(domain) > 0 and isinstance(domain[0], Mesh)
    hint = ", the first of these: domain, cell_tags, facet_tags = ..." if whole else ""
    shown = f"a {type(domain).__name__} of {len(domain)} things" if whole else repr(domain)
    raise InputError(f"domain is {shown}, expected a mesh of DOLFINx{hint}")
