"""The methods of a model for structural members, which move with its particles in explicit steps."""

from __future__ import annotations

import math
import warnings
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._core import InputError
from .collective import collectively
from .mesh import cell_sizes
from .member_warnings import leaking, odd_units, rigid_beam, rigid_fraction
from .members import Member, MemberForces, of_members, samples_of

if TYPE_CHECKING:
    from .model import Model

STRENGTHS = ("tensile_strength", "compressive_strength", "plastic_moment", "bond_strength")
"""Entries of a member that may be infinite, which JSON does not have"""


class MemberMethods:
    """The methods of a model that install structural members, and that return their forces."""

    _members: dict[str, dict[str, Any]]

    def install(self, members: dict[str, Member], forces: dict[str, MemberForces] | None = None) -> None:
        """Install structural members, which move with the soil in explicit steps (docs/members.md). Collective.

        They have no mass; rotations may have any size. A part of a member around which there is no soil any more carries nothing.
        Members shorten the time steps: the stiffer, the more.

        Args:
            members: bars, struts and beams by name, from `bar`, `strut` and `beam`. They are without strain but for their prestress,
                which acts at once and then follows the strain.
            forces: by name, where a member is and what it carries, such as `bridge.QuasiStatic.member_forces`; by default at its
                points, with its prestress.

        Raises:
            InputError: a member of another dimension, a closed or clamped beam, an axisymmetric model, a name that is there already, or
                a point outside of the mesh. Raised on all ranks alike.
        """
        model, known = cast("Model", self), forces or {}
        collectively(model.comm, lambda: _require_members(model, members, known))
        before = members_entry(model)
        try:
            self._install(members, known)
        except InputError:
            take_members(model, before)
            raise

    def _install(self, members: dict[str, Member], known: dict[str, MemberForces]) -> None:
        model = cast("Model", self)
        for name, member in members.items():
            if name in known:
                given = known[name]
                positions, axial, moment = given.places, given.axial_force, given.moment
            else:
                positions = member.nodes(_size_along(model, np.array(member.points)))
                axial, moment = np.full(len(positions) - 1, member.prestress), np.zeros(len(positions))
            bends = member.bending_stiffness > 0 and len(positions) > 2
            of_core = name, _properties(member), positions, axial, moment[1:-1] if bends else np.zeros(0)
            _core.install_member(model._core, *of_core)
            self._members[name] = {"member": _entry(member), "positions": positions.tolist()}
            rigid = rigid_beam(name, rigid_fraction(model, positions), "cells") if bends else ""
            for text in filter(None, (rigid, leaking(name, member, model), *odd_units(name, member))):
                if model.comm.rank == 0:
                    warnings.warn(text, RuntimeWarning, stacklevel=2)

    @property
    def members(self) -> dict[str, Member]:
        """The structural members by name. Not collective."""
        return {name: _member(one["member"]) for name, one in self._members.items()}

    def member_forces(self, name: str) -> MemberForces:
        """Axial forces, moments and displacements of a structural member; not collective, and the same on all ranks.

        Args:
            name: name of the member.

        Raises:
            InputError: there is no such member.
        """
        if name not in self._members:
            raise InputError(f"name is {name!r}, expected one of {list(self._members)}")
        state = _core.member_state(cast("Model", self)._core, list(self._members).index(name))
        positions, start = np.array(state["positions"]), np.array(self._members[name]["positions"])
        moment = np.zeros(len(positions))
        if len(state["moments"]):
            moment[1:-1] = state["moments"]
        return MemberForces(start, positions - start, np.array(state["axial_force"]), moment)


def members_entry(model: Model) -> list[dict[str, Any]]:
    """The members as checkpoints describe them."""
    return [
        {"name": name, **one, "state": _core.member_state(model._core, number)}
        for number, (name, one) in enumerate(model._members.items())
    ]


def take_members(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give a model the members of a checkpoint, in the place of those that it has."""
    _core.clear_members(model._core)
    model._members = {}
    for one in entries:
        _core.restore_member(model._core, one["name"], _properties(_member(one["member"])), one["state"])
        model._members[one["name"]] = {"member": one["member"], "positions": one["positions"]}


def refuse_members(model: Model, scheme: str) -> None:
    """Raises InputError where a scheme would leave structural members out."""
    if model._members:
        names = ", ".join(map(repr, model._members))
        raise InputError(f"the model has structural members ({names}), which {scheme} does not support")


def _require_members(model: Model, members: dict[str, Member], forces: dict[str, MemberForces]) -> None:
    if members and model.geometry == _core.Geometry.AXISYMMETRIC:
        raise InputError("members in an axisymmetric model, expected plane strain or three dimensions")
    for name, member in of_members(members).items():
        if name in model._members:
            raise InputError(f"members: {name!r} is installed already")
        if member.dim != model.mesh.dim:
            raise InputError(f"members: {name!r} has {member.dim} dimensions, expected {model.mesh.dim}")
        kind = "closed" if member.closed and member.bending_stiffness else "clamped"
        if kind == "closed" or member.clamped_start or member.clamped_end:
            raise InputError(
                f"members: {name!r} is {kind}, expected a beam with free ends: among particles beams have these only"
            )
    unknown = next((name for name in forces if name not in members), None)
    if unknown is not None:
        raise InputError(f"forces has {unknown!r}, expected names of members: {list(members)}")
    for name, given in forces.items():
        n, dim = len(given.positions), members[name].dim
        shapes = {"positions": (n, dim), "displacement": (n, dim), "axial_force": (n - 1,), "moment": (n,)}
        for part, shape in shapes.items():
            values = np.asarray(getattr(given, part))
            if values.shape != shape or n < 2 or not np.all(np.isfinite(values)):
                raise InputError(
                    f"forces: {part} of {name!r} has shape {values.shape}, expected {shape} of finite numbers"
                )


def _size_along(model: Model, line: NDArray[np.float64]) -> float:
    """Median size of the cells along a line (k, D) [m]. Collective."""
    cells = model.mesh.cells_of(samples_of(line))
    cells = cells[(cells >= 0) & (cells < model.mesh.owned_cells)]
    sizes = cell_sizes(model.mesh.cell_volumes[cells], model.mesh.dim)
    every = np.concatenate(model.comm.allgather(sizes))
    if len(every) == 0:
        raise InputError(f"points of a member from {line[0].tolist()} to {line[-1].tolist()} m are outside of the mesh")
    return float(np.median(every))


def _properties(member: Member) -> tuple[float, ...]:
    return (
        member.axial_stiffness, member.bending_stiffness, member.tensile_strength, member.compressive_strength,
        member.plastic_moment, member.bond_strength, float(member.free_length > 0), float(member.connected), float(member.fixed_end),
    )  # fmt: skip


def _entry(member: Member) -> dict[str, Any]:
    """A member for JSON."""
    entry = asdict(member)
    return {key: None if key in STRENGTHS and math.isinf(value) else value for key, value in entry.items()}


def _member(entry: dict[str, Any]) -> Member:
    """The member of an entry."""
    known: dict[str, Any] = {
        key: math.inf if key in STRENGTHS and value is None else value for key, value in entry.items()
    }
    known["points"] = tuple(map(tuple, known["points"]))
    return Member(**known)
