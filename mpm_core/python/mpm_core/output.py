"""Particles and background mesh over time, in HDF5 files with XDMF files beside them.

ParaView, VTK and meshio open the file ``PATH.xdmf``, also while the run goes on and after it was killed. Each frame is a file of
its own in the folder ``PATH``, ``000012.h5`` and so on, with a dataset for each field, which h5py reads directly; the XDMF file
names it when it is whole, and it never changes again. Some fields of large frames on several ranks lie in further files such
as ``000012-1.h5``, to which the first has links. The folder of a mesh also has ``mesh.h5``, its points and cells.

Fields are arrays of shape (n,) or (n, k). Two components are padded to three, so that they are vectors to ParaView; four
and six components are a symmetric tensor, ``xx yy zz xy`` (of particles in axial symmetry ``xx yy hoop xy``) or
``xx yy zz xy yz xz``, and become one dataset for each component, ``NAME_xx`` and so on; a field of four of which the name ends
with ``_gradient`` has the components ``xx xy yx yy``. The state variables of the field ``state`` are ``state_0``, ``state_1`` and
so on, in the order of the ``state_names`` of a law. Other numbers of components are kept as they are.
Names consist of letters, digits, ``_`` and ``-``.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from mpi4py import MPI

from ._core import Geometry, InputError, RunError
from .body_output import BodyOutput
from .collective import collectively
from .model import Model
from .output_checks import (
    agreed,
    checked_mesh,
    moved_points,
    narrowest,
    particle_fields,
    real_fields,
    type_of_positions,
)
from .series import Output, Series, padded

PARTICLE_FIELDS = (
    "displacement", "velocity", "stress", "deviatoric_strain", "plastic_strain", "volume", "id", "material"
)  # fmt: skip
"""Fields that are written of a model's particles beside the position, where nothing else is asked for; see `WATER_FIELDS`."""

WATER_FIELDS = ("pore_pressure",)
"""Fields that are written besides of particles with pore water."""

NODAL_FIELDS = ("mass", "velocity", "internal_force")
"""Fields that are written of its nodes."""


class ParticleOutput(Output):
    """Frames of particles; a context manager.

    Example:
        >>> with ParticleOutput("results/particles", MPI.COMM_WORLD) as output:
        ...     output.write(0.0, {"position": x, "velocity": v, "stress": stress, "id": numbers})

    Args:
        path: of the XDMF file and of the folder of frames, without suffix; the folder around them must exist. What an
            earlier series left there is removed.
        comm: communicator of the ranks that have rows; all call the methods.
        float32: store real numbers in single precision; in double precision if false. Positions are stored in double
            precision where single precision does not resolve them, as with coordinates of a map.
        compression: level of deflate, 1 to 9; 0 stores values as they are.

    Raises:
        RunError: on all ranks, with path and reason, when the files cannot be written (missing folder, no permission,
            disk full).

    Note:
        Collective: construction, ``write`` and ``close`` are called by all ranks.
    """

    def __init__(
        self, path: str | os.PathLike[str], comm: MPI.Comm, float32: bool = True, compression: int = 0
    ) -> None:
        super().__init__(Series(path, comm, "particles", float32, compression))
        self._axisymmetric = False
        self._position_type: np.dtype | None = None

    def write(self, time: float, fields: Mapping[str, np.ndarray]) -> None:
        """Write one frame, which is on disk when this returns.

        Args:
            time: s.
            fields: arrays of this rank's particles by name, the same names on all ranks. ``position``, shape (n, 2) or
                (n, 3) in m, must be among them; whole numbers are stored
                as int32 where all of a field fit, else as int64. n may differ from rank to rank
                and from frame to frame, and may be zero.

        Raises:
            InputError: a field is missing, of another length or not numeric; names the field, what it is and what was
                expected.
            RunError: the frame cannot be written.
        """
        arrays, counts = agreed(self._series.comm, lambda: particle_fields(fields))
        n, before = sum(counts), sum(counts[: self._series.comm.rank])
        position = arrays.pop("position")
        if self._position_type is None and n:
            self._position_type = type_of_positions(self._series.comm, position, self._series.real)
        position = padded(position, self._position_type or self._series.real)
        with self._series.frame(time) as frame:
            stored, vertices = self._series.shared.get("vertices", (-1, ""))  # how many, and where they are
            if stored != n:  # they are stored again only when their number changes
                numbers = np.arange(before, before + len(position), dtype=narrowest(n))
                vertices = frame.add_data("vertices", numbers, counts)
            points = frame.add_data("position", position, counts)
            frame.add_grid("Polyvertex", vertices, n, 1, points)
            # Named as a field as well: some readers give the points of the first frame only. It costs no space.
            frame.describe_field("position", "Node", 3, points)
            for name, values in arrays.items():
                frame.add_field(name, "Node", values, counts, self._axisymmetric)
        self._series.shared["vertices"] = (n, vertices)


class MeshOutput(Output):
    """The background mesh, written once, and frames of fields on its nodes and cells; a context manager.

    Args:
        path: of the XDMF file and of the folder of frames, without suffix; the folder around them must exist. What an
            earlier series left there is removed.
        comm: communicator of the ranks that have rows; all call the methods.
        points: (n, 2) or (n, 3), nodes of this rank's cells, m. A node that several ranks give is stored once for each.
        cells: (m, 3) or (m, 4), rows of ``points`` for each triangle or tetrahedron of this rank.
        float32: store real numbers in single precision; in double precision if false. Positions are stored in double
            precision where single precision does not resolve them, as with coordinates of a map.
        compression: level of deflate, 1 to 9; 0 stores values as they are.
        fixed: fields on the cells that are the same in all frames, by name; stored once.

    Raises:
        InputError: ``points`` or ``cells`` have a wrong shape, a cell names a point that is not there, or a field has
            another length than ``cells``.
        RunError: on all ranks, with path and reason, when the files cannot be written.

    Note:
        Collective: construction, ``write`` and ``close`` are called by all ranks.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        comm: MPI.Comm,
        points: np.ndarray,
        cells: np.ndarray,
        float32: bool = True,
        compression: int = 0,
        fixed: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        points, cells = collectively(comm, lambda: checked_mesh(points, cells))
        series = Series(path, comm, "mesh", float32, compression)
        super().__init__(series)
        nodes, self._cells = comm.allgather(len(points)), comm.allgather(len(cells))
        self._nodes = nodes
        fields, _ = agreed(comm, lambda: real_fields(fixed or {}, len(cells)))
        self._dim, first = points.shape[1], sum(nodes[: comm.rank])
        numbers = (cells + first).astype(narrowest(sum(nodes)))
        with series.single() as frame:
            topology = frame.add_data("cells", numbers, self._cells)
            self._grid = "Triangle" if self._dim == 2 else "Tetrahedron", topology, sum(self._cells), self._dim + 1
            self._position_type = type_of_positions(comm, points, series.real)
            frame.add_grid(*self._grid, frame.add_data("points", padded(points, self._position_type), nodes))
            for name, values in fields.items():
                frame.add_field(name, "Cell", values, self._cells)
        self._start, self._fixed = "".join(frame.text), frame.text[1:]

    def write(
        self,
        time: float,
        node_fields: Mapping[str, np.ndarray] | None = None,
        cell_fields: Mapping[str, np.ndarray] | None = None,
        points: np.ndarray | None = None,
    ) -> None:
        """Write one frame of fields, which is on disk when this returns.

        Args:
            time: s.
            node_fields: arrays with a row for each of ``points``, by name.
            cell_fields: arrays with a row for each of ``cells``, by name.
            points: positions of the nodes in this frame, m, if they have moved, on all ranks or on none; stored with the frame.

        Raises:
            InputError: a field, or ``points``, is of another length or not numeric.
            RunError: the frame cannot be written.
        """
        comm = self._series.comm
        n, m = self._nodes[comm.rank], self._cells[comm.rank]
        at_nodes, _ = agreed(comm, lambda: real_fields(node_fields or {}, n))
        in_cells, _ = agreed(comm, lambda: real_fields(cell_fields or {}, m)) if cell_fields else ({}, [])
        moved, _ = agreed(comm, lambda: moved_points(points, n, self._dim))
        with self._series.frame(time, "" if moved else self._start) as frame:
            for positions in moved.values():
                frame.add_grid(
                    *self._grid, frame.add_data("points", padded(positions, self._position_type), self._nodes)
                )
                frame.text += self._fixed
            for name, values in at_nodes.items():
                frame.add_field(name, "Node", values, self._nodes)
            for name, values in in_cells.items():
                frame.add_field(name, "Cell", values, self._cells)


class ModelOutput:
    """Frames of a model's particles and of nodal fields on its background mesh; a context manager.

    Example:
        >>> with ModelOutput(model, "results/particles", "results/mesh") as output:
        ...     for report in model.explicit(1.0, every_steps=100):
        ...         output.write()

    Args:
        model: the model whose particles and nodes are written. Its mesh may be repartitioned later; nodes keep their present
            order in the files.
        particles: path of the files of particles, as for `ParticleOutput`; None if none are to be written.
        mesh: path of the files of the mesh, as for `MeshOutput`, with the tags of cells as the field ``tag``; None if none are
            to be written.
        bodies: path of the files of the rigid surfaces that the particles touch, as for `BodyOutput`; None if none are to be
            written.
        particle_fields: attributes of ``model.particles``, such as ``velocity``, and ``displacement``, ``plastic_strain``; the
            position is always written. By default `PARTICLE_FIELDS`, and the pore pressure where there is pore water.
        nodal_fields: as ``Model.nodal`` gives them.
        float32: store real numbers in single precision; in double precision if false. Positions are stored in double
            precision where single precision does not resolve them, as with coordinates of a map.
        compression: level of deflate, 1 to 9; 0 stores values as they are.
        background: a thread of each rank that writes does so while the next steps go on. `write` returns at once, and `close` and
            the next `write` wait for the frame and raise its error. Until then no other thread may use HDF5, but by h5py.

    Raises:
        InputError: neither path is given, or a field does not exist or is not the same on all ranks.
        RunError: on all ranks, with path and reason, when the files cannot be written.

    Note:
        Collective: construction, ``write`` and ``close`` are called by all ranks.
    """

    def __init__(
        self,
        model: Model,
        particles: str | os.PathLike[str] | None = None,
        mesh: str | os.PathLike[str] | None = None,
        particle_fields: Sequence[str] | None = None,
        nodal_fields: Sequence[str] = NODAL_FIELDS,
        float32: bool = True,
        compression: int = 0,
        bodies: str | os.PathLike[str] | None = None,
        background: bool = False,
    ) -> None:
        if particles is None and mesh is None and bodies is None:
            raise InputError("particles, mesh and bodies are None, expected a path for one of them at least")
        self._model, self._start = model, model.mesh
        if particle_fields is None:
            particle_fields = (*PARTICLE_FIELDS, *(WATER_FIELDS if model.has_water else ()))
        self._fields, self._nodal = list(particle_fields), list(nodal_fields)
        self._float32 = float32
        start = model.mesh
        agreed(start.comm, self._checked_names)
        self._outputs: list[ParticleOutput | MeshOutput | BodyOutput] = []
        if particles is not None:
            particle_output = ParticleOutput(particles, start.comm, float32, compression)
            if model.geometry == Geometry.AXISYMMETRIC:
                particle_output._axisymmetric = True
            particle_output._position_type = type_of_positions(start.comm, start.points, particle_output._series.real)
            self._outputs.append(particle_output)
        if mesh is not None:
            own = slice(start.owned_cells)
            tags = {"tag": start.cell_tags[own]}
            self._outputs.append(
                MeshOutput(mesh, start.comm, start.points, start.cells[own], float32, compression, tags)
            )
        if bodies is not None:
            self._outputs.append(BodyOutput(model, bodies, float32, compression))
        if background:
            for output in self._outputs:
                output._series.write_in_background()

    def __repr__(self) -> str:
        return "\n  ".join(["<ModelOutput:", *map(repr, self._outputs)]) + ">"

    def _checked_names(self) -> dict[str, np.ndarray]:
        """The names of all fields, if these exist."""
        self._model._core.require_fields(self._fields, self._nodal)
        return dict.fromkeys([*self._fields, *(f"nodal {name}" for name in self._nodal)], np.empty(0))

    def write(self, more: Mapping[str, np.ndarray] | None = None) -> None:
        """Write a frame of the model as it is now; it is on the disk when this returns, except with ``background``.

        Args:
            more: further fields of the particles by name, a row for each.

        Raises:
            InputError: a further field is of another length or not numeric, or the model has no particles.
            RunError: the frame cannot be written; with ``background``, or the one before it.
        """
        more = {name: np.array(values) for name, values in (more or {}).items()}  # the caller may change his own
        self._require_nodal_values()
        failures = []
        for output in self._outputs:
            try:
                if isinstance(output, ParticleOutput):
                    fields = self._model._core.copied_fields(self._fields, self._float32, padded=True)
                    if output._position_type != output._series.real:
                        fields |= self._model._core.copied_fields([], single=False, padded=True)  # the position
                    output.write(self._model.time, {**fields, **more})
                elif isinstance(output, BodyOutput):
                    output.write()
                else:
                    output.write(self._model.time, self._nodal_fields(), points=self._moved_nodes())
            except RunError as failure:  # the other one may still be written
                failures.append(failure)
        if failures:
            raise failures[0]

    def _require_nodal_values(self) -> None:
        """See that nodes have values where the mesh is written, as they do after a step or a report. Collective."""
        if not (self._nodal and any(isinstance(output, MeshOutput) for output in self._outputs)):
            return
        try:
            self._model.nodal(self._nodal[0])
        except InputError:
            self._model.report()

    def _nodal_fields(self) -> dict[str, np.ndarray]:
        """Nodal fields on the mesh as it was at the start. Collective."""
        model = self._model
        return {name: self._start.nodal_of(model.mesh, model.nodal(name)) for name in self._nodal}

    def _moved_nodes(self) -> np.ndarray | None:
        """Positions of the nodes of the mesh as it was at the start, if cells have moved with the body. Collective."""
        model = self._model
        return self._start.nodal_of(model.mesh, model.node_positions) if model._core.has_moved_cells else None

    def close(self) -> None:
        """Complete the files; nothing can be written after that.

        Raises:
            RunError: with path and reason: the last frame cannot be written, or the last ones not be named.
        """
        failures = []
        for output in self._outputs:
            try:
                output.close()
            except RunError as failure:
                failures.append(failure)
        if failures:
            raise failures[0]

    def __enter__(self) -> ModelOutput:
        return self

    def __exit__(self, *error: Any) -> None:
        if error[0] is None:
            self.close()
        else:
            for output in self._outputs:
                output.__exit__(*error)
