"""Common parts of the cases: particles brought to rest by either scheme, and values read from them."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
MESHES = Path(__file__).parents[2] / "meshes"
DAMPING = 0.5
"""Local damping of the explicit runs."""
COURANT = 0.8
AT_REST = 1e-3
"""Out-of-balance over external force at which the particles of an explicit run are at rest."""


class Field(NamedTuple):
    """Cells of all ranks, on the first one: corners (m, 3, 2) [m], mean stress of their particles (m,) [Pa]."""

    corners: np.ndarray
    mean_stress: np.ndarray


class Found(NamedTuple):
    """Result of a run: the quantity of its case, the mean stresses, steps and processor time [s]."""

    value: float
    field: Field | None
    steps: int
    seconds: float


@cache
def mesh_of(name: str, divisions: int) -> tuple:
    """A mesh of ``meshes/`` by its name: domain, cell tags, facet tags. Made once, for all runs on it; collective."""
    return bridge.read_mesh(MESHES / f"{name}.geo", comm, parameters={"divisions": divisions})


def particles_in(mesh: tuple, law: object, density: float) -> mpm.Model:
    """Three particles in each cell of a mesh, so that every cell is filled."""
    model = mpm.Model(bridge.background_mesh(*mesh), law)
    model.seed(density=density, per_cell=3)
    return model


def quasi_static(model: mpm.Model, nmd: bool, steps: int) -> None:
    """Raise time from 0 to 1 in steps without inertia."""
    # The stiffness of nearly incompressible soil leaves a residual of some 1e-8 from round-off, the default tolerance.
    for _ in model.implicit(1.0, dt=1.0 / steps, quasi_static=True, nmd=nmd, solver=mpm.Newton(tolerance=1e-6)):
        pass


def damped(model: mpm.Model, nmd: bool, time: float, at_least: float) -> None:
    """Run the explicit scheme until the particles are at rest, or up to a time [s]; ``at_least`` as long as loads rise [s]."""
    for report in model.explicit(time, every=time / 100, damping=DAMPING, nmd=nmd, courant=COURANT):
        if report.time >= at_least and report.unbalanced_ratio < AT_REST:
            return


def found(model: mpm.Model, value: float, start: float) -> Found:
    """The result of a model that is at rest. start: processor time at which its run began [s]. Collective."""
    mesh, p = model.mesh, model.particles
    count = np.bincount(p.cell, minlength=mesh.owned_cells)[: mesh.owned_cells]
    total = np.bincount(p.cell, p.stress[:, :3].mean(axis=1), minlength=mesh.owned_cells)[: mesh.owned_cells]
    filled = count > 0
    corners = mesh.points[mesh.cells[: mesh.owned_cells][filled]]
    parts = comm.gather((corners, total[filled] / count[filled]))
    field = None if parts is None else Field(*(np.concatenate(column) for column in zip(*parts)))
    return Found(value, field, model.steps, comm.allreduce(process_time() - start))


def displacement_at(model: mpm.Model, point: tuple[float, float]) -> np.ndarray:
    """Displacement (2,) [m] of a node of the mesh as the particles of a cell beside it have it: affine in the cell.

    The three particles must have stayed in their cell, so that they moved with the cell's nodes. Collective.
    """
    mesh, p = model.mesh, model.particles
    node = int(np.argmin(np.linalg.norm(mesh.points - point, axis=1))) if len(mesh.points) else -1
    beside = np.flatnonzero((mesh.cells[: mesh.owned_cells] == node).any(axis=1))
    there = len(beside) > 0 and np.linalg.norm(mesh.points[node] - point) < 1e-9 * np.ptp(mesh.points)
    moved = None
    if there:
        mine = np.flatnonzero(mesh.cells_of(p.initial_position) == beside[0])
        affine = np.column_stack([np.ones(len(mine)), p.initial_position[mine] - point])
        moved = np.linalg.lstsq(affine, p.displacement[mine], rcond=None)[0][0]
    return next(value for value in comm.allgather(moved) if value is not None)


def nodal_sum(model: mpm.Model, name: str, low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    """Sum (2,) of a nodal field over the nodes in a box, each counted once although ranks share it. Collective."""
    points, tolerance = model.mesh.points, 1e-9
    inside = np.all((points >= np.array(low) - tolerance) & (points <= np.array(high) + tolerance), axis=1)
    parts = comm.allgather((points[inside], model.nodal(name)[inside]))
    places, values = (np.concatenate(column) for column in zip(*parts))
    _, first = np.unique(places.round(9), axis=0, return_index=True)
    return values[first].sum(axis=0)
