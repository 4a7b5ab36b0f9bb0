"""Strains of structural members by the displacements of their nodes: of chains of segments, and of shells of revolution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class MemberStrains:
    """Linear operators from the displacements of a member's nodes to its strains, small rotations.

    Strains are those of its segments, followed by curvatures where it bends, at its inner nodes and then at its ends if these bend:
    the change of direction there over half the length of the two segments beside it (a chain of stiff segments with springs between
    them, which converges to the beam of Euler and Bernoulli with the square of the segments' length).
    """

    operator: NDArray[np.float64]
    """Strain [-] or curvature [1/m] by displacement component, shape (k, n, D)"""
    lengths: NDArray[np.float64]
    """Length over which each strain acts [m], area of one radian of a shell [m2], shape (k,)"""
    segments: int
    """Number of segments, whose axial strains come first"""
    bends_at: tuple[tuple[int, ...], ...]
    """Nodes of each curvature: one, or both ends of a ring"""
    hoops: int = 0
    """Number of hoop strains, which come last, followed by as many hoop curvatures"""

    @property
    def of_hoops(self) -> tuple[slice, slice]:
        """Where the hoop strains and the hoop curvatures are."""
        end = len(self.lengths)
        return slice(end - 2 * self.hoops, end - self.hoops), slice(end - self.hoops, end)

    @property
    def is_axial(self) -> NDArray[np.bool_]:
        """Which strains are changes of length, rather than curvatures: (k,)."""
        axial = np.arange(len(self.lengths)) < self.segments
        axial[self.of_hoops[0]] = True
        return axial


def member_strains(
    nodes: NDArray[np.float64], bends: bool, closed: bool = False, clamped: tuple[bool, bool] = (False, False)
) -> MemberStrains:
    """The strains of a chain of nodes.

    Args:
        nodes: positions (n, D) [m].
        bends: whether there are curvatures.
        closed: whether the last node is where the first is, and the chain bends there.
        clamped: whether the chain cannot turn at its first and at its last node.
    """
    n, dim = nodes.shape
    edges = np.diff(nodes, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    along = edges / lengths[:, None]
    axial = np.zeros((n - 1, n, dim))
    rows = np.arange(n - 1)
    axial[rows, rows] = -along / lengths[:, None]
    axial[rows, rows + 1] = along / lengths[:, None]
    if not bends:
        return MemberStrains(axial, lengths, n - 1, ())
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    rotation = np.zeros((n - 1, n, dim))
    rotation[rows, rows] = -across / lengths[:, None]
    rotation[rows, rows + 1] = across / lengths[:, None]
    turns, halves = list(np.diff(rotation, axis=0)), list((lengths[1:] + lengths[:-1]) / 2)
    bends_at: list[tuple[int, ...]] = [(k,) for k in range(1, n - 1)]
    if closed:
        turns.append(rotation[0] - rotation[-1])
        halves.append((lengths[0] + lengths[-1]) / 2)
        bends_at.append((0, n - 1))
    # A clamped end is the middle of two segments that mirror one another: it turns by twice the angle of one over its length.
    for end, sign, segment in ((0, 1.0, 0), (n - 1, -1.0, -1)):
        if clamped[0 if end == 0 else 1]:
            turns.append(sign * rotation[segment])
            halves.append(lengths[segment] / 2)
            bends_at.append((end,))
    curvature = np.reshape([turn / half for turn, half in zip(turns, halves)], (-1, n, dim))
    return MemberStrains(np.concatenate([axial, curvature]), np.append(lengths, halves), n - 1, tuple(bends_at))


def shell_strains(strains: MemberStrains, nodes: NDArray[np.float64]) -> MemberStrains:
    """The strains of a shell of revolution about x = 0, of which a chain of nodes is the meridian.

    Each segment also has a hoop strain u / r and a hoop curvature theta (dr/ds) / r, with its rotation theta (Timoshenko and
    Woinowsky-Krieger 1959, chapters 3 and 15). Lengths are times the radius: areas of one radian.

    Args:
        strains: those of the meridian.
        nodes: positions (n, 2) [m], whose first coordinate is the radius.
    """
    n, edges = len(nodes), np.diff(nodes, axis=0)
    lengths = np.linalg.norm(edges, axis=1)
    middle, rows = nodes[:-1, 0] + edges[:, 0] / 2, np.arange(n - 1)
    hoop, turn = np.zeros((n - 1, n, 2)), np.zeros((n - 1, n, 2))
    hoop[rows, rows, 0] = hoop[rows, rows + 1, 0] = 0.5 / middle
    across = np.stack([-edges[:, 1], edges[:, 0]], axis=1) / lengths[:, None] ** 2
    leans = edges[:, 0] / lengths / middle
    turn[rows, rows], turn[rows, rows + 1] = -leans[:, None] * across, leans[:, None] * across
    areas = lengths * middle
    # A curvature acts over the halves of segments beside its node.
    halves = np.zeros(n)
    halves[:-1] += lengths / 4 * (nodes[:-1, 0] + middle)
    halves[1:] += lengths / 4 * (middle + nodes[1:, 0])
    bending = [sum(halves[list(at)]) for at in strains.bends_at]
    # Rotations are linear between the middles of segments and fall to zero at a clamped end: a quarter of a segment has none there.
    turned = areas.copy()
    for at in (0, -1):
        if (at % n,) in strains.bends_at:
            turned[at] *= 0.75
    operator = np.concatenate([strains.operator, hoop, turn])
    weights = np.concatenate([areas, bending, areas, turned])
    return MemberStrains(operator, weights, strains.segments, strains.bends_at, n - 1)
