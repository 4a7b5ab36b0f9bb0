"""Structural members in a body of finite elements: their axial forces and moments, and what these do to the nodes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpm_core.member_strains import MemberStrains
from mpm_core.members import Member, MemberForces
from numpy.typing import NDArray
from petsc4py import PETSc
from scipy import sparse

from fenics_bridge import compat
from fenics_bridge.structures.bond import bond_strengths, slip_tangent
from fenics_bridge.structures.embedding import Embedding, cell_sizes_along
from fenics_bridge.structures.line_nodes import runs_beside, shared_nodes
from fenics_bridge.structures.unknowns import Unknowns
from mpm_core import _core

LEAST_SIDES = 6
"""Sides from which on a line is a polygon that stands for a curve"""


@dataclass
class _Installed:
    """A member that is there, with what it has carried so far."""

    member: Member
    nodes: NDArray[np.float64]
    strains: MemberStrains
    """Its strains by the displacements of its nodes"""
    force: NDArray[np.float64]
    """Force of each strain: axial force of each segment [N], then moment where it bends [N m], (k,)"""
    origin: Any
    """Displacement of the nodes at the installation [m], (n, D); None before it"""
    stressing: bool
    """Whether it is being stressed: its axial forces stay what they are"""
    movement: Any = None
    """Matrix of the displacements of the nodes by the unknowns of the body (n D, unknowns)"""
    strain: Any = None
    """Matrix of the strains by the unknowns of the body (k, unknowns)"""
    beside: bool = False
    """Whether it goes along edges of the mesh, and has other nodes than these"""
    per_side: int = 1
    """Segments of each side, of a polygon of which each side is one edge of the mesh"""

    def stiffness(self) -> NDArray[np.float64]:
        """Elastic stiffness of each strain: (k,)."""
        axial = 0.0 if self.stressing else self.member.axial_stiffness
        return np.where(self.strains.is_axial, axial, self.member.bending_stiffness)

    def respond(self, strain: NDArray[np.float64]) -> tuple[NDArray[np.float64], Any]:
        """Forces after a strain increment (k,), within the strength of member and bond, and their derivatives (k, k)."""
        axial, member, stiffness = self.strains.is_axial, self.member, self.stiffness()
        elastic = self.force + stiffness * strain
        least = np.where(axial, -member.compressive_strength, -member.plastic_moment)
        largest = np.where(axial, member.tensile_strength, member.plastic_moment)
        force = np.clip(elastic, least, largest)
        tangent = sparse.diags(np.where(force == elastic, stiffness, 0.0))
        if np.isinf(member.bond_strength) or self.stressing:
            return force, tangent
        n, lengths = self.strains.segments, self.strains.lengths[: self.strains.segments]
        bond = bond_strengths(member, lengths)
        force[:n] = _core.forces_with_slip(elastic[:n], stiffness[:n] / lengths, least[:n], largest[:n], bond)
        slipping = slip_tangent(force[:n], (least[:n], largest[:n]), bond, lengths)
        return force, sparse.block_diag([stiffness[:n, None] * slipping, tangent.tocsr()[n:, n:]])

    def places(self) -> Any:
        """1 where a force may depend on a strain, otherwise 0: (k, k). In a bar that slips all may depend on all."""
        places, n = np.eye(len(self.force)), self.strains.segments
        if np.isfinite(self.member.bond_strength):
            places[:n, :n] = 1.0
        return places

    def unstrained(self) -> NDArray[np.float64]:
        """Forces without strain: the prestress."""
        return np.where(self.strains.is_axial, self.member.prestress, 0.0)


class Members:
    """The structural members of a body, elastic and perfectly plastic, small rotations. Collective.

    Displacements of the members' nodes are those of the soil there, so that a strain is linear in the displacements u of the body's
    nodes, e = G u, and the forces on these are G^T (L s), with the axial forces and moments s over their lengths L. The rows of G
    are the same on all ranks, which each multiply their own columns. Columns of unknowns other than displacements, as of pore
    pressures, are empty.

    Args:
        unknowns: the unknowns of the body.
        of_revolution: whether the body is axisymmetric, and beams are shells of revolution in it.
    """

    def __init__(self, unknowns: Unknowns, of_revolution: bool = False) -> None:
        self._of_revolution = of_revolution
        self._unknowns, self._space, self._comm = unknowns, unknowns.space, unknowns.space.mesh.comm
        self._first, self._n = unknowns.first, unknowns.size
        self.n_own = unknowns.own
        """Number of this rank's own unknowns"""
        self._there: dict[str, _Installed] = {}
        self._trial: NDArray[np.float64] = np.zeros(0)
        self._tangent: Any = None  # derivatives of the forces by the strains
        self._strains: Any = None
        self._own_strains: Any = None  # the columns of this rank's own dofs
        self._lengths: NDArray[np.float64] = np.zeros(0)
        self._places: Any = None  # zeros wherever the stiffness may have entries, a matrix of PETSc

    def __bool__(self) -> bool:
        return bool(self._there)

    def __iter__(self) -> Iterator[str]:
        return iter(self._there)

    def installed(self) -> Iterator[tuple[str, _Installed]]:
        """The members with what they carry, by name."""
        return iter(self._there.items())

    @property
    def given(self) -> dict[str, Member]:
        """The members by name."""
        return {name: one.member for name, one in self._there.items()}

    def prepared(self, members: dict[str, Member], active: Any, where: str = "") -> dict[str, _Installed]:
        """These members for `change`: those that are there with what they carry, and new ones. Changes nothing. Collective.

        Args:
            members: the members that are there from now on.
            active: function that is 1 in the cells that are there and 0 in others; None where all are.
            where: what begins a message.

        Raises:
            InputError: a node of a member is in no soil that is there. Raised on all ranks alike.
        """
        kept = {name: one for name, one in self._there.items() if members.get(name) == one.member}
        new = [name for name in members if name not in kept]
        sizes = cell_sizes_along(self._space.mesh, [np.array(members[name].points) for name in new])
        installed = {name: self._installed(members[name], size) for name, size in zip(new, sizes)}
        there = {name: replace(kept[name]) if name in kept else installed[name] for name in members}
        self._embed(there, active, where)
        return there

    def change(self, prepared: dict[str, _Installed], displacement: NDArray[np.float64]) -> None:
        """Keep and install the members that `prepared` returns, and remove others. Collective.

        Args:
            prepared: the members.
            displacement: this rank's own unknowns now.
        """
        self._there = prepared
        for one in prepared.values():
            if one.origin is None:
                one.origin = self._moved(one, displacement)
            else:
                one.stressing = False
        if prepared:
            there = prepared.values()
            self._strains = sparse.vstack([one.strain for one in there]).tocsr()
            self._own_strains = self._own(self._strains)
            self._lengths = np.concatenate([one.strains.lengths for one in there])
            depends = sparse.block_diag([one.places() for one in there])
            self._places = self._matrix(0.0 * (abs(self._own_strains).T @ depends @ abs(self._strains)))
        self.back()

    def lock_off(self) -> None:
        """Let the forces of members that were being stressed follow their strains from now on."""
        for one in self._there.values():
            one.stressing = False

    def follow(self, increment: NDArray[np.float64], as_elastic: bool = False) -> None:
        """Forces and stiffness after an increment, for `forces` and `with_stiffness`. Collective.

        Args:
            increment: change of this rank's own unknowns since the last step that was accepted.
            as_elastic: as the elastic stiffness predicts them, also where they exceed the strength: for the first residual of a step.
        """
        strain = self._strain(increment)
        if as_elastic:
            self.back()
            self._trial = self._trial + self._tangent @ strain
            return
        responses = [one.respond(part) for one, part in self._by_member(strain)]
        self._trial = np.concatenate([force for force, _ in responses])
        self._tangent = sparse.block_diag([tangent for _, tangent in responses]).tocsr()

    def accept(self) -> None:
        """Accept the forces of the last `follow` as those that the next step starts from."""
        for one, force in self._by_member(self._trial):
            one.force = force.copy()

    def snapshot(self) -> list[NDArray[np.float64]]:
        """Copies of the forces, for `restore`."""
        return [one.force.copy() for one in self._there.values()]

    def restore(self, snapshot: list[NDArray[np.float64]]) -> None:
        """Restore forces that were copied before."""
        for one, force in zip(self._there.values(), snapshot, strict=True):
            one.force = force.copy()
        self.back()

    def forces(self) -> Any:
        """Internal nodal forces on this rank's own unknowns [N]."""
        return self._own_strains.T @ (self._lengths * self._trial)

    def with_stiffness(self, matrix: PETSc.Mat, held: NDArray[np.integer]) -> PETSc.Mat:
        """A matrix of the soil with the members' stiffness, without rows and columns of the supports. Collective.

        Its entries are at the same places for any stiffness.

        Args:
            matrix: stiffness of the soil; it stays as it is.
            held: this rank's own dofs that supports prescribe.
        """
        of_all = self._strains @ sparse.diags(1 - self.of_all_ranks(held))
        stiffness = self._own(of_all).T @ sparse.diags(self._lengths) @ self._tangent @ of_all
        # Products leave out zeros, as of what yields, but the solver adds matrices to one another whose entries are at the same places.
        both = matrix.copy()
        both.axpy(1.0, self._places, PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        both.axpy(1.0, self._matrix(stiffness), PETSc.Mat.Structure.SUBSET_NONZERO_PATTERN)
        return both

    def of_all_ranks(self, dofs: NDArray[np.integer]) -> NDArray[np.float64]:
        """For each dof of all ranks, 1 where it is among some of this rank's own ones on any of them, otherwise 0. Collective."""
        mine = np.zeros(self.n_own)
        mine[dofs] = 1.0
        return np.concatenate(self._comm.allgather(mine))

    def _matrix(self, rows: Any) -> PETSc.Mat:
        """A matrix of PETSc from this rank's own rows. Collective."""
        own, size = rows.tocsr(), (self.n_own, self._n)
        own.sort_indices()
        parts = own.indptr.astype(np.int32), own.indices.astype(np.int32), own.data
        return PETSc.Mat().createAIJ((size, size), csr=parts, comm=self._comm)

    def result(self, name: str, displacement: NDArray[np.float64]) -> MemberForces:
        """Forces of a member in the last step accepted. Collective.

        Args:
            name: name of the member.
            displacement: this rank's own unknowns.
        """
        one = self._there[name]
        strains, moment = one.strains, np.zeros(len(one.nodes))
        for at, value in zip(strains.bends_at, one.force[strains.segments :]):
            moment[list(at)] = value
        moved = self._moved(one, displacement) - one.origin
        hoop_force, hoop_moment = (one.force[rows].copy() if strains.hoops else None for rows in strains.of_hoops)
        along = one.force[: strains.segments].copy()
        return MemberForces(one.nodes, moved, along, moment, hoop_force, hoop_moment, one.per_side)

    def moved(self, name: str, displacement: NDArray[np.float64]) -> Any:
        """Displacements of a member's nodes, those of the soil before its installation among them (n, D) [m]. Collective.

        Args:
            name: name of the member.
            displacement: this rank's own unknowns.
        """
        return self._moved(self._there[name], displacement)

    def node_distance(self, line: NDArray[np.float64]) -> float:
        """About the distance of the body's nodes along a line (k, D) [m]; 0 where the line is outside of the mesh. Collective."""
        return cell_sizes_along(self._space.mesh, [line])[0] / min(2, compat.degree_of(self._space))

    def _installed(self, member: Member, size: float) -> _Installed:
        """A member without any strain; size: of the cells around it [m]."""
        degree = compat.degree_of(self._space)
        bends_freely = member.bending_stiffness > 0 and member.spacing is None
        shared = shared_nodes(self._space.mesh, np.array(member.points), degree) if bends_freely else None
        nodes = member.nodes(size / min(2, degree) or member.length) if shared is None else shared
        strains = member.strains(nodes, self._of_revolution)
        beside = bends_freely and shared is None and runs_beside(self._space.mesh, np.array(member.points), size)
        sides = len(member.points) - 1
        is_polygon = shared is not None and sides >= LEAST_SIDES and strains.segments == degree * sides
        per_side = degree if is_polygon else 1
        one = _Installed(
            member, nodes, strains, np.zeros(0), None, member.prestress != 0, beside=beside, per_side=per_side
        )
        one.force = one.unstrained()
        return one

    def _embed(self, there: dict[str, _Installed], active: Any, where: str) -> None:
        """Find the cells around the nodes of members, all in one search; where: what begins a message."""
        moving = [one.nodes[:-1] if one.member.fixed_end else one.nodes for one in there.values()]
        if not moving:
            return
        names = [where + _named(name, one.member) for name, one in there.items()]
        owners = [name for name, nodes in zip(names, moving) for _ in nodes]
        embedding = Embedding(self._unknowns, np.concatenate(moving), active, owners)
        start = 0
        for one, nodes in zip(there.values(), moving):
            rows = slice(start, start + len(nodes))
            self._move_by(one, embedding.dofs[rows], embedding.weights[rows])
            start += len(nodes)

    def _move_by(self, one: _Installed, dofs: NDArray[np.integer], weights: NDArray[np.float64]) -> None:
        """Let the first nodes of a member move by unknowns of the body (n, k, D), with these shape functions (n, k)."""
        count, dim = one.nodes.shape
        columns = np.swapaxes(dofs, 1, 2).ravel()
        rows = np.arange(dim * len(dofs)).reshape(-1, dim, 1)
        rows = np.broadcast_to(rows, (len(dofs), dim, dofs.shape[1]))
        values = np.broadcast_to(weights[:, None, :], rows.shape)
        one.movement = sparse.csr_matrix((values.ravel(), (rows.ravel(), columns)), (count * dim, self._n))
        operator = one.strains.operator
        one.strain = sparse.csr_matrix(operator.reshape(len(operator), -1)) @ one.movement

    def _own(self, matrix: Any) -> Any:
        """The columns of this rank's own dofs."""
        return matrix[:, self._first : self._first + self.n_own]

    def _strain(self, displacement: NDArray[np.float64]) -> Any:
        return self._comm.allreduce(self._own_strains @ displacement)

    def _moved(self, one: _Installed, displacement: NDArray[np.float64]) -> Any:
        """Displacements of the nodes of a member (n, D) [m]. Collective."""
        return self._comm.allreduce(self._own(one.movement) @ displacement).reshape(one.nodes.shape)

    def taken_over(self, other: Members, active: Any) -> dict[str, _Installed]:
        """The members of another body on the same mesh, with the forces they carry, for `change`. Collective.

        Displacements count from now on, those of the body being zero.

        Args:
            other: members of the other body.
            active: as for `prepared`.

        Raises:
            InputError: a node of a member is in no soil that is there. Raised on all ranks alike.
        """
        there = {name: replace(one, force=one.force.copy(), origin=None) for name, one in other.installed()}
        self._embed(there, active, "stress: ")
        return there

    def reset(self) -> None:
        """Start with the prestress alone, the displacements of the body being zero."""
        self.reset_displacement()
        for one in self._there.values():
            one.force, one.stressing = one.unstrained(), one.member.prestress != 0
        self.back()

    def reset_displacement(self) -> None:
        """Count displacements from now on, those of the body being zero."""
        for one in self._there.values():
            one.origin = np.zeros_like(one.nodes)

    def back(self) -> None:
        """Go back to the forces of the last step accepted, with elastic stiffness."""
        there = self._there.values()
        if there:
            self._trial = np.concatenate([one.force for one in there])
            self._tangent = sparse.diags(np.concatenate([one.stiffness() for one in there]))

    def _by_member(self, values: NDArray[np.float64]) -> Iterator[tuple[_Installed, NDArray[np.float64]]]:
        start = 0
        for one in self._there.values():
            yield one, values[start : start + len(one.force)]
            start += len(one.force)


def _named(name: str, member: Member) -> str:
    """A member as messages name it."""
    return (
        f"the member {name!r}, whose last point is the one that is held in space"
        if member.fixed_end
        else f"the member {name!r}"
    )
