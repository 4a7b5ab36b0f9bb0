"""Particles and background mesh over time, in HDF5 files that all ranks write together, with XDMF files beside them.

ParaView, VTK and meshio open the file ``PATH.xdmf``, also while the run goes on and after it was killed. Each frame is a file of
its own in the folder ``PATH``, ``000012.h5`` and so on, with a dataset for each field, which h5py reads directly; the XDMF file
names it when it is whole, and it never changes again. The folder of a mesh also has ``mesh.h5``, its points and cells.

Fields are arrays of shape (n,) or (n, k). Two components are padded to three, so that they are vectors to ParaView; four
and six components are a symmetric tensor, ``xx yy zz xy`` (of particles in axial symmetry ``xx yy hoop xy``) or
``xx yy zz xy yz xz``, and become one dataset for each component, ``NAME_xx`` and so on; other numbers of components are kept
as they are. Names consist of letters, digits, ``_`` and ``-``.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
from mpi4py import MPI

from . import _core
from ._core import InputError
from .collective import collectively
from .model import Model

T = TypeVar("T")
Fields = list[tuple[str, np.ndarray]]

PARTICLE_FIELDS = (
    "displacement", "velocity", "stress", "deviatoric_strain", "plastic_strain", "volume", "id", "material"
)  # fmt: skip
"""Fields that are written of a model's particles beside the position, where nothing else is asked for."""

NODAL_FIELDS = ("mass", "velocity", "internal_force")
"""Fields that are written of its nodes."""

# What a rank hands over whose fields are refused.
NO_FIELDS: tuple[Fields, Fields] = ([], [])
NO_PARTICLES: tuple[np.ndarray, Fields, Fields] = (np.empty((0, 2)), [], [])


class ParticleOutput:
    """Frames of particles; a context manager.

    Example:
        >>> with ParticleOutput("results/particles", MPI.COMM_WORLD) as output:
        ...     output.write(0.0, {"position": x, "velocity": v, "stress": stress, "id": numbers})

    Args:
        path: of the XDMF file and of the folder of frames, without suffix; the folder around them must exist. What an
            earlier series left there is removed.
        comm: communicator whose ranks write together; must not be freed before the output is closed.
        float32: store real numbers in single precision; in double precision if false.
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
        self._alone = comm.size == 1
        self._series = _core.ParticleSeries(MPI._addressof(comm), os.fspath(path), float32, _level(compression))

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
        found, failure = _tried(lambda: _particle_fields(fields), NO_PARTICLES)
        self._series.write(float(time), *found, failure)

    def close(self) -> None:
        """Close the files; nothing can be written after that."""
        self._series.close()

    def __enter__(self) -> ParticleOutput:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or self._alone:  # after an error other ranks may not come here; the files are good as they are
            self.close()


class MeshOutput:
    """The background mesh, written once, and frames of fields on its nodes and cells; a context manager.

    Args:
        path: of the XDMF file and of the folder of frames, without suffix; the folder around them must exist. What an
            earlier series left there is removed.
        comm: communicator whose ranks write together; must not be freed before the output is closed.
        points: (n, 2) or (n, 3), nodes of this rank's cells, m. A node that several ranks give is stored once for each.
        cells: (m, 3) or (m, 4), rows of ``points`` for each triangle or tetrahedron of this rank.
        float32: store real numbers in single precision; in double precision if false.
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
        points, cells, fields = collectively(comm, lambda: (*_checked_mesh(points, cells), _real_fields(fixed or {})))
        self._alone = comm.size == 1
        self._series = _core.MeshSeries(
            MPI._addressof(comm), os.fspath(path), float32, _level(compression), points, cells, fields
        )

    def write(
        self,
        time: float,
        node_fields: Mapping[str, np.ndarray] | None = None,
        cell_fields: Mapping[str, np.ndarray] | None = None,
    ) -> None:
        """Write one frame of fields, which is on disk when this returns.

        Args:
            time: s.
            node_fields: arrays with a row for each of ``points``, by name.
            cell_fields: arrays with a row for each of ``cells``, by name.

        Raises:
            InputError: a field is of another length or not numeric.
            RunError: the frame cannot be written.
        """
        found, failure = _tried(lambda: (_real_fields(node_fields or {}), _real_fields(cell_fields or {})), NO_FIELDS)
        self._series.write(float(time), *found, failure)

    def close(self) -> None:
        """Close the files; nothing can be written after that."""
        self._series.close()

    def __enter__(self) -> MeshOutput:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or self._alone:  # after an error other ranks may not come here; the files are good as they are
            self.close()


class ModelOutput:
    """Frames of a model's particles and of nodal fields on its background mesh; a context manager.

    Values are written from where they are, without copies, and particles and mesh at the same time, by different ranks.

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
        particle_fields: attributes of ``model.particles``, such as ``velocity``, and ``displacement``, ``plastic_strain``; the
            position is always written.
        nodal_fields: as ``Model.nodal`` gives them.
        float32: store real numbers in single precision; in double precision if false.
        compression: level of deflate, 1 to 9; 0 stores values as they are.

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
        particle_fields: Sequence[str] = PARTICLE_FIELDS,
        nodal_fields: Sequence[str] = NODAL_FIELDS,
        float32: bool = True,
        compression: int = 0,
    ) -> None:
        if particles is None and mesh is None:
            raise InputError("particles and mesh are None, expected a path for one of them at least")
        self._model = model
        self._start = self._cut = start = model.mesh
        self._carrier: _core.RowCarrier | None = None
        self._comm = MPI._addressof(start.comm)
        self._fields = _core.model_fields(self._comm, model._core, list(particle_fields), list(nodal_fields))
        own = slice(start.owned_cells)
        tags = {"tag": start.cell_tags[own]}
        self._outputs: list[ParticleOutput | MeshOutput] = []
        self._particles, self._mesh = None, None
        if particles is not None:
            particle_output = ParticleOutput(particles, start.comm, float32, compression)
            self._particles = particle_output._series
            self._outputs.append(particle_output)
        if mesh is not None:
            mesh_output = MeshOutput(mesh, start.comm, start.points, start.cells[own], float32, compression, tags)
            self._mesh = mesh_output._series
            self._outputs.append(mesh_output)

    def write(self, more: Mapping[str, np.ndarray] | None = None) -> None:
        """Write a frame of the model as it is now, which is on disk when this returns.

        Args:
            more: further fields of the particles by name, a row for each.

        Raises:
            InputError: a further field is of another length or not numeric; or there was neither a step nor a ``Model.report``
                since the particles were set, without which nodes have no values.
            RunError: the frame cannot be written.
        """
        (real, whole), failure = (NO_FIELDS, "") if more is None else _tried(partial(_split_fields, more), NO_FIELDS)
        if self._mesh is not None and self._model.mesh is not self._cut:
            self._cut = self._model.mesh
            self._carrier = None if self._cut is self._start else self._start._carrier_from(self._cut)
        _core.write_model(
            self._comm,
            self._model._core,
            self._fields,
            self._particles,
            self._mesh,
            self._carrier,
            real,
            whole,
            failure,
        )

    def close(self) -> None:
        """Close the files; nothing can be written after that."""
        for output in self._outputs:
            output.close()

    def __enter__(self) -> ModelOutput:
        return self

    def __exit__(self, *error: Any) -> None:
        for output in self._outputs:
            output.__exit__(*error)


def _tried(work: Callable[[], T], otherwise: T) -> tuple[T, str]:
    """What ``work`` gives, and no failure; or something else, and the message of its InputError, for all ranks to raise."""
    try:
        return work(), ""
    except InputError as error:
        return otherwise, str(error)


def _level(compression: int) -> int:
    if compression not in range(10):
        raise InputError(f"compression is {compression}, expected a whole number from 0 to 9")
    return int(compression)


def _numeric(name: str, values: np.ndarray) -> np.ndarray:
    array = np.asarray(values)
    if array.dtype.kind not in "fiub":
        raise InputError(f"{name} has dtype {array.dtype}, expected numbers")
    if array.ndim not in (1, 2):
        raise InputError(f"{name} has shape {array.shape}, expected (n,) or (n, k)")
    return array


def _real_fields(fields: Mapping[str, np.ndarray]) -> Fields:
    return [(name, np.ascontiguousarray(_numeric(name, values), np.float64)) for name, values in fields.items()]


def _particle_fields(
    fields: Mapping[str, np.ndarray],
) -> tuple[np.ndarray, Fields, Fields]:
    """Position, real fields and fields of whole numbers."""
    if "position" not in fields:
        raise InputError(f"fields are {', '.join(fields) or 'none'}, expected 'position' among them")
    position = _numeric("position", fields["position"])
    if position.ndim != 2 or position.shape[1] not in (2, 3):
        raise InputError(f"position has shape {position.shape}, expected (n, 2) or (n, 3)")
    others = {name: values for name, values in fields.items() if name != "position"}
    for name, values in others.items():
        if len(_numeric(name, values)) != len(position):
            raise InputError(f"{name} has {len(values)} rows, expected {len(position)} as position has")
    return (np.ascontiguousarray(position, np.float64), *_split_fields(others))


def _split_fields(
    fields: Mapping[str, np.ndarray],
) -> tuple[Fields, Fields]:
    """Real fields and fields of whole numbers."""
    others = {name: _numeric(name, values) for name, values in fields.items()}
    whole = {name: values for name, values in others.items() if values.dtype.kind in "iub" and values.ndim == 1}
    real = {name: values for name, values in others.items() if name not in whole}
    return (
        _real_fields(real),
        [(name, np.ascontiguousarray(values, np.int64)) for name, values in whole.items()],
    )


def _checked_mesh(points: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    points = np.asarray(points)
    cells = np.asarray(cells)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise InputError(f"points has shape {points.shape}, expected (n, 2) or (n, 3)")
    if cells.ndim != 2 or cells.shape[1] != points.shape[1] + 1 or cells.dtype.kind not in "iu":
        raise InputError(
            f"cells has shape {cells.shape} and dtype {cells.dtype}, expected (m, {points.shape[1] + 1}) whole numbers"
        )
    if cells.size and not 0 <= cells.min() <= cells.max() < len(points):
        raise InputError(
            f"cells has node {max(cells.max(), -cells.min())}, expected numbers from 0 to {len(points) - 1}"
        )
    return np.ascontiguousarray(points, np.float64), np.ascontiguousarray(cells, np.int64)
