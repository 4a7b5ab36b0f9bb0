"""Scaling over ranks: messages and bytes counted for 1 to 64 ranks, and the time of a step on the ranks of this run.

Messages are counted: DOLFINx's partitioner divides a square (cube) full of particles into any number of parts, and the
messages of each part in a step follow from the nodes that it shares. Explicit steps of a full box are timed on the ranks of
this run, with the same total size on any number of ranks (strong scaling) and with the same size per rank (weak scaling). Rows
are added to an existing timed.csv, so that runs with --ranks 1 and --ranks 2 give one table; --overwrite begins a new one.
"""

from __future__ import annotations

import csv
import math
from argparse import Namespace
from pathlib import Path
from time import perf_counter

import dolfinx
import numpy as np
from common.options import add_count, study_parser
from common.ranks import run_study
from common.results import open_results
from common.summary import write_summary
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

comm = MPI.COMM_WORLD
RANKS = (1, 2, 4, 8, 16, 32, 64)


def node_sums(dim: int) -> int:
    """Numbers per shared node and step: mass, momentum, internal force, traction, and the momentum once more (MUSL)."""
    return 1 + 3 * dim + dim


# --- 1. Counted ------------------------------------------------------------------------------------------------------


def box_cells(dim: int, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Cells (m, D + 1) of a box of side^D squares or cubes, and pairs of cells that share a facet (k, 2)."""
    if dim == 2:
        domain = dolfinx.mesh.create_unit_square(MPI.COMM_SELF, side, side)
    else:
        domain = dolfinx.mesh.create_unit_cube(MPI.COMM_SELF, side, side, side)
    cells = np.sort(bridge.background_arrays(domain)["cells"], axis=1)
    facets = np.concatenate([np.delete(cells, k, axis=1) for k in range(dim + 1)])
    owners = np.tile(np.arange(len(cells)), dim + 1)
    order = np.lexsort(facets.T)
    same = (facets[order][1:] == facets[order][:-1]).all(axis=1)
    return cells, np.column_stack([owners[order][:-1][same], owners[order][1:][same]])


def parts_of(cells: np.ndarray, pairs: np.ndarray, count: int) -> np.ndarray:
    """The part of each cell, by DOLFINx's graph partitioner."""
    if count == 1:
        return np.zeros(len(cells), dtype=int)
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = both[np.argsort(both[:, 0], kind="stable")]
    offsets = np.searchsorted(both[:, 0], np.arange(len(cells) + 1))
    graph = dolfinx.cpp.graph.AdjacencyList_int64(both[:, 1].astype(np.int64), offsets.astype(np.int32))
    return np.asarray(dolfinx.graph.partitioner()(MPI.COMM_SELF, count, graph, False).array)


def counted(dim: int, cells: np.ndarray, pairs: np.ndarray, count: int) -> dict[str, float]:
    """Data that the busiest of ``count`` ranks sends in an explicit step without nodal mixed discretisation."""
    parts = parts_of(cells, pairs, count)
    touches = np.unique(np.column_stack([cells.ravel(), np.repeat(parts, dim + 1)]), axis=0)
    of_node = np.split(touches[:, 1], np.flatnonzero(np.diff(touches[:, 0])) + 1)
    neighbours: list[set[int]] = [set() for _ in range(count)]
    shared = np.zeros(count, dtype=int)  # a node once for each rank that it is sent to
    for ranks in of_node:
        for rank in ranks[: len(ranks) if len(ranks) > 1 else 0]:
            neighbours[rank].update(int(r) for r in ranks if r != rank)
            shared[rank] += len(ranks) - 1
    most = max(len(n) for n in neighbours)
    own = len(cells) / count
    # Nodes on the sides of a part that is a square or a cube; D! cells are one square or cube of the mesh.
    law = 2 * dim * (own / math.factorial(dim)) ** ((dim - 1) / dim) if count > 1 else 0
    return {
        "dimension": dim, "ranks": count, "cells_per_rank": own, "cells_max_over_mean": np.bincount(parts).max() / own,
        "neighbours": most, "messages": 3 * most, "shared_nodes": int(shared.max()),
        "bytes": 8 * node_sums(dim) * int(shared.max()), "shared_over_law": shared.max() / law if law else 0.0,
    }  # fmt: skip


# --- 2. Timed --------------------------------------------------------------------------------------------------------


def seconds_per_step(dim: int, side: tuple[int, ...], steps: int) -> tuple[float, int]:
    """Time of an explicit step of a box full of particles on all ranks, and its particles."""
    if dim == 2:
        domain = dolfinx.mesh.create_rectangle(comm, [(0.0, 0.0), tuple(map(float, side))], side)
    else:
        domain = dolfinx.mesh.create_box(comm, [(0.0, 0.0, 0.0), tuple(map(float, side))], side)
    soil = mpm.MohrCoulomb(young=1e7, poisson=0.3, cohesion=1e4, friction_angle=30.0)
    model = mpm.Model(bridge.background_mesh(domain), soil)
    particles = model.seed(density=2000.0, per_cell=3 if dim == 2 else 4)
    model.particles.set("velocity", 1e-3 * np.sin(model.particles.position))
    dt = 0.5 * model.critical_time_step()
    list(model.explicit(10 * dt, dt=dt))
    comm.barrier()
    start = perf_counter()
    list(model.explicit((10 + steps) * dt, dt=dt))
    comm.barrier()
    return (perf_counter() - start) / steps, particles


def timed(options: Namespace) -> list[dict[str, float]]:
    rows = []
    for dim, side in ((2, options.side_2d), (3, options.side_3d)):
        for kind, first in (("strong", side), ("weak", side * comm.size)):
            seconds, particles = seconds_per_step(dim, (first, *[side] * (dim - 1)), options.steps)
            rows.append({
                "kind": kind, "dimension": dim, "ranks": comm.size, "particles": particles,
                "seconds_per_step": seconds, "particle_steps_per_second": particles / seconds,
            })  # fmt: skip
    return rows


# --- 3. All together -------------------------------------------------------------------------------------------------


def show(rows: list[dict]) -> None:
    print("  ".join(f"{name:>12}" for name in rows[0]))
    for row in rows:
        print("  ".join(f"{value if isinstance(value, str) else format(value, '.5g'):>{max(12, len(name))}}"
                        for name, value in row.items()))  # fmt: skip


def add_rows(path: Path, rows: list[dict], replace: bool) -> None:
    new = replace or not path.exists()
    with open(path, "w" if new else "a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        if new:
            writer.writeheader()
        writer.writerows(rows)


def main(arguments: list[str] | None = None) -> int:
    parser = study_parser(__doc__)
    add_count(parser, "--side-2d", 200, "squares along a side of the two-dimensional box")
    add_count(parser, "--side-3d", 20, "cubes along an edge of the three-dimensional box")
    add_count(parser, "--steps", 100, "steps that are timed")
    options = parser.parse_args(arguments)
    folder = open_results(options, comm, adds=True)
    rows = timed(options)
    if comm.rank == 0:
        boxes = [(dim, *box_cells(dim, side)) for dim, side in ((2, options.side_2d), (3, options.side_3d))]
        counts = [counted(*box, ranks) for box in boxes for ranks in RANKS]
        show(counts)
        show(rows)
        add_rows(folder / "counted.csv", counts, replace=True)
        add_rows(folder / "timed.csv", rows, replace=False)
    write_summary(folder, options, {"timed": rows}, comm)
    return 0


if __name__ == "__main__":
    run_study(main)
