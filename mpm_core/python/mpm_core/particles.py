"""Particles seen from Python."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .mesh import floats


class Particles:
    """The particles of a model on this rank. Every attribute is a copy, one row per particle, and read-only: `set` writes.

    The order of rows changes when particles are sorted or move to another rank; ``id`` tells who is who. Of a few particles
    attributes are had sooner than by copying those of all:

    Example:
        >>> low = model.particles.position[:, 1] < 1.0
        >>> model.particles[low].stress.mean(axis=0)
    """

    def __init__(self, core: Any, rows: NDArray[np.int64] | None = None) -> None:
        self._core = core
        self._rows = rows

    def __len__(self) -> int:
        return self._core.size if self._rows is None else len(self._rows)

    def __getitem__(self, rows: ArrayLike) -> Particles:
        """The particles in some rows, as they are whenever one of its attributes is read.

        Args:
            rows: numbers of rows, from 0, in any order, shape (m,); or whether each row is chosen, shape (n,).

        Raises:
            InputError: rows of another shape or dtype, or a row that is not there, also when that is so only later.
        """
        self._require_all("choosing rows")
        return Particles(self._core, self._core.row_numbers(np.asarray(rows)))

    def find(self, ids: Sequence[int] | NDArray[np.integer]) -> NDArray[np.int64]:
        """The row of each of some particles, by their numbers, shape (m,); -1 for those that are not on this rank."""
        self._require_all("find")
        return self._core.find_rows(ids)

    def _require_all(self, what: str) -> None:
        if self._rows is not None:
            raise InputError(f"{what} is for all particles, not for those in some rows")

    def _column(self, name: str) -> NDArray[Any]:
        values = self._core.column(name, self._rows)
        values.flags.writeable = False  # a value written into a copy would be lost without a word
        return values

    @property
    def id(self) -> NDArray[np.int64]:
        """Number of each particle, unique over all ranks; shape (n,)."""
        return self._column("id")

    @property
    def position(self) -> NDArray[np.float64]:
        """Position [m], shape (n, D)."""
        return self._column("position")

    @property
    def initial_position(self) -> NDArray[np.float64]:
        """Position from which displacement counts [m], shape (n, D)."""
        return self._column("initial_position")

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Position minus initial position [m], shape (n, D)."""
        return self.position - self.initial_position

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity [m/s], shape (n, D)."""
        return self._column("velocity")

    @property
    def stress(self) -> NDArray[np.float64]:
        """Cauchy stress [Pa], tension positive, shape (n, 4) or (n, 6)."""
        return self._column("stress")

    @property
    def volume(self) -> NDArray[np.float64]:
        """Volume [m^D], shape (n,)."""
        return self._column("volume")

    @property
    def mass(self) -> NDArray[np.float64]:
        """Mass [kg], per metre of thickness in plane strain; shape (n,)."""
        return self._column("mass")

    @property
    def deviatoric_strain(self) -> NDArray[np.float64]:
        """Accumulated deviatoric strain, sum of sqrt(2/3 de : de) [-], shape (n,)."""
        return self._column("deviatoric_strain")

    @property
    def state(self) -> NDArray[np.float64]:
        """State variables of the law, shape (n, n_state)."""
        return self._column("state")

    @property
    def plastic_strain(self) -> NDArray[np.float64]:
        """Accumulated plastic deviatoric strain, the first state variable of every law [-], shape (n,)."""
        return self.state[:, 0]

    @property
    def traction(self) -> NDArray[np.float64]:
        """Force from a loaded boundary that each particle carries [N], shape (n, D); (0, D) where none does."""
        return self._column("traction")

    @property
    def material(self) -> NDArray[np.int32]:
        """Number of each particle's law, shape (n,)."""
        return self._column("material")

    @property
    def cell(self) -> NDArray[np.int32]:
        """Number of the cell on this rank that holds each particle, shape (n,)."""
        return self._column("cell")

    def single(self, *names: str) -> dict[str, NDArray[Any]]:
        """Copies of fields of all particles in single precision, such as frames that are kept in memory; sooner than one by one.

        Args:
            names: as the attributes; `id`, `material` and `cell` stay whole numbers. The position is always there.

        Raises:
            InputError: a name that no field has.
        """
        self._require_all("single")
        return self._core.single_precision(names)

    def set(self, name: str, values: ArrayLike) -> None:
        """Overwrite a field: velocity, stress, volume, mass, deviatoric_strain, state, initial_position or traction.

        Args:
            name: the field.
            values: one row per particle, in the present order; shape as the attribute of that name gives it.

        Raises:
            InputError: unknown field, wrong shape or dtype, a value that is not finite, or only some particles.
        """
        self._require_all("set")
        shape: tuple[int | None, ...] = tuple(None for _ in np.shape(values))
        self._core.set_column(name, floats(name, values, shape))
