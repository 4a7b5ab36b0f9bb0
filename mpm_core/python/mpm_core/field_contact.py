"""Contact between bodies of soil that move with different velocity fields; explicit scheme."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError
from .checks import positive
from .collective import collectively
from .input_warnings import warn_of_friction
from .mesh import floats
from .surface_description import checked, described, place_of, surface_of
from .surfaces import KINDS, Plane, Surface
from .triangles import Triangles

if TYPE_CHECKING:
    from .model import Model


class FieldContact:
    """Forces between two bodies of soil, as `Model.add_field_contact` returns them; all methods are collective.

    It is a probe: ``mpm_core.probes.ProbeFile("interface.csv", contact)`` records its histories.
    """

    def __init__(self, model: Model, number: int) -> None:
        self.model = model
        self._number = number

    @property
    def _index(self) -> int:
        return place_of(self._number, "field contact", self.model._field_contacts, "model.field_contacts")

    def __repr__(self) -> str:
        entry = self.model._field_contacts[self._index]
        return (
            f"<FieldContact {self._number}: of velocity fields {entry['first']} and {entry['second']}, friction "
            f"{entry['friction']:g}, adhesion {entry['adhesion']:g} Pa>"
        )

    def _state(self) -> dict[str, Any]:
        return _core.field_contact_state(self.model._core, self._index)  # type: ignore[no-any-return]

    @property
    def force(self) -> NDArray[np.float64]:
        """Force of the first body on the second in the last step [N], shape (D,); per metre or per radian in two dimensions."""
        return np.array(self._state()["force"])

    @property
    def impulse(self) -> NDArray[np.float64]:
        """Integral of ``force`` over time since the contact was added [N s], shape (D,).

        Its difference between two times over their distance is the mean force, without the noise of single steps.
        """
        return np.array(self._state()["impulse"])

    @property
    def nodes(self) -> int:
        """Number of nodes of the mesh at which the bodies touched in the last step."""
        return int(self._state()["nodes"])

    def touching(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """The nodes of this rank at which the bodies touched in the last step; not collective.

        Returns:
            Their positions [m], the unit normals from the first body to the second [-], and the forces of the first body on the
            second [N], all of shape (n, D).
        """
        return _core.touching_nodes(self.model._core, self._index)  # type: ignore[no-any-return]

    def values(self) -> dict[str, float]:
        """Numbers by name of column, as a probe gives them: time, force, impulse and number of nodes in contact."""
        axes, state = "xyz"[: self.model.mesh.dim], self._state()
        columns = [("force", "N"), ("impulse", "N.s")]
        values = {f"{name}_{axis}_{unit}": state[name][k] for name, unit in columns for k, axis in enumerate(axes)}
        return {"time_s": self.model.time, **values, "nodes": state["nodes"]}


def add_field_contact(
    model: Model, interface: Surface | ArrayLike, first: int, second: int, friction: float, adhesion: float
) -> FieldContact:
    """See `Model.add_field_contact`."""

    def entry() -> dict[str, Any]:
        last = max(model._velocity_fields)
        for name, number in (("first", first), ("second", second)):
            if number not in range(last + 1):
                raise InputError(f"{name} is {number!r}, expected the number of a velocity field, 0 to {last}")
        if first == second:
            raise InputError(f"first and second are both {first}, expected two velocity fields")
        if any({one["first"], one["second"]} == {first, second} for one in model._field_contacts):
            raise InputError(f"the velocity fields {first} and {second} are in contact already")
        positive("friction", friction, "(a coefficient)", zero=True)
        positive("adhesion", adhesion, "Pa", zero=True)
        checked(surface, model.mesh.dim)
        return {
            "first": int(first), "second": int(second), "friction": float(friction), "adhesion": float(adhesion),
            "interface": described(surface),
        }  # fmt: skip

    is_surface = isinstance(interface, tuple(KINDS.values()))
    surface = cast("Surface", interface) if is_surface else _plane(model, cast("ArrayLike", interface))
    if isinstance(surface, Triangles):
        model._triangulated[surface.fingerprint] = surface
    new = collectively(model.comm, entry)
    warn_of_friction(model.comm, friction)
    set_field_contacts(model, [*model._field_contacts, new])
    return FieldContact(model, len(model._field_contacts) - 1)


def _plane(model: Model, normal: ArrayLike) -> Plane:
    """The plane with a normal."""
    dim = model.mesh.dim
    return collectively(model.comm, lambda: Plane((0.0,) * dim, floats("interface", normal, (dim,))))


def set_field_contacts(model: Model, entries: list[dict[str, Any]]) -> None:
    """Give the model these contacts between velocity fields; it may have the first ones already."""
    for entry in entries[len(model._field_contacts) :]:
        surface, _ = surface_of(model, entry["interface"])._checked(model.mesh.dim)
        numbers = (entry[name] for name in ("first", "second", "friction", "adhesion"))
        _core.add_field_contact(model._core, *numbers, surface)
    model._field_contacts = entries
