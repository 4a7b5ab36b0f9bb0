"""Sides of the mesh that let waves out, and waves that come in through them."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike

from ._core import InputError
from .checks import positive
from .collective import collectively
from .mesh import Mesh, Tag, floats
from .motion import Motion


class AbsorbingSides:
    """The methods of a model for sides that absorb waves."""

    mesh: Mesh
    comm: MPI.Comm
    _core: Any
    _absorbing: list[tuple[int, float, float, float]]  # tag, impedances, thickness
    _incoming: tuple[list[float], list[float], list[float]] | None  # times, velocities, direction

    def absorb(
        self,
        facet_tag: Tag,
        *,
        thickness: float = np.inf,
        impedances: tuple[float, float] | None = None,
    ) -> None:
        """Let waves out through a side: dashpots and weak springs take the place of the ground behind it.

        The traction on the side is minus ``rho c_p`` times its normal and ``rho c_s`` times its tangential velocity (Lysmer &
        Kuhlemeyer 1969), which absorbs waves at normal incidence; at other angles a part comes back. Forces that hold the
        side at the time of the call stay: call it in equilibrium, and do not support what is to absorb (`release`). Springs
        of a layer of ground keep the side from drifting away. A call for a further side begins all of them anew.

        Args:
            facet_tag: facets with this tag, or these tags, by number or name, at cells with soil.
            thickness: of the ground behind the side that acts as springs, ``(lambda + 2 mu) / thickness`` along the normal and
                ``mu / thickness`` across it [m]; far more than a wavelength. Infinite: none.
            impedances: ``rho c_p`` and ``rho c_s`` of the ground behind the side [kg/(m2 s)], where it is another one than the
                soil at the side, such as the rock below a layer.

        Raises:
            InputError: on all ranks: a side without soil, several velocity fields, axial symmetry, numbers that are not
                positive.

        Note:
            Collective. For explicit steps. Dashpots do not limit the time step.
        """

        def checked() -> list[tuple[int, float, float, float]]:
            far = np.inf if thickness == np.inf else positive("thickness", thickness, "m")
            pair = (0.0, 0.0)
            if impedances is not None:
                given = floats("impedances", impedances, (2,)).tolist()
                pair = (
                    positive("impedances[0]", given[0], "kg/(m2 s)"),
                    positive("impedances[1]", given[1], "kg/(m2 s)"),
                )
            return [(tag, *pair, far) for tag in self.mesh.tags_of("facet", facet_tag)]

        new = collectively(self.comm, checked)
        tags = {side[0] for side in new}
        sides = [*(side for side in self._absorbing if side[0] not in tags), *new]
        self._core.set_absorbing_sides(sides)
        self._absorbing = sides

    def shake(self, motion: Motion, direction: ArrayLike) -> None:
        """Let a plane wave come in through the sides that absorb, all at once: a base below level ground.

        The traction of the wave is ``2 rho c`` times its velocity: on a free surface of the ground behind the side, an
        outcrop, it would move twice as fast. So halve the motion of a record that was taken on an outcrop.

        Args:
            motion: velocity of the incoming wave over time.
            direction: in which the ground moves, shape (D,), of any length.

        Raises:
            InputError: on all ranks: no side absorbs; a direction without length; something else than a motion.
        """

        def checked() -> list[float]:
            if not isinstance(motion, Motion):
                raise InputError(f"motion is {motion!r}, expected a Motion; see read_accelerogram")
            if not self._absorbing:
                raise InputError("no side absorbs, expected a call of absorb before shake")
            along = floats("direction", direction, (self.mesh.dim,))
            length = float(np.linalg.norm(along))
            return (along / positive("length of direction", length, "m")).tolist()

        unit = collectively(self.comm, checked)
        self._take_incoming((motion.time.tolist(), motion.velocity.tolist(), unit))

    def _take_incoming(self, incoming: Any) -> None:
        self._incoming = incoming
        self._core.set_incoming_wave(*(incoming or ([], [], [0.0] * self.mesh.dim)))

    def _absorbing_state(self) -> dict[str, Any] | None:
        """What a checkpoint needs: sides, their nodes with forces and displacements, the wave. Collective."""
        if not self._absorbing:
            return None
        nodes = {node: entry for part in self.comm.allgather(self._core.dashpots()) for node, entry in part.items()}
        sides = [[tag, normal, shear, None if far == np.inf else far] for tag, normal, shear, far in self._absorbing]
        return {"sides": sides, "nodes": [[node, nodes[node]] for node in sorted(nodes)], "incoming": self._incoming}

    def _take_absorbing(self, state: dict[str, Any] | None) -> None:
        """The state of a checkpoint. Collective."""
        state = state or {"sides": [], "nodes": [], "incoming": None}
        self._absorbing = [(tag, n, s, np.inf if far is None else far) for tag, n, s, far in state["sides"]]
        self._core.set_dashpots({node: tuple(entry) for node, entry in state["nodes"]})
        self._take_incoming(state["incoming"])


def refuse_absorbing(model: Any, what: str) -> None:
    """Raises InputError where something does not know sides that absorb."""
    if model._absorbing:
        raise InputError(f"{what} does not know sides that absorb waves, see Model.absorb")
