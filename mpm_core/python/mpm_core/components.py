"""Names of the components of vectors, tensors and states, in tables, files and probes."""

from __future__ import annotations

from collections.abc import Sequence

AXES = {2: ("x", "y"), 3: ("x", "y", "z")}
"""Of vectors, by the dimension"""
SYMMETRIC = {2: ("xx", "yy", "zz", "xy"), 3: ("xx", "yy", "zz", "xy", "yz", "xz")}
"""Of symmetric tensors such as the stress, by the dimension"""

STATE = "state"
"""The field of the state variables, which are neither vector nor tensor however many a law has; they are numbered"""


def is_vector(name: str, width: int, dim: int) -> bool:
    """Whether a field of that many components is a vector."""
    return width == dim and name != STATE


def tensor_components(name: str, width: int, axisymmetric: bool = False) -> Sequence[str] | None:
    """Names of the components of a tensor field, or numbers of state variables.

    Args:
        name: of the field; that of a gradient ends with ``_gradient``, and ``_xy`` is then the derivative along y of component x.
        width: number of components.
        axisymmetric: whether the third axis of a symmetric tensor is the hoop.

    Returns:
        The names; None for another field.
    """
    if name == STATE:
        return [str(number) for number in range(width)]
    for dim, axes in AXES.items():
        if name.endswith("_gradient") and width == dim**2:
            return [f"{of}{along}" for of in axes for along in axes]
    names = {len(each): each for each in SYMMETRIC.values()}.get(width)
    return [each.replace("zz", "hoop") for each in names] if names and axisymmetric else names
