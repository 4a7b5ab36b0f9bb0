"""The bond between bars and soil in finite elements: its strength at the nodes, and the stiffness of a bar that slips."""

from __future__ import annotations

import numpy as np
from mpm_core.members import Member
from numpy.typing import NDArray

from mpm_core import _core

AT_LIMIT = 1e-9
"""Distance from a limit, relative to it, below which a force is at it"""


def bond_strengths(member: Member, lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest force between each node of a bar and the soil: over half of the segments beside it (n,) [N/m].

    Args:
        member: the bar.
        lengths: of its segments [m], shape (n - 1,).
    """
    properties = member.bond_strength, member.free_length > 0, member.connected, member.fixed_end
    return np.array(_core.bond_strengths(lengths, *properties))


def slip_tangent(
    force: NDArray[np.float64],
    limits: tuple[NDArray[np.float64], NDArray[np.float64]],
    bond: NDArray[np.float64],
    lengths: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Derivative of the axial strains of a bar by those that it would have without slip (n, n) [-].

    Segments between which the bond yields slip as one: the forces of all of them change alike, by the mean of their strains. Where one
    of them yields, or the bond yields at an end, beyond which there is no force, theirs do not change.

    Args:
        force: axial forces of the segments [N/m], shape (n,).
        limits: least and largest axial force of each [N/m].
        bond: strength of the bond at the nodes [N/m], shape (n + 1,).
        lengths: of the segments [m].
    """
    change = np.abs(np.diff(force, prepend=0.0, append=0.0))
    slips = change >= bond * (1 - AT_LIMIT)
    yields = (force <= limits[0] * (1 - AT_LIMIT)) | (force >= limits[1] * (1 - AT_LIMIT))
    group = np.cumsum(~slips[1:-1])
    group = np.concatenate([[0], group])
    tangent = np.zeros((len(force), len(force)))
    for number in range(group[-1] + 1):
        rows = np.flatnonzero(group == number)
        held = yields[rows].any() or (rows[0] == 0 and slips[0]) or (rows[-1] == len(force) - 1 and slips[-1])
        if not held:
            tangent[np.ix_(rows, rows)] = lengths[rows] / lengths[rows].sum()
    return tangent
