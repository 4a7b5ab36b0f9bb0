"""Shear strength of rigid surfaces: friction, adhesion and drag, the same everywhere or by segments or triangles."""

from __future__ import annotations

import hashlib
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import positive, shown
from .mesh import floats
from .surfaces import Polyline, Surface
from .triangles import Triangles

if TYPE_CHECKING:
    from .model import Model

UNITS = {"friction": "(a coefficient)", "adhesion": "Pa", "drag": "(a coefficient)"}
"""What the shear strength of a contact consists of, mu sigma_n + a + C rho v^2, in the order of the core"""


def checked_strength(surface: Surface, **values: ArrayLike) -> dict[str, NDArray[np.float64]]:
    """Friction, adhesion and drag as arrays, without shape or with the shape (parts,).

    Raises:
        InputError: no numbers, negative ones, or as many as the surface does not have segments or triangles.
    """
    return {name: _checked(name, value, surface) for name, value in values.items()}


def _checked(name: str, value: ArrayLike, surface: Surface) -> NDArray[np.float64]:
    if np.ndim(value) == 0:
        return np.array(positive(name, value, UNITS[name], zero=True))  # type: ignore[arg-type]
    parts, kind = _parts(surface)
    if not parts:
        raise InputError(
            f"{name} is {shown(value)}, expected a number; one for each part is possible on a Polyline or on Triangles"
        )
    array = floats(name, value, (None,))
    if len(array) != parts:
        raise InputError(f"{name} has {len(array)} numbers, expected one, or one for each of {parts} {kind}")
    if (array < 0).any():
        k = int(np.argmin(array))
        raise InputError(f"{name} is {array[k]} {UNITS[name]} at index {k}, expected numbers not below zero")
    return array


def _parts(surface: Surface) -> tuple[int, str]:
    """How many parts a surface has that may differ in strength, and what they are."""
    if isinstance(surface, Triangles):
        return len(surface.triangles), "triangles"
    if isinstance(surface, Polyline):
        return len(np.asarray(surface.points)) - (0 if surface.closed else 1), "segments"
    return 0, ""


def described_strength(surface: Surface, strength: dict[str, NDArray[np.float64]]) -> dict[str, Any]:
    """Friction, adhesion and drag as checkpoints have them: a number, or values by part.

    As with the surfaces themselves, those of segments are all there, and of triangles, which may be millions, a fingerprint.
    """
    return {name: _described(surface, values) for name, values in strength.items()}


def _described(surface: Surface, values: NDArray[np.float64]) -> float | dict[str, Any]:
    if values.ndim == 0:
        return float(values)
    there = {"parts": len(values), "largest": float(values.max())}
    if isinstance(surface, Polyline):
        return {"values": values.tolist(), **there}
    return {"fingerprint": _fingerprint(values), **there}


def _fingerprint(values: NDArray[np.float64]) -> str:
    return hashlib.blake2b(values.tobytes(), digest_size=16).hexdigest()


def remember_strength(model: Model, strength: dict[str, NDArray[np.float64]]) -> None:
    """Keep values by part in the model, since checkpoints have fingerprints only of those of triangles."""
    for values in strength.values():
        if values.ndim:
            model._values_of_parts[_fingerprint(values)] = values


def largest(described: float | dict[str, Any]) -> float:
    """The largest friction, adhesion or drag of a surface."""
    return float(described["largest"] if isinstance(described, dict) else described)


def is_rough(entry: dict[str, Any]) -> bool:
    """Whether anything resists sliding on a surface."""
    return any(largest(entry[name]) > 0 for name in UNITS)


def strength_of(model: Model, entry: dict[str, Any]) -> NDArray[np.float64]:
    """Friction, adhesion and drag of a surface, shape (1 or parts, 3)."""
    columns = []
    for name in UNITS:
        described = entry[name]
        columns.append(_values(model, described) if isinstance(described, dict) else np.array([described]))
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def _values(model: Model, described: dict[str, Any]) -> NDArray[np.float64]:
    """The values by part that a checkpoint describes."""
    if "values" in described:
        return np.array(described["values"])
    values: NDArray[np.float64] = model._values_of_parts[described["fingerprint"]]
    return values


def strength_text(entry: dict[str, Any]) -> str:
    """The strength of a surface in words."""
    texts = [f"friction {_range(entry['friction'])}", f"adhesion {_range(entry['adhesion'])} Pa"]
    if largest(entry["drag"]) > 0:
        texts.append(f"drag {_range(entry['drag'])}")
    return ", ".join(texts)


def _range(described: float | dict[str, Any]) -> str:
    return f"up to {described['largest']:g}" if isinstance(described, dict) else f"{described:g}"


def require_strengths(model: Model, contacts: list[dict[str, Any]]) -> None:
    """Raises InputError where the model does not have the values by part of a surface in a checkpoint."""
    for entry in contacts:
        for name in UNITS:
            described = entry[name]
            known = not isinstance(described, dict) or "values" in described
            if not known and described["fingerprint"] not in model._values_of_parts:
                raise InputError(
                    f"the checkpoint has contact with a {entry['surface']['kind']} whose {name} differs between its {described['parts']} "
                    "parts by values that the model does not have; give the model soil and add the contact by model.add_contact "
                    "before model.restore, which replaces both"
                )
