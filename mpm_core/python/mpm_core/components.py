"""Names of the components of vectors and tensors, in tables, files and probes."""

from __future__ import annotations

from collections.abc import Sequence

AXES = {2: ("x", "y"), 3: ("x", "y", "z")}
"""Of vectors, by the dimension"""
SYMMETRIC = {2: ("xx", "yy", "zz", "xy"), 3: ("xx", "yy", "zz", "xy", "yz", "xz")}
"""Of symmetric tensors such as the stress, by the dimension"""


def tensor_components(name: str, width: int, axisymmetric: bool = False) -> Sequence[str] | None:
    """Names of the components of a tensor field.

    Args:
        name: of the field; that of a gradient ends with ``_gradient``, and ``_xy`` is then the derivative along y of component x.
        width: number of components.
        axisymmetric: whether the third axis of a symmetric tensor is the hoop.

    Returns:
        The names; None for a field that is no tensor.
    """
    for dim, axes in AXES.items():
        if name.endswith("_gradient") and width == dim**2:
            return [f"{of}{along}" for of in axes for along in axes]
    names = {len(each): each for each in SYMMETRIC.values()}.get(width)
    return [each.replace("zz", "hoop") for each in names] if names and axisymmetric else names
