"""Probes: histories of some particles, of points in space, of section forces and of totals, as CSV files.

A probe reads values from a model; a `ProbeFile` adds a row for each reading to a file that pandas, spreadsheets and gnuplot read.
Names of columns end in their unit. All methods are collective, and results do not depend on the number of ranks.

Example:
    >>> crest = ParticleProbe(model, [(1.1, 1.0)])
    >>> section = SectionProbe(model, point=(2.1, 0.0), normal=(1, 0))
    >>> with ProbeFile("crest.csv", crest) as crests, ProbeFile("section.csv", section) as sections:
    ...     for report in model.explicit(until=10.0, every=0.1):
    ...         crests.record()
    ...         sections.record()
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from mpi4py import MPI
from numpy.typing import ArrayLike, NDArray

from ._core import Geometry, InputError
from .collective import collectively
from .components import AXES, SYMMETRIC, tensor_components
from .mesh import Mesh, floats
from .model import Model
from .row_file import RowFile


class Probe(Protocol):
    """Quantities that a `ProbeFile` can record."""

    @property
    def model(self) -> Model:
        """The model that it reads."""

    def values(self) -> dict[str, float]:
        """Numbers by name of column, the same on all ranks; the first is ``time_s``. Collective."""


def _components(name: str, unit: str, parts: Sequence[str]) -> list[str]:
    return [f"{name}_{part}_{unit}" for part in parts]


def _vectors(dim: int, *names: tuple[str, str]) -> list[str]:
    return [column for name, unit in names for column in _components(name, unit, AXES[dim])]


def _stresses(model: Model) -> list[str]:
    """Columns of the stress, whose third axis is the hoop in axial symmetry, as in files and tables."""
    width, axisymmetric = len(SYMMETRIC[model.mesh.dim]), model.geometry == Geometry.AXISYMMETRIC
    return _components("stress", "Pa", tensor_components("stress", width, axisymmetric) or ())


def _numbered(rows: NDArray, columns: list[str]) -> dict[str, float]:
    """A number for each row and column; the columns of row k end in ``_k`` before their unit when there are several rows."""
    found = {}
    for k, row in enumerate(rows):
        for column, value in zip(columns, row, strict=True):
            name, unit = column.rsplit("_", 1)
            found[column if len(rows) == 1 else f"{name}_{k}_{unit}"] = float(value)
    return found


def nearest_particle(model: Model, place: ArrayLike) -> int:
    """Number of the particle that started nearest to a point; the highest number of several at the same distance. Collective.

    Args:
        model: the model, seeded.
        place: the point [m], shape (D,).

    Raises:
        InputError: a point of another shape, or a model without particles.
    """
    point = collectively(model.comm, lambda: floats("place", place, (model.mesh.dim,)))
    distance = np.linalg.norm(model.particles.initial_position - point, axis=1)
    least = model.comm.allreduce(float(distance.min(initial=np.inf)), MPI.MIN)
    if not np.isfinite(least):
        raise InputError("the model has no particles, seed some first")
    # Round-off, which depends on the partition, must not choose between them.
    near = model.particles.id[distance <= least * (1 + 1e-9)]
    return model.comm.allreduce(int(near.max(initial=-1)), MPI.MAX)


class ParticleProbe:
    """Follows the particles that started nearest to some points (see `nearest_particle`).

    It records their position, displacement, velocity and stress.

    Args:
        model: the model, seeded.
        points: [m], shape (n, D).

    Raises:
        InputError: points of another shape, or a model without particles.
    """

    def __init__(self, model: Model, points: ArrayLike) -> None:
        self.model = model
        places = collectively(model.comm, lambda: floats("points", points, (None, model.mesh.dim)))
        self.ids = [nearest_particle(model, place) for place in places]
        """Numbers of the particles."""
        dim = model.mesh.dim
        self._columns = _vectors(dim, ("position", "m"), ("displacement", "m"), ("velocity", "m/s"))
        self._columns += _stresses(model)

    def __repr__(self) -> str:
        return f"<ParticleProbe: particles {', '.join(map(str, self.ids))}; {', '.join(self._columns)}>"

    def values(self) -> dict[str, float]:
        """Numbers by name; NaN for a particle that left through an outflow boundary."""
        p = self.model.particles
        found = p.find(self.ids)
        here = np.flatnonzero(found >= 0)
        few = p[found[here]]
        # The first column counts the ranks that have the particle, which is one or none.
        rows = np.zeros((len(self.ids), 1 + len(self._columns)))
        rows[here, 0] = 1
        rows[here, 1:] = np.hstack([few.position, few.displacement, few.velocity, few.stress])
        self.model.comm.Allreduce(MPI.IN_PLACE, rows)
        rows[rows[:, 0] == 0] = np.nan
        rows = rows[:, 1:]
        return {"time_s": self.model.time, **_numbered(rows, self._columns)}


class PointProbe:
    """Fixed points of space: filled fraction of the cell, and mean velocity and stress of the particles in it.

    Args:
        model: the model.
        points: [m], shape (n, D), inside the mesh.

    Raises:
        InputError: points of another shape, or outside of the mesh.
    """

    def __init__(self, model: Model, points: ArrayLike) -> None:
        self.model = model
        self._points = collectively(model.comm, lambda: floats("points", points, (None, model.mesh.dim)))
        outside = np.flatnonzero(model.comm.allreduce((self._initial_cells() >= 0).astype(int)) == 0)
        if len(outside):
            raise InputError(f"points has {self._points[outside[0]]} at row {outside[0]}, which is outside of the mesh")
        dim = model.mesh.dim
        self._columns = [
            "filled_fraction",
            *_vectors(dim, ("velocity", "m/s")),
            *_stresses(model),
        ]

    def __repr__(self) -> str:
        return f"<PointProbe: at {', '.join(map(str, self._points))} m; {', '.join(self._columns)}>"

    def _initial_cells(self) -> NDArray[np.int32]:
        mesh = self.model.mesh
        cells = mesh.cells_of(self._points)
        return np.where(cells < mesh.owned_cells, cells, -1)

    def _own_cells(self) -> NDArray[np.integer]:
        if self.model._core.has_moved_cells:
            return _filled_cells_of(self.model, self._points)
        return self._initial_cells()

    def values(self) -> dict[str, float]:
        """Numbers by name; velocity and stress are NaN in an empty cell."""
        model, p = self.model, self.model.particles
        sums = np.zeros(
            (len(self._points), 2 + len(self._columns))
        )  # ranks that have it, volumes of cell and soil, the rest
        cell_of, volumes = p.cell, model.cell_volumes
        for k, cell in enumerate(self._own_cells()):
            if cell < 0:
                continue
            inside = p[cell_of == cell]
            v = inside.volume[:, None]
            moments = np.concatenate([(v * inside.velocity).sum(axis=0), (v * inside.stress).sum(axis=0)])
            sums[k] = [1.0, volumes[cell], v.sum(), *moments]
        # A point on a side between the cells of two ranks is seen by both: the mean of the two.
        sums = model.comm.allreduce(sums)
        sums[sums[:, 0] == 0, 1] = 1.0  # where cells have moved away there is none
        with np.errstate(invalid="ignore", divide="ignore"):
            rows = np.column_stack([sums[:, 2] / sums[:, 1], sums[:, 3:] / sums[:, 2:3]])
        return {"time_s": model.time, **_numbered(rows, self._columns)}


def _filled_cells_of(model: Model, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Cells with particles of this rank that contain the points where they are now, -1 for none."""
    filled = np.unique(model.particles.cell)
    corners = model.node_positions[model.mesh.cells[filled]]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    cells = np.full(len(points), -1, np.int64)
    for k, point in enumerate(points):
        n = np.linalg.solve(edges, (point - corners[:, 0])[..., None])[..., 0]
        inside = np.flatnonzero((n >= 0).all(axis=1) & (n.sum(axis=1) <= 1))
        if len(inside):
            cells[k] = filled[inside[0]]
    return cells


class SectionProbe:
    """Force that acts across a plane (a line, in two dimensions), from the stresses in the cells that it cuts.

    The traction sigma . n is taken over the cut cells with the weight that rises from 0 at their nodes behind the plane to 1 at
    those before it: sum_c (sum_p V_p sigma_p) . grad w. Where full cells integrated the mean stress over their volume in the last
    step (`Integration`), they do here. So the force balances, to round-off, the nodal forces on either side, unless nodal mixed
    discretisation averages these. Stresses are those of the laws, effective ones where particles have pore water.

    Args:
        model: the model.
        point: [m], shape (D,), a point of the plane.
        normal: direction of any length, shape (D,). A positive normal force is tension.
        box: two opposite corners [m], shape (2, D); only cells whose centre lies between them count. By default all do.

    Raises:
        InputError: arguments of another shape, or a normal without length.
    """

    def __init__(self, model: Model, *, point: ArrayLike, normal: ArrayLike, box: ArrayLike | None = None) -> None:
        self.model, dim = model, model.mesh.dim
        self._point, self._normal = floats("point", point, (dim,)), floats("normal", normal, (dim,))
        length = float(np.linalg.norm(self._normal))
        if length == 0:
            raise InputError("normal of the section has no length, expected a direction")
        self._normal /= length
        self._box = None if box is None else np.sort(floats("box", box, (2, dim)), axis=0)
        self._mesh: Mesh | None = None  # whose cells are known to be cut or not, unless they move

    def __repr__(self) -> str:
        box = "" if self._box is None else f", within {self._box[0]} to {self._box[1]} m"
        return f"<SectionProbe: plane through {self._point} m with the normal {self._normal}{box}>"

    def _cut(self, mesh: Mesh) -> None:
        """Find the cells of this rank that the plane cuts, and the gradient of w in them.

        Repeated after a repartition, and each time while cells move.
        """
        corners = self.model.node_positions[mesh.cells[: mesh.owned_cells]]
        before = (corners - self._point) @ self._normal > 0
        cut: NDArray[np.bool_] = np.not_equal(before.any(axis=1), before.all(axis=1))
        if self._box is not None:
            centres = corners.mean(axis=1)
            cut &= ((centres >= self._box[0]) & (centres <= self._box[1])).all(axis=1)
        cells = np.flatnonzero(cut)
        edges = corners[cells, 1:] - corners[cells, :1]
        rising = (before[cells, 1:].astype(float) - before[cells, :1])[..., None]
        self._mesh = None if self.model._core.has_moved_cells else mesh
        self._is_cut, self._gradient = cut, np.zeros((len(cut), mesh.dim))
        self._gradient[cells] = np.linalg.solve(edges, rising)[..., 0]

    def values(self) -> dict[str, float]:
        """The force by components, and along the normal; in N, in two dimensions per metre of thickness or per radian."""
        model, dim = self.model, self.model.mesh.dim
        if self._mesh is not model.mesh or model._core.has_moved_cells:
            self._cut(model.mesh)
        stress = _matrices(model._core.integrated_stress()[self._is_cut], dim)
        mine = np.einsum("cij,cj->i", stress, self._gradient[self._is_cut])
        force = np.empty(dim)
        model.comm.Allreduce(mine, force)
        along = {"force_normal_N": float(force @ self._normal)}
        names = _components("force", "N", AXES[dim])
        return {"time_s": model.time, **dict(zip(names, map(float, force), strict=True)), **along}


def _matrices(stress: NDArray, dim: int) -> NDArray[np.float64]:
    """Stresses in the plane or in space as matrices, shape (n, D, D)."""
    places = [[0, 3], [3, 1]] if dim == 2 else [[0, 3, 5], [3, 1, 4], [5, 4, 2]]
    return stress[:, np.array(places)]


class TotalsProbe:
    """Particles, mass, momentum, energies and the out-of-balance ratio of the whole model."""

    def __init__(self, model: Model) -> None:
        self.model = model

    def __repr__(self) -> str:
        return f"<TotalsProbe: sums over all particles, t = {self.model.time:g} s>"

    def values(self) -> dict[str, float]:
        """Numbers by name; see `Report`."""
        report, dim = self.model.report(), self.model.mesh.dim
        momentum = dict(zip(_components("momentum", "N.s", AXES[dim]), report.momentum, strict=True))
        energies = (
            "kinetic_energy", "nodal_kinetic_energy", "external_work", "internal_work", "stress_work", "stored_energy",
            "plastic_work", "damping_work", "support_work", "drag_work", "friction_work", "pic_loss", "unexplained_energy",
        )  # fmt: skip
        return {
            "time_s": report.time, "steps": report.steps, "dt_s": report.dt, "particles": report.particles,
            "mass_kg": report.mass, **momentum, **{f"{name}_J": getattr(report, name) for name in energies},
            "unexplained_fraction": report.unexplained_fraction,
            "unbalanced_ratio": report.unbalanced_ratio, "plastic_fraction": report.plastic_fraction,
        }  # fmt: skip


class ProbeFile(RowFile):
    """A CSV file with a row for each reading of a probe, on disk as soon as it was taken; a context manager.

    Args:
        path: of the file; the first rank writes.
        probe: what is recorded.
        keep: keep the rows before the model's present time that a file of that name has, as after a restart; otherwise it is
            replaced.

    Raises:
        InputError: on all ranks, with path and reason, when the file cannot be written, or has other columns to keep.
    """

    def __init__(self, path: str | os.PathLike[str], probe: Probe, *, keep: bool = False) -> None:
        self._probe = probe
        before = probe.model.time if keep else None
        super().__init__(path, list(probe.values()), probe.model.comm, keep_before=before)

    def __repr__(self) -> str:
        return f"<ProbeFile: {self.path}, of {self._probe!r}>"

    def record(self) -> None:
        """Read the probe, and add a row. Collective.

        Raises:
            RunError: on all ranks, with path and reason, when the file cannot be written.
        """
        self.add(list(self._probe.values().values()))
