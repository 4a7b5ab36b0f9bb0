"""A soil body: particles with their laws, loads and supports on a background mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from . import _core, partition
from ._core import Geometry, InputError
from .absorbing import AbsorbingSides
from .checks import positive, renamed
from .collective import collectively
from .far_field import FarFields
from .mesh import Mesh, Tag, floats
from .parameter_fields import Field, differences_of, has_varying, nominal_value, parameter_values
from .particles import Particles
from .pore_water import PoreWater
from .resting import RestingCells, refuse_resting
from .space import SpaceWatch
from .surface_load import load_surface
from .surfaces import Surface
from .triangles import Triangles


def _geometry(mesh: Mesh, geometry: Geometry | None) -> Geometry:
    """The geometry, where the mesh can have it."""
    if geometry is None:
        return Geometry.PLANE_STRAIN if mesh.dim == 2 else Geometry.SOLID
    if not isinstance(geometry, Geometry):
        raise InputError(f"geometry is {geometry!r}, expected Geometry.PLANE_STRAIN, AXISYMMETRIC or SOLID")
    if (geometry == Geometry.SOLID) != (mesh.dim == 3):
        raise InputError(f"geometry is {geometry.name}, but the mesh has {mesh.dim} dimensions")
    if geometry == Geometry.AXISYMMETRIC and len(mesh.points) and mesh.points[:, 0].min() < 0:
        radius = mesh.points[:, 0].min()
        raise InputError(f"mesh has a node at x = {radius:g} m, expected radii from 0 on in axial symmetry")
    return geometry


def _whole_numbers(name: str, values: Sequence[int]) -> list[int]:
    for value in values:
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
            raise InputError(f"{name} has {value!r}, expected whole numbers")
    return [int(value) for value in values]


class Body(PoreWater, RestingCells, AbsorbingSides, FarFields):
    """The part of a model that does not depend on the scheme; see `Model`."""

    def __init__(
        self,
        mesh: Mesh,
        laws: Any | Sequence[Any],
        *,
        geometry: Geometry | None = None,
        velocity_fields: Sequence[int] | None = None,
    ) -> None:
        if not isinstance(mesh, Mesh):
            kind = f"{type(mesh).__module__}.{type(mesh).__name__}"
            raise InputError(
                f"mesh is a {kind}, expected an mpm_core.Mesh; fenics_bridge.background_mesh(domain, cell_tags, facet_tags) "
                "makes one of a mesh of DOLFINx"
            )
        super().__init__()
        self.mesh = mesh
        self.comm: MPI.Comm = mesh.comm
        self.laws = list(laws) if isinstance(laws, (list, tuple)) else [laws]
        for law in self.laws:
            if not isinstance(law, tuple(_core.law_types)):
                raise InputError(f"laws has {law!r}, expected constitutive laws such as MohrCoulomb(...)")
        if not self.laws:
            raise InputError("laws is empty, expected at least one constitutive law")
        self.geometry = collectively(self.comm, lambda: _geometry(mesh, geometry))
        """What the mesh stands for."""
        fields = collectively(self.comm, lambda: _whole_numbers("velocity_fields", velocity_fields or ()))
        suffix = {Geometry.PLANE_STRAIN: "2", Geometry.AXISYMMETRIC: "Axisymmetric", Geometry.SOLID: "3"}[self.geometry]
        self._core = getattr(_core, f"Model{suffix}")(mesh._core, self.laws, fields, MPI._addressof(self.comm))
        self._velocity_fields = fields or [0] * len(self.laws)
        self._space_watch: SpaceWatch | None = None
        self._water_conditions = []
        self._retention = []
        self._absorbing, self._incoming = [], None
        self._border = None
        self._free_fields, self._columns, self._tables = [], [], []
        self._contacts: list[dict[str, Any]] = []  # as checkpoints describe them
        self._collisions: list[dict[str, Any]] = []
        self._field_contacts: list[dict[str, Any]] = []
        self._triangulated: dict[str, Triangles] = {}  # their triangles by fingerprint, which checkpoints do not have
        self._next_id = 0
        self._control: Any = None  # of the implicit run, a StepControl
        self._resumed: Any = None  # of a checkpoint, for the next implicit run
        self.repartitions = 0
        """Number of repartitions of the background mesh since the model was made."""
        self._first_mesh = mesh  # kept, since it may own the communicator
        self._left_imbalance = 1.0  # by the last partition
        self.particles = Particles(self._core, self.geometry)
        """The particles on this rank."""

    cuts = renamed("cuts", "repartitions")

    @property
    def cell_volumes(self) -> NDArray[np.float64]:
        """Volume of each cell of the mesh (cells,) [m^D]; in axial symmetry of one radian [m3], the integral of r dA."""
        volumes = self.mesh.cell_volumes
        if self.geometry == Geometry.AXISYMMETRIC:
            volumes = volumes * self.mesh.points[self.mesh.cells, 0].mean(axis=1)
        return volumes

    # --- particles -----------------------------------------------------------------------------------------------

    def _seeded(self, added: int, ids: int) -> int:
        self._next_id += ids
        return self.comm.allreduce(added)

    def _material(self, material: int) -> int:
        if not 0 <= material < len(self.laws):
            raise InputError(f"material is {material}, expected 0 to {len(self.laws) - 1}, the number of a law")
        return material

    def seed(self, *, density: float, per_cell: int = 10, cell_tag: Tag | None = None, material: int = 0) -> int:
        """Place particles evenly in cells, each with the same fraction of its cell's area or volume.

        In axial symmetry a particle's volume is that area times its radius. The sum is the cell's volume; with 3, 12, 48,
        ... per cell, which are Gauss points of degree 2, the masses of its nodes are exact too.

        Args:
            density: [kg/m3].
            per_cell: particles per cell: 1, 3, 4, 6, 10, 12, ... in a triangle; 1, 4, 8, 10, ... in a tetrahedron.
            cell_tag: cells with this tag, or these tags, by number or name; all cells by default.
            material: number of their law.

        Returns:
            Number of particles placed, over all ranks.

        Raises:
            InputError: a density that is not positive, a number that does not fill a cell evenly, an unknown tag or law, or
                cells that hold particles already.
        """

        def place() -> int:
            tags = [None] if cell_tag is None else self.mesh.tags_of("cell", cell_tag)
            rho = positive("density", density, "kg/m3")
            if isinstance(per_cell, bool) or not isinstance(per_cell, (int, np.integer)):
                raise InputError(f"per_cell is {per_cell}, expected a whole number")
            number = self._material(material)
            if per_cell > 0:
                self._require_empty(cell_tag, tags)
            return sum(self._core.seed_cells(tag, int(per_cell), number, rho, self._next_id) for tag in tags)

        return self._seeded(collectively(self.comm, place), self.mesh.cell_numbers * int(per_cell))

    def _require_empty(self, cell_tag: Tag | None, tags: Sequence[int | None]) -> None:
        filled = np.unique(self.particles.cell)
        again = filled if tags == [None] else filled[np.isin(self.mesh.cell_tags[filled], np.array(tags))]
        if len(again):
            where = "mesh" if cell_tag is None else f"part with the tag {cell_tag!r}"
            raise InputError(
                f"cell_tag is {cell_tag!r}, but {len(again)} cells of that {where} hold particles already, and would hold their "
                "soil twice; seed each cell once, and choose laws by material= or model.assign()"
            )

    def seed_points(self, points: ArrayLike, volumes: ArrayLike, *, density: float, material: int = 0) -> int:
        """Place one particle at each given point. Every rank gives the same points.

        Args:
            points: [m], shape (n, D).
            volumes: [m^D], in axial symmetry of one radian [m3], shape (n,), positive.
            density: [kg/m3].
            material: number of their law.

        Returns:
            Number of particles placed, over all ranks.

        Raises:
            InputError: wrong shape, a point outside of the mesh, a volume or density that is not positive.
        """

        def place() -> int:
            x = floats("points", points, (None, self.mesh.dim))
            v = floats("volumes", volumes, (len(x),))
            if (v <= 0).any():
                raise InputError(f"volumes is {v.min()} m^{self.mesh.dim} at least, expected positive numbers")
            rho = positive("density", density, "kg/m3")
            rows = np.flatnonzero(inside.argmax(axis=0) == self.comm.rank)
            return self._core.seed_points(x[rows], v[rows], self._next_id + rows, self._material(material), rho)

        # By rank and point: one on a side between the cells of two ranks is in both, and the first rank has it.
        inside = np.array(self.comm.allgather(collectively(self.comm, lambda: self._owned(points))))
        if not inside.any(axis=0).all():
            first = int(np.argmin(inside.any(axis=0)))
            raise InputError(f"points has {np.asarray(points)[first]} at row {first}, which is outside of the mesh")
        return self._seeded(collectively(self.comm, place), len(np.asarray(points)))

    def _owned(self, points: ArrayLike) -> Any:
        cells = self.mesh.cells_of(points)
        return (cells >= 0) & (cells < self.mesh.owned_cells)

    def traction(self, facet_tag: Tag, traction: ArrayLike) -> float:
        """Load the particles next to the facets with a tag (15). The force moves with them and keeps its direction.

        Args:
            facet_tag: tag of the loaded facets, by number or name.
            traction: force per area [Pa], shape (D,).

        Returns:
            Area of the loaded facets [m^(D-1)] over all ranks.
        """

        def load() -> float:
            tags, force = self.mesh.tags_of("facet", facet_tag), floats("traction", traction, (self.mesh.dim,)).tolist()
            return sum(self._core.load_facets(tag, force) for tag in tags)

        area = self.comm.allreduce(collectively(self.comm, load))
        if area == 0:
            raise InputError(f"facet_tag {facet_tag!r} has no filled cell behind it to carry the traction")
        return area

    def load_surface(
        self, surface: Surface, *, pressure: float | None = None, traction: ArrayLike | None = None
    ) -> float:
        """Load the particles beside a surface that does not follow the mesh: ground, a cavity, a footing's lower side.

        Each part of the surface gives its load to the particle nearest to it, on the side where the soil is; parts without any
        within the particle's side V^(1/D) are not loaded. The forces move with the particles, keep their direction, and add to
        those that are there. The sum of forces is that of the surface to round-off; they act half a particle inside of it.

        Args:
            surface: as for `add_contact`; it bounds the soil where it is to be loaded, and its shape is taken once. Let one
                that is larger than the soil end with it: a part of up to half a particle beyond the soil counts.
            pressure: [Pa], towards the soil.
            traction: force per area [Pa], shape (D,); instead of a pressure.

        Returns:
            Area of the loaded parts [m^(D-1)] over all ranks; per radian in axial symmetry.

        Raises:
            InputError: an argument out of its range, a surface without soil beside it. On all ranks alike.

        Example:
            >>> model.load_surface(mpm.Disc((0.0, -5.0), 1.0), pressure=50e3)  # in a tunnel
        """
        return load_surface(self, surface, pressure, traction)

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
        """Overwrite a state variable by its name, in the particles whose law has it; shape (n,). Not collective."""
        state, material = self.particles.state.copy(), self.particles.material
        new = np.asarray(values, dtype=np.float64)
        if new.shape != material.shape:
            raise InputError(f"values has shape {new.shape}, expected {material.shape}, one for each particle")
        for number, column in self._state_columns(name):
            state[material == number, column] = new[material == number]
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
                column = law.state_names.index(f"{name}_difference")
                values[rows] = nominal_value(law, name) + self.particles.state[rows, column]
        return values

    def set_parameter(self, name: str, values: Field) -> None:
        """Give particles their values of a law's parameter that varies, in all laws that are `Heterogeneous` in it.

        Particles keep their values as they move. Give values after the particles are there; those seeded later have the
        number of their law.

        Args:
            name: of the parameter, such as "cohesion".
            values: a number; an array, shape (n,), in the order of ``particles``; a function of positions, shape (n, D), that
                returns such an array, for instance a `RandomField`; or {cell tag or name: number} for the cells where the
                particles are now.

        Raises:
            InputError: on all ranks: no law varies in the parameter, another shape, a value out of the parameter's range.

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

        self.particles.set("state", collectively(self.comm, checked))

    def _state_columns(self, name: str) -> list[tuple[int, int]]:
        """(number of a law, column of the state variable) for each law that has it."""
        columns = [(k, law.state_names.index(name)) for k, law in enumerate(self.laws) if name in law.state_names]
        if not columns:
            known = sorted({known for law in self.laws for known in law.state_names})
            raise InputError(f"name is '{name}', expected a state variable of the laws: {', '.join(known)}")
        return columns

    def assign(self, material: ArrayLike) -> None:
        """Give each particle its law: numbers of laws, shape (n,), in the order of ``particles``. Not collective.

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
        self._core.set_materials(np.ascontiguousarray(numbers, dtype=np.int32))

    def remove(self, chosen: ArrayLike) -> int:
        """Take particles away, such as excavated soil; the others may have another order afterwards.

        Args:
            chosen: whether each particle of this rank goes, shape (n,) of bool, in the order of ``particles``.

        Returns:
            Number of particles taken away, over all ranks.
        """

        def rows() -> NDArray[np.int32]:
            mask = np.asarray(chosen)
            if mask.shape != (len(self.particles),) or mask.dtype != bool:
                raise InputError(
                    f"chosen has shape {mask.shape} and dtype {mask.dtype}, expected {len(self.particles)} of bool"
                )
            return np.flatnonzero(mask).astype(np.int32)

        gone = collectively(self.comm, rows)
        self._core.remove_particles(gone)
        return self.comm.allreduce(len(gone))

    def place(self, position: ArrayLike) -> None:
        """Put the particles elsewhere: their cells are searched again on all ranks, and their displacement changes accordingly.

        The particles may have another order, and other ranks, afterwards.

        Args:
            position: [m], shape (n, D), in the order of ``particles``.

        Raises:
            InputError: on all ranks, naming a particle that would be outside of the mesh; then none is moved.
        """

        def checked() -> NDArray[np.float64]:
            return floats("position", position, (len(self.particles), self.mesh.dim))

        refuse_resting(self, "place()")
        self._core.place_particles(collectively(self.comm, checked))

    # --- ranks ---------------------------------------------------------------------------------------------------

    def imbalance(self) -> float:
        """Load imbalance: maximum over mean number of particles per rank [-]; 1 is best. Collective."""
        return partition.imbalance(self)

    def rebalance(self) -> float:
        """Repartition the background mesh by the number of particles, and send cells and particles to their new ranks.

        Afterwards ``mesh`` is another object: local numbers of cells and nodes change, global numbers stay.
        Results change by round-off only. A run does this by itself, with ``rebalance=``.

        Returns:
            The remaining load imbalance.

        Raises:
            RunError: the program was built without PT-SCOTCH.
        """
        if self.comm.size > 1:
            partition.repartition(self)
        return self.imbalance()
