"""Repartition of the background mesh: by the number of particles, or as a checkpoint prescribes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from ._core import InputError
from .mesh import Mesh
from .rows import exchange_rows, find_items
from .two_phase import set_impervious

if TYPE_CHECKING:
    from .body import Body

PARTICLE_WEIGHT = 16
"""Weight of a particle in the partition, where a cell has 1: empty cells cost little, but should not all go to one rank"""

GROWTH = 1.05
"""Growth of the load imbalance since the last repartition before the next one: some meshes have no better partition"""


def imbalance(body: Body) -> float:
    """Load imbalance: maximum over mean number of particles per rank; 1 is best, and the value without particles. Collective."""
    counts = np.array([len(body.particles)] * 2, dtype=np.int64)
    most, total = np.empty(1, np.int64), np.empty(1, np.int64)
    body.comm.Allreduce(counts[:1], most, MPI.MAX)
    body.comm.Allreduce(counts[1:], total, MPI.SUM)
    return float(most[0]) * body.comm.size / float(total[0]) if total[0] > 0 else 1.0


def rebalance_threshold(given: float | None) -> float:
    """The threshold of a run; infinite when there is none."""
    if given is not None and not 1 < given < np.inf:
        raise InputError(
            f"rebalance is {given}, expected a number above 1: the maximum over the mean number of particles per rank"
        )
    return np.inf if given is None else float(given)


def keep_balance(body: Body, threshold: float) -> bool:
    """Repartition the mesh if the load imbalance exceeds the threshold; returns whether it did. Collective."""
    if threshold == np.inf or body.comm.size == 1 or imbalance(body) <= max(threshold, GROWTH * body._left_imbalance):
        return False
    repartition(body)
    return True


def repartition(body: Body) -> None:
    """Repartition the mesh by the number of particles, and send cells and particles to their new ranks. Collective."""
    mesh, address = body.mesh, MPI._addressof(body.comm)
    particles = np.bincount(body.particles.cell, minlength=mesh.owned_cells)
    parts = mesh._core.weighted_parts(1 + PARTICLE_WEIGHT * particles.astype(np.int64), address)
    first = sum(body.comm.allgather(mesh.owned_cells)[: body.comm.rank])
    take_mesh(body, redistributed(mesh, parts, first + np.arange(mesh.owned_cells)), parts)
    body._left_imbalance = imbalance(body)


def is_partition(body: Body, cells: NDArray) -> bool:
    """Whether each cell of the mesh is among the numbers that the ranks give, once. Collective."""
    mesh, comm = body.mesh, body.comm
    ranks, _ = find_items(comm, cells, np.arange(len(cells)), mesh.global_cells[: mesh.owned_cells])
    missing = comm.allreduce(int((ranks < 0).sum()))
    return missing == 0 and comm.allreduce(len(cells)) == comm.allreduce(mesh.owned_cells)


def take_partition(body: Body, cells: NDArray) -> None:
    """Bring the model to a partition, given by the numbers of the cells that this rank is to own, in their order. Collective."""
    mesh, comm = body.mesh, body.comm
    ranks, order = find_items(comm, cells, np.arange(len(cells)), mesh.global_cells[: mesh.owned_cells])
    take_mesh(body, redistributed(mesh, ranks, order), ranks)


def take_mesh(body: Body, mesh: Mesh, ranks: NDArray) -> None:
    """Give the model its mesh under another partition, and update all that depends on it. Collective.

    Args:
        body: the model.
        mesh: the mesh under the new partition.
        ranks: rank there of each cell that this rank owns now.
    """
    absorbing, border = body._absorbing_state(), body._border_state()
    body._core.set_partition(mesh._core, ranks.astype(np.int64))
    body._core.set_supports(body._conditions)
    body.mesh = mesh
    set_impervious(body)
    if absorbing:
        body._retake_absorbing(absorbing)
    body._take_border_state(border)
    body.repartitions += 1


def redistributed(mesh: Mesh, ranks: NDArray, order: NDArray) -> Mesh:
    """The same mesh on other ranks, with the cells across the facets of owned ones as ghosts. Collective.

    Cells of a rank are in the given order, ghosts by their numbers, and nodes as these cells name them: what a rank has
    depends only on which cells it owns, and in which order.

    Args:
        mesh: the mesh as it is distributed now.
        ranks: new owner of each cell that this rank owns now.
        order: place of the cell among those of its new owner: the lower number comes first.
    """
    n, d, comm = mesh.owned_cells, mesh.dim, mesh.comm
    ghosted = mesh._core.with_ghost_values(np.asarray(ranks, np.float64), MPI._addressof(comm)).astype(np.int64)
    nodes, neighbours = mesh.cells[:n], mesh._core.neighbours[:n]
    whole = np.column_stack([
        mesh.global_cells[:n], ranks, order, mesh.cell_tags[:n], mesh.global_nodes[nodes], mesh._core.facet_tags[:n],
        mesh.points[nodes].reshape(n, d * (d + 1)).view(np.int64),
    ]).astype(np.int64, copy=False)  # fmt: skip
    wanted = np.column_stack([ranks, np.where(neighbours < 0, ranks[:, None], ghosted[neighbours])])
    pairs = np.unique(np.column_stack([np.repeat(np.arange(n), d + 2), wanted.ravel()]), axis=0)
    rows, _ = exchange_rows(comm, pairs[:, 1], whole[pairs[:, 0]])

    ghost = rows[:, 1] != comm.rank
    rows = rows[np.lexsort([np.where(ghost, rows[:, 0], rows[:, 2]), ghost])]
    numbers, owners, _, tags = rows[:, :4].T
    corners, facet_tags = rows[:, 4 : 5 + d].ravel(), rows[:, 5 + d : 6 + 2 * d]
    points = np.ascontiguousarray(rows[:, 6 + 2 * d :]).view(np.float64).reshape(-1, d)
    known, first, inverse = np.unique(corners, return_index=True, return_inverse=True)
    named = np.argsort(first)
    cells = np.argsort(named)[inverse].reshape(-1, d + 1)
    facets = np.concatenate([np.column_stack([np.sort(np.delete(cells, k, axis=1), axis=1), facet_tags[:, k]])
                             for k in range(d + 1)])  # fmt: skip
    facets = np.unique(facets[facets[:, -1] >= 0], axis=0)
    return Mesh(
        points[first[named]], cells, cell_tags=tags, facets=facets[:, :-1], facet_tags=facets[:, -1],
        global_nodes=known[named], global_cells=numbers, cell_owners=owners,
        cell_names=mesh.names["cell"], facet_names=mesh.names["facet"], comm=comm,
    )  # fmt: skip
