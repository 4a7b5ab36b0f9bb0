"""Boundary conditions and gravity of a body."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import positive
from .collective import collectively
from .mesh import Mesh, Tag, floats

Condition: TypeAlias = tuple[int, bool, list[float | None]]
"""Facet tag; whether components of the velocity are prescribed or its part along a normal is zero; those components, None where
free, or the normal"""


class Conditions:
    """Boundary conditions and gravity of a body; see `Model`."""

    mesh: Mesh
    comm: MPI.Comm
    _core: Any

    def __init__(self) -> None:
        self._conditions: list[Condition] = []
        self._prescribed: dict[int, Condition] = {}

    def _set_supports(self, conditions: list[Condition]) -> None:
        collectively(self.comm, lambda: self._core.set_supports(conditions))
        self._conditions = conditions

    def _support(
        self, facet_tag: Tag, whole: bool, vector: Any, name: str, *, replaced: Sequence[Any] = ()
    ) -> list[Condition]:
        def checked() -> list[Condition]:
            given = np.array(vector, dtype=object)
            free = np.array([whole and value is None for value in given.ravel()]).reshape(given.shape)
            values = floats(name, np.where(free, 0.0, given).tolist(), (self.mesh.dim,))
            components = [None if is_free else float(value) for is_free, value in zip(free, values, strict=True)]
            return [(tag, whole, components) for tag in self.mesh.tags_of("facet", facet_tag)]

        new = collectively(self.comm, checked)
        kept = [condition for condition in self._conditions if not any(condition is old for old in replaced)]
        self._set_supports([*kept, *new])
        return new

    def fix(self, facet_tag: Tag) -> None:
        """Fix the nodes on facets with this tag, which is a number or a name here and in the methods below."""
        self._support(facet_tag, True, [0.0] * self.mesh.dim, "velocity")

    def roller(self, facet_tag: Tag, normal: ArrayLike) -> None:
        """Put the nodes on facets with this tag on rollers: they move at right angles to ``normal``, a vector of any length."""
        self._support(facet_tag, False, normal, "normal")

    def prescribe(self, facet_tag: Tag, velocity: Sequence[float | None] | NDArray) -> None:
        """Prescribe the velocity of the nodes on facets with this tag. A further call changes it.

        Args:
            facet_tag: number or name.
            velocity: components [m/s], shape (D,); None leaves one free, so that (None, -0.1) is a smooth plate that moves down.

        Raises:
            InputError: on all ranks, for an unknown tag, another number of components, or one that is not finite.
        """
        tags = collectively(self.comm, lambda: self.mesh.tags_of("facet", facet_tag))
        before = [self._prescribed[tag] for tag in tags if tag in self._prescribed]
        conditions = self._support(tags, True, velocity, "velocity", replaced=before)
        self._prescribed.update({condition[0]: condition for condition in conditions})

    def release(self, facet_tag: Tag) -> None:
        """Remove all boundary conditions of the nodes on facets with this tag.

        Raises:
            InputError: there is no boundary condition on them.
        """

        def remaining() -> list[Condition]:
            tags = self.mesh.tags_of("facet", facet_tag)
            for tag in tags:
                if tag not in {condition[0] for condition in self._conditions}:
                    raise InputError(f"facet_tag {facet_tag!r} is not supported")
            return [condition for condition in self._conditions if condition[0] not in tags]

        self._set_supports(collectively(self.comm, remaining))
        kept = {condition[0] for condition in self._conditions}
        self._prescribed = {tag: condition for tag, condition in self._prescribed.items() if tag in kept}

    def outflow(self, facet_tag: Tag) -> None:
        """Let particles leave the mesh through facets with this tag; they are counted in the report."""
        tags = collectively(self.comm, lambda: self.mesh.tags_of("facet", facet_tag))
        self._core.outflow_tags = [*self._core.outflow_tags, *tags]

    @property
    def gravity(self) -> NDArray[np.float64]:
        """Gravity [m/s2], shape (D,), after the end of any ramp. Not collective."""
        return np.array(self._core.gravity)

    def set_gravity(self, gravity: ArrayLike, ramp: float = 0.0) -> None:
        """Set gravity [m/s2], shape (D,).

        With a ramp [s] it rises linearly from zero between the times 0 and ``ramp`` of the model, whenever it is set.
        """
        components = floats("gravity", gravity, (self.mesh.dim,)).tolist()
        self._core.gravity_ramp = positive("ramp", ramp, "s", zero=True)
        self._core.gravity = components
