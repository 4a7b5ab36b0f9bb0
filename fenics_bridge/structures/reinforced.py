"""What finite elements have for structural members: their forces, and their changes."""

from __future__ import annotations

import math
from typing import Any

from mpm_core.members import Member, MemberForces
from mpm_core.petsc import DIRECT_LIMIT

from fenics_bridge.errors import agree
from fenics_bridge.fem.linear_solver import factorises
from fenics_bridge.structures.installed import Members
from fenics_bridge.structures.member_warnings import warn_of_members


class ReinforcedBody:
    """The part of `QuasiStatic` and `water.Consolidation` that concerns structural members."""

    domain: Any
    radius: Any
    _body: Any
    displacement: Any
    _nmd: bool
    _members: Members
    _options_prefix: str

    @property
    def members(self) -> dict[str, Member]:
        """The structural members that are there, by name."""
        return self._members.given

    def member_forces(self, name: str) -> MemberForces:
        """Axial forces, moments and displacements of a structural member. Collective.

        Args:
            name: name of the member.

        Raises:
            InputError: there is no such member. Raised on all ranks alike.
        """
        known = name in self._members.given
        agree(self.domain.comm, None if known else f"name is {name!r}, expected one of {list(self._members)}")
        return self._members.result(name, self._own_unknowns())

    def require_members(self, members: dict[str, Member], active: Any, where: str = "") -> None:
        """Require that members suit the body and are in soil that is there. Collective.

        Args:
            members: members by name.
            active: function that is 1 in the cells that are there and 0 in others; None where all are.
            where: what begins the message.

        Raises:
            InputError: a member of another dimension, one that is no shell in an axisymmetric body, or one in no soil. Raised on all ranks alike.
        """
        self._prepared_members(members, active, where)

    def _prepared_members(self, members: dict[str, Member], active: Any, where: str = "") -> Any:
        """Members for `Members.change`, in the cells where a function is 1; raises InputError before anything changes. Collective."""
        comm, dim = self.domain.comm, self.domain.geometry.dim
        other = next((name for name, member in members.items() if member.dim != dim), None)
        wrong = None if other is None else f"{other!r} has {members[other].dim} dimensions, expected {dim}"
        if self.radius is not None:
            wrong = wrong or next(filter(None, (_no_shell(name, one) for name, one in members.items())), None)
        if members and self._keeps_factors():
            wrong = (
                f"there are some with nmd=True in more than {DIRECT_LIMIT[dim]} nodes of three dimensions, expected a factorisation, by "
                f"PETSC_OPTIONS='-{self._options_prefix}pc_type lu' in the environment (docs/solvers.md), or elements of degree=2"
            )
        agree(comm, wrong and f"{where}members: {wrong}")
        return self._members.prepared(members, active, where)

    def _keeps_factors(self) -> bool:
        """Whether the stiffness stays in factors, to which that of members cannot be added, also where there are some."""
        factored = getattr(self._body.kinematics, "factored", False)
        return factored and not factorises(self.displacement.function_space, self._options_prefix, self._nmd, True)

    def _change_members(self, prepared: Any) -> None:
        """Install, keep and remove members that were prepared. Collective."""
        before = set(self._members)
        self._members.change(prepared, self._own_unknowns())
        held = self._body.constraints.dofs
        warn_of_members(self._members, held[held < self._members.n_own], before, self.domain.comm)

    def moved_member(self, name: str) -> Any:
        """Displacements of a member's nodes, those of the soil before its installation among them (n, D) [m]. Collective."""
        return self._members.moved(name, self._own_unknowns())

    def _own_unknowns(self) -> Any:
        """This rank's own unknowns at the last step accepted."""
        return self._body.solution.x.array[: self._members.n_own]


def _no_shell(name: str, member: Member) -> str | None:
    """Why a member cannot be a shell of revolution about x = 0, in words; None if it can."""
    if not member.bending_stiffness or member.bond_strength < math.inf:
        kind = "a beam with a bond_strength" if member.bending_stiffness else "no beam"
        return f"{name!r} is {kind} in an axisymmetric body, expected beams without it: shells of revolution"
    radii = [x for x, _ in member.points]
    if min(radii) < 0:
        return f"{name!r} reaches to x = {min(radii):g} m in an axisymmetric body, expected 0 or more"
    along = any(one == other == 0 for one, other in zip(radii, radii[1:]))
    return (
        f"{name!r} runs along the axis of an axisymmetric body, where a shell has no radius, expected x > 0 there"
        if along
        else None
    )
