"""Structural members that are embedded in soil: bars and struts, and beams in plane strain and axial symmetry."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import flag, positive, real_numbers, within
from .member_strains import MemberStrains, member_strains, shell_strains

SAMPLES = 100
"""Points along a line at which the size of the cells around it is looked up"""

CLOSED = 1e-6
"""Distance of the last point of a closed line from its first, over its length, at most: corners of a circle are rounded"""


@dataclass(frozen=True)
class Member:
    """A structural member along a line; see `bar`, `strut` and `beam`, which make one.

    Stiffness, strength and forces are per metre out of the plane in plane strain (those of one nail or anchor over their distance
    in this direction), and those of the member itself in three dimensions.
    """

    points: tuple[tuple[float, ...], ...]
    """Corners of its line [m], in order"""
    axial_stiffness: float
    """E A [N/m], [N] in three dimensions"""
    bending_stiffness: float = 0.0
    """E I [N m2/m]; 0 without bending"""
    tensile_strength: float = math.inf
    """Largest axial force [N/m], at which the member yields"""
    compressive_strength: float = math.inf
    """Largest axial force in compression [N/m], a positive number"""
    plastic_moment: float = math.inf
    """Largest bending moment [N m/m]"""
    prestress: float = 0.0
    """Axial force with which the member is installed [N/m], tension positive"""
    bond_strength: float = math.inf
    """Largest force between the member and the soil along it, per length [N/m2]; infinite without slip"""
    free_length: float = 0.0
    """Length from its first point on without any bond [m]: that of an anchor before its grouted body"""
    connected: bool = False
    """Whether its first point does not slip, being connected to a plate, a wall or another member there"""
    bonded: bool = True
    """Whether the member moves with the soil along its whole length, or only its two ends do"""
    fixed_end: bool = False
    """Whether its last point is held in space"""
    spacing: float | None = None
    """Length of the segments into which it is divided [m]; None for a length that suits the cells"""
    clamped_start: bool = False
    """Whether a beam cannot turn at its first point, as on an axis of symmetry"""
    clamped_end: bool = False
    """Whether a beam cannot turn at its last point"""
    impervious: bool = False
    """Whether water does not flow through a beam, so that pore pressures may differ on both sides of it"""

    @property
    def dim(self) -> int:
        """Dimension of the space, 2 or 3."""
        return len(self.points[0])

    @property
    def length(self) -> float:
        """Length of the line [m]."""
        return float(np.linalg.norm(np.diff(self.points, axis=0), axis=1).sum())

    @property
    def closed(self) -> bool:
        """Whether its last point is its first, as in the lining of a tunnel."""
        return len(self.points) > 2 and math.dist(self.points[0], self.points[-1]) <= CLOSED * self.length

    def strains(self, nodes: NDArray[np.float64], of_revolution: bool = False) -> MemberStrains:
        """Its strains by the displacements of its nodes (n, D) [m].

        Args:
            nodes: positions of the nodes.
            of_revolution: whether it is a shell of revolution about x = 0, in axial symmetry.
        """
        clamped = self.clamped_start, self.clamped_end
        strains = member_strains(nodes, self.bending_stiffness > 0, self.closed, clamped)
        return shell_strains(strains, nodes) if of_revolution else strains

    def nodes(self, spacing: float) -> NDArray[np.float64]:
        """Positions (n, D) [m] that divide the line into equal segments between its corners.

        Args:
            spacing: length of the segments [m], where the member has none of its own; a member that is not bonded has one segment.
        """
        corners = np.array(self.points)
        if not self.bonded:
            return corners[[0, -1]]
        parts = [corners[:1]]
        if self.free_length:
            along = (corners[1] - corners[0]) / np.linalg.norm(corners[1] - corners[0])
            corners = np.concatenate([corners[:1] + self.free_length * along, corners[1:]])
            parts.append(corners[:1])
        for start, end in zip(corners, corners[1:]):
            count = max(1, math.ceil(float(np.linalg.norm(end - start)) / (self.spacing or spacing) - 1e-6))
            parts.append(start + np.linspace(0, 1, count + 1)[1:, None] * (end - start))
        return np.concatenate(parts)


def samples_of(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (SAMPLES, D) [m] along a line (k, D) [m]."""
    ends = np.linspace(0, len(line) - 1, SAMPLES)
    part = np.minimum(ends.astype(int), len(line) - 2)
    return line[part] + (ends - part)[:, None] * (line[part + 1] - line[part])


def bar(
    points: ArrayLike,
    axial_stiffness: float,
    tensile_strength: float = math.inf,
    compressive_strength: float = math.inf,
    prestress: float = 0.0,
    bond_strength: float = math.inf,
    free_length: float = 0.0,
    connected: bool = False,
    spacing: float | None = None,
) -> Member:
    """A bar that moves with the soil along its whole length: a soil nail, a geogrid, the grouted body of an anchor.

    It slips along the soil where the force between both exceeds the strength of their bond, and is pulled out where this holds all
    along it. Without a bond strength it is pulled out when the soil around it yields, which in plane strain is far too late for
    nails and anchors: their bond is that of their surface, not of two planes.

    Args:
        points: two or more points of its line [m], shape (k, D).
        axial_stiffness: E A [N/m], [N] in three dimensions.
        tensile_strength: largest axial force [N/m], at which it yields; by default it stays elastic.
        compressive_strength: largest axial force in compression [N/m], a positive number; 0 for geogrids, which carry none.
        prestress: axial force with which it is installed [N/m], tension positive.
        bond_strength: largest force between bar and soil per length of the bar [N/m2], [N/m] in three dimensions: the skin friction
            times the circumference, over the distance of the bars in plane strain; of a geogrid that of both of its faces.
        free_length: length from its first point on without any bond [m]: an anchor is a bar whose grouted body begins there.
        connected: whether its first point does not slip, as the head of a nail at its plate or of an anchor at a wall.
        spacing: length of the segments into which it is divided [m]; by default about the distance of the nodes around it.

    Raises:
        InputError: a value is out of range.

    Example:
        >>> skin = 100e3 * math.pi * 0.1 / 1.5  # 100 kPa on a grout of 0.1 m, every 1.5 m
        >>> nail = mpm.bar([(4.0, 6.0), (-2.0, 5.0)], 70e6, tensile_strength=120e3, bond_strength=skin, connected=True)
    """
    return _made(points, axial_stiffness, tensile_strength=tensile_strength, compressive_strength=compressive_strength,
                 prestress=prestress, bond_strength=bond_strength, free_length=free_length, connected=connected, spacing=spacing)  # fmt: skip


def strut(
    start: ArrayLike,
    end: ArrayLike,
    axial_stiffness: float,
    tensile_strength: float = math.inf,
    compressive_strength: float = math.inf,
    prestress: float = 0.0,
    fixed_end: bool = False,
) -> Member:
    """A straight member whose two ends alone are connected with the soil or with a wall: a strut, a tie, the free length of an anchor.

    Args:
        start: one end [m], shape (D,).
        end: the other end [m], shape (D,).
        axial_stiffness: E A [N/m], [N] in three dimensions.
        tensile_strength: largest axial force [N/m], at which it yields; 0 for a strut that is only pressed against the wall.
        compressive_strength: largest axial force in compression [N/m], a positive number; 0 for a cable.
        prestress: axial force with which it is installed [N/m], tension positive: negative for a strut that is jacked against the walls.
        fixed_end: whether `end` is held in space, as the middle of a strut on the axis of symmetry, or an anchor in rock outside of
            the mesh.

    Raises:
        InputError: a value is out of range.

    Example:
        >>> strut = mpm.strut((5.0, 8.5), (0.0, 8.5), axial_stiffness=400e6, prestress=-50e3, fixed_end=True)
    """
    return _made((start, end), axial_stiffness, tensile_strength=tensile_strength, compressive_strength=compressive_strength,
                 prestress=prestress, bonded=False, fixed_end=fixed_end)  # fmt: skip


def beam(
    points: ArrayLike,
    axial_stiffness: float,
    bending_stiffness: float,
    plastic_moment: float = math.inf,
    bond_strength: float = math.inf,
    spacing: float | None = None,
    clamped_start: bool = False,
    clamped_end: bool = False,
    impervious: bool = False,
) -> Member:
    """A beam that bends with the soil: a sheet-pile or diaphragm wall, a row of piles, the lining of a tunnel.

    It is for plane strain and, as a shell of revolution, for axisymmetric finite elements. Its ends are free of moments unless they
    are clamped. A line whose last point is its first is a ring, which bends there as elsewhere. Shear strains are left out (Euler
    and Bernoulli). It slips along the soil where the force between both exceeds the strength of their bond, but does not part from
    it.

    Args:
        points: two or more points of its line [m], shape (k, 2).
        axial_stiffness: E A [N/m].
        bending_stiffness: E I [N m2/m].
        plastic_moment: largest bending moment [N m/m], at which a plastic hinge forms; by default it stays elastic.
        bond_strength: largest force between both sides of the beam and the soil per length of the beam [N/m2].
        spacing: length of the segments into which it is divided [m]; by default about the distance of the nodes around it, and in
            finite elements whose edges it follows their nodes along it.
        clamped_start: whether it cannot turn at its first point: where a raft or a lining is cut by an axis of symmetry. Clamped ends
            are for finite elements.
        clamped_end: whether it cannot turn at its last point.
        impervious: whether it holds back water: pore pressures that are prescribed to finite elements are taken on both sides of it,
            and what differs acts on it. Meshes must follow it then.

    Raises:
        InputError: a value is out of range.

    Example:
        >>> wall = mpm.beam([(5.0, 10.0), (5.0, 2.0)], axial_stiffness=2.7e9, bending_stiffness=44e6)  # AZ 18
    """
    bending_stiffness = float(positive("bending_stiffness", bending_stiffness, "N m2/m"))
    return _made(points, axial_stiffness, bending_stiffness=bending_stiffness, plastic_moment=plastic_moment,
                 bond_strength=bond_strength, spacing=spacing, clamped_start=clamped_start, clamped_end=clamped_end,
                 impervious=impervious)  # fmt: skip


def _made(points: Any, axial_stiffness: float, **values: Any) -> Member:
    """A member of plain numbers, which checkpoints can hold; raises InputError for values that are not possible."""
    points = real_numbers("points", points)
    if points.ndim != 2 or len(points) < 2 or points.shape[1] not in (2, 3) or not np.all(np.isfinite(points)):
        raise InputError(f"points is {points.tolist()}, expected two or more finite points (x, y) or (x, y, z) [m]")
    edges = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if np.any(edges == 0):
        raise InputError(f"points is {points.tolist()}, expected points that differ from the one before")
    if "bending_stiffness" in values and points.shape[1] == 3:
        raise InputError("points has three dimensions, expected two: beams are for plane strain and axial symmetry")
    for name in ("tensile_strength", "compressive_strength", "plastic_moment", "bond_strength"):
        values[name] = within(name, values.get(name, math.inf), 0.0, math.inf)
    for name in ("fixed_end", "connected", "clamped_start", "clamped_end", "impervious"):
        values[name] = bool(flag(name, values.get(name, False)))
    if values.get("spacing") is not None:
        values["spacing"] = float(positive("spacing", values["spacing"], "m"))
    values["free_length"] = within("free_length", values.get("free_length", 0.0), 0.0, float(edges[0]), open_above=True)
    stiffness = float(positive("axial_stiffness", axial_stiffness, "N/m"))
    member = Member(tuple(map(tuple, points.tolist())), stiffness, **values)
    if member.tensile_strength == member.compressive_strength == 0:
        raise InputError(
            "tensile_strength and compressive_strength are 0, expected one above it: the member carries nothing"
        )
    prestress = within("prestress", member.prestress, -math.inf, math.inf)
    for name, limit in (
        ("tensile_strength", member.tensile_strength),
        ("compressive_strength", member.compressive_strength),
    ):
        force = prestress if name == "tensile_strength" else -prestress
        if force > limit:
            kind = name.split("_")[0]
            raise InputError(
                f"prestress is {prestress:g} N/m, expected a {kind} force up to {name}, {limit:g} N/m; tension is positive, and a strut that is "
                "pressed against a wall has a negative prestress"
            )
    if math.isinf(prestress):
        raise InputError(f"prestress is {prestress}, expected a finite number")
    if member.closed and (member.clamped_start or member.clamped_end):
        raise InputError("clamped_start or clamped_end of a line whose last point is its first, expected an open line")
    return replace(member, prestress=prestress)


@dataclass(frozen=True)
class MemberForces:
    """Forces of a member, along its line. Those of plane strain are per metre, those of axial symmetry per metre of their section."""

    positions: NDArray[np.float64]
    """Its nodes as they were installed [m], shape (n, D)"""
    displacement: NDArray[np.float64]
    """Their displacement since then [m], shape (n, D)"""
    axial_force: NDArray[np.float64]
    """Axial force of each segment [N/m], tension positive, shape (n - 1,)"""
    moment: NDArray[np.float64]
    """Bending moment at the nodes [N m/m], 0 at free ends, shape (n,); positive where its left side, seen along its line, is compressed"""
    hoop_force: NDArray[np.float64] | None = None
    """In axial symmetry, hoop force of each segment [N/m], tension positive, shape (n - 1,)"""
    hoop_moment: NDArray[np.float64] | None = None
    """In axial symmetry, hoop moment of each segment [N m/m], with the sign of the moment, shape (n - 1,)"""
    per_side: int = 1
    """Segments of each side, of a polygon of which each side is one edge of quadratic or quartic elements; otherwise 1"""

    @property
    def places(self) -> NDArray[np.float64]:
        """Where its nodes are now [m], shape (n, D)."""
        return self.positions + self.displacement

    @property
    def bends(self) -> bool:
        """Whether there are any moments."""
        return bool(np.any(self.moment))

    @property
    def shear_force(self) -> NDArray[np.float64]:
        """Shear force of each segment, the change of the moment along it [N/m], shape (n - 1,); with the hoop moment in a shell.

        Segments of a polygon of `per_side` have the mean of their side: its ends turn and its middle bears most of the pressure, so that
        the shear force goes up and down within a side by more than it has along a circle.
        """
        edges = np.diff(self.positions, axis=0)
        lengths = np.linalg.norm(edges, axis=1)
        if self.hoop_moment is None:
            of_sides = np.diff(self.moment[:: self.per_side]) / lengths.reshape(-1, self.per_side).sum(axis=1)
            return np.repeat(of_sides, self.per_side)
        radius = self.positions[:, 0]
        change = np.diff(radius * self.moment) - edges[:, 0] * self.hoop_moment
        return change / (lengths * (radius[1:] + radius[:-1]) / 2)

    def __repr__(self) -> str:
        axial = f"axial force from {self.axial_force.min():.4g} to {self.axial_force.max():.4g} N/m"
        moment = f", moment from {self.moment.min():.4g} to {self.moment.max():.4g} N m/m" if self.bends else ""
        hoop = (
            ""
            if self.hoop_force is None
            else f", hoop force from {self.hoop_force.min():.4g} to {self.hoop_force.max():.4g} N/m"
        )
        return f"<MemberForces: {len(self.positions)} nodes, {axial}{moment}{hoop}>"


def of_members(members: Any) -> dict[str, Member]:
    """A dictionary of members by name; raises InputError for anything else."""
    if not isinstance(members, dict) or not all(isinstance(one, Member) for one in members.values()):
        raise InputError(
            f"members is {members!r}, expected a dictionary of what `bar`, `strut` and `beam` return, by name"
        )
    return dict(members)
