"""The particles of a model, as NumPy arrays."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._core import Geometry, InputError
from .collective import collectively
from .mesh import floats
from .views import particle_mesh, particle_table, particles_text, plot_particles

SHOWN = ("position", "displacement", "velocity", "stress", "plastic_strain")
"""Fields of tables and point meshes where nothing else is asked for."""


class Particles:
    """The particles of a model on this rank. Every attribute is a copy, one row per particle, and read-only: `set` writes.

    The order of rows changes when particles are sorted or move to another rank; ``id`` identifies a particle. Attributes of a
    few particles are copied faster by indexing:

    Example:
        >>> low = model.particles.position[:, 1] < 1.0
        >>> model.particles[low].stress.mean(axis=0)
    """

    def __init__(self, core: Any, geometry: Geometry, comm: MPI.Comm, rows: NDArray[np.int64] | None = None) -> None:
        self._core = core
        self._geometry = geometry
        self._comm = comm
        self._rows = rows

    def __repr__(self) -> str:
        return particles_text(self)

    def __len__(self) -> int:
        return self._core.size if self._rows is None else len(self._rows)

    def __getitem__(self, rows: ArrayLike) -> Particles:
        """The particles in some rows; attributes have the values of the time at which they are read.

        Args:
            rows: numbers of rows, from 0, in any order, shape (m,); or whether each row is chosen, shape (n,).

        Raises:
            InputError: rows of another shape or dtype, or a row that does not exist, also when the attribute is read later.
        """
        self._require_all("choosing rows")
        return Particles(self._core, self._geometry, self._comm, self._core.row_numbers(np.asarray(rows)))

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
    def displacement(self) -> NDArray[np.float64]:
        """Position minus initial position [m], shape (n, D).

        Steps of small displacements, which leave the position as it is, change the initial position instead.
        """
        return self.position - self.initial_position

    @property
    def plastic_strain(self) -> NDArray[np.float64]:
        """Accumulated plastic deviatoric strain, the first state variable of every law [-], shape (n,)."""
        return self.state[:, 0]

    @property
    def is_resting(self) -> NDArray[np.bool_]:
        """Whether each row is that of a resting cell, which stands for several particles; shape (n,). See `Model.rest`."""
        counts = self._column("resting")
        return counts > 0 if len(counts) else np.zeros(len(self), dtype=bool)

    def schedule(self) -> list[dict[str, Any]]:
        """All fields, including those that `Model.add_field` declared.

        Returns:
            For each field: ``name``, ``unit``, ``meaning``, number of ``components``, ``initial`` value, whether it is
            ``optional`` and whether it is ``settable``.
        """
        return self._core.particle_schedule()

    def __getattr__(self, name: str) -> NDArray[Any]:
        """A field that the model has declared."""
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._column(name)
        except InputError as error:
            fields = {"displacement", "plastic_strain", *(field["name"] for field in self.schedule())}
            raise AttributeError(f"{error}, expected one of {', '.join(sorted(fields))}") from None

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *(field["name"] for field in self.schedule())})

    def _sides(self) -> NDArray[np.float64]:
        """Side of the square or cube that is as large as each particle [m], twice its radius at surfaces; shape (n,)."""
        size = self.volume / self.position[:, 0] if self._geometry == Geometry.AXISYMMETRIC else self.volume
        return size ** (1 / self.position.shape[1])  # type: ignore[no-any-return]

    def single(self, *names: str) -> dict[str, NDArray[Any]]:
        """Copies of fields of all particles in single precision, such as frames that are kept in memory; faster than one by one.

        Args:
            names: as the attributes; `id`, `material` and `cell` stay whole numbers. The position is always there.

        Raises:
            InputError: a name that no field has.
        """
        self._require_all("single")
        return self._core.copied_fields(names, single=True, padded=False)

    def to_dataframe(self, *names: str) -> Any:
        """The particles of this rank as a table of pandas, by their numbers.

        Args:
            names: fields, one column for each component: ``position_x``, ``stress_xx``, in axial symmetry ``stress_hoop`` in the
                place of ``stress_zz``, ``velocity_gradient_xy`` for dv_x/dy, ``state_0`` for the first of the ``state_names`` of
                a law; without any, position, displacement, velocity, stress and plastic strain.

        Returns:
            pandas.DataFrame; its ``attrs["units"]`` has the unit of each column.

        Raises:
            AttributeError: a field that does not exist.
            InputError: an optional field that no particle has yet.
            ImportError: pandas is not installed.

        Example:
            >>> model.particles.to_dataframe("velocity").describe()
        """
        return particle_table(self, names or SHOWN)

    def to_meshio(self, *names: str) -> Any:
        """The particles of this rank as points of a meshio.Mesh with fields, which ``pyvista.from_meshio`` takes as well.

        Args:
            names: fields, as for `to_dataframe`. Vectors have three components; tensors are one field for each component, with
                the names of `to_dataframe`, as in the files of `ParticleOutput`.

        Raises:
            AttributeError: a field that does not exist.
            InputError: an optional field that no particle has yet.
            ImportError: meshio is not installed.
        """
        return particle_mesh(self, names or SHOWN)

    def plot(self, name: str = "displacement", axes: Any = None) -> Any:
        """Draw the particles of this rank, coloured by a field.

        Args:
            name: a field, whose size is shown if it is a vector, or a component such as ``stress_yy`` or ``velocity_x``.
            axes: matplotlib axes to draw into, three-dimensional ones in 3D; new ones by default.

        Returns:
            The axes. In two dimensions particles are circles that cover the soil, in three points.

        Raises:
            InputError: no such field or component; the message lists them. Or an optional field that no particle has yet.
            ImportError: matplotlib is not installed.

        Example:
            >>> model.particles.plot("stress_yy").set_title("after a second")
        """
        per_radian = self._geometry == Geometry.AXISYMMETRIC
        return plot_particles(self, name, axes, self.volume / self.position[:, 0] if per_radian else self.volume)

    def set(self, name: str, values: ArrayLike) -> None:
        """Overwrite a field that can be set according to `schedule`, such as velocity, stress, state or traction.

        Not collective, except for tractions where cells rest.

        Args:
            name: the field.
            values: one row per particle, in the present order; shape as the attribute of that name gives it.

        Raises:
            InputError: unknown field, wrong shape or dtype, a value that is not finite, only some particles, a velocity of the
                water before an explicit step has given it one of its own, or, on all ranks, a traction on a resting cell.
        """
        self._require_all("set")
        settable = [field["name"] for field in self.schedule() if field["settable"]]
        if name not in settable:
            what = "cannot be set" if name in dir(self) else "does not exist"
            place = "; Model.place moves particles" if name == "position" else ""
            raise InputError(f"particle field is {name!r}, which {what}, expected one of {', '.join(settable)}{place}")
        if name == "water_velocity" and not self._core.has_two_phases:
            raise InputError(
                "water_velocity cannot be set yet: water moves with the soil up to the first explicit step with pore water, "
                "such as model.explicit(until=1e-9, dt=1e-9).last()"
            )
        shape: tuple[int | None, ...] = tuple(None for _ in np.shape(values))
        if name == "traction" and self._core.has_resting_cells:
            self._set_tractions(collectively(self._comm, lambda: floats(name, values, shape)), name)
        else:
            self._core.set_column(name, floats(name, values, shape))

    def _set_tractions(self, forces: NDArray[np.float64], what: str) -> None:
        """Set the forces on particles; raises InputError, on all ranks, where resting cells would be given some. Collective."""
        loaded = np.any(forces != 0, axis=1) if forces.ndim == 2 and len(forces) == len(self) else False
        count = self._comm.allreduce(int(np.count_nonzero(loaded & self.is_resting)))
        if count:
            raise InputError(
                f"{what} would load {count} resting cells, expected particles to carry it: turn the cells there into particles "
                "first, by Model.convert"
            )
        self._core.set_column("traction", forces)


def field_text(field: dict[str, Any], shape: str) -> str:
    """A field of the schedule in a sentence: meaning, unit, shape."""
    optional = "; no rows as long as no particle has one" if field["optional"] else ""
    return f"{field['meaning']} [{field['unit']}], shape {shape}{optional}."


def field_table(schedule: list[dict[str, Any]]) -> str:
    """A schedule of fields as a table in Markdown."""
    rows = [
        f"| `{field['name']}` | {field['unit']} | {field['components'] or 'as the law says'} | {field['meaning']}"
        f"{' (optional)' if field['optional'] else ''} | {'yes' if field['settable'] else 'no'} |"
        for field in schedule
    ]
    return "\n".join(["| field | unit | components | meaning | can be set |", "| --- | --- | --- | --- | --- |", *rows])


def _add_properties() -> None:
    """An attribute of `Particles` for each field of the schedule, with what the schedule says of it."""

    def getter(name: str) -> Callable[[Particles], NDArray[Any]]:
        return lambda particles: particles._column(name)

    plane, solid = (core.default_particle_schedule() for core in (_core.Model2, _core.Model3))
    for field, in_space in zip(plane, solid, strict=True):
        assert in_space["name"] == field["name"]
        in_both = field["components"], in_space["components"]
        shapes = {(1, 1): "(n,)", (2, 3): "(n, D)", (4, 6): "(n, 4) or (n, 6)", (4, 9): "(n, 4) or (n, 9)"}
        setattr(
            Particles,
            field["name"],
            property(
                getter(field["name"]), doc=field_text(field, shapes.get(in_both, "(n, number of state variables)"))
            ),
        )


_add_properties()
