"""Types that the signatures of the bridge share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fenics_bridge.compat import MeshTags

__all__ = ["Law", "Laws", "MeshTags", "OfPosition"]

Law = Any
"""A constitutive law of `mpm_core`, such as `MohrCoulomb`."""

Laws = Law | dict[int | str, Law]
"""One law, or laws by cell tag or name."""

OfPosition = Callable[[NDArray[np.float64]], ArrayLike]
"""A function of positions (n, D) [m] that returns a value for each of them."""
