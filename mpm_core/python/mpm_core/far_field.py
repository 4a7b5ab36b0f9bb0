"""Elastic ground beyond a border of the mesh, as a stiffness of the nodes there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .collective import collectively
from .mesh import Mesh, floats


@dataclass(frozen=True)
class _Border:
    """Border of a far field: its nodes, stiffness and mass, its held forces, and the gravity that they balance."""

    nodes: NDArray[np.int64]
    stiffness: NDArray[np.float64]
    mass: NDArray[np.float64]
    held: NDArray[np.float64]
    gravity: NDArray[np.float64]

    def marks(self) -> list[float]:
        """Numbers of the same far field are the same whatever the ranks, but for round-off."""
        return [float(len(self.nodes)), float(np.trace(self.stiffness)), float(np.abs(self.mass).sum())]


class FarFields:
    """The methods of a model for a far field."""

    mesh: Mesh
    comm: MPI.Comm
    _core: Any
    _border: _Border | None

    def attach_far_field(
        self, nodes: ArrayLike, stiffness: ArrayLike, mass: ArrayLike | None = None, *, balanced: bool = False
    ) -> None:
        """Attach elastic ground to nodes of the mesh: it exerts f = f_0 + W g - K u, with their displacement u from now on.

        `fenics_bridge.FarField` finds K and W by static condensation of finite elements, and calls this. The forces take part in
        implicit steps; their work counts as external. The arguments are the same on all ranks.

        Args:
            nodes: numbers over all ranks of the nodes on the border, shape (n,), with soil around each.
            stiffness: K [N/m], shape (n D, n D); per metre in plane strain, per radian in axial symmetry. Each rank keeps it:
                (n D)^2 numbers.
            mass: W [kg], shape (n, D, D): the force of a node by gravity; none by default.
            balanced: whether f_0 holds the soil as it is now, in equilibrium with the ground beyond, with its weight.
                By default f_0 is zero.

        Raises:
            InputError: on all ranks: an array of another shape, a stiffness that is not symmetric, a node that is none or without
                soil, several velocity fields, pore water.

        Note:
            Collective. A second call replaces the far field of the first.
        """

        def checked() -> _Border:
            d, numbers = self.mesh.dim, np.asarray(nodes)
            if (
                numbers.ndim != 1
                or not np.issubdtype(numbers.dtype, np.integer)
                or len(np.unique(numbers)) != numbers.size
            ):
                raise InputError(
                    f"nodes has shape {numbers.shape} and dtype {numbers.dtype}, expected different whole numbers"
                )
            n = len(numbers)
            matrix = floats("stiffness", stiffness, (n * d, n * d))
            if np.abs(matrix - matrix.T).max(initial=0.0) > 1e-8 * np.abs(matrix).max(initial=0.0):
                raise InputError("stiffness is not symmetric, expected that of an elastic body")
            weight = floats("mass", np.zeros((n, d, d)) if mass is None else mass, (n, d, d))
            return _Border(numbers.astype(np.int64), matrix, weight, np.zeros((n, d)), np.zeros(d))

        border = collectively(self.comm, checked)
        _refuse(self)
        unbalanced = np.array(self._core.unbalanced_at(border.nodes.tolist())).reshape(border.held.shape)
        if balanced:
            gravity = np.array(self._core.gravity)
            held = -self.comm.allreduce(unbalanced) - border.mass @ gravity
            border = replace(border, held=held, gravity=gravity)
        self._take_border(border, np.zeros_like(border.held))

    def detach_far_field(self) -> None:
        """Remove the far field; its border is free from now on. Collective."""
        self._take_border(None, None)

    @property
    def far_field_displacement(self) -> NDArray[np.float64]:
        """Displacement of the border since the far field was attached [m], (n, D), in the order of its nodes. Not collective.

        Raises:
            InputError: there is no far field.
        """
        return np.array(self._core.far_field_displacement).reshape(self._attached().held.shape)

    @property
    def far_field_gravity(self) -> NDArray[np.float64]:
        """Gravity for which the far field was `balanced` as it was attached [m/s2], (D,); zero where it was not.

        Raises:
            InputError: there is no far field.
        """
        return self._attached().gravity.copy()

    def _attached(self) -> _Border:
        if self._border is None:
            raise InputError("the model has no far field, expected attach_far_field before")
        return self._border

    def _take_border(self, border: _Border | None, displacement: NDArray[np.float64] | None) -> None:
        self._border = border
        d = self.mesh.dim
        none = _Border(np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros((0, d, d)), np.zeros((0, d)), np.zeros(d))
        b = border or none
        self._core.set_far_field(
            b.nodes.tolist(), b.stiffness, b.mass, b.held, b.held * 0 if displacement is None else displacement
        )

    def _border_state(self) -> dict[str, Any] | None:
        """State for a checkpoint, without the far field itself."""
        if self._border is None:
            return None
        return {
            "marks": self._border.marks(),
            "held": self._border.held.tolist(),
            "gravity": self._border.gravity.tolist(),
            "displacement": self.far_field_displacement.tolist(),
        }

    def _take_border_state(self, state: dict[str, Any] | None) -> None:
        """Restore the state from a checkpoint, whose far field the model has; see `require_border`."""
        border = self._border
        if state is None or border is None:
            return
        gravity = np.array(state.get("gravity", border.gravity))  # not in older files
        taken = replace(border, held=np.array(state["held"]), gravity=gravity)
        self._take_border(taken, np.array(state["displacement"]))


def require_border(model: Any, path: str, state: dict[str, Any] | None) -> None:
    """Raises InputError unless the model has the far field of a checkpoint, which does not hold it."""
    there, here = state and state["marks"], model._border and model._border.marks()
    if bool(there) != bool(here) or (there and here and not np.allclose(there, here, rtol=1e-6, atol=0.0)):
        raise InputError(
            f"checkpoint {path} is of a run with {'a' if there else 'no'} far field, the model has "
            f"{'another one' if there and here else 'one' if here else 'none'}; expected the same, attached before restore"
        )


def refuse_far_field(model: Any, what: str) -> None:
    """Raises InputError where something does not support a far field."""
    if model._border is not None:
        raise InputError(f"{what} does not support far fields, expected implicit steps; see Model.detach_far_field")


def _refuse(model: Any) -> None:
    """Raises InputError for models that cannot have a far field."""
    if len(set(model._velocity_fields)) > 1:
        raise InputError("the model has several velocity fields, expected one for a far field")
    if model._core.water is not None:
        raise InputError("the model has pore water, expected none for a far field")
