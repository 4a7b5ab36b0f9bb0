"""The force of a flow that a wall stops, by the balances of mass and momentum over the bore that goes back from the wall.

A layer of depth h and velocity u comes in; behind the bore, which goes back with the speed s, it is at rest and has the depth
H. Both have a pressure on vertical planes that rises linearly with depth, K_1 and K_2 times the vertical one. Per width

    mass      h (u + s) = H s
    momentum  rho h u (u + s) = rho g (K_2 H^2 - K_1 h^2) / 2,   force on the wall  F = rho g K_2 H^2 / 2

With K_1 = K_2 = 1 these are the jump conditions of shallow water. Sand that is pushed together has Rankine's passive pressure.
"""

from __future__ import annotations

import numpy as np


def bore(froude: float, after: float, before: float) -> tuple[float, float]:
    """Depth behind the bore over that of the flow, and force on the wall over rho g h^2.

    Args:
        froude: u / sqrt(g h) of the flow.
        after, before: K_2 and K_1.
    """
    # With x = H / h: x^3 K_2 - x^2 K_2 - x (K_1 + 2 Fr^2) + K_1 = 0, whose largest root is the bore's.
    x = float(np.roots([after, -after, -(before + 2 * froude**2), before]).real.max())
    return x, 0.5 * after * x * x
