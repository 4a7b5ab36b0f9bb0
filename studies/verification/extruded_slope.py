"""A slope that slides between two smooth planes in three dimensions, against the same slope in plane strain.

The paper's slope under 60 kN/m³ is released at once. It is computed as a slice, two cubes of cells thick, between rollers: the
motion must be the same in all planes of the slice, and equal to that in plane strain. The two computations have different
cells, shape functions and numbers of particles per cell, so that they differ by the error of the spatial discretisation, which
must decrease with the cell size. The particles are on a regular grid, with mixed integration and averaged strains; the soil is
that of the case "An undamped slide", whose strength rises with the shear rate, so that a converged solution exists.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
from _case import Check, Kind, Result
from _plots import save_comparison
from mpi4py import MPI

import fenics_bridge as bridge
import mpm_core as mpm

HEIGHT, CREST, UNIT_WEIGHT, GRAVITY, END = 1.0, 1.1, 60e3, 9.81, 1.0  # m, m, N/m3, m/s2, s
SOIL = mpm.ViscoplasticMohrCoulomb(
    young=200e3, poisson=0.33, cohesion=1e3, friction_angle=25.0, dilation_angle=0.0, viscosity=1e3
)
PER_SIDE = 4
"""Particles along the side of a square or a cube of cells"""


class Slide(NamedTuple):
    """Displacements [m] of all particles: initial positions and motion, shape (n, D)."""

    start: np.ndarray
    moved: np.ndarray

    def mean(self) -> np.ndarray:
        """Mean displacement by mass, shape (D,)."""
        return self.moved.mean(axis=0)

    def crest(self) -> float:
        """Length, mean over the particles nearest to the crest."""
        away = np.hypot(self.start[:, 0] - CREST, self.start[:, 1] - HEIGHT)
        near = away < away.min() * (1 + 1e-6)
        return float(np.linalg.norm(self.moved[near, :2], axis=1).mean())

    def run_out(self) -> float:
        """Distance of the farthest particle from the start of the farthest one."""
        return float((self.start + self.moved)[:, 0].max() - self.start[:, 0].max())


def slide(dim: int, cell: float) -> Slide:
    """The slope in plane strain, or two cubes thick. Collective."""
    comm, thick = MPI.COMM_WORLD, 2
    # --- 1. The same grid of particles in a box of cells, in one plane or in several ---------------------------------
    counts = [round(3.2 / cell), round(1.1 / cell), thick][:dim]
    mesh = bridge.box_mesh(comm, [cell * n for n in counts], counts)
    model = mpm.Model(bridge.background_mesh(*mesh), SOIL)
    d = cell / PER_SIDE
    numbers = [round((CREST + HEIGHT) / d), round(HEIGHT / d), thick * PER_SIDE][:dim]
    grid = d * (np.indices(numbers).reshape(dim, -1).T + 0.5)
    points = grid[grid[:, 0] + grid[:, 1] < CREST + HEIGHT]
    model.seed_points(points, np.full(len(points), d**dim), density=UNIT_WEIGHT / GRAVITY)

    # --- 2. Rollers at the back and, in three dimensions, on both planes; a rough base ------------------------------
    axes = np.eye(dim)
    model.roller(1, axes[0])
    model.fix(3)
    for tag in (5, 6)[: 2 * (dim - 2)]:
        model.roller(tag, axes[2])
    model.set_gravity(-GRAVITY * axes[1])

    # --- 3. Let go --------------------------------------------------------------------------------------------------
    list(model.explicit(END, nmd=True, integration=mpm.Integration.MIXED))
    p = model.particles
    parts = comm.allgather((p.initial_position, p.displacement))
    return Slide(*(np.concatenate([part[k] for part in parts]) for k in range(2)))


def run(quick: bool, folder: Path) -> Result:
    cells = (0.2, 0.1) if quick else (0.2, 0.1, 0.05)
    found = {cell: (slide(2, cell), slide(3, cell)) for cell in cells}
    fine, tolerance = cells[-1], 0.1 if quick else 0.03
    checks, source = [], "plane strain, cells of the same size"

    # --- 4. What moves, by both ---------------------------------------------------------------------------------------
    plane, solid = found[fine]
    for name, axis in (("forwards", 0), ("down", 1)):
        expected, computed = plane.mean()[axis], solid.mean()[axis]
        checks.append(Check(f"displacement of the centre of mass, {name}", expected, source, computed, tolerance, "m"))
    checks.append(Check("displacement of the crest", plane.crest(), source, solid.crest(), tolerance, "m"))
    checks.append(Check("run-out", plane.run_out(), source, solid.run_out(), 2 * tolerance, "m"))

    # --- 5. Nothing moves across the slice, and the difference falls -------------------------------------------------
    across = np.sqrt(np.mean(solid.moved[:, 2] ** 2)) / plane.crest()
    checks.append(
        Check(
            "motion across the slice, root mean square",
            0.0,
            "plane strain",
            across,
            0.01,
            scale=1.0,
            over="the displacement of the crest",
        )
    )
    apart = [np.linalg.norm(b.mean()[:2] - a.mean()) / np.linalg.norm(a.mean()) for a, b in found.values()]
    checks.append(Check(f"difference of the mean displacements, cells of {fine:g} m", apart[-2],
                        f"difference with cells of {cells[-2]:g} m", apart[-1], 0.0, kind=Kind.AT_MOST))  # fmt: skip

    # --- 6. Picture -------------------------------------------------------------------------------------------------
    if MPI.COMM_WORLD.rank == 0:
        width = np.array(cells)
        curves = {
            f"{what}, {name}": (width, np.array([value(pair[k]) for pair in found.values()]))
            for what, value in (("crest", Slide.crest), ("run-out", Slide.run_out))
            for k, name in enumerate(("plane strain", "three dimensions"))
        }
        save_comparison(folder / "cells.png", curves, {}, ("Size of the cells [m]", "Displacement after 1 s [m]"),
                        limits=((0, None), (0, None)), joined=True)  # fmt: skip
    return Result(checks, {"cells.png": "Crest and run-out in plane strain and of a slice in three dimensions"})
