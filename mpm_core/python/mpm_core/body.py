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
from .collective import collectively, require_same
from .far_field import FarFields
from .mesh import Mesh, Tag, floats
from .particle_values import ParticleValues
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


class Body(ParticleValues, PoreWater, RestingCells, AbsorbingSides, FarFields):
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
        """Geometry of the body on the mesh."""
        fields = collectively(self.comm, lambda: _whole_numbers("velocity_fields", velocity_fields or ()))
        suffix = {Geometry.PLANE_STRAIN: "2", Geometry.AXISYMMETRIC: "Axisymmetric", Geometry.SOLID: "3"}[self.geometry]
        self._core = getattr(_core, f"Model{suffix}")(mesh._core, self.laws, fields, MPI._addressof(self.comm))
        self._velocity_fields = fields or [0] * len(self.laws)
        self._space_watch: SpaceWatch | None = None
        self._water_conditions = []
        self._retention = []
        self._absorbing, self._incoming = [], None
        self._border = None
        self._free_fields, self._columns, self._tables, self._free_damping = [], [], [], None
        self._contacts: list[dict[str, Any]] = []  # as checkpoints describe them
        self._members: dict[str, dict[str, Any]] = {}  # structural ones by name, likewise
        self._collisions: list[dict[str, Any]] = []
        self._field_contacts: list[dict[str, Any]] = []
        self._triangulated: dict[str, Triangles] = {}  # their triangles by fingerprint, which checkpoints do not have
        self._values_of_parts: dict[str, NDArray[np.float64]] = {}  # of their friction, adhesion and drag, likewise
        self._next_id = 0
        self._late: int | None = None  # first number of the particles that were placed after a rigid surface was added
        self._control: Any = None  # of the implicit run, a StepControl
        self._resumed: Any = None  # of a checkpoint, for the next implicit run
        self.repartitions = 0
        """Number of repartitions of the background mesh since the model was made."""
        self._first_mesh = mesh  # kept, since it may own the communicator
        self._left_imbalance = 1.0  # by the last partition
        self._integration: Any = None  # of stresses, where runs name none; kept until more particles are seeded
        self.particles = Particles(self._core, self.geometry, self.comm)
        """The particles on this rank."""

    cuts = renamed("cuts", "repartitions")

    @property
    def cell_volumes(self) -> NDArray[np.float64]:
        """Volume of each cell of the mesh as it is now (cells,) [m^D]; in axial symmetry of one radian [m3], the integral of r dA.

        After steps with ``moving_cells`` only those of cells with particles of this rank are those of now.
        """
        return self._core.cell_volumes

    @property
    def node_positions(self) -> NDArray[np.float64]:
        """Positions of the nodes of the mesh (nodes, D) [m], where steps with ``moving_cells`` have moved them.

        Those of cells without particles of this rank may be where they were before.
        """
        return self._core.node_positions

    # --- particles -----------------------------------------------------------------------------------------------

    def _seeded(self, added: int, ids: int) -> int:
        if self._contacts and self._late is None:
            self._late = self._next_id
        self._next_id += ids
        self._integration = None
        return self.comm.allreduce(added)

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
            InputError: wrong shape, a point outside of the mesh, a volume or density that is not positive, other points on
                another rank.
        """

        def place() -> int:
            x = floats("points", points, (None, self.mesh.dim))
            v = floats("volumes", volumes, (len(x),))
            if (v <= 0).any():
                raise InputError(f"volumes is {v.min()} m^{self.mesh.dim} at least, expected positive numbers")
            rho = positive("density", density, "kg/m3")
            rows = np.flatnonzero(inside.argmax(axis=0) == self.comm.rank)
            return self._core.seed_points(x[rows], v[rows], self._next_id + rows, self._material(material), rho)

        own = collectively(self.comm, lambda: self._owned(points))
        require_same(self.comm, "points", np.asarray(points))
        # By rank and point: one on a side between the cells of two ranks is in both, and the first rank has it.
        inside = np.array(self.comm.allgather(own))
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

        Each part of the surface gives its load to the particle nearest to it, on the side where the soil is. Parts within the
        particle's side V^(1/D) are loaded, and so are those within twice of it (more in flat cells) between such parts or at the
        end of the surface: particles that fill triangles or tetrahedra are not in rows along it. Other parts are not, which a
        warning says where soil is a little farther away. The forces move with the particles, keep their direction, and add to
        those that are there. The sum of forces is that of the loaded parts to round-off; they act half a particle inside of it.

        Args:
            surface: as for `add_contact`; it bounds the soil where it is to be loaded, and its shape is taken once. Let one
                that is larger than the soil end with it: parts count until some half a particle's side beyond the soil, at most
                a side, and so do the faces of a box that rise from the soil on which it stands.
            pressure: [Pa], towards the soil.
            traction: force per area [Pa], shape (D,); instead of a pressure.

        Returns:
            Area of the loaded parts [m^(D-1)] over all ranks; per radian in axial symmetry.

        Raises:
            InputError: an argument out of its range, a surface without soil or with resting cells beside it. On all ranks alike.

        Example:
            >>> model.load_surface(mpm.Disc((0.0, -5.0), 1.0), pressure=50e3)  # in a tunnel
        """
        return load_surface(self, surface, pressure, traction)

    def remove(self, chosen: ArrayLike) -> int:
        """Remove particles, such as excavated soil; the order of the others may change.

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
        """Move the particles to other positions: cells are searched again on all ranks, and displacements change accordingly.

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
