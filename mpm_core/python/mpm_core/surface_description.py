"""Rigid surfaces and interfaces as models describe them, and as checkpoints have them."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from ._core import InputError
from .surfaces import KINDS, Surface
from .triangles import Triangles

if TYPE_CHECKING:
    from .model import Model


def checked(surface: Surface, dim: int) -> Any:
    """The surface in the core, and the point about which it rotates.

    Raises:
        InputError: no surface, or one of another dimension.
    """
    if not isinstance(surface, tuple(KINDS.values())):
        raise InputError(f"surface is {surface!r}, expected a {', '.join(KINDS)}")
    return surface._checked(dim)


def described(surface: Surface) -> dict[str, Any]:
    """A surface as checkpoints have it; triangles by their fingerprint."""
    if isinstance(surface, Triangles):
        return {"kind": "Triangles", "fingerprint": surface.fingerprint, "triangles": len(surface.triangles)}
    shape = {field.name: _plain(getattr(surface, field.name)) for field in fields(surface)}
    return {"kind": type(surface).__name__, **shape}


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool) or value is None else np.asarray(value, dtype=float).tolist()


def require_surfaces(model: Model, surfaces: list[dict[str, Any]]) -> None:
    """Raises InputError where the model does not have the triangles of a surface in a checkpoint."""
    for surface in surfaces:
        if surface["kind"] == "Triangles" and surface["fingerprint"] not in model._triangulated:
            raise InputError(
                f"the checkpoint has contact with a surface of {surface['triangles']} triangles that the model does not have; "
                "give the model soil and add the surface by model.add_contact or add_field_contact before model.restore, which replaces both"
            )


def surface_of(model: Model, described: dict[str, Any]) -> Surface:
    """The surface that a checkpoint describes."""
    if described["kind"] == "Triangles":
        return model._triangulated[described["fingerprint"]]
    surface: Surface = KINDS[described["kind"]](**{key: value for key, value in described.items() if key != "kind"})
    return surface


def place_of(number: int, what: str, there: list[Any], those: str) -> int:
    """The number of a surface or contact among those of a model, which `Model.restore` replaces.

    Raises:
        InputError: the model has fewer since it was restored.
    """
    if number >= len(there):
        raise InputError(
            f"{what} {number} is not in the model, which has {len(there)} since it was restored; expected one of {those}"
        )
    return number
