"""Sides of the mesh that absorb outgoing waves, and incoming waves."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike

from ._core import InputError
from .checks import flag, positive
from .collective import collectively
from .free_field import layers_at, layers_of
from .ground_column import Base, GroundColumn, Layers
from .mesh import Mesh, Tag, floats
from .motion import Motion
from .rayleigh import Rayleigh

WAVE = -1
"""Stands for the number of a free field where the incoming wave passes through the side"""
Side = tuple[int, float, float, float, int]
"""Facet tag, impedances for compression and shear waves [kg/(m2 s)], thickness of the springs [m], number of the free field"""


class AbsorbingSides:
    """The methods of a model for sides that absorb waves."""

    mesh: Mesh
    comm: MPI.Comm
    _core: Any
    laws: list[Any]
    _absorbing: list[Side]
    _free_fields: list[Layers]  # by number, as they began
    _columns: list[GroundColumn]  # likewise; empty until a run needs them
    _tables: list[Any]  # what the core knows of their motion
    _free_damping: Rayleigh | None  # of the free fields since they began to move; None before
    _incoming: tuple[list[float], list[float], list[float]] | None  # times, velocities, direction

    def absorb(
        self,
        facet_tag: Tag,
        *,
        thickness: float = np.inf,
        impedances: tuple[float, float] | None = None,
        free_field: bool = False,
    ) -> None:
        """Make a side absorb outgoing waves: dashpots and weak springs replace the ground behind it.

        The traction on the side is minus ``rho c_p`` times its normal and ``rho c_s`` times its tangential velocity (Lysmer &
        Kuhlemeyer 1969), which absorbs waves at normal incidence; at other angles a part comes back. Forces that hold the
        side at the time of the call stay: call it in equilibrium, and do not support what is to absorb (`release`). Springs
        of a layer of ground keep the side from drifting away. A call for a further side begins all of them anew.

        With ``free_field`` the ground behind a vertical side is level, has the layers of the soil at the side, and moves as a
        column of them does by the wave that `shake` or `drive` lets in through the base: dashpots and springs work against this
        motion, and the stresses that it makes act on the side. So a level site moves as if it had no sides.

        Soil with pore water has the wave speeds and stiffnesses of undrained soil, and no water passes the side unless
        `hold_pore_pressure` prescribes its pressure there. In a free field water flows up and down through the soil, and leaves it
        at the surface, over which the water of `stand_water` stands, given before this call; conditions of `hold_pore_pressure`
        do not reach the free fields.

        Args:
            facet_tag: facets with this tag, or these tags, by number or name, at cells with soil.
            thickness: of the ground behind the side that acts as springs, ``(lambda + 2 mu) / thickness`` along the normal and
                ``mu / thickness`` across it [m]; far more than a wavelength. Infinite: none.
            impedances: ``rho c_p`` and ``rho c_s`` of the ground behind the side [kg/(m2 s)], where it is another one than the
                soil at the side, such as the rock below a layer.
            free_field: whether level ground that moves lies behind the side, a vertical plane; the last axis points up. At most
                one other side may absorb then, the base.

        Raises:
            InputError: on all ranks: a side without soil, or beside a free field one that is not vertical; several velocity
                fields, axial symmetry, numbers that are not positive, a shear wave that is faster than the compression wave.

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
                if pair[0] < pair[1]:
                    raise InputError(
                        f"impedances is {pair} kg/(m2 s), expected that of the compression wave, the faster one, and then that of "
                        "the shear wave"
                    )
            flag("free_field", free_field)
            return [(tag, *pair, far) for tag in self.mesh.tags_of("facet", facet_tag)]

        new = collectively(self.comm, checked)
        self._take_sides([(*side, 0 if free_field else WAVE) for side in new])

    def _take_sides(self, new: list[Side]) -> None:
        """Set up all sides again; these replace the ones with the same tags. Collective."""
        tags = {side[0] for side in new}
        kept = [*(side for side in self._absorbing if side[0] not in tags), *new]
        free = [side[0] for side in kept if side[4] != WAVE]
        if free and len(kept) - len(free) > 1:
            through = [side[0] for side in kept if side[4] == WAVE]
            raise InputError(
                f"sides {through} absorb without a free field beside them, expected only the base to do so"
            )
        sides = [(*side[:4], free.index(side[0]) if side[4] != WAVE else WAVE) for side in kept]
        free_fields = [layers_at(self, tag) for tag in free]
        self._core.set_absorbing_sides(sides)
        self._absorbing, self._free_fields = sides, free_fields
        self._columns, self._tables, self._free_damping = [], [], None

    def shake(self, motion: Motion, direction: ArrayLike) -> None:
        """Apply an incoming plane wave at the absorbing sides, at all of them at the same time: a base below level ground.

        The traction of the wave is ``2 rho c`` times its velocity: on a free surface of the ground behind the side, an
        outcrop, it would move twice as fast. So halve the motion of a record that was taken on an outcrop.

        Args:
            motion: velocity of the incoming wave over time.
            direction: in which the ground moves, shape (D,), of any length.

        Raises:
            InputError: on all ranks: no side absorbs, or none without a free field; a direction without length; something else
                than a motion.
        """
        self._let_in(motion, direction, 1.0)

    def drive(self, facet_tag: Tag, motion: Motion, direction: ArrayLike) -> None:
        """Prescribe the motion of a side, as of a base on rigid ground, which reflects all waves.

        Args:
            facet_tag: facets with this tag, or these tags, at cells with soil; without other boundary conditions (`release`).
            motion: velocity of the side over time.
            direction: in which it moves, shape (D,), of any length; it does not move across that.

        Raises:
            InputError: on all ranks: as `shake` and `absorb`; another side than this lets a wave in.

        Note:
            Collective. For explicit steps.
        """
        tags = collectively(self.comm, lambda: self.mesh.tags_of("facet", facet_tag))
        others = [side[0] for side in self._absorbing if side[4] == WAVE and side[0] not in tags]
        if others:
            raise InputError(
                f"sides {others} absorb and let waves in, expected only the driven one, or free fields beside others"
            )
        self._checked_wave(motion, direction)
        self._take_sides([(tag, np.inf, np.inf, np.inf, WAVE) for tag in tags])
        self._let_in(motion, direction, 0.5)  # a rigid side moves with twice the wave

    def _checked_wave(self, motion: Motion, direction: ArrayLike) -> list[float]:
        def checked() -> list[float]:
            if not isinstance(motion, Motion):
                raise InputError(f"motion is {motion!r}, expected a Motion; see read_accelerogram")
            along = floats("direction", direction, (self.mesh.dim,))
            length = float(np.linalg.norm(along))
            return (along / positive("length of direction", length, "m")).tolist()

        return collectively(self.comm, checked)

    def _let_in(self, motion: Motion, direction: ArrayLike, factor: float) -> None:
        unit = self._checked_wave(motion, direction)
        if not self._absorbing:
            raise InputError("no side absorbs, expected a call of absorb before shake")
        if all(side[4] != WAVE for side in self._absorbing):
            raise InputError(
                "all sides that absorb have free fields beside them, expected a call of absorb for the base, through which the wave "
                "comes in, before shake"
            )
        if self._free_damping is not None:
            raise InputError(
                "free fields have begun to move, expected shake before the run, or absorb for these sides again"
            )
        self._take_incoming((motion.time.tolist(), (factor * motion.velocity).tolist(), unit))

    def _check_free_fields(self, damping: float, rayleigh: Rayleigh) -> None:
        """Raise InputError where free fields do not support the damping of a run."""
        if damping and self._free_fields:
            raise InputError(
                f"damping is {damping} with free fields beside the sides, which support rayleigh only; expected 0"
            )
        if self._free_damping not in (None, rayleigh):
            raise InputError(
                f"rayleigh is {rayleigh}, expected {self._free_damping}, with which the free fields beside the sides have begun to "
                "move; call absorb for these sides again to begin anew, when the ground is at rest"
            )

    def _advance_free_fields(self, until: float, rayleigh: Rayleigh) -> None:
        """Give the core the motion of the free fields up to a time, on each rank alike."""
        if self._free_fields:
            self._free_damping = rayleigh
        if not self._columns:
            water = self._core.water
            self._columns = [
                GroundColumn(layers, self.laws, self._base(), rayleigh, water) for layers in self._free_fields
            ]
        self._set_tables([(column.heights, *column.advance(self._core.time, until)) for column in self._columns])

    def _set_tables(self, tables: list[Any]) -> None:
        self._tables = tables
        for number, (heights, *table) in enumerate(tables):
            self._core.set_free_field(number, heights, *table)

    def _base(self) -> Base | None:
        """Base of the free fields."""
        below = [side for side in self._absorbing if side[4] == WAVE]
        if not below:
            return None
        times, velocities, unit = self._incoming or ([], [], [0.0] * self.mesh.dim)
        _, normal, shear, thickness, _ = below[0]
        return Base((normal, shear), thickness, np.array(times), np.array(velocities), np.array(unit))

    def _take_incoming(self, incoming: Any) -> None:
        self._incoming = incoming
        self._core.set_incoming_wave(*(incoming or ([], [], [0.0] * self.mesh.dim)))

    def _absorbing_state(self) -> dict[str, Any] | None:
        """State for a checkpoint: the sides, their nodes with forces and displacements, and the wave. Collective."""
        if not self._absorbing:
            return None
        nodes = self._nodes_of_sides()
        sides = [[tag, *map(_finite, numbers), free] for tag, *numbers, free in self._absorbing]
        damping = self._free_damping
        return {
            "sides": sides,
            "nodes": [[place, nodes[place]] for place in sorted(nodes)],
            "incoming": self._incoming,
            "free_fields": [asdict(layers) for layers in self._free_fields],
            "free_damping": None if damping is None else [_finite(number) for number in damping._as_core()],
        }

    def _nodes_of_sides(self) -> dict[tuple[float, ...], list[Any]]:
        """What the sides that absorb have at each of their nodes, by its place. Collective."""
        return {tuple(place): entries for part in self.comm.allgather(self._core.dashpots()) for place, entries in part}

    def _take_absorbing(self, state: dict[str, Any] | None) -> None:
        """Restore the state from a checkpoint. Collective."""
        state = state or {"sides": [], "nodes": [], "incoming": None, "free_fields": []}
        self._absorbing = [
            (tag, _given(normal), _given(shear), _given(far), free) for tag, normal, shear, far, free in state["sides"]
        ]
        self._core.set_dashpots([(place, [tuple(entry) for entry in entries]) for place, entries in state["nodes"]])
        self._take_incoming(state["incoming"])
        self._free_fields = [layers_of(entry, self._core.water) for entry in state["free_fields"]]
        damping = state.get("free_damping")  # not in older files
        self._free_damping = None if damping is None else Rayleigh(*map(_given, damping))
        self._columns, self._tables = [], []  # a run begins them anew, and brings them to the present

    def _retake_absorbing(self, state: dict[str, Any] | None) -> None:
        """Restore the state after a repartition during a run."""
        columns, tables = self._columns, self._tables
        self._take_absorbing(state)
        self._columns = columns
        self._set_tables(tables)


def _finite(number: float) -> float | None:
    """A number for JSON, which has no infinite ones."""
    return None if number == np.inf else number


def _given(number: float | None) -> float:
    """The number of `_finite`."""
    return np.inf if number is None else number


def refuse_absorbing(model: Any, what: str) -> None:
    """Raises InputError where something does not support sides that absorb."""
    if model._absorbing:
        raise InputError(f"{what} does not support sides that absorb waves, see Model.absorb")
