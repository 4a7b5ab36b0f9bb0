"""Resting cells: finite elements with one material point, which turn into particles where the soil fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import InputError, Integration
from .checks import positive
from .collective import collectively
from .mesh import Mesh, Tag
from .particles import Particles

Where: TypeAlias = Callable[[NDArray[np.float64]], ArrayLike] | ArrayLike
"""Function of the centres of cells, shape (cells, D), that returns whether each is chosen; or that, for this rank's own cells"""


@dataclass(frozen=True)
class Conversion:
    """When resting cells turn into particles; checked every 32 steps of an explicit run, and after each implicit step.

    A cell that a particle enters, or that a rigid surface comes near to, turns into particles whatever the criterion.

    Args:
        plastic_strain: accumulated plastic deviatoric strain of a cell, or of a particle in it, above which the cell turns into
            particles [-]. In a shear band it grows without bound, elsewhere it is of the order of the elastic strains.
        displacement: displacement of a node since its cell became a resting cell, over the cell size h, above which the cell
            turns into particles [-]. They are placed at the original position of the cell, so that this is the largest error
            of their positions, over the cell size.
        layers: layers of cells around such a cell that turn into particles with it, so that a shear band grows in particles.

    Raises:
        InputError: a limit that is not positive, layers that are not a whole number from 1.
    """

    plastic_strain: float = 0.05
    displacement: float = 0.1
    layers: int = 2

    def __post_init__(self) -> None:
        positive("plastic_strain", self.plastic_strain, "(a strain)")
        positive("displacement", self.displacement, "(a ratio)")
        if isinstance(self.layers, bool) or self.layers != int(self.layers) or self.layers < 1:
            raise InputError(f"layers is {self.layers!r}, expected a whole number from 1")

    def _as_core(self) -> Any:
        return _core.Conversion(self.plastic_strain, self.displacement, int(self.layers))


def represented(particles: Particles) -> NDArray[Any]:
    """Number of particles that each row stands for: those of a resting cell, otherwise 1; shape (n,)."""
    return np.maximum(particles.resting, 1) if particles.is_resting.any() else np.ones(len(particles))


class RestingCells:
    """The methods of a model for cells that rest."""

    mesh: Mesh
    comm: MPI.Comm
    particles: Particles
    _core: Any

    @property
    def resting_cells(self) -> NDArray[np.bool_]:
        """Whether each of this rank's own cells rests, shape (owned cells,). Not collective."""
        resting = np.zeros(self.mesh.owned_cells, dtype=bool)
        resting[self.particles.cell[self.particles.is_resting]] = True
        return resting

    def rest(self, cell_tag: Tag | None = None, *, where: Where | None = None) -> int:
        """Turn cells into resting cells: each is a linear finite element with one material point, instead of its particles.

        A resting cell costs little more than one particle. Its nodes are those of the particles around it, and it has their
        mass, so that waves pass from one to the other. It is for soil that hardly moves: a cell turns into particles where it
        fails (`Conversion`), which changes neither mass, momentum and force of the nodes nor the energy.

        Stress, state and all other values of a cell are the means of those of its particles. `particles` has one row for each
        resting cell, at its centre, with the mass and volume of the cell; `particles.is_resting` marks these rows. In axial
        symmetry stresses and states are means by volume, and its velocity is that at the centre, not at the centre of mass.

        Args:
            cell_tag: cells with this tag, or these tags, by number or name; all cells by default.
            where: among them the cells with a centre where this function of positions, (cells, D), says so; or a mask over this
                rank's own cells.

        Returns:
            Number of resting cells over all ranks.

        Raises:
            InputError: on all ranks: cells whose particles are not where `seed` placed them, or carry tractions; several
                velocity fields.

        Example:
            >>> model.seed(density=2000.0, per_cell=10)
            >>> model.rest(where=lambda x: x[:, 1] < 5.0)
        """
        self._core.rest_cells(self._chosen(cell_tag, where))
        return self._count()

    def convert(self, cell_tag: Tag | None = None, *, where: Where | None = None) -> int:
        """Turn resting cells into the particles that they stand for, which a run does by itself where the soil fails.

        Args:
            cell_tag: as for `rest`.
            where: as for `rest`.

        Returns:
            Number of remaining resting cells over all ranks.
        """
        self._core.convert_cells(self._chosen(cell_tag, where))
        return self._count()

    def _count(self) -> int:
        return self.comm.allreduce(int(self.resting_cells.sum()))

    def _chosen(self, cell_tag: Tag | None, where: Where | None) -> NDArray[np.uint8]:
        def checked() -> NDArray[np.uint8]:
            mesh, n = self.mesh, self.mesh.owned_cells
            chosen = np.ones(n, dtype=bool)
            if cell_tag is not None:
                chosen = np.isin(mesh.cell_tags[:n], mesh.tags_of("cell", cell_tag))
            if where is not None:
                centres = mesh.points[mesh.cells[:n]].mean(axis=1)
                mask = np.asarray(where(centres) if callable(where) else where)
                if mask.shape != (n,) or mask.dtype != bool:
                    raise InputError(f"where has shape {mask.shape} and dtype {mask.dtype}, expected ({n},) of bool")
                chosen = chosen & mask
            return chosen.astype(np.uint8)

        return collectively(self.comm, checked)


def refuse_resting(model: Any, what: str) -> None:
    """Raises InputError where something does not support resting cells. Collective."""
    count = model.comm.allreduce(int(model.particles.is_resting.sum()))
    if count:
        raise InputError(f"{what} does not support resting cells, of which the model has {count}; see Model.convert")


def checked_conversion(model: Any, conversion: Conversion | None, integration: Any) -> Any:
    """The core's criterion; None where resting cells are to stay.

    Raises:
        InputError: something else, or what resting cells do not support.
    """
    if conversion is not None and not isinstance(conversion, Conversion):
        raise InputError(f"conversion is {conversion!r}, expected a Conversion or None")
    if model._core.has_resting_cells:
        if integration == Integration.DUAL_DOMAIN:
            refuse_resting(model, "integration DUAL_DOMAIN")
    return None if conversion is None else conversion._as_core()
