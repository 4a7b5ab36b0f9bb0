"""Conductivities that differ with the direction, as the core takes them: a tensor for each law."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._core import InputError
from .checks import real_numbers


def tensors_of_laws(anisotropy: Any, laws: int, dim: int) -> list[list[list[float]]]:
    """Tensors of the conductivity over its number for each law, (3, 3); nothing where all soil is isotropic.

    Raises:
        InputError: neither (D,) nor (D, D), nor one for each law, or a tensor that is not symmetric and positive.
    """
    if anisotropy is None:
        return []
    one_each = isinstance(anisotropy, (list, tuple)) and any(part is None or np.ndim(part) for part in anisotropy)
    if one_each and len(anisotropy) != laws and None not in anisotropy and np.shape(anisotropy) == (dim, dim):
        one_each = False  # a tensor, as lists
    given = list(anisotropy) if one_each else [anisotropy] * laws
    if len(given) != laws:
        raise InputError(
            f"anisotropy has {len(given)} entries, expected {dim} factors, or an entry for each of the {laws} laws"
        )
    return [_tensor(entry, dim) for entry in given]


def _tensor(entry: Any, dim: int) -> list[list[float]]:
    try:
        values = np.ones(dim) if entry is None else real_numbers("anisotropy", entry)
    except InputError:
        values = np.empty(0)
    square = np.diag(values) if values.shape == (dim,) else values
    good = square.shape == (dim, dim) and bool(np.all(np.isfinite(square))) and np.allclose(square, square.T)
    if not (good and np.linalg.eigvalsh(square)[0] > 0):
        raise InputError(
            f"anisotropy is {entry!r}, expected {dim} positive factors, one along each axis, or a symmetric ({dim}, {dim}) tensor "
            "with positive principal values"
        )
    tensor = np.eye(3)
    tensor[:dim, :dim] = 0.5 * (square + square.T)
    return tensor.tolist()
