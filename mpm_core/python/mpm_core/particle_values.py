"""Which law each particle of a model follows, and its state variables, parameters and fields by their names."""

from __future__ import annotations

from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from ._core import InputError
from .checks import real_numbers
from .collective import collectively
from .mesh import Mesh, floats
from .parameter_fields import Field, check_differences, differences_of, has_varying, parameter_values, values_from
from .particles import Particles


class ParticleValues:
    """The methods of a model for laws, states, parameters and fields of its particles."""

    mesh: Mesh
    comm: MPI.Comm
    laws: list[Any]
    particles: Particles
    _core: Any

    def _material(self, material: int) -> int:
        whole = isinstance(material, (int, np.integer)) and not isinstance(material, bool)
        if not (whole and 0 <= material < len(self.laws)):
            raise InputError(f"material is {material!r}, expected 0 to {len(self.laws) - 1}, the number of a law")
        return material

    def add_field(self, name: str, *, unit: str, meaning: str, components: int = 1, initial: float = 0.0) -> None:
        """Declare a field of the particles of your own, which from now on is an attribute of ``particles``.

        It is sorted, sent to other ranks, saved in checkpoints and offered to output as all fields are.

        Args:
            name: letters, digits and ``_``; no other field may have it.
            unit: such as "Pa"; "-" without dimension.
            meaning: a sentence.
            components: numbers per particle.
            initial: value of all particles, present and future.

        Raises:
            InputError: a name that is already used or not a word, no components, an initial value that is not finite.

        Example:
            >>> model.add_field("first_yield", unit="s", meaning="Time at which the particle yielded first", initial=-1.0)
            >>> model.particles.set("first_yield", np.where(model.particles.plastic_strain > 0, model.time, -1.0))
        """

        def add() -> None:
            value = float(floats("initial", initial, ()))
            if hasattr(self.particles, name) or name.startswith("_"):
                raise InputError(f"name of the field is {name!r}, which an attribute of the particles has")
            if isinstance(components, bool) or not isinstance(components, (int, np.integer)):
                raise InputError(f"components is {components!r}, expected a whole number")
            self._core.add_field(name, str(unit), str(meaning), int(components), value)

        collectively(self.comm, add)

    def state(self, name: str) -> NDArray[np.float64]:
        """A state variable by its name in ``state_names`` of the laws, such as "excess_pore_pressure".

        Returns:
            Shape (n,), in the order of ``particles``; NaN where a particle's law has no such variable. Not collective.
        """
        state, material = self.particles.state, self.particles.material
        values = np.full(len(material), np.nan)
        for number, column in self._state_columns(name):
            values[material == number] = state[material == number, column]
        return values

    def set_state(self, name: str, values: ArrayLike) -> None:
        """Overwrite a state variable by its name, in the particles whose law has it; shape (n,). Not collective.

        Raises:
            InputError: another shape, or values of a parameter that varies by which a particle would have no law.
        """
        state, material = self.particles.state.copy(), self.particles.material
        new = real_numbers("values", values)
        if new.shape != material.shape:
            raise InputError(f"values has shape {new.shape}, expected {material.shape}, one for each particle")
        for number, column in self._state_columns(name):
            state[material == number, column] = new[material == number]
            if name.endswith("_difference"):
                check_differences(self.laws[number], state[material == number])
        self.particles.set("state", state)

    def parameter(self, name: str) -> NDArray[np.float64]:
        """Values of a law's parameter that varies from particle to particle, see `set_parameter`.

        Returns:
            Shape (n,), in the order of ``particles``; NaN where it does not vary in a particle's law. Not collective.
        """
        values = np.full(len(self.particles), np.nan)
        for number, law in enumerate(self.laws):
            if has_varying(law, name):
                rows = self.particles.material == number
                values[rows] = values_from(law, name, self.particles.state[rows])
        return values

    def set_parameter(self, name: str, values: Field) -> None:
        """Give particles their values of a law's parameter that varies, in all laws that are `Heterogeneous` in it.

        The cohesion of `SofteningMohrCoulomb` varies as well, and its residual cohesion in proportion.

        Particles keep their values as they move. Give values after the particles are there; those seeded later have the
        number of their law.

        Args:
            name: of the parameter, such as "cohesion".
            values: a number; an array, shape (n,), in the order of ``particles``; a function of positions, shape (n, D), that
                returns such an array, for instance a `RandomField`; or {cell tag or name: number} for the cells where the
                particles are now.

        Raises:
            InputError: on all ranks: no law varies in the parameter, no particles, another shape, a value out of the parameter's
                range.

        Example:
            >>> soil = mpm.Heterogeneous(mpm.tresca(young=3e6, poisson=0.45, shear_strength=12e3), ["cohesion"])
            >>> model.set_parameter("cohesion", lambda x: 12e3 + 1.5e3 * (3.0 - x[:, 1]))  # s_u grows with depth
            >>> model.set_parameter("cohesion", -0.25 * model.particles.stress[:, 1])  # s_u of the stress at the start
        """

        def checked() -> NDArray[np.float64]:
            tags = {tag: self.mesh.tags_of("cell", tag) for tag in values} if isinstance(values, dict) else {}
            of_cell = self.mesh.cell_tags[self.particles.cell] if tags else None
            new = parameter_values(name, values, self.particles.position, of_cell, tags)
            return differences_of(name, new, self.laws, self.particles.material, self.particles.state)

        if self.comm.allreduce(len(self.particles)) == 0:
            raise InputError(
                f"values of {name!r} are for particles, of which the model has none: give them after seeding"
            )
        self.particles.set("state", collectively(self.comm, checked))

    def average_over_nodes(self, values: ArrayLike) -> NDArray[np.float64]:
        """Average values of the particles over nodes as nodal mixed discretisation (``nmd=True``) averages strains. Collective.

        Mean stresses and pore pressures of such runs may alternate from cell to cell, which does no work and moves nothing.
        Average them before you use them as results. Means are weighted by volumes, over the cells around a node and back over
        the nodes of a cell, for each velocity field and the soils of like stiffness in it by themselves (Detournay and Dzik 2006,
        docs/guide/theory.md). A cell of several soils counts with that of most of its particles.

        Args:
            values: of the particles of this rank in the order of ``particles``, shape (n,) or (n, k).

        Returns:
            Averages of the same shape and unit; the same for all particles of a velocity field in a cell.

        Raises:
            InputError: on all ranks, for another shape, or values that are not finite, such as `state` of soils without it.

        Example:
            >>> mean_stress = model.average_over_nodes(model.particles.stress[:, :3].mean(axis=1))
        """

        def checked() -> NDArray[np.float64]:
            array, n = real_numbers("values", values), len(self.particles)
            if array.ndim not in (1, 2) or len(array) != n:
                raise InputError(
                    f"values have shape {array.shape}, expected ({n},) or ({n}, k), in the order of the particles"
                )
            if not np.isfinite(array).all():
                raise InputError("values contain numbers that are not finite, expected finite ones")
            return array

        given = collectively(self.comm, checked)
        widths = set(self.comm.allgather(given.shape[1:]))
        if len(widths) > 1:
            raise InputError(f"values have {widths} components on different ranks, expected as many on all of them")
        if given.ndim == 1:
            return self._core.averaged_over_nodes(given)
        averaged = [self._core.averaged_over_nodes(np.ascontiguousarray(one)) for one in given.T]
        return np.array(averaged).reshape(given.shape[::-1]).T

    def _state_columns(self, name: str) -> list[tuple[int, int]]:
        """(number of a law, column of the state variable) for each law that has it."""
        columns = [(k, law.state_names.index(name)) for k, law in enumerate(self.laws) if name in law.state_names]
        if not columns:
            known = sorted({known for law in self.laws for known in law.state_names})
            raise InputError(f"name is '{name}', expected a state variable of the laws: {', '.join(known)}")
        return columns

    def wave_moduli(self) -> NDArray[np.float64]:
        """Moduli of compression and shear waves in this rank's particles as they are now [Pa], shape (n, 2)."""
        p, moduli = self.particles, np.empty((len(self.particles), 2))
        for number, law in enumerate(self.laws):
            rows = np.flatnonzero(p.material == number)
            moduli[rows] = law.wave_moduli(p.stress[rows], np.ascontiguousarray(p.state[rows, : law.n_state]))
        return moduli

    def assign(self, material: ArrayLike) -> None:
        """Give each particle its law: numbers of laws, shape (n,), in the order of ``particles``. Not collective.

        Stresses stay. Of the state variables those stay that the new law has, too, by their names; its others begin at zero.

        Example:
            >>> model.assign(np.where(model.particles.position[:, 1] < 2.0, 1, 0))  # layers
        """
        numbers = np.asarray(material)
        if numbers.shape != (len(self.particles),) or not np.issubdtype(numbers.dtype, np.integer):
            raise InputError(
                f"material has shape {numbers.shape} and dtype {numbers.dtype}, expected one whole number each"
            )
        for number in np.unique(numbers):
            self._material(int(number))
        state = self._state_under(numbers)
        self._core.set_materials(np.ascontiguousarray(numbers, dtype=np.int32))
        if state is not None:
            self.particles.set("state", state)

    def _state_under(self, numbers: NDArray[Any]) -> NDArray[np.float64] | None:
        """State variables under other laws; None if they stay as they are."""
        here, state = self.particles.material, self.particles.state
        new = state.copy()
        for before, after in np.unique(np.column_stack([here, numbers])[here != numbers], axis=0):
            rows, known = (here == before) & (numbers == after), self.laws[before].state_names
            new[rows] = 0.0
            for column, name in enumerate(self.laws[after].state_names):
                if name in known:
                    new[rows, column] = state[rows, known.index(name)]
        return None if np.array_equal(new, state) else new
