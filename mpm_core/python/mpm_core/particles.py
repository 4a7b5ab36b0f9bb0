"""Particles seen from Python."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .mesh import floats


class Particles:
    """The particles of a model on this rank. Every attribute is a copy, one row per particle.

    The order of rows changes when particles are sorted or move to another rank; ``id`` tells who is who.
    """

    def __init__(self, core: Any, dim: int) -> None:
        self._core = core
        self._dim = dim

    def __len__(self) -> int:
        return self._core.size

    @property
    def id(self) -> NDArray[np.int64]:
        """Number of each particle, unique over all ranks; shape (n,)."""
        return self._core.column("id")

    @property
    def position(self) -> NDArray[np.float64]:
        """Position [m], shape (n, D)."""
        return self._core.column("position")

    @property
    def initial_position(self) -> NDArray[np.float64]:
        """Position from which displacement counts [m], shape (n, D)."""
        return self._core.column("initial_position")

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Position minus initial position [m], shape (n, D)."""
        return self.position - self.initial_position

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity [m/s], shape (n, D)."""
        return self._core.column("velocity")

    @property
    def stress(self) -> NDArray[np.float64]:
        """Cauchy stress [Pa], tension positive, shape (n, 4) or (n, 6)."""
        return self._core.column("stress")

    @property
    def volume(self) -> NDArray[np.float64]:
        """Volume [m^D], shape (n,)."""
        return self._core.column("volume")

    @property
    def mass(self) -> NDArray[np.float64]:
        """Mass [kg], per metre of thickness in plane strain; shape (n,)."""
        return self._core.column("mass")

    @property
    def deviatoric_strain(self) -> NDArray[np.float64]:
        """Accumulated deviatoric strain, sum of sqrt(2/3 de : de) [-], shape (n,)."""
        return self._core.column("deviatoric_strain")

    @property
    def state(self) -> NDArray[np.float64]:
        """State variables of the law, shape (n, n_state)."""
        return self._core.column("state")

    @property
    def plastic_strain(self) -> NDArray[np.float64]:
        """Accumulated plastic deviatoric strain, the first state variable of every law [-], shape (n,)."""
        return self.state[:, 0]

    @property
    def traction(self) -> NDArray[np.float64]:
        """Force from a loaded boundary that each particle carries [N], shape (n, D); (0, D) where none does."""
        return self._core.column("traction")

    @property
    def material(self) -> NDArray[np.int32]:
        """Number of each particle's law, shape (n,)."""
        return self._core.column("material")

    @property
    def cell(self) -> NDArray[np.int32]:
        """Number of the cell on this rank that holds each particle, shape (n,)."""
        return self._core.column("cell")

    def set(self, name: str, values: ArrayLike) -> None:
        """Overwrite a field: velocity, stress, volume, mass, deviatoric_strain, state, initial_position or traction.

        Args:
            name: the field.
            values: one row per particle, in the present order; shape as the attribute of that name gives it.

        Raises:
            InputError: unknown field, wrong shape or dtype, a value that is not finite.
        """
        shape: tuple[int | None, ...] = tuple(None for _ in np.shape(values))
        self._core.set_column(name, floats(name, values, shape))
