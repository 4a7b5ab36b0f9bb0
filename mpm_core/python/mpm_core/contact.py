"""Rigid surfaces that touch the particles of a model, with Coulomb friction; explicit scheme."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import positive, within
from .collective import collectively
from .mesh import floats
from .surfaces import KINDS, Surface

if TYPE_CHECKING:
    from .model import Model


class RigidContact:
    """What a rigid surface feels and where it is, as `Model.add_contact` returns it; all is collective.

    It is a probe: ``mpm_core.probes.ProbeFile("wall.csv", wall)`` records its histories.
    """

    def __init__(self, model: Model, number: int) -> None:
        self.model = model
        self._number = number

    def _state(self, entry: int) -> NDArray[np.float64]:
        return np.array(_core.contact_state(self.model._core, self._number)[entry])

    @property
    def force(self) -> NDArray[np.float64]:
        """Force of the soil on the surface in the last step [N], shape (D,); per metre or per radian in two dimensions."""
        return self._state(0)

    @property
    def impulse(self) -> NDArray[np.float64]:
        """Integral of ``force`` over time since the surface was added [N s], shape (D,); its difference between two times over
        their distance is the mean force, without the noise of single steps."""
        return self._state(1)

    @property
    def moment(self) -> NDArray[np.float64]:
        """Moment of these forces in the last step [N m], shape (1,) in two dimensions, counterclockwise, and (3,) in three; about
        the surface's ``point``, ``centre``, first point, or the centre of the box, as it has moved."""
        return self._state(2)

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of the surface since it was added [m], shape (D,)."""
        return self._state(3)

    def values(self) -> dict[str, float]:
        """Numbers by name of column, as a probe gives them: time, force, impulse, moment, displacement."""
        axes = "xyz"[: self.model.mesh.dim]
        state = _core.contact_state(self.model._core, self._number)
        columns = [("force", "N", axes), ("impulse", "N.s", axes), ("moment", "N.m", "xyz"[3 - len(state[2]) :])]
        columns.append(("displacement", "m", axes))
        names = [f"{name}_{axis}_{unit}" for name, unit, along in columns for axis in along]
        return {"time_s": self.model.time, **dict(zip(names, np.concatenate(state).tolist(), strict=True))}


Velocity: TypeAlias = ArrayLike | tuple[Sequence[float], ArrayLike] | None


def _motion(velocity: Velocity, dim: int) -> tuple[list[float], list[list[float]]]:
    """Times and velocities of a translation."""
    if velocity is None:
        return [0.0], [[0.0] * dim]
    if isinstance(velocity, tuple) and len(velocity) == 2 and np.ndim(velocity[0]) == 1:
        times = floats("times of the velocity", velocity[0], (None,))
        if len(times) == 0 or (np.diff(times) <= 0).any():
            raise InputError(f"times of the velocity are {times.tolist()} s, expected rising ones")
        return times.tolist(), floats("velocities", velocity[1], (len(times), dim)).tolist()
    constant: Any = velocity
    return [0.0], [floats("velocity", constant, (dim,)).tolist()]


def smallest_gap(model: Model, surface: Surface) -> float:
    """See `Model.gap`."""

    def own() -> float:
        return float(_core.smallest_gap(model._core, _checked(surface, model.mesh.dim)[0]))

    return model.comm.allreduce(collectively(model.comm, own), MPI.MIN)


def _checked(surface: Surface, dim: int) -> Any:
    if not isinstance(surface, tuple(KINDS.values())):
        raise InputError(f"surface is {surface!r}, expected a {', '.join(KINDS)}")
    return surface._checked(dim)


def add_contact(model: Model, surface: Surface, friction: float, velocity: Velocity, penalty: float) -> RigidContact:
    """See `Model.add_contact`."""

    def entry() -> dict[str, Any]:
        dim = model.mesh.dim
        _checked(surface, dim)
        positive("friction", friction, "(a coefficient)", zero=True)
        within("penalty", penalty, 0, 1)
        positive("penalty", penalty, "(a ratio)")
        times, velocities = _motion(velocity, dim)
        shape = {field.name: _plain(getattr(surface, field.name)) for field in fields(surface)}
        return {
            "surface": {"kind": type(surface).__name__, **shape}, "friction": float(friction), "penalty": float(penalty),
            "times": times, "velocities": velocities, "start": model.time,
        }  # fmt: skip

    new = collectively(model.comm, entry)
    gap = smallest_gap(model, surface)
    if gap == np.inf:
        raise InputError("the model has no particles, seed some before surfaces are added")
    if gap < 0:
        raise InputError(
            f"surface {surface!r} overlaps the soil by {-gap:.6g} m, expected it outside of all particles, which have the radius "
            "V^(1/D)/2; see Model.gap, and for planes and polylines the side on which the soil is"
        )
    set_contacts(model, [*model._contacts, new])
    return RigidContact(model, len(model._contacts) - 1)


def _plain(value: Any) -> Any:
    return value if isinstance(value, bool) else np.asarray(value, dtype=float).tolist()


def set_contacts(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give the model these contacts; those that it has already, at the beginning of the list, keep their state."""
    dim, known = model.mesh.dim, len(model._contacts)
    for number, entry in list(enumerate(entries))[known:]:
        shape = dict(entry["surface"])
        surface, reference = KINDS[shape.pop("kind")](**shape)._checked(dim)
        slip = f"contact_slip_{number}" if entry["friction"] > 0 else ""
        if slip and slip not in {field["name"] for field in model.particles.schedule()}:
            model.add_field(slip, unit="m", meaning=f"Elastic slip on rigid surface {number}", components=dim)
        _core.add_contact(
            model._core, surface, entry["friction"], entry["penalty"], entry["times"], entry["velocities"], entry["start"],
            reference.tolist(), slip,
        )  # fmt: skip
    model._contacts = entries


def refuse_contacts(model: Model, scheme: str) -> None:
    """Raises InputError where a scheme would leave rigid surfaces out."""
    if model._contacts:
        kinds = ", ".join(entry["surface"]["kind"] for entry in model._contacts)
        raise InputError(
            f"the model has contact with rigid surfaces ({kinds}), which {scheme} does not know; use explicit()"
        )
